//! Where the march begins: the paper's steps down from particles, and the search that misses nothing.
//!
//! Source: Rosenberg & Birdwell 2008, section 4; the complete search is this project's, see [`super`].

use super::{
    Blend, March, Skin,
    slice::{ABOVE, BELOW, Rows, WIDEST},
};
use crate::{
    bricks::boxes::{BOX, MARGIN},
    field::falloff::Falloff,
    lookup::columns::Extent,
    math::{bits::ones, simd::Simd},
};

impl<B: Blend, K: Skin> March<'_, B, K> {
    /// Steps down from the node nearest to each particle until one is not inside; the cube above that step is a seed.
    /// Farther than its reach below a particle there is another that will find the surface.
    #[inline(always)]
    pub(super) fn seed<S: Simd>(&mut self, s: S, extent: Extent) {
        let work = &mut *self.work;
        for i in 0..work.columns.particles().len() {
            let particle = work.columns.particles()[i];
            let at: [i32; 3] = std::array::from_fn(|a| particle.node[a] - extent.first[a]);
            if (0..3).any(|a| at[a] < 1 || at[a] > extent.nodes[a] as i32 - 2) {
                continue;
            }
            let [x, y, top] = at.map(|v| v as usize);
            let column = x + extent.nodes[0] * y;
            let bottom = top.saturating_sub(particle.reach.ceil() as usize);
            for z in (bottom..=top).rev() {
                let inside = z > 0 && {
                    work.columns.find(s, column, z as i32, B::WANT, &mut work.near);
                    self.scene.blend.value(s, &work.near, work.columns.particles()) > self.scene.iso
                };
                if !inside {
                    if z < top {
                        work.todo[z].push(x, y);
                        self.piece.counts.seeds += 1;
                    }
                    break;
                }
            }
        }
    }

    /// Finds the side of all nodes of slab `z` that belong to a suspect box, and notes the crossed cubes among them.
    #[inline(always)]
    pub(super) fn look_through<S: Simd>(&mut self, s: S, extent: Extent, z: usize) {
        if z.is_multiple_of(BOX) || self.work.certain.layer != z / BOX {
            self.bound_layer(s, extent, z / BOX);
        }
        for side in [0, 1] {
            for y in 0..extent.nodes[1] {
                let work = &mut *self.work;
                let slice = &mut *work.pool.pair(z)[side];
                let wanted = work.boxes.nodes(y, z) & !slice.known[y];
                if wanted == 0 {
                    continue;
                }
                let (inside, outside) = (work.certain.inside[y] & wanted, work.certain.outside[y] & wanted);
                slice.touch(y);
                slice.known[y] |= inside | outside;
                slice.inside[y] |= inside;
                let open = wanted & !(inside | outside);
                if open != 0 {
                    self.evaluate(s, extent, z, side, y, open);
                }
            }
        }
        let [lower, upper] = self.work.pool.pair(z);
        for y in 0..extent.nodes[1] - 1 {
            let suspects = self.work.boxes.cells(y, z);
            let rows = [lower.inside[y], lower.inside[y + 1], upper.inside[y], upper.inside[y + 1]];
            let any = rows.iter().fold(0, |a, b| a | b);
            let all = rows.iter().fold(u64::MAX, |a, b| a & b);
            let crossed = (any | any >> 1) & !(all & all >> 1) & suspects;
            self.work.todo[z].push_row(y, crossed);
        }
    }

    /// Finds the columns of a layer of boxes all of whose nodes are on one side for certain.
    #[inline(always)]
    fn bound_layer<S: Simd>(&mut self, s: S, extent: Extent, layer: usize) {
        let work = &mut *self.work;
        work.certain = Certain { layer, ..Certain::default() };
        let Some(falloff) = self.scene.blend.falloff() else { return };
        let range = [(layer * BOX) as i32, ((layer + 1) * BOX).min(extent.nodes[2] - 1) as i32];
        let iso = self.scene.iso;
        for y in 0..extent.nodes[1] {
            let nodes = work.boxes.nodes(y, layer * BOX);
            for x in ones(nodes) {
                let column = x + extent.nodes[0] * y;
                let [least, most] = work.columns.bound(s, column, range, B::WANT.varied, |u| falloff.value(s, u));
                work.certain.inside[y] |= u64::from(least > iso * (1.0 + MARGIN)) << x;
                work.certain.outside[y] |= u64::from(most < iso * (1.0 - MARGIN)) << x;
            }
            self.piece.counts.bounds += u64::from(nodes.count_ones());
        }
    }

    /// Adds the cubes beyond crossed faces that were not visited.
    #[inline(always)]
    pub(super) fn push_neighbours(&mut self, extent: Extent, cube: [usize; 3], case: u8) {
        let [x, y, z] = cube;
        for face in ones(u64::from(CROSSED_FACES[usize::from(case)])) {
            let (axis, up) = (face / 2, face % 2 == 1);
            let limit = extent.nodes[axis] - 1;
            if if up { cube[axis] + 1 == limit } else { cube[axis] == 0 } {
                continue;
            }
            let mut to = cube;
            to[axis] = if up { cube[axis] + 1 } else { cube[axis] - 1 };
            let [lower, upper] = self.work.pool.pair(z);
            let done = match (axis, up) {
                (2, false) => lower.done[BELOW][y] >> x & 1,
                (2, true) => upper.done[ABOVE][y] >> x & 1,
                _ => (lower.done[ABOVE][to[1]] | upper.done[BELOW][to[1]]) >> to[0] & 1,
            };
            if done == 0 {
                self.work.todo[to[2]].push(to[0], to[1]);
            }
        }
    }
}

/// Columns of one layer of boxes whose nodes are all inside or all outside, row by row.
#[derive(Debug, Clone)]
pub(crate) struct Certain {
    layer: usize,
    inside: Rows,
    outside: Rows,
}

impl Default for Certain {
    fn default() -> Self {
        Self { layer: usize::MAX, inside: [0; WIDEST], outside: [0; WIDEST] }
    }
}

/// For each case, the faces (2·axis + side) whose corners differ.
static CROSSED_FACES: [u8; 256] = {
    let mut table = [0; 256];
    let mut case = 0;
    while case < 256 {
        let mut face = 0;
        while face < 6 {
            let (mut corner, mut inside) = (0, 0);
            while corner < 8 {
                if corner >> (face / 2) & 1 == face % 2 {
                    inside += case >> corner & 1;
                }
                corner += 1;
            }
            if inside != 0 && inside != 4 {
                table[case] |= 1 << face;
            }
            face += 1;
        }
        case += 1;
    }
    table
};

const _: () = assert!(BOX == 4, "look_through takes cells of boxes as groups of four bits");
