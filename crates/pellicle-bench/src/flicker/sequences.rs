//! What moves: particles of a few frames, the same ones in all.

use pellicle_scenes::{Random, splash};

/// Frames of a sequence.
const FRAMES: usize = 7;

/// Of the blocks' particles.
pub const RADIUS: f64 = 0.05;

const SPACING: f64 = 2.0 * RADIUS;

/// Particles of the blocks along each axis.
const DIMS: [usize; 3] = [16, 16, 10];

/// Particles that move.
pub struct Sequence {
    pub name: &'static str,
    pub radius: f64,
    pub frames: Vec<Vec<[f64; 3]>>,
}

/// All sequences.
pub const SEQUENCES: [fn() -> Sequence; 4] = [translation, strain, tremble, flight];

/// A lattice of particles about the origin, each moved by up to a tenth of the spacing along each axis.
pub fn block(dims: [usize; 3]) -> Vec<[f64; 3]> {
    let mut random = Random::new(1);
    let places =
        (0..dims[0] * dims[1] * dims[2]).map(|i| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])]);
    places
        .map(|place| {
            let jitter = random.in_cube(0.1 * SPACING);
            std::array::from_fn(|a| (place[a] as f64 - 0.5 * (dims[a] - 1) as f64) * SPACING + jitter[a])
        })
        .collect()
}

fn frames(at: impl FnMut(usize) -> Vec<[f64; 3]>) -> Vec<Vec<[f64; 3]>> {
    (0..FRAMES).map(at).collect()
}

/// About an eighth of a spacing a frame, in no direction of the lattice.
fn translation() -> Sequence {
    let still = block(DIMS);
    let step = [0.113, 0.071, 0.037].map(|x| x * SPACING);
    let moved = |t: usize| still.iter().map(|p| std::array::from_fn(|a| p[a] + t as f64 * step[a])).collect();
    Sequence { name: "translation", radius: RADIUS, frames: frames(moved) }
}

fn strain() -> Sequence {
    let mut now = block(DIMS);
    let stretched = |t| {
        if t > 0 {
            now.iter_mut().for_each(|p| *p = [p[0] * 1.02, p[1] / 1.02, p[2]]);
        }
        now.clone()
    };
    Sequence { name: "strain", radius: RADIUS, frames: frames(stretched) }
}

fn tremble() -> Sequence {
    let still = block(DIMS);
    let mut random = Random::new(2);
    let trembling = |_| {
        let mut moved = |p: &[f64; 3]| {
            let off = random.in_ball(0.02 * SPACING);
            std::array::from_fn(|a| p[a] + off[a])
        };
        still.iter().map(&mut moved).collect()
    };
    Sequence { name: "tremble", radius: RADIUS, frames: frames(trembling) }
}

/// Particles move by a fifth of a spacing a frame, root mean square.
fn flight() -> Sequence {
    let scene = splash(4000, 1);
    let squares: f64 = scene.velocities.as_flattened().iter().map(|v| f64::from(*v).powi(2)).sum();
    let speed = (squares / scene.velocities.len() as f64).sqrt();
    let radius = f64::from(scene.radius);
    let step = 0.2 * 2.0 * radius / speed;
    let particles = || scene.positions.iter().zip(&scene.velocities);
    let moved = |t: usize| {
        let at = |(p, v): (&[f32; 3], &[f32; 3])| {
            std::array::from_fn(|a| f64::from(p[a]) + t as f64 * step * f64::from(v[a]))
        };
        particles().map(at).collect()
    };
    Sequence { name: "splash", radius, frames: frames(moved) }
}
