//! Sums of one brick's nodes: 16 nodes of a plane are one vector, and particles come one after the other.
//!
//! ```text
//! lane l of plane p   node (l mod 4, l div 4, p)
//! ```
//!
//! A list holds few particles more than reach some node (as many again where the reach is many cells), and each is loaded
//! once for all 64 nodes. Every node adds its particles in the list's order; one that does not reach it adds exactly zero.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 6, with the vector's lanes as
//! further dimensions of the projection; no closures, since these would not have the lanes' instructions.

use crate::{
    bricks::lists::{List, SIDE},
    field::falloff::Falloff,
    math::simd::{LANES, Simd},
};

/// Nodes of a brick.
pub(super) const NODES: usize = SIDE * SIDE * SIDE;

/// Where the lanes' nodes lie along x and y.
const LANE_X: [f32; LANES] = lanes(1);
const LANE_Y: [f32; LANES] = lanes(SIDE);

const fn lanes(step: usize) -> [f32; LANES] {
    let mut to = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        to[lane] = (lane / step % SIDE) as f32;
        lane += 1;
    }
    to
}

/// Where a plane's nodes lie along x and y, from the block's first: whole numbers.
#[inline(always)]
fn nodes<S: Simd>(s: S, list: &List<'_>) -> (S::F, S::F) {
    (s.add(s.load(&LANE_X), s.splat(list.first[0])), s.add(s.load(&LANE_Y), s.splat(list.first[1])))
}

/// Values of the first `PLANES` planes of nodes. Gives one bit for each node that is inside.
#[inline(always)]
pub(super) fn values<S: Simd, W: Falloff, const VARIED: bool, const PLANES: usize>(
    s: S,
    falloff: &W,
    list: &List<'_>,
    iso: f32,
    to: &mut [f32; NODES],
) -> u64 {
    let (xs, ys) = nodes(s, list);
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let mut sums = [zero; PLANES];
    for piece in list.pieces() {
        for &i in piece {
            let seen = &list.seen[i as usize];
            let (dx, dy) = (seen.away(s, xs, 0), seen.away(s, ys, 1));
            let flat = s.add(s.mul(dx, dx), s.mul(dy, dy));
            let flat = s.sub(one, s.mul(flat, s.splat(seen.per_reach_sq)));
            for plane in 0..PLANES {
                let u = s.max(s.sub(flat, s.splat(seen.rest[plane])), zero);
                let value = falloff.value(s, u);
                let value = if VARIED { s.mul(value, s.splat(seen.strength)) } else { value };
                sums[plane] = s.add(sums[plane], value);
            }
        }
    }
    let mut inside = 0;
    for plane in 0..PLANES {
        s.store(sums[plane], &mut to[LANES * plane..]);
        inside |= u64::from(s.gt(sums[plane], s.splat(iso))) << (LANES * plane);
    }
    inside
}

/// Outward vectors, up to a factor common to all, at `PLANES` planes of nodes from `first` on.
#[inline(always)]
pub(super) fn outward<S: Simd, W: Falloff, const VARIED: bool, const PLANES: usize>(
    s: S,
    falloff: &W,
    list: &List<'_>,
    first: usize,
    to: &mut [[f32; NODES]; 3],
) {
    let (xs, ys) = nodes(s, list);
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let mut sums = [[zero; 3]; PLANES];
    for piece in list.pieces() {
        for &i in piece {
            let seen = &list.seen[i as usize];
            let (dx, dy) = (seen.away(s, xs, 0), seen.away(s, ys, 1));
            let flat = s.add(s.mul(dx, dx), s.mul(dy, dy));
            let flat = s.sub(one, s.mul(flat, s.splat(seen.per_reach_sq)));
            let factor = if VARIED { seen.strength * seen.per_reach_sq } else { 1.0 };
            for plane in 0..PLANES {
                let u = s.max(s.sub(flat, s.splat(seen.rest[first + plane])), zero);
                let slope = falloff.slope(s, u);
                let slope = if VARIED { s.mul(slope, s.splat(factor)) } else { slope };
                let dz = s.splat((first + plane) as f32 - seen.z);
                sums[plane][0] = s.add(sums[plane][0], s.mul(slope, dx));
                sums[plane][1] = s.add(sums[plane][1], s.mul(slope, dy));
                sums[plane][2] = s.add(sums[plane][2], s.mul(slope, dz));
            }
        }
    }
    for plane in 0..PLANES {
        for axis in 0..3 {
            s.store(sums[plane][axis], &mut to[axis][LANES * (first + plane)..]);
        }
    }
}
