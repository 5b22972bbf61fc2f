//! Normals of counted rows' vertices, from the samples' gradient.
//!
//! A node's gradient is the central difference of its neighbours, or a one-sided one where a neighbour is absent; along an edge
//! it is interpolated, inside a cell it is that of the trilinear interpolant. It goes to the world by the reciprocal of the
//! direction vectors, so that normals of oblique volumes are right. On a cap, where an edge leads to an absent node, the
//! samples fall endlessly along the edge: the normal is that of the border.
//!
//! Source: central differences are Lorensen & Cline 1987, Marching Cubes; the rest is this project's.

use std::ops::Range;

use super::{
    ABSENT, Grid, Iso,
    classify::Signs,
    count::{Cases, corner_words, four_rows},
};
use crate::{
    field::volume::{Scalar, determinant},
    march::{
        cubes::count::crossed_cells,
        resolve::{crossing, inner_place},
    },
    math::{bits::ones, simd::Portable},
};

/// Writes the normals of some rows' vertices.
pub(crate) struct Normals<'a> {
    pub(crate) signs: &'a Signs,
    pub(crate) iso: Iso,
    pub(crate) rows: Range<usize>,
    /// One for each vertex of those rows: of unit length, outward, zero where there is no gradient.
    pub(crate) to: &'a mut [[f32; 3]],
}

/// Gradient of node coordinates to a unit normal in the world.
struct Outward {
    /// Minus the reciprocal directions.
    reciprocal: [[f64; 3]; 3],
}

impl Outward {
    fn new(directions: [[f64; 3]; 3]) -> Self {
        let [a, b, c] = directions;
        let cross = |u: [f64; 3], v: [f64; 3]| {
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        };
        let by = -1.0 / determinant(directions);
        Self { reciprocal: [cross(b, c), cross(c, a), cross(a, b)].map(|v| v.map(|x| x * by)) }
    }

    fn normal(&self, gradient: [f64; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for (g, r) in gradient.into_iter().zip(self.reciprocal) {
            (0..3).for_each(|a| sum[a] += g * r[a]);
        }
        // By the greatest first, so that no square overflows or vanishes.
        let most = sum.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if most == 0.0 {
            return [0.0; 3];
        }
        let scaled = sum.map(|v| v / most);
        let length = scaled.iter().map(|v| v * v).sum::<f64>().sqrt();
        scaled.map(|v| (v / length) as f32)
    }
}

impl<T: Scalar> Grid<'_, T> {
    /// Relative value of a node; [`ABSENT`] beyond the lattice.
    fn at(&self, node: [isize; 3], iso: f64) -> f64 {
        let [i, j, k] = node.map(|n| n as usize);
        self.row(j, k, iso).get(i)
    }

    /// Gradient of a node that is present, per step along each axis.
    fn gradient(&self, node: [isize; 3], iso: f64) -> [f64; 3] {
        let here = self.at(node, iso);
        std::array::from_fn(|a| {
            let beside = |step: isize| self.at(std::array::from_fn(|b| node[b] + if a == b { step } else { 0 }), iso);
            match [beside(-1), beside(1)] {
                [ABSENT, ABSENT] => 0.0,
                [ABSENT, after] => after - here,
                [before, ABSENT] => here - before,
                [before, after] => 0.5 * (after - before),
            }
        })
    }

    /// Gradient where the surface crosses the edge from a node along an axis.
    fn edge_gradient(&self, node: [isize; 3], axis: usize, iso: f64) -> [f64; 3] {
        let mut end = node;
        end[axis] += 1;
        let (a, b) = (self.at(node, iso), self.at(end, iso));
        if a == ABSENT || b == ABSENT {
            return std::array::from_fn(|i| if i == axis { (b - a).signum() } else { 0.0 });
        }
        let t = crossing(a, b);
        let (a, b) = (self.gradient(node, iso), self.gradient(end, iso));
        std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
    }
}

/// Gradient of the trilinear interpolant at a place in the unit cell.
fn trilinear_gradient(values: &[f64; 8], at: [f64; 3]) -> [f64; 3] {
    let mut gradient = [0.0; 3];
    for (corner, value) in values.iter().enumerate() {
        let weight = |a: usize| if corner >> a & 1 == 1 { at[a] } else { 1.0 - at[a] };
        for axis in 0..3 {
            let sign = if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            gradient[axis] += sign * weight((axis + 1) % 3) * weight((axis + 2) % 3) * value;
        }
    }
    gradient
}

impl Normals<'_> {
    pub(super) fn run<T: Scalar>(self, grid: &Grid<'_, T>) {
        let (shape, iso) = (&grid.shape, self.iso);
        let outward = Outward::new(shape.directions);
        let mut to = self.to.iter_mut();
        for row in self.rows {
            let [Some(own), y, z, yz] = four_rows(shape, self.signs, iso.number, row) else { continue };
            let rows = [own, y.unwrap_or(own), z.unwrap_or(own), yz.unwrap_or(own)];
            let node = |i: usize| [i, row % shape.nodes[1], row / shape.nodes[1]].map(|n| n as isize);
            for axis in 0..3 {
                for w in 0..own.len() {
                    let corners = corner_words(&rows, w);
                    let among = if axis == 0 { shape.with_next(w) } else { u64::MAX };
                    for (bit, to) in ones((corners[0] ^ corners[1 << axis]) & among).zip(&mut to) {
                        *to = outward.normal(grid.edge_gradient(node(64 * w + bit), axis, iso.value));
                    }
                }
            }
            for w in 0..if yz.is_some() { own.len() } else { 0 } {
                let corners = corner_words(&rows, w);
                let mut cells = Cases::new(Portable, &corners, crossed_cells(&corners) & shape.with_next(w));
                while let Some((cell, case)) = cells.next() {
                    if iso.is_hard(case) {
                        let resolved = iso.resolve(grid, row, 64 * w + cell, case);
                        let values = super::Rows::corners(grid, node(64 * w + cell).map(|n| n as usize), iso.value);
                        for (&edges, to) in resolved.inner[..resolved.inner_len].iter().zip(&mut to) {
                            *to = outward.normal(trilinear_gradient(&values, inner_place(edges, &values)));
                        }
                    }
                }
            }
        }
    }
}
