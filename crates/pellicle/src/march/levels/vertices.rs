//! Vertices of a block: where its owned edges are crossed, moved aside where transition cells need room.
//!
//! Source: see [`super`].

use super::{
    Grid, RowSet, Samples,
    around::side,
    rows::{View, WIDEST},
};
use crate::{lattice::Coord, math::bits::ones, math::ranges::Split};

/// Cells that a moved node moves along an axis: the width of a transition cell.
const MOVE: f32 = 0.25;

/// Isovalue, and where the mesh lies in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) iso: f32,
    /// Node that vertices count from.
    pub(crate) origin: Coord,
    /// Edge of a finest cell in world units.
    pub(crate) spacing: f64,
}

/// Where vertices go: as many places in each.
pub(crate) struct Vertices<'a> {
    pub(crate) positions: &'a mut [[f32; 3]],
    pub(crate) normals: Option<&'a mut [[f32; 3]]>,
}

impl Split for Vertices<'_> {
    fn split(self, item: usize, at: usize) -> (Self, Self) {
        let (left, right) = (self.positions, self.normals).split(item, at);
        (Self { positions: left.0, normals: left.1 }, Self { positions: right.0, normals: right.1 })
    }
}

/// Rows that hold an end of an owned crossed edge.
pub(crate) fn rows_needed(view: &View<'_>) -> RowSet {
    let mut needed = [0; WIDEST + 1];
    for k in 0..=view.n {
        for j in 0..=view.n {
            let crossed: [bool; 3] = std::array::from_fn(|axis| view.owned(axis, j, k) != 0);
            if crossed.contains(&true) {
                needed[k] |= 1 << j;
            }
            if crossed[1] {
                needed[k] |= 1 << (j + 1);
            }
            if crossed[2] {
                needed[k + 1] |= 1 << j;
            }
        }
    }
    needed
}

/// Writes the vertices of one block, in the order of their numbers.
pub(crate) fn write(view: &View<'_>, grid: Grid, samples: &Samples, place: Place, to: Vertices<'_>) {
    let Vertices { positions, mut normals } = to;
    let mut next = 0;
    for k in 0..=view.n {
        for j in 0..=view.n {
            for axis in 0..3 {
                for i in ones(view.owned(axis, j, k)) {
                    let (position, normal) = vertex(view, grid, samples, place, axis, [i, j, k]);
                    positions[next] = position;
                    if let Some(normals) = &mut normals {
                        normals[next] = normal;
                    }
                    next += 1;
                }
            }
        }
    }
}

/// Position and outward normal of the vertex on one edge.
#[inline(always)]
fn vertex(
    view: &View<'_>,
    grid: Grid,
    samples: &Samples,
    place: Place,
    axis: usize,
    low: [usize; 3],
) -> ([f32; 3], [f32; 3]) {
    let mut high = low;
    high[axis] += 1;
    let ends = [low, high];
    let [a, b] = ends.map(|node| grid.place(node));
    let (from, to) = (samples.values[a], samples.values[b]);
    let t = (place.iso - from) / (to - from);
    let normal = outward(std::array::from_fn(|x| {
        let gradient = &samples.gradients[x];
        gradient[a] + t * (gradient[b] - gradient[a])
    }));
    let n = view.n;
    let moves = ends.map(|node| view.around.node_move(node.map(|v| side(v, n))));
    let shift = if moves == [[0; 3]; 2] {
        [0.0; 3]
    } else {
        along_surface(
            std::array::from_fn(|x| MOVE * ((1.0 - t) * f32::from(moves[0][x]) + t * f32::from(moves[1][x]))),
            normal,
        )
    };
    let position = std::array::from_fn(|x| {
        let within = low[x] as f64 + f64::from(shift[x]) + if x == axis { f64::from(t) } else { 0.0 };
        ((f64::from(grid.first[x] - place.origin[x]) + within * f64::from(grid.stride)) * place.spacing) as f32
    });
    (position, normal)
}

/// The part of a move that is at a right angle to the normal.
#[inline(always)]
fn along_surface(shift: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let across = shift[0] * normal[0] + shift[1] * normal[1] + shift[2] * normal[2];
    std::array::from_fn(|x| shift[x] - across * normal[x])
}

/// Unit vector against a gradient; zero where there is none.
#[inline(always)]
fn outward(gradient: [f32; 3]) -> [f32; 3] {
    let length_sq = gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2];
    let length = length_sq.max(f32::MIN_POSITIVE).sqrt();
    gradient.map(|g| -g / length)
}
