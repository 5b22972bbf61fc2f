//! Flicker: how much a surface changes from frame to frame beyond what the motion of the particles explains.
//!
//! ```text
//! x_i(t)             the particles, the same ones in every frame
//! u(v)               how the particles around v move from t to t + 1, fitted linearly      carry.rs
//! S'                 the surface at t, every vertex v moved to v + u(v)
//! rms                root mean square distance between S' and the surface at t + 1, by area, both ways
//! max                the largest such distance
//! turn               root mean square angle between the normals of S' and those of the nearest vertices at t + 1
//! ```
//!
//! Lengths are in particle spacings r, angles in degrees, and all frames of a sequence count alike. Motion that is steady,
//! rigid or an even stretch is no flicker, however fast: what is left is what the lattice, the arrangement of the particles and
//! the field add by themselves. An observer who follows the water sees `rms` as trembling, and `turn` as glitter.
//!
//! Sequences (sequences.rs), of 7 frames each:
//!
//! ```text
//! translation   a jittered block moves rigidly through the lattice: 0 for a perfect extraction
//! strain        the block is stretched along x and squeezed along y, 2 % a frame: particles rearrange
//! tremble       every particle of the block trembles by itself by up to 0.02 r: the noise of a simulator
//! splash        a crown, a jet, drops and thin sheets, each particle at its own steady velocity: surfaces part
//! ```
//!
//! All fields at their defaults, cell 0.5 radii, as they come and with what `--smooth` does. It reads no clock: the same numbers
//! on every machine. Prints a table in Markdown; with `--json`, rows `{sequence, field, smooth, rms, max, turn_deg, frames}`.
//!
//! Source: this project; no published measure was found. The fit is Lancaster & Salkauskas 1981, see `carry.rs`.

mod carry;
mod sequences;

use pellicle::mesh::Comparison;
use pellicle::post::snap::Nodes;
use pellicle::post::{Finish, normals};
use pellicle::{Attribute, Control, Mesh, Params, Reconstructor, ScalarField, crowding};

use carry::{Grid, Motion};
use sequences::{SEQUENCES, Sequence};

/// Samples of each surface in a comparison.
const SAMPLES: usize = 100_000;

/// Sums over the frames of a sequence.
#[derive(Debug, Default, Clone, Copy)]
struct Flicker {
    frames: usize,
    squares: f64,
    max: f64,
    turns: f64,
}

impl Flicker {
    fn rms(&self) -> f64 {
        (self.squares / self.frames.max(1) as f64).sqrt()
    }

    /// In degrees.
    fn turn(&self) -> f64 {
        (self.turns / self.frames.max(1) as f64).sqrt().to_degrees()
    }
}

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let json = words.iter().any(|word| word == "--json");
    let mut rows = Vec::new();
    for field in ScalarField::NAMES.into_iter().filter_map(ScalarField::from_name) {
        for smooth in [false, true] {
            let name = field.name();
            let mut cells = vec![name.to_owned(), if smooth { "yes" } else { "no" }.to_owned()];
            for make in SEQUENCES {
                let sequence = make();
                let found = measure(&sequence, field, smooth)?;
                let (rms, turn) = (found.rms(), found.turn());
                if json {
                    println!(
                        "{{\"sequence\": \"{}\", \"field\": \"{name}\", \"smooth\": {smooth}, \"rms\": {rms:.5}, \
                         \"max\": {:.4}, \"turn_deg\": {turn:.2}, \"frames\": {}}}",
                        sequence.name, found.max, found.frames
                    );
                }
                cells.push(format!("{rms:.4}"));
                cells.push(format!("{turn:.1}"));
            }
            rows.push(format!("| {} |", cells.join(" | ")));
        }
    }
    if !json {
        println!("| field | smooth | translation, r | ° | strain, r | ° | tremble, r | ° | splash, r | ° |");
        println!("|---|---|--:|--:|--:|--:|--:|--:|--:|--:|");
        println!("{}", rows.join("\n"));
    }
    Ok(())
}

/// The flicker of a field on a sequence.
fn measure(sequence: &Sequence, field: ScalarField, smooth: bool) -> Result<Flicker, String> {
    let params = Params::with_field(sequence.radius, field);
    let spacing = 2.0 * sequence.radius;
    let mut reconstructor = Reconstructor::new();
    let mut flicker = Flicker::default();
    let mut before: Option<Mesh> = None;
    for (t, frame) in sequence.frames.iter().enumerate() {
        let now = surface(&mut reconstructor, frame, &params, smooth).map_err(|error| error.to_string())?;
        if let Some(mut carried) = before.take() {
            let motion = Motion::new(&sequence.frames[t - 1], frame, 2.0 * spacing);
            motion.carry(&mut carried);
            add(&mut flicker, carried, &now, spacing)?;
        }
        before = Some(now);
    }
    Ok(flicker)
}

/// One frame's surface, its normals from its triangles.
fn surface(
    reconstructor: &mut Reconstructor,
    frame: &[[f64; 3]],
    params: &Params,
    smooth: bool,
) -> Result<Mesh, pellicle::Error> {
    let control = Control::default();
    let crowds = if smooth { crowding(frame.into(), params.support(), &control)? } else { Vec::new() };
    let attributes: Vec<Attribute> = smooth.then(|| Attribute::new("crowding", 1, &crowds)).into_iter().collect();
    let mut mesh = reconstructor.extract(frame.into(), &attributes, params, &control)?.to_mesh()?;
    if smooth {
        let weights = mesh.attributes.pop().map(|attribute| attribute.values);
        Finish::good_looking().apply(&mut mesh, &Nodes::cubic(params.spacing()), weights.as_deref(), &control)?;
    }
    Ok(mesh)
}

/// Adds what lies between the surface that was carried on and the one that is there.
fn add(flicker: &mut Flicker, mut carried: Mesh, now: &Mesh, spacing: f64) -> Result<(), String> {
    let Comparison { to_reference, from_reference } = Comparison::of(&carried, now, SAMPLES);
    let squares = 0.5 * (to_reference.rms.powi(2) + from_reference.rms.powi(2));
    let error = |error: pellicle::Error| error.to_string();
    normals::from_triangles(&mut carried, 0, &Control::default()).map_err(error)?;
    let mut now = Mesh { normals: Vec::new(), ..now.clone() };
    normals::from_triangles(&mut now, 0, &Control::default()).map_err(error)?;
    flicker.frames += 1;
    flicker.squares += squares / spacing.powi(2);
    flicker.max = flicker.max.max(to_reference.max.max(from_reference.max) / spacing);
    flicker.turns += turn_squared(&carried, &now, spacing);
    Ok(())
}

/// Mean square angle, in radians, between the normals of one mesh and those of the nearest vertices of the other; vertices
/// with none closer than a spacing are left out.
fn turn_squared(carried: &Mesh, now: &Mesh, spacing: f64) -> f64 {
    let places: Vec<[f64; 3]> = (0..now.vertices.len()).map(|v| now.position(v)).collect();
    // A quarter of a spacing is a cell of the lattice.
    let grid = Grid::new(&places, 0.25 * spacing);
    let (mut sum, mut count) = (0.0, 0);
    for (v, normal) in carried.normals.iter().enumerate() {
        let here = carried.position(v);
        let Some(nearest) = grid.nearest(here, 4) else { continue };
        let cosine: f64 = (0..3).map(|a| f64::from(normal[a]) * f64::from(now.normals[nearest][a])).sum();
        sum += cosine.clamp(-1.0, 1.0).acos().powi(2);
        count += 1;
    }
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(step: [f64; 3]) -> Sequence {
        let still = sequences::block([8, 8, 5]);
        let frames =
            (0..3).map(|t| still.iter().map(|p| std::array::from_fn(|a| p[a] + f64::from(t) * step[a])).collect());
        Sequence { name: "moved", radius: sequences::RADIUS, frames: frames.collect() }
    }

    #[test]
    fn whole_cells_are_no_flicker_and_parts_of_cells_are_a_little() {
        let cell = 0.5 * sequences::RADIUS;
        let of = |step, smooth| measure(&moved(step), ScalarField::Sph, smooth).unwrap();
        for smooth in [false, true] {
            let whole = of([4.0 * cell, 0.0, -cell], smooth);
            assert!(whole.rms() < 1e-4 && whole.turn() < 1.0, "{whole:?}");
            let part = of([0.37 * cell, 0.21 * cell, 0.0], smooth);
            assert!(part.rms() > 10.0 * whole.rms() && part.rms() < 0.05, "{part:?}");
        }
    }

    #[test]
    fn what_no_motion_explains_is_found_in_full() {
        // The block grows, and the particles do not say so: what is carried is told that nothing moves.
        let sequence = moved([0.0; 3]);
        let params = Params::new(sequence.radius);
        let spacing = 2.0 * sequence.radius;
        let mesh = surface(&mut Reconstructor::new(), &sequence.frames[0], &params, false).unwrap();
        let mut up = mesh.clone();
        up.origin[2] += 0.1 * spacing;
        let mut flicker = Flicker::default();
        add(&mut flicker, mesh, &up, spacing).unwrap();
        assert!((flicker.max - 0.1).abs() < 0.01 && flicker.rms() > 0.04 && flicker.rms() < 0.1, "{flicker:?}");
    }
}
