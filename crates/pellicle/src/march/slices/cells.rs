//! One cube: its corners, its case, its triangles and their vertices.
//!
//! Source: Lorensen & Cline 1987 with the generated tables of [`tables`](crate::march::tables); corners evaluated once and
//! vertices shared as in Rosenberg & Birdwell 2008, section 4.

use super::{Blend, FOREIGN, March, Skin, Sorting, Work, seam::Owner, skin::Neighbours};
use crate::{
    lookup::columns::{Extent, Want},
    march::tables::{CASES, edge_corner},
    math::{bits::ones, simd::Simd},
};

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Evaluates the nodes of row `y` given bit by bit, in the lower (`side` 0) or upper slice of slab `z`.
    #[inline(always)]
    pub(super) fn evaluate<S: Simd>(&mut self, s: S, extent: Extent, z: usize, side: usize, y: usize, nodes: u64) {
        let work = &mut *self.work;
        let slice = &mut *work.pool.pair(z)[side];
        // The lowest and the highest slice of a margin hold nothing, as its outermost columns do.
        let height = z + side;
        let closed = self.seam.margin > 0 && (height == 0 || height + 1 == extent.nodes[2]);
        let mut inside = 0;
        for x in ones(nodes) {
            let at = x + extent.nodes[0] * y;
            let value = if closed {
                0.0
            } else {
                work.columns.find(s, at, height as i32, B::WANT, &mut work.near);
                self.scene.blend.value(s, &work.near, work.columns.particles())
            };
            slice.values[at] = value;
            inside |= u64::from(value > self.scene.iso) << x;
        }
        slice.touch(y);
        slice.known[y] |= nodes;
        slice.inside[y] |= inside;
        self.piece.counts.corners += u64::from(nodes.count_ones());
    }

    /// Evaluates those corners of a cube that are not known yet.
    #[inline(always)]
    pub(super) fn evaluate_corners<S: Simd>(&mut self, s: S, extent: Extent, [x, y, z]: [usize; 3]) {
        for side in [0, 1] {
            for row in [y, y + 1] {
                let missing = 0b11 << x & !self.work.pool.pair(z)[side].known[row];
                if missing != 0 {
                    self.evaluate(s, extent, z, side, row, missing);
                }
            }
        }
    }

    /// The case of a cube whose corners are known.
    #[inline(always)]
    pub(super) fn case(&mut self, [x, y, z]: [usize; 3]) -> u8 {
        let [lower, upper] = self.work.pool.pair(z);
        let rows = [lower.inside[y], lower.inside[y + 1], upper.inside[y], upper.inside[y + 1]];
        rows.iter().enumerate().fold(0, |case, (i, row)| case | ((row >> x & 0b11) as u8) << (2 * i))
    }

    /// Makes the triangles of a cube, and those of its vertices that are not there yet.
    #[inline(always)]
    pub(super) fn make_triangles<S: Simd>(&mut self, s: S, extent: Extent, cube: [usize; 3], case: u8) {
        let entry = &CASES[usize::from(case)];
        let mut vertices = [0u32; 16];
        let [x, y, z] = cube;
        for edge in ones(entry.edges.into()) {
            let (corner, axis) = (edge_corner(edge), edge / 4);
            let (x, y, side) = (x + (corner & 1), y + (corner >> 1 & 1), corner >> 2);
            let at = x + extent.nodes[0] * y;
            let slice = &mut *self.work.pool.pair(z)[side];
            vertices[edge] = if slice.made[axis][y] >> x & 1 != 0 {
                slice.vertices[axis][at]
            } else {
                slice.made[axis][y] |= 1 << x;
                slice.touch(y);
                let vertex = self.make_vertex(s, extent, axis, [x, y, z], side);
                self.work.pool.pair(z)[side].vertices[axis][at] = vertex;
                vertex
            };
        }
        let numbered = |triangle: [u8; 3]| triangle.map(|edge| vertices[usize::from(edge & 15)]);
        match &self.sight {
            None => self.piece.triangles.extend(entry.triangles[..entry.len.into()].iter().map(|&t| numbered(t))),
            Some(sight) => {
                let triangles = sight.triangles(cube, case.into()).map(numbered);
                match sight.sorting {
                    Sorting::Fast => self.piece.triangles.extend(triangles),
                    Sorting::Exact => self.work.slabs.push(sight.place(cube), triangles),
                }
            }
        }
        self.piece.counts.cubes += 1;
    }

    /// Makes the vertex on the edge along `axis` from node (x, y) of the lower or upper slice of slab z: its number here,
    /// or a reference to the block that owns it.
    #[inline(always)]
    fn make_vertex<S: Simd>(&mut self, s: S, extent: Extent, axis: usize, [x, y, z]: [usize; 3], side: usize) -> u32 {
        let node = [x, y, z + side];
        let key = match self.seam.owner(axis, node) {
            Owner::Mine => None,
            Owner::Shared(key) => Some(key),
            Owner::Other(reference) => {
                self.piece.foreign.push(reference);
                return FOREIGN | (self.piece.foreign.len() as u32 - 1);
            }
        };
        let vertex = self.piece.positions.len() as u32;
        if let Some(key) = key {
            self.piece.shared.push((key, vertex));
        }
        let width = extent.nodes[0];
        let to = [x + usize::from(axis == 0), y + usize::from(axis == 1), side + usize::from(axis == 2)];
        let ends = [(x + width * y, side), (to[0] + width * to[1], to[2])];
        let pair = self.work.pool.pair(z);
        let [a, b] = ends.map(|(at, side)| pair[side].values[at]);
        let t = (self.scene.iso - a) / (b - a);
        let mut at: [f64; 3] =
            std::array::from_fn(|a| f64::from(extent.first[a] + node[a] as i32 - self.scene.origin[a]));
        at[axis] += f64::from(t);
        self.piece.positions.push(self.scene.world_position(at));
        if self.scene.shading.any() {
            self.shade(s, extent, z, side, [x, y]);
            self.shade(s, extent, z, to[2], [to[0], to[1]]);
            self.finish_vertex(z, ends, t);
        }
        vertex
    }

    /// Interpolates the outward vectors and the user's data of an edge's ends.
    #[inline(always)]
    fn finish_vertex(&mut self, z: usize, ends: [(usize, usize); 2], t: f32) {
        if self.scene.shading.normals() {
            let pair = self.work.pool.pair(z);
            let [a, b] = ends.map(|(at, side)| pair[side].outward[at]);
            self.piece.normals.push(self.scene.normal_between(a, b, t));
        }
        if self.scene.shading.data() {
            let pair = self.work.pool.pair(z);
            let corners = ends.map(|(at, side)| pair[side].corners[at]);
            self.piece.data.push(self.scene.skin.vertex(corners, t));
        }
    }

    /// Computes the outward vector and the user's data of a corner, unless they are known.
    #[inline(always)]
    fn shade<S: Simd>(&mut self, s: S, extent: Extent, z: usize, side: usize, [x, y]: [usize; 2]) {
        let at = x + extent.nodes[0] * y;
        let work = &mut *self.work;
        let slice = &mut *work.pool.pair(z)[side];
        if slice.shaded[y] >> x & 1 != 0 {
            return;
        }
        slice.shaded[y] |= 1 << x;
        slice.touch(y);
        let want = Want { who: true, ..B::WANT };
        work.columns.find(s, at, (z + side) as i32, want, &mut work.near);
        let node: [i32; 3] = std::array::from_fn(|a| extent.first[a] + [x, y, z + side][a] as i32);
        let particles = work.columns.particles();
        if self.scene.shading.normals() {
            self.scene.blend.slopes(s, &work.near, particles, &mut work.slopes);
            let mut outward = [0.0f32; 3];
            for (slope, who) in work.slopes.iter().zip(work.near.who()) {
                let particle = &particles[who];
                for a in 0..3 {
                    outward[a] += slope * ((node[a] - particle.node[a]) as f32 - particle.offset[a]);
                }
            }
            slice.outward[at] = outward;
        }
        if self.scene.shading.data() {
            let near = Neighbours { near: &work.near, particles, node, next: 0 };
            slice.corners[at] = self.scene.skin.corner(near);
        }
        self.piece.counts.shaded += 1;
    }
}
