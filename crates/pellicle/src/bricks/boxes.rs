//! Which boxes of a block may hold a crossing, from bounds that hold for certain.
//!
//! A block is divided into boxes of 4×4×4 cells. Where contributions are not negative and never grow with the distance,
//! the field within a box lies between the sum of what every particle brings at its largest distance from the box and the
//! sum of what it brings at its least. A box whose upper bound is below the isovalue is outside, one whose lower bound is
//! above it is inside, with a margin for rounding; all others may hold a crossing. So the nodes of those are all that a
//! complete search has to look at: proven, not tested.
//!
//! ```text
//! upper, lower   box rows of 16 along x, then y, then z
//! ```
//!
//! Source: interval bounds are Snyder 1992, Interval analysis for computer graphics; this use of them is this project's.

use crate::{
    field::falloff::Falloff,
    lookup::columns::{Extent, Placed, provide},
    math::simd::{LANES, Simd},
};

/// Cells of a box along an axis.
pub(crate) const BOX: usize = 4;
/// Relative margin of the bounds: more than the rounding of a sum of 1,500 terms in `f32`.
pub(crate) const MARGIN: f32 = 1e-4;
/// More than a distance within a block is off by rounding, in cells.
const SLACK: f32 = 2e-5;
/// Where the boxes of a row begin, in cells.
const STARTS: [f32; LANES] = {
    let mut starts = [0.0; LANES];
    let mut i = 0;
    while i < LANES {
        starts[i] = (BOX * i) as f32;
        i += 1;
    }
    starts
};

/// Bounds of all boxes of a block. Reusable.
#[derive(Default)]
pub(crate) struct Boxes {
    upper: Vec<f32>,
    lower: Vec<f32>,
    /// Boxes along each axis; at most 16 along x.
    count: [usize; 3],
    /// For each row of boxes, those that may hold a crossing.
    suspect: Vec<u16>,
}

impl Boxes {
    /// Finds the suspects of a block whose particles are given.
    #[inline(always)]
    pub(crate) fn find<S: Simd, W: Falloff>(
        &mut self,
        s: S,
        falloff: &W,
        iso: f32,
        extent: Extent,
        particles: &[Placed],
    ) {
        self.count = extent.nodes.map(|n| (n - 1).div_ceil(BOX));
        let rows = self.count[1] * self.count[2];
        for sums in [&mut self.upper, &mut self.lower] {
            sums.clear();
            sums.resize(rows * LANES, 0.0);
        }
        for particle in particles {
            self.add(s, falloff, extent, particle);
        }
        self.suspect.clear();
        let (above, below) = (s.splat(iso * (1.0 + MARGIN)), s.splat(iso * (1.0 - MARGIN)));
        let all = ((1u32 << self.count[0]) - 1) as u16;
        for row in 0..rows {
            let may_be_inside = s.gt(s.load(&self.upper[row * LANES..]), below);
            let is_inside = s.gt(s.load(&self.lower[row * LANES..]), above);
            self.suspect.push(may_be_inside & !is_inside & all);
        }
    }

    /// The boxes along each axis that a particle may reach, and perhaps one more on either side.
    #[inline(always)]
    fn range(&self, extent: Extent, particle: &Placed) -> [std::ops::Range<usize>; 3] {
        std::array::from_fn(|a| {
            let at = (particle.node[a] - extent.first[a]) as f32 + particle.offset[a];
            let low = ((at - particle.reach) / BOX as f32 - 1.0).max(0.0) as usize;
            let high = ((at + particle.reach) / BOX as f32 + 1.0).max(0.0) as usize;
            low.min(self.count[a])..high.min(self.count[a])
        })
    }

    /// Adds one particle to the bounds of the boxes within its reach.
    #[inline(always)]
    fn add<S: Simd, W: Falloff>(&mut self, s: S, falloff: &W, extent: Extent, particle: &Placed) {
        let at: [f32; 3] = std::array::from_fn(|a| (particle.node[a] - extent.first[a]) as f32 + particle.offset[a]);
        let range = self.range(extent, particle);
        let (near, far) = edges(s, at[0]);
        let (per_reach_sq, strength) = (s.splat(1.0 / (particle.reach * particle.reach)), s.splat(particle.strength));
        let reach_sq = particle.reach * particle.reach;
        let mut in_y = [[0.0; 2]; LANES];
        for (y, in_y) in range[1].clone().zip(&mut in_y) {
            *in_y = squares(y, at[1]);
        }
        for z in range[2].clone() {
            let [near_z, far_z] = squares(z, at[2]);
            for (y, [near_y, far_y]) in range[1].clone().zip(in_y) {
                if near_y + near_z >= reach_sq {
                    continue;
                }
                let row = LANES * (y + self.count[1] * z);
                let rest = s.splat(near_y + near_z);
                add_row(s, falloff, strength, per_reach_sq, s.add(near, rest), &mut self.upper[row..row + LANES]);
                if far_y + far_z < reach_sq {
                    let rest = s.splat(far_y + far_z);
                    add_row(s, falloff, strength, per_reach_sq, s.add(far, rest), &mut self.lower[row..row + LANES]);
                }
            }
        }
    }

    /// The nodes of row `y` of the layer of boxes that slab `z` belongs to that are a suspect's, bit by bit.
    #[inline(always)]
    pub(crate) fn nodes(&self, y: usize, z: usize) -> u64 {
        let layer = self.count[1] * (z / BOX);
        // A node between two boxes is both's.
        let boxes = y.saturating_sub(1) / BOX..(y / BOX + 1).min(self.count[1]);
        let suspects = boxes.fold(0, |row, box_y| row | self.suspect[box_y + layer]);
        // Four cells have five nodes.
        let cells = spread(suspects) * 0b1111;
        cells | cells << 1
    }

    /// The cells of row `y` and slab `z` that belong to a suspect.
    #[cfg(test)]
    fn cells(&self, y: usize, z: usize) -> u64 {
        spread(self.suspect[y / BOX + self.count[1] * (z / BOX)]) * 0b1111
    }

    /// Makes room for blocks of so many cells.
    pub(crate) fn provide(&mut self, cells: [usize; 3]) {
        let rows = cells[1].div_ceil(BOX) * cells[2].div_ceil(BOX);
        provide(&mut self.upper, rows * LANES);
        provide(&mut self.lower, rows * LANES);
        provide(&mut self.suspect, rows);
    }
}

/// Adds what a particle brings at 16 squared distances.
#[inline(always)]
fn add_row<S: Simd, W: Falloff>(s: S, falloff: &W, strength: S::F, per_reach_sq: S::F, dist_sq: S::F, to: &mut [f32]) {
    let u = s.max(s.sub(s.splat(1.0), s.mul(dist_sq, per_reach_sq)), s.splat(0.0));
    s.store(s.add(s.load(to), s.mul(strength, falloff.value(s, u))), to);
}

/// Moves bit i to bit 4 i.
#[inline(always)]
fn spread(v: u16) -> u64 {
    let v = u64::from(v);
    let v = (v | v << 24) & 0x0000_00ff_0000_00ff;
    let v = (v | v << 12) & 0x000f_000f_000f_000f;
    let v = (v | v << 6) & 0x0303_0303_0303_0303;
    (v | v << 3) & 0x1111_1111_1111_1111
}

/// Squares of the least and the largest distance along an axis from `at` to box `index`, a little too small and large.
#[inline(always)]
fn squares(index: usize, at: f32) -> [f32; 2] {
    let low = (BOX * index) as f32 - at;
    let high = -(low + BOX as f32);
    let near = (low.max(high) - SLACK).max(0.0);
    let far = (-low).max(-high) + SLACK;
    [near * near, far * far]
}

/// [`squares`] of 16 boxes.
#[inline(always)]
fn edges<S: Simd>(s: S, at: f32) -> (S::F, S::F) {
    let zero = s.splat(0.0);
    let low = s.sub(s.load(&STARTS), s.splat(at));
    let high = s.sub(zero, s.add(low, s.splat(BOX as f32)));
    let slack = s.splat(SLACK);
    let near = s.max(s.sub(s.max(low, high), slack), zero);
    let far = s.add(s.max(s.sub(zero, low), s.sub(zero, high)), slack);
    (s.mul(near, near), s.mul(far, far))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{field::falloff::Triquet, math::simd::Portable};

    #[test]
    fn bits_are_spread_to_every_fourth() {
        for bit in 0..16 {
            assert_eq!(spread(1 << bit), 1 << (4 * bit));
        }
        assert_eq!(spread(0xffff), 0x1111_1111_1111_1111);
    }

    #[test]
    fn no_box_without_suspicion_holds_a_crossing() {
        let mut state = 7u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let extent = Extent { first: [0; 3], nodes: [17; 3] };
        let mut proven = [0, 0];
        for (count, reach) in [(30, 3.0), (300, 3.0), (40, 9.0), (1500, 5.0)] {
            let particles: Vec<Placed> = (0..count)
                .map(|i| Placed {
                    node: std::array::from_fn(|_| (random() * 22.0) as i32 - 3),
                    offset: std::array::from_fn(|_| random() - 0.5),
                    reach,
                    strength: 1.0,
                    index: i,
                })
                .collect();
            let value = |node: [i32; 3]| -> f64 {
                particles
                    .iter()
                    .map(|p| {
                        let d = (0..3).map(|a| (f64::from(node[a] - p.node[a]) - f64::from(p.offset[a])).powi(2));
                        (1.0 - d.sum::<f64>() / f64::from(p.reach).powi(2)).max(0.0).powi(2) / 4.0
                    })
                    .sum()
            };
            let mut boxes = Boxes::default();
            boxes.find(Portable, &Triquet, 0.2, extent, &particles);
            for (x, y, z) in (0..64).map(|i| (i % 4, i / 4 % 4, i / 16)) {
                if boxes.cells(4 * y, 4 * z) >> (4 * x) & 1 != 0 {
                    continue;
                }
                let node = |n: usize| [4 * x + n % 5, 4 * y + n / 5 % 5, 4 * z + n / 25].map(|v| v as i32);
                let signs = (0..125).map(|n| value(node(n)) > 0.2);
                let inside = signs.filter(|&s| s).count();
                assert!(inside == 0 || inside == 125, "{count} {reach}: box {x} {y} {z}");
                proven[usize::from(inside > 0)] += 1;
            }
        }
        assert!(proven[0] > 5 && proven[1] > 0, "boxes are proven on both sides: {proven:?}");
    }
}
