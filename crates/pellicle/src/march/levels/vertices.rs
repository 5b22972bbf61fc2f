//! Vertices of a block: where its owned edges are crossed, moved aside where transition cells need room.
//!
//! Source: this project; transition cells are Lengyel 2010, see [`super`].

use super::{Grid, NodeSet, Samples, Source, around::side, rows::View};
use crate::{
    lattice::Coord,
    math::{
        bits::ones,
        ranges::Split,
        vector::{Axes, from_axes},
    },
};

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
    /// The lattice's axes in the world, where they are not the world's own.
    pub(crate) axes: Option<Axes>,
}

impl Place {
    /// A direction, turned from the lattice's axes to the world's.
    #[inline(always)]
    fn direction(&self, v: [f32; 3]) -> [f32; 3] {
        if self.axes.is_some() { from_axes(self.axes.as_ref(), v.map(f64::from)).map(|v| v as f32) } else { v }
    }
}

/// Where vertices go: as many places in each that is asked for.
pub(crate) struct Vertices<'a, V> {
    pub(crate) positions: &'a mut [[f32; 3]],
    pub(crate) normals: Option<&'a mut [[f32; 3]]>,
    pub(crate) data: Option<&'a mut [V]>,
}

impl<V: Send> Split for Vertices<'_, V> {
    fn split(self, item: usize, at: usize) -> (Self, Self) {
        let (left, right) = (self.positions, self.normals, self.data).split(item, at);
        let vertices = |(positions, normals, data)| Self { positions, normals, data };
        (vertices(left), vertices(right))
    }
}

/// Nodes that are an end of an owned crossed edge.
pub(crate) fn nodes_needed(view: &View<'_>, to: &mut NodeSet) {
    let pitch = view.n + 1;
    to.clear();
    to.resize(pitch * pitch, 0);
    for k in 0..pitch {
        for j in 0..pitch {
            let row = j + pitch * k;
            let [x, y, z] = std::array::from_fn(|axis| view.owned(axis, j, k));
            to[row] |= x | x << 1 | y | z;
            if y != 0 {
                to[row + 1] |= y;
            }
            if z != 0 {
                to[row + pitch] |= z;
            }
        }
    }
}

/// Writes the vertices of one block, in the order of their numbers.
pub(crate) fn write<S: Source>(
    view: &View<'_>,
    grid: Grid,
    samples: &Samples<S::Corner>,
    place: Place,
    source: &S,
    mut to: Vertices<'_, S::Vertex>,
) {
    let mut next = 0;
    for k in 0..=view.n {
        for j in 0..=view.n {
            for axis in 0..3 {
                for i in ones(view.owned(axis, j, k)) {
                    let crossing = Crossing::new(grid, samples, place.iso, axis, [i, j, k]);
                    let normal = crossing.normal(samples);
                    to.positions[next] = crossing.position(view, grid, place, normal);
                    if let Some(normals) = &mut to.normals {
                        normals[next] = place.direction(normal);
                    }
                    if let Some(data) = &mut to.data {
                        data[next] = source.mix(crossing.at.map(|at| samples.corners[at]), crossing.t);
                    }
                    next += 1;
                }
            }
        }
    }
}

/// A crossed edge.
struct Crossing {
    axis: usize,
    ends: [[usize; 3]; 2],
    /// Places of the ends' samples.
    at: [usize; 2],
    /// Where it is crossed, from 0 to 1.
    t: f32,
}

impl Crossing {
    #[inline(always)]
    fn new<C>(grid: Grid, samples: &Samples<C>, iso: f32, axis: usize, low: [usize; 3]) -> Self {
        let mut high = low;
        high[axis] += 1;
        let at = [low, high].map(|node| grid.place(node));
        let [a, b] = at.map(|at| samples.values[at]);
        Self { axis, ends: [low, high], at, t: (iso - a) / (b - a) }
    }

    /// Outward normal along the lattice's axes; zero where the field has no slope.
    #[inline(always)]
    fn normal<C>(&self, samples: &Samples<C>) -> [f32; 3] {
        let [a, b] = self.at.map(|at| samples.outward[at]);
        let mixed: [f32; 3] = std::array::from_fn(|i| a[i] + self.t * (b[i] - a[i]));
        let length = (mixed[0] * mixed[0] + mixed[1] * mixed[1] + mixed[2] * mixed[2]).sqrt();
        let per_length = 1.0 / length.max(f32::MIN_POSITIVE);
        mixed.map(|v| v * per_length)
    }

    #[inline(always)]
    fn position(&self, view: &View<'_>, grid: Grid, place: Place, normal: [f32; 3]) -> [f32; 3] {
        let moves = self.ends.map(|node| view.around.node_move(node.map(|v| side(v, view.n))));
        let shift = if moves == [[0; 3]; 2] {
            [0.0; 3]
        } else {
            let mixed = |x: usize| (1.0 - self.t) * f32::from(moves[0][x]) + self.t * f32::from(moves[1][x]);
            along_surface(std::array::from_fn(|x| MOVE * mixed(x)), normal)
        };
        let at = std::array::from_fn(|x| {
            let along = if x == self.axis { f64::from(self.t) } else { 0.0 };
            let first = f64::from(grid.first[x] - place.origin[x]);
            let cells = self.ends[0][x] as f64 + along + f64::from(shift[x]);
            (first + cells * f64::from(grid.stride)) * place.spacing
        });
        from_axes(place.axes.as_ref(), at).map(|v| v as f32)
    }
}

/// The part of a move that is at a right angle to the normal.
#[inline(always)]
fn along_surface(shift: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let across = shift[0] * normal[0] + shift[1] * normal[1] + shift[2] * normal[2];
    std::array::from_fn(|x| shift[x] - across * normal[x])
}
