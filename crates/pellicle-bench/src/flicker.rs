//! `pellicle-bench flicker [FILE RADIUS] [--field NAME] [--json]`: how much each field's surface changes from frame to frame without the particles
//! having moved so. See [`pellicle::mesh::Flicker`].
//!
//! A frame of a simulator goes on for some steps of 1/240 s, every particle straight ahead by its velocity: so what each one does
//! between frames is known exactly. *Still* is the same frame moved as a whole, by no multiple of a cell: the lattice's part. Lengths are in r, the spacing; each field has its own
//! threshold and support, cells are half of r, and no mesh is smoothed.
//!
//! No clock: every machine gives these numbers.

use std::path::PathBuf;

use pellicle::{
    Attribute, Control, Mesh, Params, Reconstructor, ScalarField,
    mesh::{Flicker, Summary},
};
use pellicle_conformance::particle_file;
use pellicle_io::{PositionData, ReadOptions, read_particles};
use serde_json::json;

/// Seconds from frame to frame.
const STEP: f64 = 1.0 / 240.0;
/// Pairs of frames.
const PAIRS: usize = 4;
/// What moves as a whole is moved by this, in cells.
const SHIFT: [f64; 3] = [0.37, -0.61, 0.23];

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let (mut of, mut names, mut is_json) = (Vec::new(), ScalarField::NAMES.to_vec(), false);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--json" => is_json = true,
            "--field" => names = vec![words.next().ok_or("--field: of which field")?],
            _ => of.push(word),
        }
    }
    let (file, radius) = match of[..] {
        [] => (particle_file("cbd_t1.75.vtk").ok_or("no frame")?, 0.025),
        [file, radius] => (PathBuf::from(file), radius.parse().map_err(|_| "a radius")?),
        _ => return Err("a file and a radius, or neither".into()),
    };
    let frame = Frame::read(file)?;
    if !is_json {
        println!("| field | RMS, r | median, r | one in twenty exceeds, r | still, RMS, r |\n|---|--:|--:|--:|--:|");
    }
    for name in names {
        let field = ScalarField::from_name(name).ok_or_else(|| format!("there is no field {name}"))?;
        let params = Params::with_field(radius, field);
        let (moving, still) = (frame.flicker(&params, Motion::Own)?, frame.flicker(&params, Motion::Whole)?);
        let Flicker { rms, distances: Summary { median, p95, .. } } = moving;
        let [rms, median, p95, still] = [rms, median, p95, still.rms].map(|v| v / (2.0 * radius));
        if is_json {
            println!("{}", json!({"field": name, "rms": rms, "median": median, "p95": p95, "still_rms": still}));
        } else {
            println!("| {name} | {rms:.4} | {median:.4} | {p95:.4} | {still:.5} |");
        }
    }
    Ok(())
}

/// Where particles are, and where they go.
struct Frame {
    positions: Vec<[f64; 3]>,
    velocities: Vec<f32>,
}

/// How they move.
#[derive(Clone, Copy, PartialEq)]
enum Motion {
    /// Each by its velocity.
    Own,
    /// All alike.
    Whole,
}

impl Frame {
    fn read(file: PathBuf) -> Result<Self, String> {
        let particles = read_particles(&file, &ReadOptions::default()).map_err(|error| error.to_string())?;
        let velocities = particles.attribute("velocity").ok_or("the frame has no velocities")?;
        let velocities = velocities.to_f32().into_owned();
        let positions = match particles.positions {
            PositionData::F32(positions) => positions.iter().map(|p| p.map(f64::from)).collect(),
            PositionData::F64(positions) => positions,
        };
        Ok(Self { positions, velocities })
    }

    /// Over all pairs: the means of what each has.
    fn flicker(&self, params: &Params, motion: Motion) -> Result<Flicker, String> {
        let displacement = |i: usize, a: usize| match motion {
            Motion::Own => STEP * f64::from(self.velocities[3 * i + a]),
            Motion::Whole => SHIFT[a] * params.spacing(),
        };
        let values: Vec<f32> = (0..3 * self.positions.len()).map(|n| displacement(n / 3, n % 3) as f32).collect();
        let at = |step: usize| -> Vec<[f64; 3]> {
            let place = |(i, p): (usize, &[f64; 3])| [0, 1, 2].map(|a| p[a] + step as f64 * displacement(i, a));
            self.positions.iter().enumerate().map(place).collect()
        };
        let pairs = if motion == Motion::Own { PAIRS } else { 1 };
        let mut reconstructor = Reconstructor::new();
        let mut before = surface(&mut reconstructor, &at(0), &values, params)?;
        let (mut square, mut median, mut p95) = (0.0, 0.0, 0.0);
        for step in 1..=pairs {
            let after = surface(&mut reconstructor, &at(step), &values, params)?;
            let found = Flicker::between(&before.carried(&before.attributes[0].values), &after);
            let share = 1.0 / pairs as f64;
            square += share * found.rms * found.rms;
            median += share * found.distances.median;
            p95 += share * found.distances.p95;
            before = after;
        }
        Ok(Flicker { rms: square.sqrt(), distances: Summary { median, p95, ..Summary::default() } })
    }
}

/// A frame's surface, with the displacement of its vertices.
fn surface(
    reconstructor: &mut Reconstructor,
    positions: &[[f64; 3]],
    displacements: &[f32],
    params: &Params,
) -> Result<Mesh, String> {
    let attributes = [Attribute::new("displacement", 3, displacements)];
    let control = Control::default();
    let surface = reconstructor.extract(positions.into(), &attributes, params, &control);
    surface.and_then(|surface| surface.to_mesh()).map_err(|error| error.to_string())
}
