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
    node::{DIRECTIONS, coordinate, direction, step_of},
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
        let turns = is_square(at)
            && is_off(at[0], at[1])
            && four.iter().all(|&v| links.is_sure(v))
            && flip.is_flat(self.vertices);
        turns.then_some(flip)
    }
}

/// A step along the diagonal of a unit square.
#[derive(Clone, Copy)]
struct Diagonal {
    /// The axis along which rows follow each other.
    axis: usize,
    /// Whether the step goes up that axis, and whether the diagonal then rises along the other.
    goes_up: bool,
    rises: bool,
}

/// What each [direction] is.
const DIAGONALS: [Option<Diagonal>; DIRECTIONS as usize] = {
    let mut table = [None; DIRECTIONS as usize];
    let mut number = 0;
    while number < table.len() {
        let step = step_of(number as u32);
        let mut square_to = 0;
        while square_to < 3 {
            let (u, v) = (step[(square_to + 1) % 3], step[(square_to + 2) % 3]);
            if step[square_to] == 0 && u != 0 && v != 0 {
                table[number] = Some(Diagonal { axis: (square_to + 1) % 3, goes_up: u > 0, rises: u == v });
            }
            square_to += 1;
        }
        number += 1;
    }
    table
};

/// Bit set for each [direction] along an axis.
const SIDES: u32 = {
    let (mut sides, mut number) = (0, 0);
    while number < DIRECTIONS {
        let [x, y, z] = step_of(number);
        sides |= if x * x + y * y + z * z == 1 { 1 << number } else { 0 };
        number += 1;
    }
    sides
};

/// Whether two nodes are the ends of a diagonal of a unit square that its row should not have. A row has the coordinate of its
/// lower side, and its diagonals rise where that is even.
#[inline(always)]
fn is_off(from: u64, to: u64) -> bool {
    let Some(diagonal) = direction(from, to).and_then(|number| DIAGONALS[number as usize]) else { return false };
    let lower = if diagonal.goes_up { from } else { to };
    diagonal.rises != (coordinate(lower, diagonal.axis) & 1 == 0)
}

/// Whether nodes are the corners of a unit square, of which the first two are the ends of a diagonal.
#[inline(always)]
fn is_square([a, b, c, d]: [u64; 4]) -> bool {
    // The middles of the diagonals are one.
    let is_side = |to: u64| direction(a, to).is_some_and(|number| SIDES >> number & 1 != 0);
    a.wrapping_add(b) == c.wrapping_add(d) && a != b && c != d && is_side(c) && is_side(d)
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
                for swapped in [false, true] {
                    let is_off = |n: [u64; 4]| if swapped { is_off(n[1], n[0]) } else { is_off(n[0], n[1]) };
                    assert_eq!([rising, falling].map(is_off), [row % 2 != 0, row % 2 == 0], "{axis} {row}");
                }
                assert!(is_square(rising) && is_square(falling));
            }
        }
        let [a, b, c, d] = [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 1]].map(packed);
        assert!(!is_square([a, b, c, d]) && !is_square([a, c, b, d]), "no square, no diagonal");
        assert!(!is_off(a, c) && !is_off(a, a) && !is_off(c, d));
    }
}
