//! Triangles as three positions each, cell by cell: no vertex is shared, so a cell needs nothing from its neighbours.
//!
//! Source: Gourlay 2014, Fluid Simulation for Video Games 18: every cell makes its own vertices.

use std::ops::Range;

use super::{
    Iso, Rows,
    classify::Signs,
    count::{Cases, corner_words, four_rows},
};
use crate::{
    march::{
        cubes::count::crossed_cells,
        resolve::{crossing, inner_place},
        tables::{CASES, edge_corner},
    },
    math::{bits::ones, simd::Portable},
};

/// Hands out the triangles of some rows, in the order of the mesh; positions are bit for bit those of the mesh.
pub(crate) struct Soup<'a> {
    pub(crate) signs: &'a Signs,
    pub(crate) iso: Iso,
    pub(crate) rows: Range<usize>,
    /// Takes a triangle's corners, relative to the volume's origin, counter-clockwise seen from outside.
    pub(crate) to: &'a mut dyn FnMut([[f32; 3]; 3]),
}

impl Soup<'_> {
    pub(crate) fn run(self, grid: &dyn Rows) {
        let shape = grid.shape();
        let flip = shape.is_left_handed;
        for row in self.rows {
            let [Some(own), Some(y), Some(z), Some(yz)] = four_rows(shape, self.signs, self.iso.number, row) else {
                continue;
            };
            let ny = shape.nodes[1];
            let starts = [0, 1, ny, ny + 1].map(|r| shape.row_start(row + r));
            for w in 0..own.len() {
                let corners = corner_words(&[own, y, z, yz], w);
                let mut cells = Cases::new(Portable, &corners, crossed_cells(&corners) & shape.with_next(w));
                while let Some((cell, case)) = cells.next() {
                    let (i, j, k) = (64 * w + cell, row % ny, row / ny);
                    let values = grid.corners([i, j, k], self.iso.value);
                    let mut at = [[0.0f32; 3]; 16];
                    let entry = &CASES[usize::from(case)];
                    for edge in ones(entry.edges.into()) {
                        let low = edge_corner(edge);
                        let t = crossing(values[low], values[low | 1 << (edge / 4)]);
                        let node = [i + (low & 1), j + (low >> 1 & 1), k + (low >> 2)];
                        at[edge] = grid.on_edge(&starts[low >> 1], node, edge / 4, t);
                    }
                    let (mut triangles, mut len) = (&entry.triangles[..], usize::from(entry.len));
                    let resolved;
                    if self.iso.is_hard(case) {
                        resolved = self.iso.resolve(grid, row, i, case);
                        for (n, &edges) in resolved.inner[..resolved.inner_len].iter().enumerate() {
                            at[12 + n] = grid.in_cell(&starts[0], [i, j, k], inner_place(edges, &values));
                        }
                        (triangles, len) = (&resolved.triangles[..], resolved.len);
                    }
                    for triangle in &triangles[..len] {
                        let [a, b, c] = triangle.map(|v| at[usize::from(v & 15)]);
                        (self.to)(if flip { [a, c, b] } else { [a, b, c] });
                    }
                }
            }
        }
    }
}
