//! Speed and memory of approaches on the same frames.

use std::time::Instant;

use crate::rivals::{Approach, Output};
use pellicle_conformance::allocations::count;

/// What one approach took.
#[derive(Debug, Clone, Copy, Default)]
pub struct Row {
    pub cubes_per_s: f64,
    pub triangles_per_s: f64,
    pub render_bytes: usize,
    pub cache_bytes: usize,
    pub fps: f64,
    /// Over all frames.
    pub cubes: usize,
    pub triangles: usize,
    pub corners: usize,
}

/// Makes an approach that has no memory yet.
pub type Maker = Box<dyn Fn() -> Box<dyn Approach>>;

/// Rounds over all frames, of which the middle one counts.
const ROUNDS: usize = 5;

/// Cubes in a thousand that rivals may lack. Approach 1 finds every piece of the surface; what follows the surface finds
/// those that lie below a particle, and misses a few bubbles.
const MISSED: f64 = 1.0;

/// Makes approaches; measures each on all frames.
///
/// # Errors
/// When they do not find the same surface.
pub fn measure(frames: &[Vec<[f32; 3]>], makers: Vec<Maker>) -> Result<Vec<Row>, String> {
    let mut out =
        Output { vertices: Vec::with_capacity(1 << 20), indices: Vec::with_capacity(6 << 20), ..Output::default() };
    let room = [out.vertices.capacity(), out.indices.capacity()];
    let mut rows = Vec::new();
    let mut approaches = Vec::new();
    for make in makers {
        let mut row = Row::default();
        let (approach, allocated) = count(|| {
            let mut approach = make();
            for positions in frames {
                approach.update(positions, &mut out);
                row.cubes += out.cubes;
                row.triangles += out.indices.len() / 3;
                row.corners += out.corners;
            }
            approach
        });
        row.cache_bytes = approach.cache_bytes();
        row.render_bytes = (allocated.peak as usize).saturating_sub(row.cache_bytes);
        rows.push(row);
        approaches.push(approach);
    }
    if room != [out.vertices.capacity(), out.indices.capacity()] {
        return Err("the output grew, which would count as memory of an approach".into());
    }
    check_agreement(&rows)?;
    let mut seconds = vec![Vec::new(); rows.len()];
    for _ in 0..ROUNDS {
        for (approach, seconds) in approaches.iter_mut().zip(&mut seconds) {
            let start = Instant::now();
            for positions in frames {
                approach.update(positions, &mut out);
            }
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    for (row, mut seconds) in rows.iter_mut().zip(seconds) {
        seconds.sort_by(f64::total_cmp);
        let seconds = seconds[ROUNDS / 2];
        row.fps = frames.len() as f64 / seconds;
        row.cubes_per_s = row.cubes as f64 / seconds;
        row.triangles_per_s = row.triangles as f64 / seconds;
    }
    Ok(rows)
}

/// Whether all found the same surface, but for bubbles that the later ones missed.
fn check_agreement(rows: &[Row]) -> Result<(), String> {
    let counts = |row: &Row| [row.cubes, row.triangles];
    let least = counts(&rows[0]).map(|count| count as f64 * (1.0 - MISSED / 1e3));
    let wrong = |row: &Row| (0..2).any(|i| counts(row)[i] > counts(&rows[0])[i] || (counts(row)[i] as f64) < least[i]);
    match rows.iter().any(wrong) {
        true => Err(format!(
            "the approaches differ in cubes and triangles: {:?}",
            rows.iter().map(counts).collect::<Vec<_>>()
        )),
        false => Ok(()),
    }
}
