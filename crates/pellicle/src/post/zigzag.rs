//! Diagonals that alternate from row to row, where vertices stand in squares of the lattice.
//!
//! ```text
//!     o---o---o---o          o---o---o---o
//!     | / | / | / |          | \ | \ | \ |          Smoothing moves a vertex to the mean of its neighbors. On the left that
//!     o---o---o---o   ──►    o---o---o---o          is where it stands, and triangles keep their right angles; on the right
//!     | / | / | / |          | / | / | / |          every second row moves by half an edge, and they become equilateral.
//!     o---o---o---o          o---o---o---o
//! ```
//!
//! Marching cubes cuts the squares of a level surface along one and the same diagonal, and merging vertices by nodes makes such
//! squares of what is nearly level. Every vertex has six neighbors either way.
//!
//! Marching cubes cuts a square within one cell, so its triangles follow each other.
//!
//! Source: this project.

use rayon::prelude::*;

use super::{
    flip::Flip,
    links::Links,
    node::{coordinate, direction, step},
};

/// Triangles looked at by one task.
const CHUNK: usize = 1 << 13;

/// Merged vertices and what is known of them, by group.
pub(super) struct Squares<'a> {
    pub vertices: &'a [[f32; 3]],
    /// The lattice node of each, packed.
    pub nodes: &'a [u64],
}

impl Squares<'_> {
    /// Turns the diagonals of squares that run the wrong way for their row.
    pub(super) fn alternate(&self, triangles: &mut [[u32; 3]], links: &mut Links) {
        let starts: Vec<usize> = (0..triangles.len().saturating_sub(1)).step_by(CHUNK).collect();
        let in_chunk = |&first: &usize| {
            let mut found = Vec::new();
            for (i, pair) in (first..first + CHUNK).zip(triangles[first..].array_windows()) {
                found.extend(self.off(pair, links).map(|flip| (i, flip)));
            }
            found
        };
        let found: Vec<Vec<(usize, Flip)>> = starts.par_iter().map(in_chunk).collect();
        let mut valences: Vec<u8> = (0..self.nodes.len() as u32).map(|g| links.valence(g) as u8).collect();
        for (i, flip) in found.into_iter().flatten() {
            let ([a, b], [c, d]) = (flip.ends, flip.wings);
            let across = direction(self.nodes[c as usize], self.nodes[d as usize]);
            let back = direction(self.nodes[d as usize], self.nodes[c as usize]);
            let (Some(across), Some(back)) = (across, back) else { continue };
            // A vertex may lose several edges at the rim of a level part; an edge that is there already is not made again.
            if [a, b].iter().any(|&v| valences[v as usize] <= 3) || links.may_lead(c, across) {
                continue;
            }
            links.lead(c, across);
            links.lead(d, back);
            [a, b].iter().for_each(|&v| valences[v as usize] -= 1);
            [c, d].iter().for_each(|&v| valences[v as usize] += 1);
            triangles[i..i + 2].copy_from_slice(&flip.turned());
        }
    }

    /// The diagonal between two triangles, if they make a square of the lattice and it is off.
    #[inline(always)]
    fn off(&self, &[first, second]: &[[u32; 3]; 2], links: &Links) -> Option<Flip> {
        let flip = Flip::between(first, second)?;
        let four = flip.four();
        let at = four.map(|v| self.nodes[v as usize]);
        // Of a square, the middles of the diagonals are one.
        let is_off = at[0].wrapping_add(at[1]) == at[2].wrapping_add(at[3])
            && (is_off(at[0], at[1]) || is_off(at[1], at[0]))
            && is_square(at)
            && four.iter().all(|&v| links.is_sure(v))
            && flip.is_flat(self.vertices);
        is_off.then_some(flip)
    }
}

/// The axis that a step along the diagonal of a unit square is square to; `None` for other steps.
#[inline(always)]
fn plane_of(step: [i32; 3]) -> Option<usize> {
    let is_unit = step.iter().all(|s| s.abs() <= 1) && step.iter().filter(|s| **s != 0).count() == 2;
    is_unit.then(|| step.iter().position(|s| *s == 0)).flatten()
}

/// Whether a step goes up the diagonal of a unit square that its row should not have. A row has the coordinate of its lower
/// side, and its diagonals rise where that is even.
#[inline(always)]
fn is_off(from: u64, to: u64) -> bool {
    let diagonal = step(from, to);
    let Some(axis) = plane_of(diagonal) else { return false };
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    diagonal[u] > 0 && (diagonal[v] > 0) != (coordinate(from, u) & 1 == 0)
}

/// Whether nodes are the corners of a unit square, of which the first two are the ends of a diagonal.
fn is_square([a, b, c, d]: [u64; 4]) -> bool {
    let (diagonal, sides) = (step(a, b), [step(a, c), step(a, d)]);
    let is_side = |side: [i32; 3]| side.iter().filter(|s| **s != 0).count() == 1;
    is_side(sides[0]) && is_side(sides[1]) && (0..3).all(|i| sides[0][i] + sides[1][i] == diagonal[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Control, Mesh, Params,
        mesh::{Quality, Report},
        post::{Finish, node::packed, snap::Nodes},
    };

    /// A box of water, level on all sides but for ripples on top.
    fn water() -> (Mesh, Params) {
        let at = |i: usize| [i % 12, i / 12 % 12, i / 144].map(|v| v as f32 * 0.05);
        let positions: Vec<[f32; 3]> = (0..12 * 12 * 6).map(at).collect();
        let positions: Vec<[f32; 3]> =
            positions.iter().map(|&[x, y, z]| [x, y, z + 0.01 * (9.0 * x + 4.0 * y).sin()]).collect();
        let params = Params { cell_size: 0.5, ..Params::new(0.025) };
        (crate::reconstruct(&positions, &params).unwrap(), params)
    }

    fn finished(mesh: &Mesh, params: &Params, zigzag: bool, threads: usize) -> Mesh {
        let mut mesh = mesh.clone();
        let finish = Finish { zigzag, ..Finish::good_looking() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let nodes = Nodes::cubic(params.spacing());
        pool.install(|| finish.apply(&mut mesh, &nodes, None, &Control::default())).unwrap();
        mesh
    }

    #[test]
    fn level_parts_become_equilateral_and_the_surface_stays_what_it_was() {
        let (mesh, params) = water();
        let (plain, zigzag) = (finished(&mesh, &params, false, 1), finished(&mesh, &params, true, 1));
        let [before, after] = [&plain, &zigzag].map(|mesh| Quality::of(mesh).radius_ratio);
        assert!(after.mean > before.mean + 0.03, "{} {}", before.mean, after.mean);
        assert!(after.p1 > before.p1 - 0.02, "{} {}", before.p1, after.p1);
        let [before, after] = [&plain, &zigzag].map(Report::of);
        assert!(after.closed_manifold());
        assert_eq!(
            [after.vertices, after.triangles, after.components],
            [before.vertices, before.triangles, before.components]
        );
        assert_eq!(after.euler_characteristic, before.euler_characteristic);
        assert_eq!(finished(&mesh, &params, true, 3), zigzag);
    }

    #[test]
    fn a_square_is_known_by_its_nodes_and_its_row() {
        // Both diagonals of a square, in rows that follow each other along x, in each of the three planes.
        for axis in 0..3 {
            for row in [-2, -1, 0, 1] {
                let at = |u: i64, v: i64| {
                    let mut at = [5; 3];
                    (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (row + u, v - 7);
                    packed(at)
                };
                let (rising, falling) =
                    ([at(0, 0), at(1, 1), at(1, 0), at(0, 1)], [at(1, 0), at(0, 1), at(0, 0), at(1, 1)]);
                assert_eq!([rising, falling].map(|n| is_off(n[0], n[1])), [row % 2 != 0, false], "{axis} {row}");
                assert_eq!(is_off(falling[1], falling[0]), row % 2 == 0, "{axis} {row}");
                assert!(is_square(rising) && is_square(falling));
            }
        }
        let [a, b, c, d] = [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 1]].map(packed);
        assert!(!is_square([a, b, c, d]) && !is_square([a, c, b, d]), "no square, no diagonal");
        assert!(!is_off(a, c) && !is_off(a, a) && !is_off(c, d));
    }
}
