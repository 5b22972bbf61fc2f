//! The specification: the value of one node, one particle after the other, in plain arithmetic.
//!
//! Source: this project; the definition in [`crate::lattice`].

use super::{corner, node_offset};
use crate::{
    field::kernel::half_spline_scalar,
    lattice::{CHUNK, Coord},
    lookup::cells::{CELLS, Cells},
};

/// The colour field at a node of an octet, summed over all particles that there are: chunks by z, y, x around the octet,
/// then rows of cells by z, y, x.
pub(crate) fn node_value(cells: &Cells, weights: &[f32], step: f64, octet: Coord, node: [i32; 3]) -> f32 {
    let corner = corner(octet, step);
    let at = node.map(|n| node_offset(n, step));
    let mut chunks: Vec<usize> = (0..cells.chunks.len()).collect();
    chunks.sort_by_key(|&c| cells.chunks[c].into_iter().rev().collect::<Vec<_>>());
    let mut sum = 0.0;
    for chunk in chunks {
        let shift: [f32; 3] = std::array::from_fn(|a| (f64::from(cells.chunks[chunk][a] * CHUNK) - corner[a]) as f32);
        for i in cells.run(chunk, 0, CELLS - 1) {
            let d = [at[0] - (cells.x[i] + shift[0]), at[1] - (cells.y[i] + shift[1]), at[2] - (cells.z[i] + shift[2])];
            sum += weights[i] * half_spline_scalar((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
        }
    }
    sum
}
