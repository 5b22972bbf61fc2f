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
//! Source: this project.

use rayon::prelude::*;

use super::flip::{CHUNK, Flip, Flips, Merged};
use crate::mesh::stars::followers;

impl Merged<'_> {
    /// Adds the diagonals of squares that run the wrong way for their row, and brings the valences up to date.
    pub(super) fn alternate(&self, nodes: &[u64], valences: &mut [u8], flips: &mut Flips) {
        let n = self.groups.len();
        let chunks = (0..n.div_ceil(CHUNK)).into_par_iter();
        let found = chunks.map_init(Vec::new, |fan, chunk| {
            let mut found = Vec::new();
            for g in chunk * CHUNK..n.min((chunk + 1) * CHUNK) {
                self.find_squares(g, nodes, fan, &mut found);
            }
            found
        });
        let found: Vec<Vec<Flip>> = found.collect();
        for flip in found.iter().flatten() {
            let numbers = flip.four().map(|v| self.groups.number_of(v));
            // A vertex may lose several edges at the rim of a level part.
            if numbers[..2].iter().all(|&g| valences[g] > 3) && flips.add(flip) {
                numbers[..2].iter().for_each(|&g| valences[g] -= 1);
                numbers[2..].iter().for_each(|&g| valences[g] = valences[g].saturating_add(1));
            }
        }
    }

    /// Such diagonals at one end.
    fn find_squares(&self, group: usize, nodes: &[u64], fan: &mut Vec<[u32; 2]>, found: &mut Vec<Flip>) {
        let members = self.groups.members(group);
        let (a, here) = (members[0], nodes[members[0] as usize]);
        // Most have none, and nodes tell that before anything is gathered.
        let has_any = |&v: &u32| self.stars.corners(v as usize).iter().any(|&[n, _]| is_off(here, nodes[n as usize]));
        if !members.iter().any(has_any) {
            return;
        }
        self.fan(a, fan);
        let first = found.len();
        let is_ring = followers(fan, |i, j| {
            let ([d, b], c) = (fan[i], fan[j][1]);
            if c != d && is_off(here, nodes[b as usize]) && is_square([a, b, c, d].map(|v| nodes[v as usize])) {
                found.push(Flip { loss: 0, mixed: 0, ends: [a, b], wings: [c, d] });
            }
        });
        if !is_ring {
            found.truncate(first);
        }
        self.keep_allowed(first, fan, found);
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

/// A coordinate of a packed node, as far as its bits go.
#[inline(always)]
fn coordinate(node: u64, axis: usize) -> i32 {
    (node >> (43 - 21 * axis)) as i32
}

/// From one packed node to another that is near.
#[inline(always)]
fn step(from: u64, to: u64) -> [i32; 3] {
    [0, 1, 2].map(|a| (coordinate(to, a).wrapping_sub(coordinate(from, a)) << 11) >> 11)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Control, Mesh, Params,
        mesh::{Quality, Report},
        post::{Finish, snap::Nodes},
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
        let node = |[x, y, z]: [i64; 3]| [x, y, z].iter().fold(0u64, |key, v| key << 21 | (*v as u64 & 0x1f_ffff)) << 1;
        // Both diagonals of a square, in rows that follow each other along x, in each of the three planes.
        for axis in 0..3 {
            for row in [-2, -1, 0, 1] {
                let at = |u: i64, v: i64| {
                    let mut at = [5; 3];
                    (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (row + u, v - 7);
                    node(at)
                };
                let (rising, falling) =
                    ([at(0, 0), at(1, 1), at(1, 0), at(0, 1)], [at(1, 0), at(0, 1), at(0, 0), at(1, 1)]);
                assert_eq!([rising, falling].map(|n| is_off(n[0], n[1])), [row % 2 != 0, false], "{axis} {row}");
                assert_eq!(is_off(falling[1], falling[0]), row % 2 == 0, "{axis} {row}");
                assert!(is_square(rising) && is_square(falling));
            }
        }
        let [a, b, c, d] = [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 1]].map(node);
        assert!(!is_square([a, b, c, d]) && !is_square([a, c, b, d]), "no square, no diagonal");
        assert!(!is_off(a, c) && !is_off(a, a) && !is_off(c, d));
    }
}
