//! SPH densities, as what the colour field needs of them.
//!
//! With equal masses m and the kernel W = 16/(π h³) g (see [`kernel`](super::kernel)), the volume of particle j is
//! V_j = m/ρ_j = 1/Σ_k W(x_j − x_k), itself included, so the colour field Σ V_j W is Σ_j g(x − x_j)/G_j with
//! G_j = Σ_k g(x_j − x_k): mass, rest density and the kernel's factor cancel. This stage computes the weights 1/G_j.
//!
//! A cell's candidates are its 27 neighbours' particles, in canonical order, relative to its chunk's corner; 16 at a time
//! are summed in lanes, then the lanes. G_j ≥ ½, so weights are finite and at most 2.
//!
//! Source: Müller, Charypar, Gross, Particle-based fluid simulation for interactive applications, 2003, equations 3, 15.

use super::kernel::half_spline;
use crate::{
    lattice::{CHUNK, plus},
    lookup::{
        cells::{CELLS, Cells, cell_index},
        directory::Cursor,
    },
    math::{
        ranges::for_each_part,
        simd::{Kernel, LANES, Simd, Unit},
    },
    progress::Control,
};

/// Particles summed side by side.
const GROUP: usize = 2;
/// Far enough from every chunk to contribute nothing.
const NOWHERE: f32 = 1e3;

/// What a particle sums over its neighbors.
pub(crate) trait PairSum: Copy + Sync {
    /// What one brings, itself included, by the squared distance; exactly 0 beyond the support.
    fn term<S: Simd>(self, s: S, dist_sq: S::F) -> S::F;
    /// What becomes of the sum.
    fn finish(self, sum: f32) -> f32;
}

/// 1/G.
#[derive(Clone, Copy)]
struct Weight;

impl PairSum for Weight {
    #[inline(always)]
    fn term<S: Simd>(self, s: S, dist_sq: S::F) -> S::F {
        half_spline(s, dist_sq)
    }

    fn finish(self, sum: f32) -> f32 {
        1.0 / sum
    }
}

/// Writes the weight 1/G of every particle, in canonical order, with [`LANES`] zeros behind.
pub(crate) fn weights(unit: Unit, cells: &Cells, control: &Control<'_>, to: &mut Vec<f32>) {
    sums(unit, cells, Weight, control, to);
}

/// Writes a sum of every particle, in canonical order, with [`LANES`] zeros behind.
pub(crate) fn sums(unit: Unit, cells: &Cells, of: impl PairSum, control: &Control<'_>, to: &mut Vec<f32>) {
    let n = cells.len();
    to.resize(n + LANES, 0.0);
    let starts = |c: usize| if c < cells.chunks.len() { cells.chunk_range(c).start } else { n };
    for_each_part(0..cells.chunks.len(), &mut to[..n], &starts, &|chunk, to: &mut [f32]| {
        if control.check().is_ok() {
            unit.run(Chunk { cells, chunk, of, to });
        }
    });
}

/// Sums of one chunk's particles.
struct Chunk<'a, P> {
    cells: &'a Cells,
    chunk: usize,
    of: P,
    to: &'a mut [f32],
}

/// Positions near one cell, padded to whole vectors.
#[derive(Default)]
struct Near {
    axes: [Vec<f32>; 3],
    len: usize,
}

thread_local! {
    /// Kept between chunks and frames: what one cell's neighbourhood holds, a few kilobytes.
    static NEAR: std::cell::RefCell<Near> = std::cell::RefCell::default();
}

impl<P: PairSum> Kernel for Chunk<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let around = neighbours(self.cells, self.chunk);
        let base = self.cells.chunk_range(self.chunk).start;
        NEAR.with_borrow_mut(|near| {
            for cell in 0..CELLS {
                let members = self.cells.run(self.chunk, cell, cell);
                if members.is_empty() {
                    continue;
                }
                near.collect(s, self.cells, &around, cell);
                for group in members.clone().step_by(GROUP) {
                    // A short last group repeats its last particle.
                    let at: [_; GROUP] = std::array::from_fn(|g| {
                        let i = (group + g).min(members.end - 1);
                        [self.cells.x[i], self.cells.y[i], self.cells.z[i]]
                    });
                    let to = &mut self.to[group - base..(group + GROUP).min(members.end) - base];
                    for (to, sum) in to.iter_mut().zip(near.sums(s, self.of, at)) {
                        *to = self.of.finish(sum);
                    }
                }
            }
        });
    }
}

/// The 27 chunks around one, itself in the middle, x fastest.
fn neighbours(cells: &Cells, chunk: usize) -> [Option<usize>; 27] {
    let mut cursor = Cursor::default();
    std::array::from_fn(|i| {
        let d = [i % 3, i / 3 % 3, i / 9].map(|v| v as i32 - 1);
        if d == [0; 3] { Some(chunk) } else { cells.chunk_at(&mut cursor, plus(cells.chunks[chunk], d)) }
    })
}

impl Near {
    /// Collects the particles of the 27 cells around `cell`.
    #[inline(always)]
    fn collect<S: Simd>(&mut self, s: S, cells: &Cells, around: &[Option<usize>; 27], cell: usize) {
        self.len = 0;
        let [cx, cy, cz] = [cell as i32 % CHUNK, cell as i32 / CHUNK % CHUNK, cell as i32 / (CHUNK * CHUNK)];
        for z in cz - 1..=cz + 1 {
            for y in cy - 1..=cy + 1 {
                // A row of three cells, cut where it leaves a chunk.
                let (mut x, end) = (cx - 1, cx + 2);
                while x < end {
                    let chunk = [x, y, z].map(|v| v.div_euclid(CHUNK));
                    let last = (end - 1).min(chunk[0] * CHUNK + CHUNK - 1);
                    let index = (chunk[0] + 1) + 3 * (chunk[1] + 1) + 9 * (chunk[2] + 1);
                    if let Some(source) = around[index as usize] {
                        let local =
                            |x: i32| cell_index(x - chunk[0] * CHUNK, y - chunk[1] * CHUNK, z - chunk[2] * CHUNK);
                        self.append(
                            s,
                            cells,
                            cells.run(source, local(x), local(last)),
                            chunk.map(|v| (v * CHUNK) as f32),
                        );
                    }
                    x = last + 1;
                }
            }
        }
        for axis in &mut self.axes {
            axis.resize((self.len + LANES).max(axis.len()), 0.0);
            s.store(s.splat(NOWHERE), &mut axis[self.len..]);
        }
    }

    #[inline(always)]
    fn append<S: Simd>(&mut self, s: S, cells: &Cells, run: std::ops::Range<usize>, shift: [f32; 3]) {
        let end = run.start + run.len().next_multiple_of(LANES);
        for ((to, from), shift) in self.axes.iter_mut().zip([&cells.x, &cells.y, &cells.z]).zip(shift) {
            if to.len() < self.len + run.len() + LANES {
                to.resize(2 * (self.len + run.len() + LANES), 0.0);
            }
            let to = to[self.len..].chunks_exact_mut(LANES);
            for (from, to) in from[run.start..end].chunks_exact(LANES).zip(to) {
                s.store(s.add(s.load(from), s.splat(shift)), to);
            }
        }
        self.len += run.len();
    }

    /// The sums over the collected particles, for a group of particles at once: each vector is loaded once for all, and the
    /// square roots of one hide behind those of the others.
    #[inline(always)]
    fn sums<S: Simd>(&self, s: S, of: impl PairSum, at: [[f32; 3]; GROUP]) -> [f32; GROUP] {
        let len = self.len.next_multiple_of(LANES);
        let [x, y, z] = self.axes.each_ref().map(|axis| axis[..len].chunks_exact(LANES));
        let mut sums = [s.splat(0.0); GROUP];
        for ((x, y), z) in x.zip(y).zip(z) {
            let near = [s.load(x), s.load(y), s.load(z)];
            for (sum, at) in sums.iter_mut().zip(at) {
                let d: [_; 3] = std::array::from_fn(|a| s.sub(s.splat(at[a]), near[a]));
                let dist_sq = s.add(s.add(s.mul(d[0], d[0]), s.mul(d[1], d[1])), s.mul(d[2], d[2]));
                *sum = s.add(*sum, of.term(s, dist_sq));
            }
        }
        sums.map(|sum| s.sum(sum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{field::kernel::half_spline_scalar, lattice::Lattice, math::simd::Portable};

    #[test]
    fn weights_are_one_over_the_sum_over_all_particles() {
        let positions: Vec<[f32; 3]> = (0..1500)
            .map(|i| {
                [
                    (i % 11) as f32 * 0.31 - 2.0,
                    (i / 11 % 11) as f32 * 0.29,
                    (i / 121) as f32 * 0.33 + (i % 7) as f32 * 0.01,
                ]
            })
            .collect();
        let lattice = Lattice { spacing: 0.1, support: 0.8 };
        let mut cells = Cells::default();
        cells.build((&positions).into(), lattice).unwrap();
        let mut found = Vec::new();
        weights(Unit::Portable(Portable), &cells, &Control::default(), &mut found);
        for (i, &index) in cells.order().iter().enumerate() {
            let at = positions[index as usize];
            let sum: f64 = positions
                .iter()
                .map(|p| (0..3).map(|a| f64::from(p[a] - at[a]).powi(2)).sum::<f64>() / 0.64)
                .map(|d| f64::from(half_spline_scalar(d as f32)))
                .sum();
            assert!((f64::from(found[i]) * sum - 1.0).abs() < 1e-5, "particle {index}: {} {}", found[i], 1.0 / sum);
        }
    }
}
