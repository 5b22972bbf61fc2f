//! Sixteen virtual lanes of `f32`.
//!
//! Every vector operation of pellicle is defined on 16 lanes, whatever the machine has: one AVX-512 register, two AVX2
//! registers, or an array of 16 that the compiler vectorises as it can. All give the same bits: only correctly rounded
//! operations are offered (add, sub, mul, div, sqrt), multiply and add are never fused, and `max`, `min` return their
//! *second* operand when the two compare equal or unordered, as x86 does.
//!
//! A stage writes its hot loop once, as a [`Kernel`]; [`Lanes`] chosen at run time calls it inside a function that has the
//! instructions enabled. A value of a [`Simd`] type proves that the machine has them.
//!
//! Source: the dispatch through a trait with one generic method follows the crate `pulp`.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;
mod quad;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
pub use portable::Portable;
pub(crate) use quad::Quad;

use crate::params::Lanes;

/// Number of lanes of every vector.
pub const LANES: usize = 16;

/// The operations on 16 lanes. A mask has one bit a lane, lane 0 lowest.
pub trait Simd: Copy + Send + Sync {
    /// Sixteen `f32`.
    type F: Copy;
    /// Sixteen `u32`.
    type U: Copy;
    /// Whether sixteen lanes take two registers, too few of which are left for a loop with many sums: eight lanes at a time are
    /// faster. Where only [`store_eight`](Self::store_eight) looks at a result, the compiler leaves out the other eight.
    const IS_WIDE: bool;

    /// The same in every lane.
    fn splat(self, v: f32) -> Self::F;
    /// The first 16 values of `from`, which must have as many.
    fn load(self, from: &[f32]) -> Self::F;
    /// Writes to the first 16 places of `to`, which must have as many.
    fn store(self, v: Self::F, to: &mut [f32]);
    /// Writes the first 8 lanes to the first 8 places of `to`, which must have as many.
    fn store_eight(self, v: Self::F, to: &mut [f32]);
    /// a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a − b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a · b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a / b.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// The square root, correctly rounded.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// `a > b ? a : b` in each lane.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a < b ? a : b` in each lane.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The greater of |a| and b, which is not negative.
    fn max_size(self, a: Self::F, b: Self::F) -> Self::F;
    /// Bit set where `a > b`.
    fn gt(self, a: Self::F, b: Self::F) -> u16;
    /// `a` where the mask's bit is set, else `b`.
    fn select(self, mask: u16, a: Self::F, b: Self::F) -> Self::F;
    /// Moves the lanes of `v` whose bit is set to the front, in order, and writes all 16 places of `to`; those behind
    /// the moved ones hold anything.
    fn compress(self, v: Self::F, mask: u16, to: &mut [f32]);

    /// Sum of all lanes: halves are added until one is left, lanes 8 apart first, then 4, 2, 1.
    fn sum(self, v: Self::F) -> f32;

    /// Bit `bit`, below 64, of each of eight words: that of word c is bit c.
    fn bits_at(self, words: &[u64; 8], bit: u32) -> u8;

    /// Numbers in eight lists that have one element for each set bit of their word and begin at `first`. Lane l: how many
    /// bits of word l are set below `bit`, plus `first[l]`, modulo 2³². Lane 8 + l: the same with bit `bit`, below 64, counted.
    fn ranks(self, words: &[u64; 8], first: &[u32; 8], bit: u32) -> Self::U;

    /// Lane i of the result is lane `index[i]`, below 16, of `from`.
    fn pick(self, from: Self::U, index: &[u8; LANES]) -> Self::U;

    /// Writes to the first 16 places of `to`, which must have as many.
    fn store_u(self, v: Self::U, to: &mut [u32]);

    /// Asks for the cache line of a value that will be read soon.
    fn prefetch<T>(self, value: &T);

    /// Runs `kernel` with this type's instructions enabled.
    fn run<K: Kernel>(self, kernel: K) -> K::Output;
}

/// A hot loop, generic over the vector unit. Its `run` must be `#[inline(always)]`, as must all that it calls.
pub trait Kernel {
    /// What it results in.
    type Output;
    /// The loop.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// A vector unit that this machine has.
#[derive(Clone, Copy, Debug)]
pub enum Unit {
    /// One register of 512 bits.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    /// Two registers of 256 bits.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// An array.
    Portable(Portable),
}

impl Unit {
    /// The unit asked for, or `None` if this machine lacks it.
    pub fn new(lanes: Lanes) -> Option<Self> {
        match lanes {
            Lanes::Auto => [Lanes::Avx512, Lanes::Avx2, Lanes::Portable].into_iter().find_map(Self::new),
            #[cfg(target_arch = "x86_64")]
            Lanes::Avx512 => Avx512::new().map(Self::Avx512),
            #[cfg(target_arch = "x86_64")]
            Lanes::Avx2 => Avx2::new().map(Self::Avx2),
            #[cfg(not(target_arch = "x86_64"))]
            Lanes::Avx512 | Lanes::Avx2 => None,
            Lanes::Portable => Some(Self::Portable(Portable)),
        }
    }

    /// Runs `kernel` on this unit.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(s) => s.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(s) => s.run(kernel),
            Self::Portable(s) => s.run(kernel),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation on awkward numbers, as bits.
    struct All;

    impl Kernel for All {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Vec<u32> {
            let a: Vec<f32> = (0..16).map(|i| (i as f32 - 7.3) * 1.7e-3 * (1 << i) as f32).collect();
            let mut b: Vec<f32> = (0..16).map(|i| (i as f32 * 0.77 - 3.1).powi(3)).collect();
            b[3] = a[3];
            b[4] = 0.0;
            b[5] = -0.0;
            let (x, y) = (s.load(&a), s.load(&b));
            let mut out = Vec::new();
            let mut buf = [0.0; 16];
            for v in [
                s.add(x, y),
                s.sub(x, y),
                s.mul(x, y),
                s.div(x, s.splat(3.7)),
                s.sqrt(s.max(x, s.splat(0.0))),
                s.max(x, y),
                s.min(x, y),
                s.max_size(y, s.max(x, s.splat(0.0))),
                s.max(s.splat(0.0), s.splat(-0.0)),
                s.select(0xa5c3, x, y),
            ] {
                s.store(v, &mut buf);
                out.extend(buf.map(f32::to_bits));
                s.store_eight(v, &mut buf[8..]);
                let (first, eight) = buf.split_at(8);
                assert!(first.iter().zip(eight).all(|(a, b)| a.to_bits() == b.to_bits()));
                out.push(s.sum(v).to_bits());
            }
            let words: [u64; 8] = std::array::from_fn(|c| 0x9e37_79b9_7f4a_7c15u64.rotate_left(7 * c as u32));
            for bit in 0..64 {
                let plain = (0..8).fold(0, |bits, c| bits | ((words[c] >> bit & 1) as u8) << c);
                assert_eq!(s.bits_at(&words, bit), plain, "bit {bit}");
            }
            let first: [u32; 8] = std::array::from_fn(|l| u32::MAX - 60 + 7 * l as u32);
            let index: [u8; 16] = std::array::from_fn(|i| (11 * i as u8 + 5) % 16);
            let mut numbers = [0; 16];
            for bit in 0..64 {
                let ranks = s.ranks(&words, &first, bit);
                s.store_u(ranks, &mut numbers);
                for l in 0..8 {
                    let below = (words[l] & ((1u64 << bit) - 1)).count_ones();
                    assert_eq!(numbers[l], first[l].wrapping_add(below), "bit {bit}");
                    assert_eq!(numbers[8 + l], numbers[l].wrapping_add((words[l] >> bit & 1) as u32), "bit {bit}");
                }
                let ordered = numbers;
                s.store_u(s.pick(ranks, &index), &mut numbers);
                assert_eq!(numbers, index.map(|i| ordered[usize::from(i)]), "bit {bit}");
            }
            for mask in [0u16, 1, 0x8000, 0xffff, 0x1234, 0xfedc, 0x0ff0, s.gt(x, y)] {
                s.compress(x, mask, &mut buf);
                out.push(u32::from(mask));
                out.extend(buf.iter().take(mask.count_ones() as usize).map(|v| v.to_bits()));
            }
            out
        }
    }

    #[test]
    fn every_unit_gives_the_same_bits() {
        let want = Unit::Portable(Portable).run(All);
        for lanes in [Lanes::Avx512, Lanes::Avx2] {
            if let Some(unit) = Unit::new(lanes) {
                assert_eq!(unit.run(All), want, "{unit:?}");
            }
        }
    }

    #[test]
    fn compress_keeps_the_marked_lanes_in_order() {
        let v: Vec<f32> = (0..16).map(|i| i as f32).collect();
        let mut to = [0.0; 16];
        Portable.compress(Portable.load(&v), 0b1000_0000_0001_0010, &mut to);
        assert_eq!(to[..3], [1.0, 4.0, 15.0]);
    }
}
