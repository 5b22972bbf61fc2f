//! What nodes get: values; at crossed edges outward vectors and user data.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 4: corner values, normals and user
//! data are computed once and used again.

use super::{
    Work, bricks_of,
    fill::{self, NODES},
    sides::Wanted,
};
use crate::{
    bricks::lists::{List, SIDE},
    lookup::columns::Extent,
    march::slices::{Blend, March, Neighbours, Skin},
    math::{
        bits::ones,
        simd::{LANES, Simd},
    },
};

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Planes of a layer's bricks that the block has.
    #[inline(always)]
    fn planes(extent: Extent, layer: usize) -> usize {
        SIDE.min(extent.nodes[2] - SIDE * layer)
    }

    /// Evaluates the nodes of a brick. Gives one bit for each that is inside.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, s: S, extent: Extent, layer: usize, brick: usize) -> u64 {
        let planes = Self::planes(extent, layer);
        let iso = self.scene.iso;
        let (lists, values) = self.work.layers[layer % 2].place(brick);
        let list = lists.list(brick);
        self.piece.counts.corners += (LANES * planes) as u64;
        self.piece.counts.looked_at += (LANES * planes * list.len()) as u64;
        if let Some(falloff) = self.scene.blend.falloff() {
            // The highest layer has but one plane of the block.
            return match (B::WANT.varied, planes) {
                (true, 1) => fill::values::<S, _, true, 1>(s, falloff, &list, iso, values),
                (true, _) => fill::values::<S, _, true, SIDE>(s, falloff, &list, iso, values),
                (false, 1) => fill::values::<S, _, false, 1>(s, falloff, &list, iso, values),
                (false, _) => fill::values::<S, _, false, SIDE>(s, falloff, &list, iso, values),
            };
        }
        let mut inside = 0;
        self.work.near.provide(list.len() + 2 * LANES);
        for (node, value) in values.iter_mut().enumerate().take(LANES * planes) {
            list.find(lane(node), &mut self.work.near);
            *value = self.scene.blend.value(s, &self.work.near, self.scene.particles);
            inside |= u64::from(*value > iso) << node;
        }
        inside
    }

    /// Gives the nodes that are needed, of those in `of` of each brick, what their vertices are made of. `wanted` holds the
    /// bricks with needed nodes, one bit each, row by row.
    #[inline(always)]
    pub(super) fn prepare<S: Simd>(&mut self, s: S, extent: Extent, layer: usize, wanted: &Wanted, of: u64) {
        let [width, rows] = bricks_of(extent);
        // No particle reaches some of those beside a crossing: their nodes are 0.
        for (row, &bricks) in wanted[..rows].iter().enumerate() {
            for column in ones(bricks.into()) {
                let brick = row * width + column;
                if !self.work.layers[layer % 2].is_filled(brick) {
                    self.fill(s, extent, layer, brick);
                }
            }
        }
        if self.scene.shading.any() {
            for (row, &bricks) in wanted[..rows].iter().enumerate() {
                for column in ones(bricks.into()) {
                    let brick = row * width + column;
                    let needed = self.work.layers[layer % 2].needed[brick] & of;
                    self.shade(s, extent, layer, brick, needed);
                }
            }
        }
    }

    /// Gives the needed nodes of a brick the outward vectors and the user data that they do not have yet.
    #[inline(always)]
    fn shade<S: Simd>(&mut self, s: S, extent: Extent, layer: usize, brick: usize, needed: u64) {
        let (shading, corners, bricks) = (self.scene.shading, self.corners(), bricks_of(extent));
        let (particles, blend) = (self.scene.particles, self.scene.blend);
        let work = &mut *self.work;
        let (lists, shade) = work.layers[layer % 2].shade(brick, corners);
        let list = lists.list(brick);
        let at = [brick % bricks[0], brick / bricks[0], layer];
        let first: [i32; 3] = [0, 1, 2].map(|a| extent.first[a] + (SIDE * at[a]) as i32);
        match blend.falloff() {
            Some(falloff) if shading.normals() => {
                let mut planes = 0u8;
                for plane in 0..SIDE {
                    planes |= u8::from(needed >> (LANES * plane) & 0xffff != 0) << plane;
                }
                planes &= !shade.planes;
                shade.planes |= outward_planes::<S, B>(s, falloff, &list, planes, &mut shade.outward);
                self.piece.counts.shaded += LANES as u64 * u64::from(planes.count_ones());
            }
            _ => {}
        }
        let by_node = blend.falloff().is_none() && shading.normals();
        if !(by_node || shading.data()) {
            return;
        }
        work.near.provide(list.len() + 2 * LANES);
        for node in ones(needed & !shade.nodes) {
            list.find(lane(node), &mut work.near);
            let place: [i32; 3] = [0, 1, 2].map(|a| first[a] + lane(node)[a] as i32);
            if by_node {
                blend.slopes(s, &work.near, particles, &mut work.slopes);
                let mut outward = [0.0f32; 3];
                for (slope, who) in work.slopes.iter().zip(work.near.who()) {
                    let particle = &particles[who];
                    for a in 0..3 {
                        outward[a] += slope * ((place[a] - particle.node[a]) as f32 - particle.offset[a]);
                    }
                }
                for a in 0..3 {
                    shade.outward[a][node] = outward[a];
                }
            }
            if shading.data() {
                shade.corners[node] = self.scene.skin.corner(Neighbours::new(&work.near, particles, place));
            }
            self.piece.counts.shaded += 1;
        }
        shade.nodes |= needed;
    }
}

/// Outward vectors of some planes of a brick's nodes, bit by bit; gives those that it made, which may be more.
#[inline(always)]
fn outward_planes<S: Simd, B: Blend>(
    s: S,
    falloff: &B::Falloff,
    list: &List<'_>,
    planes: u8,
    to: &mut [[f32; NODES]; 3],
) -> u8 {
    // Side by side, planes share a particle's distances along x and y.
    if planes.count_ones() > 2 {
        match B::WANT.varied {
            true => fill::outward::<S, _, true, SIDE>(s, falloff, list, 0, to),
            false => fill::outward::<S, _, false, SIDE>(s, falloff, list, 0, to),
        }
        return 0b1111;
    }
    for plane in ones(planes.into()) {
        match B::WANT.varied {
            true => fill::outward::<S, _, true, 1>(s, falloff, list, plane, to),
            false => fill::outward::<S, _, false, 1>(s, falloff, list, plane, to),
        }
    }
    planes
}

/// Where a node lies in its brick.
#[inline(always)]
fn lane(node: usize) -> [usize; 3] {
    [node % SIDE, node / SIDE % SIDE, node / (SIDE * SIDE)]
}
