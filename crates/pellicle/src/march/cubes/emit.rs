//! Write vertices and triangles of counted octets to their places.
//!
//! Source: this project; see [`super`].

use super::{
    above, brick_above,
    count::{Counted, Crossings, Part, cases, crossed_cells},
    signs,
};
use crate::{
    bricks::{
        marks::Marks,
        store::{Octet, Store},
    },
    fill::{brick_origin, eighths, walled::WallLattice},
    lattice::{BRICK, Coord, OCTET},
    lookup::directory::Cursor,
    march::tables::{CASES, edge_corner},
    math::{
        bits::{corner_sets, ones, side_mask},
        simd::{Kernel, Simd},
    },
};

/// World placement of the mesh: its origin's node, and the node distance in world units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) origin: Coord,
    pub(crate) spacing: f64,
}

/// Writes the vertices of one octet.
pub(crate) struct Vertices<'a> {
    pub(crate) store: &'a Store<1>,
    /// Where the values of [`needed`] bricks are: the same store, or one that holds just those.
    pub(crate) values: &'a Store<1>,
    pub(crate) counted: &'a Counted,
    pub(crate) part: Part,
    pub(crate) iso: f32,
    pub(crate) frame: Frame,
    /// What cuts edges besides the field.
    pub(crate) walls: Option<&'a WallLattice>,
    /// One for each crossing of the octet.
    pub(crate) to: &'a mut [[f32; 3]],
}

impl Kernel for Vertices<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let octet = &self.store.octets[self.part.octet as usize];
        let Some(with_values) = self.values.find(&mut Cursor::default(), octet.at) else { return };
        let above = above(self.values, with_values);
        let mut to = self.to.iter_mut();
        for brick in ones(octet.filled.into()) {
            let crossings = self.counted.crossings(octet, brick);
            if crossings.edges == [0; 3] {
                continue;
            }
            let here = self.values.values(with_values, brick).all();
            let first: [f64; 3] = std::array::from_fn(|a| {
                f64::from(octet.at[a]) * f64::from(OCTET) + f64::from(brick_origin(brick)[a] - self.frame.origin[a])
            });
            let place = |a: usize, n: f64| ((first[a] + n) * self.frame.spacing) as f32;
            let nodes: [[f32; 4]; 3] = std::array::from_fn(|a| std::array::from_fn(|n| place(a, n as f64)));
            let node_of = |a: usize, n: usize| octet.at[a] * OCTET + brick_origin(brick)[a] + n as i32;
            let walls = self.walls.filter(|walls| walls.is_near([0, 1, 2].map(|a| node_of(a, 0)), BRICK + 1, 0.0));
            for axis in 0..3 {
                let stride = 1 << (2 * axis);
                let (owner, index) = brick_above(brick, 1 << axis);
                let next = above[owner].filter(|o| o.filled >> index & 1 != 0).map(|o| self.values.values(o, index));
                for (node, to) in ones(crossings.edges[axis]).zip(&mut to) {
                    let local = [node & 3, node >> 2 & 3, node >> 4];
                    let a = here[node];
                    // A crossed edge never leads to a brick without values.
                    let b =
                        if local[axis] < 3 { here[node + stride] } else { next.map_or(a, |v| v.at(node - 3 * stride)) };
                    let mut t = f64::from((self.iso - a) / (b - a));
                    if let Some(walls) = walls {
                        let node = [node_of(0, local[0]), node_of(1, local[1]), node_of(2, local[2])];
                        t = walls.share(node, axis, t, [a > self.iso, b > self.iso]);
                    }
                    *to = std::array::from_fn(|a| nodes[a][local[a]]);
                    to[axis] = place(axis, local[axis] as f64 + t);
                }
            }
        }
    }
}

/// Asks `values` for the bricks whose values the vertices of one octet depend on.
pub(crate) fn want_needed(store: &Store<1>, counted: &Counted, part: Part, values: &mut Store<1>) {
    let octet = &store.octets[part.octet as usize];
    for brick in ones(octet.filled.into()) {
        let crossings = counted.crossings(octet, brick);
        for axis in 0..3 {
            if crossings.edges[axis] == 0 {
                continue;
            }
            values.want(octet.at, eighths::OF[brick], |_| 0);
            let last = side_mask(std::array::from_fn(|a| i32::from(a == axis)));
            if crossings.edges[axis] & last != 0 {
                let (owner, index) = brick_above(brick, 1 << axis);
                let at = std::array::from_fn(|a| octet.at[a] + (owner >> a & 1) as i32);
                values.want(at, eighths::OF[index], |_| 0);
            }
        }
    }
}

/// For each cell and edge of it: brick above (bits 8..), axis (bits 6, 7) and node (bits 0..6) that own the edge.
static OWNERS: [[u16; 12]; 64] = {
    let mut table = [[0; 12]; 64];
    let mut cell = 0;
    while cell < 64 {
        let mut edge = 0;
        while edge < 12 {
            let corner = edge_corner(edge);
            let at = [(cell & 3) + (corner & 1), (cell >> 2 & 3) + (corner >> 1 & 1), (cell >> 4) + (corner >> 2)];
            let brick = at[0] >> 2 | (at[1] >> 2) << 1 | (at[2] >> 2) << 2;
            let node = at[0] & 3 | (at[1] & 3) << 2 | (at[2] & 3) << 4;
            table[cell][edge] = (brick << 8 | (edge / 4) << 6 | node) as u16;
            edge += 1;
        }
        cell += 1;
    }
    table
};

/// Crossings of a brick and those above it as ranks need them: index 4·brick + axis.
struct Ranks {
    edges: [u64; 32],
    bases: [u32; 32],
}

impl Ranks {
    #[inline(always)]
    fn new(counted: &Counted, above: &[Option<&Octet>; 8], brick: usize) -> Self {
        let mut ranks = Self { edges: [0; 32], bases: [0; 32] };
        for c in 0..8 {
            let (octet, index) = brick_above(brick, c);
            let Some(owner) = above[octet] else { continue };
            if owner.filled >> index & 1 == 0 {
                continue;
            }
            let Crossings { edges, mut base } = *counted.crossings(owner, index);
            for axis in 0..3 {
                ranks.edges[4 * c + axis] = edges[axis];
                ranks.bases[4 * c + axis] = base;
                base += edges[axis].count_ones();
            }
        }
        ranks
    }

    /// Number of the vertex on an edge given by its owner.
    #[inline(always)]
    fn vertex(&self, owner: u16) -> u32 {
        let at = usize::from(owner >> 6) & 31;
        let before = (1u64 << (owner & 63)) - 1;
        self.bases[at] + (self.edges[at] & before).count_ones()
    }
}

/// Writes the triangles of one octet.
pub(crate) struct Triangles<'a> {
    pub(crate) store: &'a Store<1>,
    pub(crate) marks: &'a Marks,
    pub(crate) counted: &'a Counted,
    pub(crate) part: Part,
    pub(crate) to: &'a mut [[u32; 3]],
}

impl Kernel for Triangles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let octet = &self.store.octets[self.part.octet as usize];
        let above = above(self.store, octet);
        let mut written = 0;
        for brick in ones(octet.filled.into()) {
            let Some(signs) = signs(self.store, &above, brick) else { continue };
            let corners = corner_sets(&signs);
            let crossed = crossed_cells(&corners) & self.marks.of(octet, brick).cells;
            if crossed == 0 {
                continue;
            }
            let ranks = Ranks::new(self.counted, &above, brick);
            let cases = cases(&corners);
            for cell in ones(crossed) {
                let case = &CASES[usize::from(cases[cell / 8][cell % 8])];
                let mut vertices = [0u32; 16];
                for edge in ones(case.edges.into()) {
                    vertices[edge & 15] = ranks.vertex(OWNERS[cell][edge]);
                }
                let to = &mut self.to[written..written + usize::from(case.len)];
                for (to, from) in to.iter_mut().zip(&case.triangles) {
                    *to = from.map(|edge| vertices[usize::from(edge & 15)]);
                }
                written += usize::from(case.len);
            }
        }
    }
}
