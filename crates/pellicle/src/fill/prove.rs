//! Which bricks are outside, proven from where the particles lie: for fields that measure the distance to a weighted centre.
//!
//! Such a field is at most r̄ − |x − x̄|, with r̄ and x̄ the means of the particles' radii and places, weighted by k_j(x). Let u be a unit
//! vector, and g_j = (x_j − x)·u − r_j how far particle j lies along it, less its radius. Then x is outside if
//!
//! ```text
//! Σ_j k_j(x) g_j > 0            since |x − x̄| ≥ (x̄ − x)·u
//! ```
//!
//! For a box of nodes with the middle c: g_j is at least (x_j − c)·u − r_j − Σ_a e_a |u_a|, where e are half of the box's edges,
//! and k_j(x) lies between its values at the box's farthest corner and at its nearest point. The least that the sum can be is
//! had with the lesser weight where g_j is positive and the greater one where it is negative. So one pass over the particles, 16 at
//! a time, proves a box. u is the direction to the particles' mean; any other would be right, too.
//!
//! An octet is tried whole, then each brick, then its [`eighths`] of 2×2×2 nodes, along the brick's u. Where the mean of the particles
//! lies too near for a proof none is tried. Between splashes, where thin blobs may arise in the midst of lowest
//! values, nothing is proven, and nodes are evaluated one by one.
//!
//! Source: this project; tested against the field itself.

use super::{Scratch, brick_box, corner, eighths, octet_box, simd::fills_eighths};
use crate::{
    field::Field,
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

/// Some bricks of one octet, to be proven.
pub(crate) struct ProveOctet<'a> {
    pub(crate) cells: &'a Cells,
    pub(crate) columns: &'a [&'a [f32]],
    /// Distance of neighbouring nodes in support units.
    pub(crate) step: f64,
    pub(crate) octet: Coord,
    /// The [`eighths`] to prove.
    pub(crate) eighths: u64,
    pub(crate) scratch: &'a mut Scratch,
}

/// [`ProveOctet`] with a field. Results in the eighths whose nodes are all outside, as far as that could be proven; where
/// whole bricks are filled, in whole bricks.
pub(crate) struct Prove<'a, F> {
    pub(crate) field: &'a F,
    pub(crate) octet: ProveOctet<'a>,
}

impl<F: Field> Kernel for Prove<'_, F> {
    type Output = u64;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> u64 {
        if !F::PROVES {
            return 0;
        }
        let Self { field, octet } = self;
        let ProveOctet { cells, columns, step, .. } = octet;
        let Scratch { octet: near, brick: nearer, .. } = octet.scratch;
        near.gather(s, cells, columns, F::REACH, corner(octet.octet, step), octet_box(step));
        if is_octet_outside(s, field, near, step) {
            return u64::MAX;
        }
        let mut proven = 0;
        for brick in ones(eighths::bricks_with(octet.eighths).into()) {
            nearer.refine(s, near, F::COLUMNS, F::REACH, brick_box(brick, step));
            let wanted = eighths::of_brick(octet.eighths, brick);
            proven |= eighths::in_octet(brick_outside(s, field, nearer, brick, wanted, step), brick);
        }
        proven
    }
}

/// Whether all of an octet is outside, as far as that can be proven. `near` are all particles that reach it.
#[inline(always)]
pub(super) fn is_octet_outside<S: Simd, F: Field>(s: S, field: &F, near: &Candidates, step: f64) -> bool {
    let place = octet_box(step);
    let pull = Pull::new(s, field, near, place);
    pull.is_likely(place) && is_outside(s, field, near, place, pull.along)
}

/// The eighths of a brick that are outside, as far as that can be proven: all, or some of those `wanted`; where whole bricks are filled
/// all of those, or none. `near` are all particles that reach the brick.
#[inline(always)]
pub(super) fn brick_outside<S: Simd, F: Field>(
    s: S,
    field: &F,
    near: &Candidates,
    brick: usize,
    wanted: u8,
    step: f64,
) -> u8 {
    let place = brick_box(brick, step);
    let pull = Pull::new(s, field, near, place);
    if pull.is_likely(place) && is_outside(s, field, near, place, pull.along) {
        return u8::MAX;
    }
    let mut likely = 0;
    for eighth in ones(wanted.into()) {
        likely |= u8::from(pull.is_likely(eighths::place(brick, eighth, step))) << eighth;
    }
    let by_eighths = fills_eighths::<F>(step);
    if likely == 0 || !by_eighths && likely != wanted {
        return 0;
    }
    let found = eighths_outside(s, field, near, brick, likely, step, pull.along);
    if by_eighths || found == wanted { found } else { 0 }
}

/// Where the particles near a box are in the mean, nearer ones counting more.
struct Pull {
    /// To there from the box's middle: a unit vector.
    along: [f32; 3],
    mean: [f32; 3],
    /// The mean of radii less isovalue.
    radius: f32,
}

impl Pull {
    #[inline(always)]
    fn new<S: Simd, F: Field>(s: S, field: &F, near: &Candidates, place: Box3) -> Self {
        let n = near.len();
        let ([xs, ys, zs], columns) = near.padded(F::COLUMNS);
        let zero = s.splat(0.0);
        let (mut middle, mut half) = ([0.0; 3], [0.0; 3]);
        for a in 0..3 {
            middle[a] = 0.5 * (place.low[a] + place.high[a]);
            half[a] = 0.5 * (place.high[a] - place.low[a]);
        }
        let centre = [s.splat(middle[0]), s.splat(middle[1]), s.splat(middle[2])];
        let diagonal_sq = half[0] * half[0] + half[1] * half[1] + half[2] * half[2];
        let reach = s.splat(1.1 + diagonal_sq + 2.0 * diagonal_sq.sqrt());
        let (mut total, mut radii, mut sums) = (zero, zero, [zero; 3]);
        let mut at = 0;
        while at < n {
            let d = [
                s.sub(s.load(&xs[at..]), centre[0]),
                s.sub(s.load(&ys[at..]), centre[1]),
                s.sub(s.load(&zs[at..]), centre[2]),
            ];
            let dist_sq = s.add(s.add(s.mul(d[0], d[0]), s.mul(d[1], d[1])), s.mul(d[2], d[2]));
            let t = s.max(s.sub(reach, dist_sq), zero);
            let k = s.select(valid(n - at), s.mul(t, t), zero);
            let [_, radius] = field.pull(s, &columns, at);
            total = s.add(total, k);
            radii = s.add(radii, s.mul(k, s.select(valid(n - at), radius, zero)));
            for a in 0..3 {
                sums[a] = s.add(sums[a], s.mul(k, d[a]));
            }
            at += LANES;
        }
        let total = s.sum(total).max(f32::MIN_POSITIVE);
        let off = [s.sum(sums[0]) / total, s.sum(sums[1]) / total, s.sum(sums[2]) / total];
        let length = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt().max(1e-20);
        Self {
            along: [off[0] / length, off[1] / length, off[2] / length],
            mean: [middle[0] + off[0], middle[1] + off[1], middle[2] + off[2]],
            radius: s.sum(radii) / total,
        }
    }

    /// Whether a proof for a box may succeed: farther from the mean than the radius, or nearly so. A guess, that costs or saves
    /// time and nothing else.
    #[inline(always)]
    fn is_likely(&self, place: Box3) -> bool {
        let mut far = -0.03 - self.radius;
        for a in 0..3 {
            let (middle, half) = (0.5 * (place.low[a] + place.high[a]), 0.5 * (place.high[a] - place.low[a]));
            far += (self.mean[a] - middle) * self.along[a] - half * self.along[a].abs();
        }
        far > 0.0 || self.radius == 0.0
    }
}

/// For the rounding of places, in support units: a hundred times what it can amount to.
const SLACK: f32 = 1e-4;
/// For that of 1 − d² and of sums.
const ROUNDING: f32 = 4e-6;
const SHARE: f32 = 1.001;

/// Whether all points of a box are outside, as far as one direction proves it. `near` are all particles that reach it.
#[inline(always)]
fn is_outside<S: Simd, F: Field>(s: S, field: &F, near: &Candidates, place: Box3, u: [f32; 3]) -> bool {
    let n = near.len();
    if n == 0 {
        return true;
    }
    let ([xs, ys, zs], columns) = near.padded(F::COLUMNS);
    let zero = s.splat(0.0);
    let (mut middle, mut half) = ([zero; 3], [0.0; 3]);
    for a in 0..3 {
        middle[a] = s.splat(0.5 * (place.low[a] + place.high[a]));
        half[a] = 0.5 * (place.high[a] - place.low[a]);
    }
    let behind = SLACK + half[0] * u[0].abs() + half[1] * u[1].abs() + half[2] * u[2].abs();
    let (mut ahead, mut back) = (zero, zero);
    let mut at = 0;
    while at < n {
        let d = [
            s.sub(s.load(&xs[at..]), middle[0]),
            s.sub(s.load(&ys[at..]), middle[1]),
            s.sub(s.load(&zs[at..]), middle[2]),
        ];
        let along = s.add(s.add(s.mul(d[0], s.splat(u[0])), s.mul(d[1], s.splat(u[1]))), s.mul(d[2], s.splat(u[2])));
        let [mass, radius] = field.pull(s, &columns, at);
        let g = s.sub(s.sub(along, radius), s.splat(behind));
        let (mut near_sq, mut far_sq) = (zero, zero);
        for a in 0..3 {
            let [near, far] = reach_along(s, d[a], half[a]);
            (near_sq, far_sq) = (s.add(near_sq, near), s.add(far_sq, far));
        }
        let part = least_part(s, g, near_sq, far_sq, mass, valid(n - at));
        ahead = s.add(ahead, s.max(part, zero));
        back = s.add(back, s.max(s.sub(zero, part), zero));
        at += LANES;
    }
    is_ahead(s, ahead, back)
}

/// [`is_outside`] for some eighths of a brick, in one pass: what they have in common is computed once.
#[inline(always)]
fn eighths_outside<S: Simd, F: Field>(
    s: S,
    field: &F,
    near: &Candidates,
    brick: usize,
    wanted: u8,
    step: f64,
    u: [f32; 3],
) -> u8 {
    let n = near.len();
    let ([xs, ys, zs], columns) = near.padded(F::COLUMNS);
    let zero = s.splat(0.0);
    let (first, last) = (eighths::place(brick, 0, step), eighths::place(brick, 7, step));
    // Along each axis the eighths below and those above.
    let (mut middle, mut half, mut behind) = ([[0.0; 2]; 3], [0.0; 3], SLACK);
    for a in 0..3 {
        middle[a] = [0.5 * (first.low[a] + first.high[a]), 0.5 * (last.low[a] + last.high[a])];
        half[a] = 0.5 * f32::max(first.high[a] - first.low[a], last.high[a] - last.low[a]);
        behind += half[a] * u[a].abs();
    }
    // What is taken from how far a particle lies along u, by eighth: to its middle, and from there to its farthest corner.
    let mut offset = [0.0; 8];
    let (mut list, mut count) = ([0; 8], 0);
    for eighth in ones(wanted.into()) {
        list[count] = eighth;
        count += 1;
        let along = |a: usize| middle[a][eighth >> a & 1] * u[a];
        offset[eighth] = behind + along(0) + along(1) + along(2);
    }
    let (mut ahead, mut back) = ([zero; 8], [zero; 8]);
    let mut at = 0;
    while at < n {
        let place = [s.load(&xs[at..]), s.load(&ys[at..]), s.load(&zs[at..])];
        let along = s
            .add(s.add(s.mul(place[0], s.splat(u[0])), s.mul(place[1], s.splat(u[1]))), s.mul(place[2], s.splat(u[2])));
        let [mass, radius] = field.pull(s, &columns, at);
        let g = s.sub(along, radius);
        let mut squares = [[[zero; 2]; 2]; 3];
        for a in 0..3 {
            for side in 0..2 {
                squares[a][side] = reach_along(s, s.sub(place[a], s.splat(middle[a][side])), half[a]);
            }
        }
        for &eighth in &list[..count] {
            let [x, y, z] = [squares[0][eighth & 1], squares[1][eighth >> 1 & 1], squares[2][eighth >> 2]];
            let (near_sq, far_sq) = (s.add(s.add(x[0], y[0]), z[0]), s.add(s.add(x[1], y[1]), z[1]));
            let g = s.sub(g, s.splat(offset[eighth]));
            let part = least_part(s, g, near_sq, far_sq, mass, valid(n - at));
            ahead[eighth] = s.add(ahead[eighth], s.max(part, zero));
            back[eighth] = s.add(back[eighth], s.max(s.sub(zero, part), zero));
        }
        at += LANES;
    }
    let mut found = 0;
    for &eighth in &list[..count] {
        found |= u8::from(is_ahead(s, ahead[eighth], back[eighth])) << eighth;
    }
    found
}

/// Squares of how far 16 particles are from an interval, at the least and at the most: `d` from its middle, `half` its half.
#[inline(always)]
fn reach_along<S: Simd>(s: S, d: S::F, half: f32) -> [S::F; 2] {
    let zero = s.splat(0.0);
    let off = s.max(d, s.sub(zero, d));
    let (near, far) = (s.max(s.sub(off, s.splat(half)), zero), s.add(off, s.splat(half)));
    [s.mul(near, near), s.mul(far, far)]
}

/// The least that k g can be of 16 particles.
#[inline(always)]
fn least_part<S: Simd>(s: S, g: S::F, near_sq: S::F, far_sq: S::F, mass: S::F, valid: u16) -> S::F {
    let zero = s.splat(0.0);
    let t_most = s.max(s.sub(s.splat(1.0 + ROUNDING), near_sq), zero);
    let t_least = s.max(s.sub(s.splat(1.0 - ROUNDING), far_sq), zero);
    let t = s.select(s.gt(g, zero), t_least, t_most);
    let k = s.select(valid, s.mul(s.mul(t, mass), s.mul(t, t)), zero);
    s.mul(k, g)
}

/// Whether what pulls ahead outweighs what pulls back for certain.
#[inline(always)]
fn is_ahead<S: Simd>(s: S, ahead: S::F, back: S::F) -> bool {
    let (ahead, back) = (s.sum(ahead), s.sum(back));
    // None pulls back: whatever the weights, the sum is positive.
    back == 0.0 || ahead > SHARE * back
}

/// The first lanes, as many as there are left.
#[inline(always)]
fn valid(left: usize) -> u16 {
    ((1u32 << if left < LANES { left } else { LANES }) - 1) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        field::{onderik::Onderik, solenthaler::Solenthaler, zhu_bridson::ZhuBridson},
        fill::simd::{Fill, FillOctet},
        lattice::Lattice,
        math::simd::Unit,
    };

    /// Particles in one half of a block, with a bay and a splash before it, jittered.
    fn scene() -> Vec<[f64; 3]> {
        let jitter = |i: i32| f64::from(i.wrapping_mul(1_103_515_245).wrapping_add(12_345) >> 8 & 0xffff) / 65536.0;
        let mut positions = Vec::new();
        for i in 0..12 * 12 * 12 {
            let at: [i32; 3] = [i % 12, i / 12 % 12, i / 144];
            let bay = (at[0] - 5).pow(2) + (at[1] - 5).pow(2) < 12 && at[2] > 2;
            let splash = at[2] > 8 && i % 11 == 0;
            if (at[2] < 6 && !bay) || splash {
                positions
                    .push(std::array::from_fn(|a| (f64::from(at[a]) + 0.3 * jitter(3 * i + a as i32)) * 0.25 - 0.7));
            }
        }
        positions
    }

    /// Proven bricks hold no node above the isovalue; returns how many were proven, and how many are outside.
    fn judge<F: Field>(field: &F, columns: &[&[f32]], cells: &Cells, step: f64) -> [usize; 2] {
        let mut counts = [0; 2];
        let mut scratch = Scratch::default();
        let unit = Unit::new(crate::Lanes::Auto).expect("every machine has one");
        // From below all particles to above them, with a support to spare.
        let [first, end] = [-1.9, 3.6].map(|v: f64| (v / (8.0 * step)).ceil() as i32);
        let n = end - first;
        for i in 0..n.pow(3) {
            let octet = [i % n, i / n % n, i / (n * n)].map(|v| first + v);
            let of = ProveOctet { cells, columns, step, octet, eighths: u64::MAX, scratch: &mut scratch };
            let proven = unit.run(Prove { field, octet: of });
            let (mut values, mut above) = ([[0.0; 8]; 64], [0; 8]);
            let mut fill = |proves, above: &mut [u64]| {
                let octet = FillOctet {
                    cells,
                    columns,
                    step,
                    octet,
                    eighths: u64::MAX,
                    whole: false,
                    proves,
                    scratch: &mut scratch,
                    values: &mut values,
                    thresholds: &[field.iso()],
                    sampling: None,
                    above,
                };
                unit.run(Fill { field, octet })
            };
            fill(false, &mut above);
            // Proven on the way, the same is left out.
            let mut rest = [u64::MAX; 8];
            let filled = fill(true, &mut rest);
            assert_eq!((filled.outside, filled.eighths), (proven, !proven));
            for brick in ones(eighths::bricks_with(filled.eighths).into()) {
                let nodes = eighths::nodes(eighths::of_brick(filled.eighths, brick));
                assert_eq!(rest[brick], above[brick] & nodes);
            }
            for brick in 0..8 {
                let own = eighths::of_brick(proven, brick);
                assert_eq!(above[brick] & eighths::nodes(own), 0, "brick {brick} of {octet:?} at step {step}");
                counts[0] += usize::from(own == u8::MAX);
                counts[1] += usize::from(above[brick] == 0);
            }
        }
        counts
    }

    #[test]
    fn no_node_of_a_proven_brick_is_inside_and_most_bricks_outside_are_proven() {
        let positions = scene();
        for step in [0.0625, 0.125, 0.25] {
            let mut cells = Cells::default();
            cells.build((&positions).into(), Lattice { spacing: step, support: 1.0 }).unwrap();
            let n = positions.len() + LANES;
            let radii: Vec<f32> = (0..n).map(|i| 0.15 + 0.01 * (i % 20) as f32).collect();
            let masses: Vec<f32> = (0..n).map(|i| 0.5 + 0.1 * (i % 7) as f32).collect();
            let (iso, radius, particles_per_support) = (0.0, 0.25, 4.0);
            let solenthaler = Solenthaler::<false> { iso, radius, t_low: 0.4, t_high: 3.5, particles_per_support };
            let of_radii = Solenthaler::<true> { iso: -0.3, radius, t_low: 0.4, t_high: 3.5, particles_per_support };
            let zhu_bridson = ZhuBridson::<true> { iso: 0.2, radius, particles_per_support };
            let onderik = Onderik::<true> { iso, radius, w_min: 0.0, w_max: 1.05, particles_per_support };
            for counts in [
                judge(&solenthaler, &[], &cells, step),
                judge(&of_radii, &[&radii], &cells, step),
                judge(&zhu_bridson, &[&radii], &cells, step),
                judge(&onderik, &[&masses, &radii], &cells, step),
            ] {
                assert!(counts[0] * 10 > counts[1] * 7, "{counts:?} at step {step}");
            }
        }
    }
}
