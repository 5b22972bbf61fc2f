//! The particles that matter in a box, compressed from sorted cells.
//!
//! Candidates come in canonical order (chunk by chunk, row by row of cells), positions in the frame asked for, columns
//! beside them, so that a loop over them streams through memory. A candidate lies within the support of the box, with
//! a margin for rounding; beyond the support a field is exactly zero, so the margin never shows in a value.
//!
//! Source: this project; compressing vectors takes the place of the linked lists of Rosenberg & Birdwell 2008, section 5.

use super::{
    cells::{Cells, cell_index},
    directory::Cursor,
};
use crate::{
    lattice::{CHUNK, cover},
    math::simd::{LANES, Simd},
};

/// Most columns that a particle may bring: a symmetric matrix, a volume, a reach and an index.
pub(crate) const MAX_COLUMNS: usize = 9;
/// Square of the support radius, in support units, widened by more than rounding can make of a distance.
const REACH_SQ: f32 = 1.000_01;
/// The reach along an axis when cells are chosen, in support units: a little more than [`REACH_SQ`]'s root.
pub(crate) const REACH: f64 = 1.000_02;

/// Particles as a structure of arrays: x, y, z and columns.
#[derive(Default)]
pub(crate) struct Candidates {
    axes: [Vec<f32>; 3],
    columns: [Vec<f32>; MAX_COLUMNS],
    len: usize,
}

/// An axis-aligned box in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Box3 {
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

impl Candidates {
    /// Number of candidates.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Positions, axis by axis.
    #[inline(always)]
    pub(crate) fn axes(&self) -> [&[f32]; 3] {
        [&self.axes[0][..self.len], &self.axes[1][..self.len], &self.axes[2][..self.len]]
    }

    /// The columns, each as long as there are candidates; those from `count` on are empty.
    #[inline(always)]
    pub(crate) fn columns(&self, count: usize) -> [&[f32]; MAX_COLUMNS] {
        let mut columns = [&[][..]; MAX_COLUMNS];
        for c in 0..count {
            columns[c] = &self.columns[c][..self.len];
        }
        columns
    }

    /// Axes and columns in whole vectors: what lies behind the last candidate is anything.
    #[inline(always)]
    pub(crate) fn padded(&self, count: usize) -> ([&[f32]; 3], [&[f32]; MAX_COLUMNS]) {
        let len = self.len.next_multiple_of(LANES);
        let axes = [&self.axes[0][..len], &self.axes[1][..len], &self.axes[2][..len]];
        let mut columns = [&[][..]; MAX_COLUMNS];
        for c in 0..count {
            columns[c] = &self.columns[c][..len];
        }
        (axes, columns)
    }

    /// Makes room for `more` candidates and the lanes that a last store spills.
    #[inline(always)]
    fn reserve(&mut self, columns: usize, more: usize) {
        let need = self.len + more + LANES;
        // The columns of the last field may have been fewer than this one's.
        if self.axes[0].len() < need || self.columns[..columns].iter().any(|c| c.len() < need) {
            self.grow(columns, need);
        }
    }

    #[cold]
    fn grow(&mut self, columns: usize, need: usize) {
        for v in self.axes.iter_mut().chain(&mut self.columns[..columns]) {
            v.resize((2 * need).max(v.len()), 0.0);
        }
    }

    /// Collects the particles within reach of `place`, whose frame has its origin at `corner` (support units). `reach` names
    /// the column with the square of each particle's own reach, where they differ.
    #[inline(always)]
    pub(crate) fn gather<S: Simd>(
        &mut self,
        s: S,
        cells: &Cells,
        columns: &[&[f32]],
        reach: Option<usize>,
        corner: [f64; 3],
        place: Box3,
    ) {
        self.len = 0;
        let range: [_; 3] = std::array::from_fn(|a| {
            cover(corner[a] + f64::from(place.low[a]) - REACH, corner[a] + f64::from(place.high[a]) + REACH, 1.0)
        });
        let chunks = range.each_ref().map(|r| r.start() >> CHUNK.ilog2()..=r.end() >> CHUNK.ilog2());
        let mut cursor = Cursor::default();
        for cz in chunks[2].clone() {
            for cy in chunks[1].clone() {
                for cx in chunks[0].clone() {
                    let Some(chunk) = cells.chunk_at(&mut cursor, [cx, cy, cz]) else { continue };
                    let local = |a: usize, c: i32| {
                        (range[a].start() - c * CHUNK).max(0)..=(range[a].end() - c * CHUNK).min(CHUNK - 1)
                    };
                    let mut shift = [0.0; 3];
                    for a in 0..3 {
                        shift[a] = (f64::from([cx, cy, cz][a] * CHUNK) - corner[a]) as f32;
                    }
                    let (x, y) = (local(0, cx), local(1, cy));
                    for z in local(2, cz) {
                        for y in y.clone() {
                            let run = cells.run(chunk, cell_index(*x.start(), y, z), cell_index(*x.end(), y, z));
                            if run.is_empty() {
                                continue;
                            }
                            let from = [&cells.x[..], &cells.y[..], &cells.z[..]];
                            self.append::<S, true>(s, from, columns, reach, run, shift, place);
                        }
                    }
                }
            }
        }
    }

    /// Keeps of `from`'s candidates those within reach of `place`, in the same frame.
    #[inline(always)]
    pub(crate) fn refine<S: Simd>(&mut self, s: S, from: &Self, columns: usize, reach: Option<usize>, place: Box3) {
        self.len = 0;
        let mut sources = [&[][..]; MAX_COLUMNS];
        for c in 0..columns {
            sources[c] = &from.columns[c][..];
        }
        let axes = [&from.axes[0][..], &from.axes[1][..], &from.axes[2][..]];
        self.append::<S, false>(s, axes, &sources[..columns], reach, 0..from.len, [0.0; 3], place);
    }

    /// Appends those of a run that are within reach, moved by `shift` if that `MOVES`. The sources have 16 values to spare behind the run.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the inner loop of two callers")]
    fn append<S: Simd, const MOVES: bool>(
        &mut self,
        s: S,
        axes: [&[f32]; 3],
        columns: &[&[f32]],
        reach: Option<usize>,
        run: std::ops::Range<usize>,
        shift: [f32; 3],
        place: Box3,
    ) {
        self.reserve(columns.len(), run.len());
        let (mut middle, mut half) = ([0.0; 3], [0.0; 3]);
        for a in 0..3 {
            middle[a] = 0.5 * (place.low[a] + place.high[a]);
            half[a] = 0.5 * (place.high[a] - place.low[a]);
        }
        // Written out: the array's own `map` need not be inlined, and then runs without the vector unit's instructions.
        let [middle, half, shift] = [splat_all(s, middle), splat_all(s, half), splat_all(s, shift)];
        // Cut once, so that the loop has one check a store and none a load.
        let end = run.start + run.len().next_multiple_of(LANES);
        let chunks = run.start..end;
        let (xs, ys) = (axes[0][chunks.clone()].chunks_exact(LANES), axes[1][chunks.clone()].chunks_exact(LANES));
        let zs = axes[2][chunks].chunks_exact(LANES);
        let room = self.len..self.len + run.len() + LANES;
        let [to_x, to_y, to_z] = &mut self.axes;
        let (to_x, to_y, to_z) = (&mut to_x[room.clone()], &mut to_y[room.clone()], &mut to_z[room.clone()]);
        let mut kept = 0;
        for (i, ((x, y), z)) in xs.zip(ys).zip(zs).enumerate() {
            let mut at = [s.load(x), s.load(y), s.load(z)];
            if MOVES {
                at = [s.add(at[0], shift[0]), s.add(at[1], shift[1]), s.add(at[2], shift[2])];
            }
            // The distance from the box: what that from its middle is beyond its half.
            let mut sq = at;
            for a in 0..3 {
                let d = s.sub(s.max_size(s.sub(at[a], middle[a]), half[a]), half[a]);
                sq[a] = s.mul(d, d);
            }
            let dist_sq = s.add(s.add(sq[0], sq[1]), sq[2]);
            let valid = ((1u32 << (run.len() - i * LANES).min(LANES)) - 1) as u16;
            let reach_sq = reach.map_or(s.splat(REACH_SQ), |c| s.load(&columns[c][run.start + i * LANES..]));
            let near = s.gt(reach_sq, dist_sq) & valid;
            s.compress(at[0], near, &mut to_x[kept..]);
            s.compress(at[1], near, &mut to_y[kept..]);
            s.compress(at[2], near, &mut to_z[kept..]);
            for (column, to) in columns.iter().zip(&mut self.columns) {
                s.compress(s.load(&column[run.start + i * LANES..]), near, &mut to[room.start + kept..]);
            }
            kept += near.count_ones() as usize;
        }
        self.len += kept;
    }
}

#[inline(always)]
fn splat_all<S: Simd>(s: S, v: [f32; 3]) -> [S::F; 3] {
    [s.splat(v[0]), s.splat(v[1]), s.splat(v[2])]
}
