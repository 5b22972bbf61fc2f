//! Where the march begins, and where it goes on: steps down from particles, then from cube to cube.
//!
//! Source: Rosenberg & Birdwell 2008, section 4, algorithm 1.

use super::{
    Blend, March, Skin, Work,
    slice::{ABOVE, BELOW},
};
use crate::{
    lookup::columns::Extent,
    math::{bits::ones, simd::Simd},
};

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
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
