//! The world-anchored lattice: the only code that turns world coordinates into integers and back.
//!
//! Node (i, j, k) lies at (i, j, k) · spacing from the world's origin, never from the data's bounding box, so that a still
//! fluid gives the same triangles in every frame. Four things are counted along each axis, all from the world's origin:
//!
//! ```text
//! node    i                     the lattice point at i · spacing
//! brick   i >> 2                4 × 4 × 4 nodes: one u64 of signs, 64 values
//! octet   i >> 3                2 × 2 × 2 bricks that share a frame and a gather of candidates
//! cell    floor(x / support)    particle cell, one support radius wide; 4 × 4 × 4 of them are a chunk
//! ```
//!
//! Inside the core, lengths are in *support units* (the kernel's support radius is 1). A node's value is defined in the
//! frame of its octet: a particle's position is rounded once, to `f32`, relative to its chunk's corner, and then shifted
//! by the `f32` distance between the two corners. Far from the origin nothing is lost, and no node has two values.

use crate::Error;

/// Integer coordinates of a node, brick, octet, cell or chunk.
pub(crate) type Coord = [i32; 3];

/// Nodes of a brick along an axis.
pub(crate) const BRICK: i32 = 4;
/// Nodes of an octet along an axis.
pub(crate) const OCTET: i32 = 8;
/// Particle cells of a chunk along an axis.
pub(crate) const CHUNK: i32 = 4;
/// Node and cell indices stay below this, so that neighbours and sums of two fit an `i32`.
const INDEX_LIMIT: f64 = (1u64 << 30) as f64;

/// The lattice of one set of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lattice {
    /// Distance of neighbouring nodes in world units.
    pub(crate) spacing: f64,
    /// Support radius in world units.
    pub(crate) support: f64,
}

impl Lattice {
    /// Distance of neighbouring nodes in support units.
    pub(crate) fn step(&self) -> f64 {
        self.spacing / self.support
    }

    /// A world position in support units.
    #[inline(always)]
    pub(crate) fn to_support_units(self, p: [f64; 3]) -> [f64; 3] {
        let per_unit = 1.0 / self.support;
        p.map(|v| v * per_unit)
    }

    /// The node nearest to a position in cells, and the position from there.
    #[inline(always)]
    pub(crate) fn nearest(p: [f64; 3]) -> (Coord, [f32; 3]) {
        let node = p.map(|v| floor(v + 0.5));
        (node, std::array::from_fn(|a| (p[a] - f64::from(node[a])) as f32))
    }

    /// Whether particle `index` can be placed: finite, and no index near it overflows.
    ///
    /// # Errors
    /// [`Error::NotFinite`] and [`Error::OutsideLattice`].
    pub(crate) fn check(&self, index: usize, position: [f64; 3]) -> Result<(), Error> {
        if !position.iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite { index, position });
        }
        let far = position.iter().fold(0.0f64, |far, v| far.max(v.abs()));
        let unit = self.spacing.min(self.support);
        if far < INDEX_LIMIT * unit {
            Ok(())
        } else {
            Err(Error::OutsideLattice { index, position, cells: far / unit, limit: INDEX_LIMIT })
        }
    }

    /// Quick form of [`check`](Self::check) in support units: `limit` is [`Self::limit`].
    #[inline(always)]
    pub(crate) fn fits(u: [f64; 3], limit: f64) -> bool {
        u[0].abs() < limit && u[1].abs() < limit && u[2].abs() < limit
    }

    /// Largest distance from the origin along an axis, in support units.
    pub(crate) fn limit(&self) -> f64 {
        INDEX_LIMIT * self.step().min(1.0)
    }
}

/// `a + b`, axis by axis.
#[inline(always)]
pub(crate) fn plus(a: Coord, b: Coord) -> Coord {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Position on the Morton (Z-order) curve through all coordinates, negative ones first.
pub(crate) fn morton(c: Coord) -> u128 {
    /// Spreads 32 bits to every third of 96.
    fn spread(v: u32) -> u128 {
        /// Spreads 16 bits to every third of 48.
        fn half(v: u64) -> u64 {
            let v = (v | v << 16) & 0x0000_0000_ff00_00ff;
            let v = (v | v << 8) & 0x0000_00f0_0f00_f00f;
            let v = (v | v << 4) & 0x0000_0c30_c30c_30c3;
            (v | v << 2) & 0x0000_2492_4924_9249
        }
        u128::from(half(u64::from(v & 0xffff))) | u128::from(half(u64::from(v >> 16))) << 48
    }
    let [x, y, z] = c.map(|v| spread(v as u32 ^ 0x8000_0000));
    x | y << 1 | z << 2
}

/// The largest integer not above `v`, which must fit; without the call that `f64::floor` is on the oldest x86-64.
#[inline(always)]
pub(crate) fn floor(v: f64) -> i32 {
    let cut = v as i32;
    cut - i32::from(f64::from(cut) > v)
}

/// As [`floor`], in single precision.
#[inline(always)]
pub(crate) fn floor_f32(v: f32) -> i32 {
    let cut = v as i32;
    cut - i32::from(cut as f32 > v)
}

/// The smallest integer not below `v`, which must fit.
#[inline(always)]
pub(crate) fn ceil_f32(v: f32) -> i32 {
    let cut = v as i32;
    cut + i32::from((cut as f32) < v)
}

/// Divides integers by a positive one, rounding down, without a division.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Divisor {
    reciprocal: f64,
}

impl Divisor {
    pub(crate) fn new(by: i32) -> Self {
        Self { reciprocal: 1.0 / f64::from(by) }
    }

    /// Half of one more never reaches the next quotient, and is far more than rounding takes away.
    #[inline(always)]
    pub(crate) fn floor(&self, v: i32) -> i32 {
        floor((f64::from(v) + 0.5) * self.reciprocal)
    }
}

/// The integer box of `[low, high]` in units of `unit`.
#[inline(always)]
pub(crate) fn cover(low: f64, high: f64, unit: f64) -> std::ops::RangeInclusive<i32> {
    floor(low / unit)..=floor(high / unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn morton_bit_by_bit(c: Coord) -> u128 {
        let mut key = 0;
        for bit in 0..32 {
            for (axis, v) in c.iter().enumerate() {
                key |= u128::from((*v as u32 ^ 0x8000_0000) >> bit & 1) << (3 * bit + axis);
            }
        }
        key
    }

    #[test]
    fn morton_interleaves_bits() {
        for c in [[0, 0, 0], [1, 2, 3], [-1, 0, 5], [i32::MIN, i32::MAX, -77], [123_456, -654_321, 0x5555_5555]] {
            assert_eq!(morton(c), morton_bit_by_bit(c), "{c:?}");
        }
        assert!(morton([-1, 0, 0]) < morton([0, 0, 0]));
    }

    #[test]
    fn floor_is_floor() {
        for v in [-2.0, -1.5, -1e-300, 0.0, 0.99, 1.0, 1e9, -1e9 - 0.5] {
            assert_eq!(f64::from(floor(v)), v.floor());
            assert_eq!(floor_f32(v as f32), (v as f32).floor() as i32);
            assert_eq!(ceil_f32(v as f32), (v as f32).ceil() as i32);
        }
        for a in (-70..70).chain([i32::MIN + 1, i32::MAX, (1 << 30) - 1]) {
            for b in [1, 4, 12, 32, 39, 60] {
                assert_eq!(Divisor::new(b).floor(a), a.div_euclid(b));
            }
        }
    }

    #[test]
    fn positions_that_do_not_fit_are_refused_with_their_index() {
        let lattice = Lattice { spacing: 0.01, support: 0.08 };
        assert!(lattice.check(0, [1e6, 0.0, -1e6]).is_ok());
        assert!(matches!(lattice.check(7, [0.0, f64::NAN, 0.0]), Err(Error::NotFinite { index: 7, .. })));
        assert!(matches!(lattice.check(7, [0.0, f64::INFINITY, 0.0]), Err(Error::NotFinite { index: 7, .. })));
        assert!(matches!(lattice.check(7, [3e38, 0.0, 0.0]), Err(Error::OutsideLattice { index: 7, .. })));
        let fine = Lattice { spacing: 1e-30, support: 1e-29 };
        assert!(matches!(fine.check(1, [1.0, 0.0, 0.0]), Err(Error::OutsideLattice { index: 1, .. })));
    }
}
