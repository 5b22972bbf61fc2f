//! The field at a corner, 16 particles at a time.

use pellicle::internals::{Falloff, Kernel, LANES, Simd, Triquet};

/// Particles in the order of their cells, relative to some origin, in units of the support. Sixteen beyond the last can be
/// loaded.
#[derive(Debug, Default)]
pub struct Particles {
    axes: [Vec<f32>; 3],
}

impl Particles {
    /// Room for `count`.
    pub fn resize(&mut self, count: usize) {
        for column in &mut self.axes {
            column.clear();
            column.resize(count + LANES, 0.0);
        }
    }

    pub fn set(&mut self, at: usize, position: [f32; 3]) {
        for (column, x) in self.axes.iter_mut().zip(position) {
            column[at] = x;
        }
    }

    pub fn held(&self) -> usize {
        self.axes.iter().map(super::held).sum()
    }
}

/// Value and outward normal, up to its length, at a place, from runs of particles. What is beyond the support adds
/// nothing.
pub struct Sum<'a> {
    pub particles: &'a Particles,
    /// First particle, and the one after the last.
    pub runs: &'a [[u32; 2]],
    pub at: [f32; 3],
}

impl Kernel for Sum<'_> {
    type Output = [f32; 4];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [f32; 4] {
        // No closures in what follows: they would not have the lanes' instructions.
        let [x, y, z] = &self.particles.axes;
        let (px, py, pz) = (s.splat(self.at[0]), s.splat(self.at[1]), s.splat(self.at[2]));
        let (zero, one) = (s.splat(0.0), s.splat(1.0));
        let (mut value, mut nx, mut ny, mut nz) = (zero, zero, zero, zero);
        for &[first, end] in self.runs {
            let (mut i, end) = (first as usize, end as usize);
            while i < end {
                let (dx, dy, dz) = (s.sub(px, s.load(&x[i..])), s.sub(py, s.load(&y[i..])), s.sub(pz, s.load(&z[i..])));
                let dist_sq = s.add(s.add(s.mul(dx, dx), s.mul(dy, dy)), s.mul(dz, dz));
                let mut u = s.max(s.sub(one, dist_sq), zero);
                if end - i < LANES {
                    u = s.select((1u16 << (end - i)) - 1, u, zero);
                }
                value = s.add(value, Triquet.value(s, u));
                let slope = Triquet.slope(s, u);
                nx = s.add(nx, s.mul(slope, dx));
                ny = s.add(ny, s.mul(slope, dy));
                nz = s.add(nz, s.mul(slope, dz));
                i += LANES;
            }
        }
        [s.sum(value), s.sum(nx), s.sum(ny), s.sum(nz)]
    }
}
