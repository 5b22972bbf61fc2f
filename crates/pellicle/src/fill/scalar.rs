//! The specification: what one node sums, one particle after the other, in plain arithmetic.
//!
//! Source: this project; the definition in [`crate::lattice`].

use super::{corner, node_offset};
use crate::{
    field::scalar::Term,
    lattice::{CHUNK, Coord},
    lookup::cells::{CELLS, Cells},
};

/// All particles that there are, as a node of an octet sees them: chunks by z, y, x around the octet, then rows of cells by
/// z, y, x. [`crate::field::scalar`] makes values of them.
pub(crate) fn node_terms(cells: &Cells, step: f64, octet: Coord, node: [i32; 3]) -> Vec<Term> {
    let corner = corner(octet, step);
    let at = node.map(|n| node_offset(n, step));
    let mut chunks: Vec<usize> = (0..cells.chunks.len()).collect();
    chunks.sort_by_key(|&c| cells.chunks[c].into_iter().rev().collect::<Vec<_>>());
    let mut terms = Vec::new();
    for chunk in chunks {
        let shift: [f32; 3] = std::array::from_fn(|a| (f64::from(cells.chunks[chunk][a] * CHUNK) - corner[a]) as f32);
        for i in cells.run(chunk, 0, CELLS - 1) {
            let d = [at[0] - (cells.x[i] + shift[0]), at[1] - (cells.y[i] + shift[1]), at[2] - (cells.z[i] + shift[2])];
            terms.push(Term { d, dist_sq: (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2], particle: i });
        }
    }
    terms
}
