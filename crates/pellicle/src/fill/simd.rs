//! Values of an octet's bricks in 16 lanes.
//!
//! ```text
//! octet   candidates gathered once from the cells, in the octet's frame
//! brick   candidates refined by the distance to the brick's box
//! plane   16 nodes (4 along x, 4 along y) in one vector; four planes are summed side by side, so that a particle's x and
//!         y distances are computed once
//! pair    or two of a brick's eighths, 2×2×2 nodes each, in one vector, with candidates of their own: of wide bricks, and of fields
//!         whose sums fill all registers, more is saved by leaving out particles and eighths than by sharing distances; where such
//!         fields find eight lanes in a register, one eighth at a time, so that its sums stay in registers
//! ```
//!
//! Every node adds its particles in canonical order; one beyond the support adds exactly zero, so what is refined away
//! never shows. Source: the projection of a particle's distance to a line of nodes is Rosenberg & Birdwell 2008,
//! section 5, with the vector's lanes as further dimensions.

use super::{
    Scratch, Values, brick_box, brick_origin, corner,
    eighths::{self, Eight},
    node_offset, octet_box,
    points::distance,
    prove,
};
use crate::{
    field::{Field, Row},
    lattice::Coord,
    lookup::{
        cells::Cells,
        gather::{Box3, Candidates},
    },
    math::{
        bits::ones,
        simd::{Kernel, LANES, Simd},
    },
};

/// Some bricks of one octet, to be filled.
pub(crate) struct FillOctet<'a> {
    pub(crate) cells: &'a Cells,
    pub(crate) columns: &'a [&'a [f32]],
    /// Distance of neighbouring nodes in support units.
    pub(crate) step: f64,
    pub(crate) octet: Coord,
    /// The [`eighths`] to fill.
    pub(crate) eighths: u64,
    /// Whether whole bricks are filled where one of their eighths is; a field that fills nothing less has no choice.
    pub(crate) whole: bool,
    /// Whether what is [proven](super::prove) to be outside is left out, by a field that proves.
    pub(crate) proves: bool,
    pub(crate) scratch: &'a mut Scratch,
    /// For those that are filled, one behind the other, brick by brick.
    pub(crate) values: &'a mut [Eight; 64],
    pub(crate) thresholds: &'a [f32],
    /// What the sets of a coarse lattice need besides; `None` for a fine one.
    pub(crate) sampling: Option<Sampling>,
    /// For each brick, the nodes of filled eighths above each threshold.
    pub(crate) above: &'a mut [u64],
}

/// Eighths of an octet that were filled, and those that need not be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Filled {
    pub(crate) eighths: u64,
    /// Proven to be outside, some that were not asked for among them.
    pub(crate) outside: u64,
}

/// How samples on a coarse lattice are judged. The first threshold tells what may be inside, the last what surely is, of those that are
/// trusted: where a field tells, the [dense](Field::is_dense) ones.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampling {
    /// Else where fewer candidates are near a brick, no node of it counts as above the last threshold.
    pub(crate) crowd: usize,
}

/// [`FillOctet`] with a field.
pub(crate) struct Fill<'a, F> {
    pub(crate) field: &'a F,
    pub(crate) octet: FillOctet<'a>,
}

impl<F: Field> Kernel for Fill<'_, F> {
    type Output = Filled;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Filled {
        let Self { field, octet } = self;
        let FillOctet { cells, columns, step, thresholds, sampling, values, above, .. } = octet;
        let Scratch { octet: near, brick: nearer, pair: in_pair } = octet.scratch;
        near.gather(s, cells, columns, F::REACH, corner(octet.octet, step), octet_box(step));
        let proves = F::PROVES && octet.proves;
        let mut done = Filled::default();
        if proves && prove::is_octet_outside(s, field, near, step) {
            done.outside = u64::MAX;
            return done;
        }
        let mut count = 0;
        for brick in ones(eighths::bricks_with(octet.eighths).into()) {
            let mut wanted = eighths::of_brick(octet.eighths, brick);
            nearer.refine(s, near, F::COLUMNS, F::REACH, brick_box(brick, step));
            if proves {
                let outside = prove::brick_outside(s, field, nearer, brick, wanted, step);
                done.outside |= eighths::in_octet(outside, brick);
                wanted &= !outside;
                if wanted == 0 {
                    continue;
                }
            }
            if octet.whole || !fills_eighths::<F>(step) {
                wanted = u8::MAX;
            }
            done.eighths |= eighths::in_octet(wanted, brick);
            let values = &mut values[count..][..wanted.count_ones() as usize];
            count += values.len();
            let above = &mut above[thresholds.len() * brick..][..thresholds.len()];
            let is_sparse = |part| sampling.is_some_and(|sampling| nearer.len() < sampling.crowd / part);
            if F::PROVES && is_sparse(if F::WEIGHS { 8 } else { 1 }) {
                // Where no sample is trusted, or next to none, and none tells outside, none need be taken.
                above.fill(0);
                above[0] = u64::MAX;
                continue;
            }
            let mut dense = 0;
            if fills_eighths::<F>(step) || sampling.is_some() {
                dense = fill_eighths(s, field, nearer, in_pair, brick, wanted, step, values);
                for (above, &threshold) in above.iter_mut().zip(thresholds) {
                    *above = eighths_above(s, wanted, values, threshold);
                }
            } else {
                let mut by_plane = [0.0; 64];
                fill_planes(s, field, nearer, brick_origin(brick), step, &mut by_plane);
                eighths::split(&by_plane, values);
                for (above, &threshold) in above.iter_mut().zip(thresholds) {
                    *above = 0;
                    for k in 0..4 {
                        *above |= u64::from(s.gt(s.load(&by_plane[LANES * k..]), s.splat(threshold))) << (LANES * k);
                    }
                }
            }
            if sampling.is_some() {
                let trusted = if F::WEIGHS { dense } else { u64::from(!is_sparse(1)).wrapping_neg() };
                above[thresholds.len() - 1] &= trusted;
            }
        }
        done
    }
}

/// Whether eighths are filled, else whole bricks: those of fields that sum much, and of any where the lattice is wide.
///
/// A particle near a brick misses some of it, the more the wider the brick is. Compressing candidates once more for each pair of eighths
/// is cheaper than a branch for each particle, and from a fifth of a support radius on than the sums that it saves.
#[inline(always)]
pub(super) fn fills_eighths<F: Field>(step: f64) -> bool {
    F::PLANES == 1 || step >= 0.2
}

/// The nodes of some eighths of a brick above a threshold.
#[inline(always)]
fn eighths_above<S: Simd>(s: S, eighths: u8, values: &[Eight], threshold: f32) -> u64 {
    let mut set = 0;
    let mut eighths = ones(eighths.into());
    for pair in values.chunks(2) {
        let mut lanes = [f32::NEG_INFINITY; LANES];
        lanes[..8 * pair.len()].copy_from_slice(pair.as_flattened());
        let above = s.gt(s.load(&lanes), s.splat(threshold));
        for (half, eighth) in (0..pair.len()).zip(&mut eighths) {
            set |= eighths::deposit((above >> (LANES / 2 * half)) as u8, eighth);
        }
    }
    set
}

/// Coordinates of a plane's nodes along x and y, of the brick whose first node is `first`.
#[inline(always)]
fn in_plane<S: Simd>(s: S, first: [i32; 3], step: f64) -> [S::F; 2] {
    let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        x[lane] = node_offset(first[0] + (lane & 3) as i32, step);
        y[lane] = node_offset(first[1] + (lane >> 2) as i32, step);
    }
    [s.load(&x), s.load(&y)]
}

/// Values of the brick whose first node is `first`, four planes side by side.
#[inline(always)]
fn fill_planes<S: Simd, F: Field>(s: S, field: &F, near: &Candidates, first: [i32; 3], step: f64, values: &mut Values) {
    let [x, y] = in_plane(s, first, step);
    let [px, py, pz] = near.axes();
    let columns = near.columns(F::COLUMNS);
    let mut z = [0.0; 4];
    for k in 0..4 {
        z[k] = node_offset(first[2] + k as i32, step);
    }
    let mut sums = [field.zero(s); 4];
    for particle in 0..near.len() {
        let (dx, dy) = (s.sub(x, s.splat(px[particle])), s.sub(y, s.splat(py[particle])));
        let in_plane = s.add(s.mul(dx, dx), s.mul(dy, dy));
        let row = Row { columns: &columns, particle };
        for k in 0..4 {
            let dz = z[k] - pz[particle];
            field.add(s, &mut sums[k], [dx, dy, s.splat(dz)], s.add(in_plane, s.splat(dz * dz)), row);
        }
    }
    for k in 0..4 {
        s.store(field.value(s, sums[k]), &mut values[LANES * k..]);
    }
}

/// Values of some eighths of a brick, one or two at a time, one behind the other. Gives the nodes that are [dense](Field::is_dense).
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the inner loop of one caller")]
fn fill_eighths<S: Simd, F: Field>(
    s: S,
    field: &F,
    near: &Candidates,
    in_pair: &mut Candidates,
    brick: usize,
    wanted: u8,
    step: f64,
    values: &mut [Eight],
) -> u64 {
    let alone = S::IS_WIDE && F::PLANES == 1;
    /// The lanes of nodes above along each axis, and of the second eighth.
    const UPPER: [u16; 3] = [0xaaaa, 0xcccc, 0xf0f0];
    const SECOND: u16 = 0xff00;
    // The nodes of the eighths below and above along each axis.
    let (below, above) = (eighths::place(brick, 0, step), eighths::place(brick, 7, step));
    let mut ends = [[[0.0; 2]; 2]; 3];
    for a in 0..3 {
        ends[a] = [[below.low[a], below.high[a]], [above.low[a], above.high[a]]];
    }
    let (mut left, mut dense) = (wanted, 0);
    while left != 0 {
        let first = left.trailing_zeros() as usize;
        left &= left - 1;
        // An odd one is done twice. Two that touch have the most particles in common.
        let mut second = first;
        if !alone && left != 0 {
            second = ones(left.into()).min_by_key(|other| (other ^ first).count_ones()).unwrap_or(first);
            left &= !(1 << second);
        }
        let mut place = Box3 { low: [0.0; 3], high: [0.0; 3] };
        let mut at = [s.splat(0.0); 3];
        for a in 0..3 {
            let [low, high] = ends[a][first >> a & 1];
            let [other_low, other_high] = ends[a][second >> a & 1];
            (place.low[a], place.high[a]) = (low.min(other_low), high.max(other_high));
            let one = s.select(UPPER[a], s.splat(high), s.splat(low));
            let other = s.select(UPPER[a], s.splat(other_high), s.splat(other_low));
            at[a] = s.select(SECOND, other, one);
        }
        in_pair.refine(s, near, F::COLUMNS, F::REACH, place);
        let sums = sum_all(s, field, in_pair, at);
        let is_dense = field.is_dense(s, &sums);
        let mut found = [0.0; LANES];
        if alone {
            s.store_eight(field.value(s, sums), &mut found);
        } else {
            s.store(field.value(s, sums), &mut found);
            values[eighths::rank(wanted, second)].copy_from_slice(&found[LANES / 2..]);
            dense |= eighths::deposit((is_dense >> (LANES / 2)) as u8, second);
        }
        values[eighths::rank(wanted, first)].copy_from_slice(&found[..LANES / 2]);
        dense |= eighths::deposit(is_dense as u8, first);
    }
    dense
}

/// The sums of all candidates at 16 points.
#[inline(always)]
pub(super) fn sum_all<S: Simd, F: Field>(s: S, field: &F, near: &Candidates, at: [S::F; 3]) -> F::Sums<S> {
    let columns = near.columns(F::COLUMNS);
    let mut sums = field.zero(s);
    if S::IS_WIDE {
        // Registers are few: what is computed ahead would only be put aside.
        for particle in 0..near.len() {
            let (d, dist_sq) = distance(s, at, near.axes(), particle);
            field.add(s, &mut sums, d, dist_sq, Row { columns: &columns, particle });
        }
        return sums;
    }
    // Distances two ahead, kernels one: else what a particle adds waits for a chain of operations longer than the machine looks ahead.
    let n = near.len();
    if n == 0 {
        return sums;
    }
    let (mut d, dist_sq) = distance(s, at, near.axes(), 0);
    let mut kernels = field.kernels(s, dist_sq, Row { columns: &columns, particle: 0 });
    let (mut next_d, mut next_sq) = distance(s, at, near.axes(), 1.min(n - 1));
    for particle in 0..n {
        let next = Row { columns: &columns, particle: (particle + 1).min(n - 1) };
        let next_kernels = field.kernels(s, next_sq, next);
        let (then_d, then_sq) = distance(s, at, near.axes(), (particle + 2).min(n - 1));
        field.add_kernels(s, &mut sums, d, kernels, Row { columns: &columns, particle });
        (d, kernels) = (next_d, next_kernels);
        (next_d, next_sq) = (then_d, then_sq);
    }
    sums
}
