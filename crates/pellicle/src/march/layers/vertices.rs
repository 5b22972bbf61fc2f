//! Vertices and triangles of one slab.
//!
//! A vertex is a crossed edge. Vertices get their numbers slice by slice, row by row; a cell finds its own by the lower nodes
//! of its edges, in arrays that hold two slices' numbers and those between.
//!
//! ```text
//! numbers   even slice: x, y │ odd slice: x, y │ between: z        each as many as a slice has nodes
//! ```
//!
//! Source: Lorensen & Cline 1987 with the generated tables of [`tables`](crate::march::tables); shared vertices and order as in
//! Rosenberg & Birdwell 2008, sections 4 and 5.

use super::{NUMBERED, RING, Work, bricks_of, place};
use crate::{
    bricks::lists::SIDE,
    lookup::columns::Extent,
    march::{
        slices::{Blend, FOREIGN, March, Owner, Skin, next},
        tables::{CASES, edge_corner},
    },
    math::bits::ones,
};

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Numbers the vertices on a slice's edges along x and y.
    #[inline(always)]
    pub(super) fn number_slice(&mut self, extent: Extent, z: usize) {
        let [width, height, _] = extent.nodes;
        let (nodes, cells) = (u64::MAX >> (64 - width), u64::MAX >> (65 - width));
        for y in 0..height {
            let inside = &self.work.inside[z % RING];
            let row = inside[y];
            let along_x = (row ^ row >> 1) & cells;
            let along_y = if y + 1 < height { (row ^ inside[y + 1]) & nodes } else { 0 };
            self.number_row(extent, 0, y, z, along_x);
            self.number_row(extent, 1, y, z, along_y);
        }
    }

    /// Numbers the vertices on edges along z, between a slice and the next.
    #[inline(always)]
    pub(super) fn number_between(&mut self, extent: Extent, z: usize) {
        let nodes = u64::MAX >> (64 - extent.nodes[0]);
        for y in 0..extent.nodes[1] {
            let along_z = (self.work.inside[z % RING][y] ^ self.work.inside[(z + 1) % RING][y]) & nodes;
            self.number_row(extent, 2, y, z, along_z);
        }
    }

    /// Makes the vertices of a row's crossed edges along `axis`, or references to the blocks that own them.
    #[inline(always)]
    fn number_row(&mut self, extent: Extent, axis: usize, y: usize, z: usize, edges: u64) {
        if edges == 0 {
            return;
        }
        let first = section(axis, z) * extent.nodes[0] * extent.nodes[1] + extent.nodes[0] * y;
        let on_border = |a: usize, at: usize| a != axis && (at == 0 || at + 1 == extent.nodes[a]);
        let border = if on_border(1, y) || on_border(2, z) { u64::MAX } else { 1 | 1 << (extent.nodes[0] - 1) };
        for x in ones(edges) {
            let number = if border >> x & 1 == 0 {
                self.make_vertex(extent, axis, [x, y, z])
            } else {
                match self.seam.owner(axis, [x, y, z]) {
                    Owner::Mine => self.make_vertex(extent, axis, [x, y, z]),
                    Owner::Shared(key) => {
                        let vertex = self.make_vertex(extent, axis, [x, y, z]);
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

    /// Makes the vertex on the edge along `axis` from a node.
    #[inline(always)]
    fn make_vertex(&mut self, extent: Extent, axis: usize, node: [usize; 3]) -> u32 {
        let (scene, layers) = (self.scene, &self.work.layers);
        let width = bricks_of(extent)[0];
        let mut to = node;
        to[axis] += 1;
        let (from_brick, from) = place(width, node);
        let (to_brick, to_node) = place(width, to);
        let (below, above) = (&layers[node[2] / SIDE % 2], &layers[to[2] / SIDE % 2]);
        let (a, b) = (below.values[from_brick][from], above.values[to_brick][to_node]);
        let t = (scene.iso - a) / (b - a);
        let mut at = [0.0; 3];
        for axis in 0..3 {
            at[axis] = f64::from(extent.first[axis] + node[axis] as i32 - scene.origin[axis]);
        }
        at[axis] += f64::from(t);
        let vertex = self.piece.positions.len() as u32;
        self.piece.positions.push(scene.world_position(at));
        if scene.shading.any() {
            let ends = [below.shade_of(from_brick), above.shade_of(to_brick)];
            if scene.shading.normals() {
                let [mut a, mut b] = [[0.0; 3]; 2];
                for axis in 0..3 {
                    (a[axis], b[axis]) = (ends[0].outward[axis][from], ends[1].outward[axis][to_node]);
                }
                self.piece.normals.push(scene.normal_between(a, b, t));
            }
            if scene.shading.data() {
                self.piece.data.push(scene.skin.vertex([ends[0].corners[from], ends[1].corners[to_node]], t));
            }
        }
        vertex
    }

    /// Makes the triangles of the cells of a slab that are to be done.
    #[inline(always)]
    pub(super) fn make_triangles(&mut self, extent: Extent, z: usize) {
        let width = extent.nodes[0];
        let nodes = width * extent.nodes[1];
        let mut offsets = [0; 16];
        for (edge, offset) in offsets.iter_mut().enumerate().take(12) {
            let corner = edge_corner(edge);
            *offset = section(edge / 4, z + (corner >> 2)) * nodes + (corner & 1) + width * (corner >> 1 & 1);
        }
        let work = &mut *self.work;
        let (lower, upper) = (&work.inside[z % RING], &work.inside[(z + 1) % RING]);
        let numbers = &work.numbers[..NUMBERED * nodes];
        let triangles = &mut self.piece.triangles;
        while let Some((x, y)) = next(&mut work.todo, self.sight.as_ref()) {
            let rows = [lower[y], lower[y + 1], upper[y], upper[y + 1]];
            let mut case = 0;
            for (i, row) in rows.iter().enumerate() {
                case |= ((row >> x & 0b11) as usize) << (2 * i);
            }
            let first = x + width * y;
            let numbered = |edges: [u8; 3]| edges.map(|edge| numbers[first + offsets[usize::from(edge & 15)]]);
            let entry = &CASES[case];
            match &self.sight {
                None => triangles.extend(entry.triangles[..entry.len.into()].iter().map(|&t| numbered(t))),
                Some(sight) => triangles.extend(sight.triangles([x, y, z], case).map(numbered)),
            }
        }
    }
}

/// Which of the five arrays holds the numbers of edges along `axis` whose lower node is in slice `z`.
#[inline(always)]
fn section(axis: usize, z: usize) -> usize {
    if axis == 2 { NUMBERED - 1 } else { 2 * (z % 2) + axis }
}
