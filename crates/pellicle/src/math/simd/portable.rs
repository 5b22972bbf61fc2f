//! Sixteen lanes as an array: the definition of every operation, and what runs where nothing better is.

use super::{Kernel, LANES, Simd};

#[derive(Clone, Copy, Debug)]
pub struct Portable;

type F = [f32; LANES];

#[inline(always)]
fn each(a: F, b: F, f: impl Fn(f32, f32) -> f32) -> F {
    std::array::from_fn(|i| f(a[i], b[i]))
}

impl Simd for Portable {
    type F = F;
    type U = [u32; LANES];
    const IS_WIDE: bool = false;

    #[inline(always)]
    fn splat(self, v: f32) -> F {
        [v; LANES]
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> F {
        std::array::from_fn(|i| from[..LANES][i])
    }

    #[inline(always)]
    fn store(self, v: F, to: &mut [f32]) {
        to[..LANES].copy_from_slice(&v);
    }

    #[inline(always)]
    fn store_eight(self, v: F, to: &mut [f32]) {
        to[..8].copy_from_slice(&v[..8]);
    }

    #[inline(always)]
    fn add(self, a: F, b: F) -> F {
        each(a, b, |x, y| x + y)
    }

    #[inline(always)]
    fn sub(self, a: F, b: F) -> F {
        each(a, b, |x, y| x - y)
    }

    #[inline(always)]
    fn mul(self, a: F, b: F) -> F {
        each(a, b, |x, y| x * y)
    }

    #[inline(always)]
    fn div(self, a: F, b: F) -> F {
        each(a, b, |x, y| x / y)
    }

    #[inline(always)]
    fn sqrt(self, a: F) -> F {
        a.map(f32::sqrt)
    }

    #[inline(always)]
    fn max(self, a: F, b: F) -> F {
        each(a, b, |x, y| if x > y { x } else { y })
    }

    #[inline(always)]
    fn min(self, a: F, b: F) -> F {
        each(a, b, |x, y| if x < y { x } else { y })
    }

    #[inline(always)]
    fn max_size(self, a: F, b: F) -> F {
        each(a, b, |x, y| if x.abs() > y { x.abs() } else { y })
    }

    #[inline(always)]
    fn gt(self, a: F, b: F) -> u16 {
        (0..LANES).fold(0, |mask, i| mask | (u16::from(a[i] > b[i]) << i))
    }

    #[inline(always)]
    fn select(self, mask: u16, a: F, b: F) -> F {
        std::array::from_fn(|i| if mask >> i & 1 != 0 { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn compress(self, v: F, mask: u16, to: &mut [f32]) {
        let to = &mut to[..LANES];
        let mut n = 0;
        // Every lane is written, a marked one moves the place on: no branch to mispredict. n is at most i.
        for (i, x) in v.into_iter().enumerate() {
            to[n] = x;
            n += usize::from(mask >> i & 1 != 0);
        }
    }

    #[inline(always)]
    fn sum(self, mut v: F) -> f32 {
        for half in [8, 4, 2, 1] {
            for i in 0..half {
                v[i] += v[i + half];
            }
        }
        v[0]
    }

    #[inline(always)]
    fn bits_at(self, words: &[u64; 8], bit: u32) -> u8 {
        let mut bits = 0;
        for c in 0..8 {
            bits |= ((words[c] >> bit & 1) as u8) << c;
        }
        bits
    }

    #[inline(always)]
    fn ranks(self, words: &[u64; 8], first: &[u32; 8], bit: u32) -> [u32; LANES] {
        let mut ranks = [0; LANES];
        for l in 0..8 {
            ranks[l] = first[l].wrapping_add((words[l] & ((1 << bit) - 1)).count_ones());
            ranks[8 + l] = ranks[l].wrapping_add((words[l] >> bit & 1) as u32);
        }
        ranks
    }

    #[inline(always)]
    fn pick(self, from: [u32; LANES], index: &[u8; LANES]) -> [u32; LANES] {
        let mut picked = [0; LANES];
        for i in 0..LANES {
            picked[i] = from[usize::from(index[i] & 15)];
        }
        picked
    }

    #[inline(always)]
    fn store_u(self, v: [u32; LANES], to: &mut [u32]) {
        to[..LANES].copy_from_slice(&v);
    }

    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}
