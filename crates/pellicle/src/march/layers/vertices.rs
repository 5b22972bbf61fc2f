//! Vertices of one slab.
//!
//! A vertex is a crossed edge. Vertices get their numbers slice by slice, row by row; a cell finds its own by the lower nodes
//! of its edges, in arrays that hold two slices' numbers and those between.
//!
//! ```text
//! numbers   even slice: x, y │ odd slice: x, y │ between: z        each as many as a slice has nodes
//! ends      what is known at both ends of 16 edges: a vector each of values and outward vectors
//! ```
//!
//! What is at the ends of an edge is gathered when it gets its number, and as soon as there are 16 their vertices are made
//! at once.
//!
//! Source: Lorensen & Cline 1987; shared vertices as in Rosenberg & Birdwell 2008, section 4.

use super::{NUMBERED, RING, Work, bricks_of, place};
use crate::{
    lookup::columns::Extent,
    march::slices::{Blend, FOREIGN, March, Owner, Skin, WIDEST},
    math::{
        bits::ones,
        simd::{LANES, Simd},
    },
};

/// Crossed edges that have a number and no vertex yet.
pub(super) struct Ends {
    count: usize,
    /// Of the lower ends, then of the upper ones.
    values: [[f32; LANES]; 2],
    outward: [[[f32; LANES]; 3]; 2],
    /// Lower node and axis.
    edges: [([u8; 3], u8); LANES],
}

impl Default for Ends {
    fn default() -> Self {
        let none = [0.0; LANES];
        Self { count: 0, values: [none; 2], outward: [[none; 3]; 2], edges: [([0; 3], 0); LANES] }
    }
}

/// Where nodes lie along each axis: offsets from the mesh's origin in world units, unless the lattice is turned.
pub(super) type Places = [[f32; WIDEST]; 3];

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Where the block's nodes lie.
    pub(super) fn find_places(&mut self, extent: Extent) {
        let scene = self.scene;
        for a in 0..3 {
            for (i, place) in self.work.places[a].iter_mut().enumerate().take(extent.nodes[a]) {
                *place = (f64::from(extent.first[a] + i as i32 - scene.origin[a]) * scene.spacing) as f32;
            }
        }
    }

    /// Numbers the vertices on a slice's edges along x and y, of some rows.
    #[inline(always)]
    pub(super) fn number_slice<S: Simd>(&mut self, s: S, extent: Extent, z: usize, rows: u64) {
        let [width, height, _] = extent.nodes;
        let (nodes, cells) = (u64::MAX >> (64 - width), u64::MAX >> (65 - width));
        for y in ones(rows) {
            let inside = &self.work.inside[z % RING];
            let row = inside[y];
            let along_x = (row ^ row >> 1) & cells;
            let along_y = if y + 1 < height { (row ^ inside[y + 1]) & nodes } else { 0 };
            self.number_row(s, extent, 0, [y, z], along_x);
            self.number_row(s, extent, 1, [y, z], along_y);
        }
    }

    /// Numbers the vertices on edges along z, between a slice and the next, of some rows.
    #[inline(always)]
    pub(super) fn number_between<S: Simd>(&mut self, s: S, extent: Extent, z: usize, rows: u64) {
        let nodes = u64::MAX >> (64 - extent.nodes[0]);
        for y in ones(rows) {
            let along_z = (self.work.inside[z % RING][y] ^ self.work.inside[(z + 1) % RING][y]) & nodes;
            self.number_row(s, extent, 2, [y, z], along_z);
        }
    }

    /// Numbers a row's crossed edges along `axis`: own vertices, or references to the blocks that own them.
    #[inline(always)]
    fn number_row<S: Simd>(&mut self, s: S, extent: Extent, axis: usize, [y, z]: [usize; 2], edges: u64) {
        if edges == 0 {
            return;
        }
        let first = section(axis, z) * extent.nodes[0] * extent.nodes[1] + extent.nodes[0] * y;
        let on_border = |a: usize, at: usize| a != axis && (at == 0 || at + 1 == extent.nodes[a]);
        let border = if on_border(1, y) || on_border(2, z) { u64::MAX } else { 1 | 1 << (extent.nodes[0] - 1) };
        for x in ones(edges) {
            let number = if border >> x & 1 == 0 {
                self.push_edge(s, extent, axis, [x, y, z])
            } else {
                match self.seam.owner(axis, [x, y, z]) {
                    Owner::Mine => self.push_edge(s, extent, axis, [x, y, z]),
                    Owner::Shared(key) => {
                        let vertex = self.push_edge(s, extent, axis, [x, y, z]);
                        self.piece.shared.push((key, vertex));
                        vertex
                    }
                    Owner::Other(reference) => {
                        self.piece.foreign.push(reference);
                        FOREIGN | (self.piece.foreign.len() as u32 - 1)
                    }
                }
            };
            self.work.numbers[first + x] = number;
        }
    }

    /// Gathers what is at the ends of the edge along `axis` from a node. Gives the vertex's number.
    #[inline(always)]
    fn push_edge<S: Simd>(&mut self, s: S, extent: Extent, axis: usize, node: [usize; 3]) -> u32 {
        let (width, normals) = (bricks_of(extent)[0], self.scene.shading.normals());
        let work = &mut *self.work;
        let (ends, mut at) = (&mut work.ends, node);
        let lane = ends.count;
        for end in 0..2 {
            let layer = &work.layers[at[2] / super::SIDE % 2];
            let (brick, node) = place(width, at);
            ends.values[end][lane] = layer.values_of(brick)[node];
            if normals {
                let outward = &layer.shade_of(brick).outward;
                for a in 0..3 {
                    ends.outward[end][a][lane] = outward[a][node];
                }
            }
            at[axis] += 1;
        }
        ends.edges[lane] = ([node[0] as u8, node[1] as u8, node[2] as u8], axis as u8);
        ends.count += 1;
        let vertex = (self.piece.drained + self.piece.positions.len() + lane) as u32;
        if ends.count == LANES {
            self.make_vertices(s, extent);
        }
        vertex
    }

    /// Makes the vertices on the edges whose ends are known.
    #[inline(always)]
    pub(super) fn make_vertices<S: Simd>(&mut self, s: S, extent: Extent) {
        let (scene, work, piece) = (self.scene, &mut *self.work, &mut *self.piece);
        let ends = &mut work.ends;
        let edges = &ends.edges[..std::mem::take(&mut ends.count)];
        let (a, b) = (s.load(&ends.values[0]), s.load(&ends.values[1]));
        let t = s.div(s.sub(s.splat(scene.iso), a), s.sub(b, a));
        let (mut ts, mut steps) = ([0.0; LANES], [0.0; LANES]);
        s.store(t, &mut ts);
        s.store(s.mul(t, s.splat(scene.spacing as f32)), &mut steps);
        let mut to = [[0.0; 3]; LANES];
        for (lane, &(node, axis)) in edges.iter().enumerate() {
            for a in 0..3 {
                to[lane][a] = work.places[a][usize::from(node[a]) % WIDEST];
            }
            to[lane][usize::from(axis % 3)] += steps[lane];
        }
        if scene.axes.is_some() {
            for (lane, &(node, axis)) in edges.iter().enumerate() {
                let mut at = [0, 1, 2].map(|a| f64::from(extent.first[a] + i32::from(node[a]) - scene.origin[a]));
                at[usize::from(axis % 3)] += f64::from(ts[lane]);
                to[lane] = scene.world_position(at);
            }
        }
        piece.positions.extend_from_slice(&to[..edges.len()]);
        if scene.shading.normals() {
            unit_normals(s, t, &ends.outward, &mut to);
            if scene.axes.is_some() {
                to = to.map(|normal| scene.to_world(normal.map(f64::from)).map(|v| v as f32));
            }
            piece.normals.extend_from_slice(&to[..edges.len()]);
        }
        if scene.shading.data() {
            let width = bricks_of(extent)[0];
            for (&(node, axis), &t) in edges.iter().zip(&ts) {
                let mut at = node.map(usize::from);
                let corners = [0, 1].map(|_| {
                    let (brick, node) = place(width, at);
                    let corner = work.layers[at[2] / super::SIDE % 2].shade_of(brick).corners[node];
                    at[usize::from(axis)] += 1;
                    corner
                });
                piece.data.push(scene.skin.vertex(corners, t));
            }
        }
    }
}

/// Unit normals at `t` of the way between ends with these outward vectors.
#[inline(always)]
fn unit_normals<S: Simd>(s: S, t: S::F, outward: &[[[f32; LANES]; 3]; 2], to: &mut [[f32; 3]; LANES]) {
    let mut mixed = [s.splat(0.0); 3];
    for axis in 0..3 {
        let (a, b) = (s.load(&outward[0][axis]), s.load(&outward[1][axis]));
        mixed[axis] = s.add(a, s.mul(t, s.sub(b, a)));
    }
    let [x, y, z] = mixed;
    let length = s.sqrt(s.add(s.add(s.mul(x, x), s.mul(y, y)), s.mul(z, z)));
    let per_length = s.div(s.splat(1.0), s.max(length, s.splat(f32::MIN_POSITIVE)));
    let mut unit = [[0.0; LANES]; 3];
    for axis in 0..3 {
        s.store(s.mul(mixed[axis], per_length), &mut unit[axis]);
    }
    for (lane, to) in to.iter_mut().enumerate() {
        *to = [unit[0][lane], unit[1][lane], unit[2][lane]];
    }
}

/// Which of the five arrays holds the numbers of edges along `axis` whose lower node is in slice `z`.
#[inline(always)]
pub(super) fn section(axis: usize, z: usize) -> usize {
    if axis == 2 { NUMBERED - 1 } else { 2 * (z % 2) + axis }
}
