//! Sums over the particles around each particle: densities, and all else that a particle must know of its neighbours before a
//! field can be summed.
//!
//! A cell's candidates are its 27 neighbours' particles, in canonical order, relative to its chunk's corner; 16 at a time
//! are summed in lanes, then the lanes. No neighbour lists are kept.
//!
//! Source: this project; the sweep over sorted cells is that of Ihmsen et al. 2011, A Parallel SPH Implementation on
//! Multi-Core CPUs.

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

/// What is summed around each particle.
pub(crate) trait Around: Sync {
    /// Numbers that come of it.
    const OUT: usize;
    /// Sums of one particle, in lanes.
    type Sums<S: Simd>: Copy;

    /// Sums of no neighbour.
    fn zero<S: Simd>(&self, s: S) -> Self::Sums<S>;

    /// Adds 16 neighbours of particle `own`, itself among them. `d` is the particle minus the neighbour, in support units;
    /// those beyond the support, and what fills the lanes, must add exactly nothing. `mass` is the neighbours' column, or 0.
    fn add<S: Simd>(&self, s: S, sums: &mut Self::Sums<S>, d: [S::F; 3], dist_sq: S::F, mass: S::F, own: usize);

    /// Makes [`OUT`](Self::OUT) numbers of the sums.
    fn finish<S: Simd>(&self, s: S, sums: Self::Sums<S>, own: usize, to: &mut [f32]);
}

/// Writes [`Around::OUT`] numbers for every particle, in canonical order, with [`LANES`] zeros behind. `masses` is a number that
/// each neighbour brings.
pub(crate) fn around<A: Around>(
    unit: Unit,
    cells: &Cells,
    what: &A,
    masses: Option<&[f32]>,
    control: &Control<'_>,
    to: &mut Vec<f32>,
) {
    let n = cells.len();
    to.clear();
    to.resize(n * A::OUT + LANES, 0.0);
    let starts = |c: usize| A::OUT * if c < cells.chunks.len() { cells.chunk_range(c).start } else { n };
    for_each_part(0..cells.chunks.len(), &mut to[..n * A::OUT], &starts, &|chunk, to: &mut [f32]| {
        if control.check().is_ok() {
            unit.run(Chunk { cells, chunk, what, masses, to });
        }
    });
}

/// One chunk's particles.
struct Chunk<'a, A> {
    cells: &'a Cells,
    chunk: usize,
    what: &'a A,
    masses: Option<&'a [f32]>,
    to: &'a mut [f32],
}

/// Positions near one cell, padded to whole vectors.
#[derive(Default)]
struct Near {
    axes: [Vec<f32>; 3],
    masses: Vec<f32>,
    len: usize,
}

thread_local! {
    /// Kept between chunks and frames: what one cell's neighbourhood holds, a few kilobytes.
    static NEAR: std::cell::RefCell<Near> = std::cell::RefCell::default();
}

impl<A: Around> Kernel for Chunk<'_, A> {
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
                near.collect(s, self.cells, self.masses, &around, cell);
                for group in members.clone().step_by(GROUP) {
                    // A short last group repeats its last particle.
                    let own: [usize; GROUP] = std::array::from_fn(|g| (group + g).min(members.end - 1));
                    let sums = near.sums(s, self.what, self.cells, own);
                    for (own, sums) in own.into_iter().zip(sums).take(members.end - group) {
                        self.what.finish(s, sums, own, &mut self.to[(own - base) * A::OUT..][..A::OUT]);
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
    fn collect<S: Simd>(
        &mut self,
        s: S,
        cells: &Cells,
        masses: Option<&[f32]>,
        around: &[Option<usize>; 27],
        cell: usize,
    ) {
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
                            masses,
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
        self.masses.resize((self.len + LANES).max(self.masses.len()), 0.0);
        s.store(s.splat(0.0), &mut self.masses[self.len..]);
    }

    #[inline(always)]
    fn append<S: Simd>(
        &mut self,
        s: S,
        cells: &Cells,
        masses: Option<&[f32]>,
        run: std::ops::Range<usize>,
        shift: [f32; 3],
    ) {
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
        if let Some(from) = masses {
            self.masses.resize((self.len + run.len() + LANES).max(self.masses.len()), 0.0);
            self.masses[self.len..self.len + run.len()].copy_from_slice(&from[run.clone()]);
        }
        self.len += run.len();
    }

    /// Sums over the collected particles, for a group of particles at once: each vector is loaded once for all, and the
    /// square roots of one hide behind those of the others.
    #[inline(always)]
    fn sums<S: Simd, A: Around>(&self, s: S, what: &A, cells: &Cells, own: [usize; GROUP]) -> [A::Sums<S>; GROUP] {
        let at = own.map(|i| [cells.x[i], cells.y[i], cells.z[i]]);
        let len = self.len.next_multiple_of(LANES);
        let [x, y, z] = self.axes.each_ref().map(|axis| axis[..len].chunks_exact(LANES));
        let masses = self.masses[..len].chunks_exact(LANES);
        let mut sums = [what.zero(s); GROUP];
        for (((x, y), z), mass) in x.zip(y).zip(z).zip(masses) {
            let near = [s.load(x), s.load(y), s.load(z)];
            let mass = s.load(mass);
            for ((sums, at), own) in sums.iter_mut().zip(at).zip(own) {
                // No closure over the axes: it need not be inlined, and then runs without the vector unit's instructions.
                let to = [s.splat(at[0]), s.splat(at[1]), s.splat(at[2])];
                let d = [s.sub(to[0], near[0]), s.sub(to[1], near[1]), s.sub(to[2], near[2])];
                let dist_sq = s.add(s.add(s.mul(d[0], d[0]), s.mul(d[1], d[1])), s.mul(d[2], d[2]));
                what.add(s, sums, d, dist_sq, mass, own);
            }
        }
        sums
    }
}
