//! Which particles have next to no neighbors: spray, to be drawn as spheres and kept out of the surface.
//!
//! Particles are put in buckets by a hash of their cell, a cube of two distances. Counting stops at the first neighbor too
//! many, so that a particle within a body of fluid costs one or two comparisons.
//!
//! ```text
//! bucket_end  hash of a cell ──► end of its members                     ¼ to ½ a number a particle
//! members     the caller's indices, bucket by bucket, in any order
//! ```
//!
//! Not the sorted cells of the surface: their directory takes kilobytes for each stray particle and ends where the lattice
//! ends, and strays are what is looked for here. Here memory is at most 7 bytes a particle, wherever the particles lie.
//! Nothing is summed, so the order within a bucket cannot show in the result.
//!
//! Guarantees: exactly the particles with at most so many others closer than the distance, computed in double precision;
//! the same for any number of threads. Many coincident particles cost no more than few.
//!
//! Source: Akinci, Ihmsen, Akinci, Teschner, "Parallel Surface Reconstruction for Particle-Based Fluids", 2012, section 6,
//! for extracting isolated particles and drawing them as spheres; the hashed cells are those of Teschner et al. 2003,
//! "Optimized Spatial Hashing for Collision Detection of Deformable Objects".

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use rayon::prelude::*;

use crate::{Control, Error, Params, Positions, ScalarField};

/// Particles between two looks at the token of cancellation.
const BLOCK: usize = 1 << 13;

/// What counts as isolated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IsolationParams {
    /// Others count as neighbors when they are closer than this: world units, > 0. Two particles exactly so far apart are
    /// no neighbors, as the kernel is 0 there.
    pub distance: f64,
    /// A particle with so many neighbors, or fewer, is isolated; itself does not count, coincident others do. 0 finds
    /// single drops, 1 pairs, too. Larger numbers do not find groups of so many: at the rim of a body of fluid a particle
    /// may have few neighbors, too.
    pub max_neighbors: usize,
}

impl IsolationParams {
    /// Particles without any other within the field's support, or twice that where a field takes more from its neighbours than a
    /// sum: the rest of the surface is what it was without them.
    pub fn of(params: &Params) -> Self {
        let is_sum = matches!(params.field, ScalarField::Sph | ScalarField::Metaball(_));
        let distance = if is_sum { params.support() } else { 2.0 * params.support() };
        Self { distance, max_neighbors: 0 }
    }

    fn check(&self) -> Result<(), Error> {
        let distance = self.distance;
        let is_usable = distance > 0.0 && [distance, distance * distance, 2.0 * distance].iter().all(|v| v.is_normal());
        if is_usable {
            return Ok(());
        }
        Err(Error::Parameter { name: "distance", value: distance, must: "greater than 0, with an ordinary square" })
    }
}

/// Tells of each particle, in the caller's order, whether it is isolated. Runs in the current rayon pool. Particles may lie
/// anywhere, far beyond what a lattice of this spacing could hold.
///
/// ```
/// use pellicle::{Control, IsolationParams, isolated};
///
/// let positions = [[0.0f32, 0.0, 0.0], [0.05, 0.0, 0.0], [1e9, 0.0, 0.0]];
/// let params = IsolationParams { distance: 0.1, max_neighbors: 0 };
/// assert_eq!(isolated((&positions).into(), &params, &Control::default())?, [false, false, true]);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a distance out of range, [`Error::NotFinite`] for the first such particle, [`Error::Count`] for
/// more particles than a `u32` counts, [`Error::Cancelled`].
pub fn isolated(positions: Positions<'_>, params: &IsolationParams, control: &Control<'_>) -> Result<Vec<bool>, Error> {
    params.check()?;
    control.check()?;
    let n = positions.len();
    if n >= u32::MAX as usize {
        return Err(Error::Count { what: "particles", needed: n as u64, available: u64::from(u32::MAX - 1) });
    }
    let is_bad = |&i: &usize| !positions.get(i).iter().all(|v| v.is_finite());
    if let Some(index) = (0..n).into_par_iter().find_first(is_bad) {
        return Err(Error::NotFinite { index, position: positions.get(index) });
    }
    let buckets = Buckets::build(positions, 2.0 * params.distance, control);
    let found: Vec<AtomicBool> = std::iter::repeat_with(AtomicBool::default).take(n).collect();
    buckets.members.par_chunks(BLOCK).enumerate().for_each(|(block, members)| {
        if control.check().is_err() {
            return;
        }
        for (i, member) in members.iter().enumerate() {
            let is_isolated = !buckets.exceeds(block * BLOCK + i, params);
            // Every particle is a member once, so places are disjoint; the atomic only says so to the compiler.
            found[member.load(Ordering::Relaxed) as usize].store(is_isolated, Ordering::Relaxed);
        }
    });
    control.check()?;
    Ok(found.into_iter().map(AtomicBool::into_inner).collect())
}

/// Particles by the hash of their cell.
struct Buckets<'a> {
    positions: Positions<'a>,
    edge: f64,
    /// A power of two of them; a bucket begins where the last one ends.
    ends: Vec<u32>,
    members: Vec<AtomicU32>,
}

/// Cell coordinates; beyond the range of integers all are the same, which costs nothing but time.
type Cell = [i64; 3];

impl<'a> Buckets<'a> {
    fn build(positions: Positions<'a>, edge: f64, control: &Control<'_>) -> Self {
        let n = positions.len();
        let ends: Vec<AtomicU32> =
            std::iter::repeat_with(AtomicU32::default).take((n / 4 + 1).next_power_of_two()).collect();
        let mut buckets = Self { positions, edge, ends: Vec::new(), members: Vec::new() };
        let mask = ends.len() - 1;
        let each_block = |work: &(dyn Fn(usize, &AtomicU32) + Sync)| {
            (0..n.div_ceil(BLOCK)).into_par_iter().for_each(|block| {
                if control.check().is_ok() {
                    for i in block * BLOCK..((block + 1) * BLOCK).min(n) {
                        work(i, &ends[hash(buckets.cell(i)) & mask]);
                    }
                }
            });
        };
        each_block(&|_, count| {
            count.fetch_add(1, Ordering::Relaxed);
        });
        let mut end = 0;
        for count in &ends {
            end += count.load(Ordering::Relaxed);
            count.store(end, Ordering::Relaxed);
        }
        let members: Vec<AtomicU32> = std::iter::repeat_with(AtomicU32::default).take(n).collect();
        // Each bucket is filled from its end, so that what remains is its beginning: the end of the one before.
        each_block(&|i, next| {
            let place = next.fetch_sub(1, Ordering::Relaxed).wrapping_sub(1);
            // Out of range only where counting was cancelled.
            if let Some(member) = members.get(place as usize) {
                member.store(i as u32, Ordering::Relaxed);
            }
        });
        let mut ends: Vec<u32> = ends.into_iter().map(AtomicU32::into_inner).collect();
        ends.rotate_left(1);
        if let Some(last) = ends.last_mut() {
            *last = n as u32;
        }
        buckets.ends = ends;
        buckets.members = members;
        buckets
    }

    fn cell(&self, i: usize) -> Cell {
        self.positions.get(i).map(|v| floor(v / self.edge))
    }

    /// The slots of a cell's bucket, in which others may be, too.
    fn bucket(&self, cell: Cell) -> std::ops::Range<usize> {
        let at = hash(cell) & (self.ends.len() - 1);
        let start = if at == 0 { 0 } else { self.ends[at - 1] };
        start as usize..self.ends[at] as usize
    }

    /// Whether the member in this slot has more neighbors than are allowed.
    fn exceeds(&self, slot: usize, params: &IsolationParams) -> bool {
        let index = self.members[slot].load(Ordering::Relaxed) as usize;
        let place = self.positions.get(index);
        let home = self.cell(index);
        let mut found = 0;
        // The members behind come first and those before last: where thousands lie on one spot, each finds another at once.
        let bucket = self.bucket(home);
        for others in [slot + 1..bucket.end, bucket.start..slot] {
            self.count(others, home, place, params, &mut found);
        }
        if found > params.max_neighbors {
            return true;
        }
        let [xs, ys, zs] = place.map(|v| reach(v / self.edge));
        for z in zs.0..=zs.1 {
            for y in ys.0..=ys.1 {
                for x in xs.0..=xs.1 {
                    if [x, y, z] != home {
                        self.count(self.bucket([x, y, z]), [x, y, z], place, params, &mut found);
                    }
                    if found > params.max_neighbors {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Counts the members of `cell` that are near, until there are too many.
    fn count(
        &self,
        slots: std::ops::Range<usize>,
        cell: Cell,
        place: [f64; 3],
        params: &IsolationParams,
        found: &mut usize,
    ) {
        for other in &self.members[slots] {
            if *found > params.max_neighbors {
                return;
            }
            let index = other.load(Ordering::Relaxed) as usize;
            let is_near = dist_sq(place, self.positions.get(index)) < params.distance * params.distance;
            // Two cells may share a bucket, and nobody is to be counted twice.
            if is_near && self.cell(index) == cell {
                *found += 1;
            }
        }
    }
}

fn dist_sq(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// The first and last cell along an axis that hold anything within half a cell of `u`, with what rounding may take from
/// both sides. From 2⁵³ cells on neighboring numbers are a cell apart and only coincident particles are near, so the
/// margin need not grow further.
fn reach(u: f64) -> (i64, i64) {
    let margin = 0.5 + (1e-6 + u.abs() * (2.0 * f64::EPSILON)).min(2.0);
    (floor(u - margin), floor(u + margin))
}

/// The largest integer not above `v`, or the last integer there is: for all particles alike. Without the call that
/// `f64::floor` is on the oldest x86-64.
#[inline(always)]
fn floor(v: f64) -> i64 {
    let cut = v as i64;
    cut.saturating_sub(i64::from(cut as f64 > v))
}

/// Neighbors along x share a cache line.
fn hash([x, y, z]: Cell) -> usize {
    let row =
        (y as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (z as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(31);
    let row = row.wrapping_mul(0xd6e8_feb8_6659_fd93);
    ((row >> 29).wrapping_add(x as u64)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(positions: Positions<'_>, distance: f64, max_neighbors: usize) -> Vec<bool> {
        isolated(positions, &IsolationParams { distance, max_neighbors }, &Control::default()).unwrap()
    }

    fn brute(positions: Positions<'_>, distance: f64, max_neighbors: usize) -> Vec<bool> {
        let near = |i, j| i != j && dist_sq(positions.get(i), positions.get(j)) < distance * distance;
        let n = positions.len();
        (0..n).map(|i| (0..n).filter(|&j| near(i, j)).count() <= max_neighbors).collect()
    }

    fn cloud(n: usize, reach: f64, offset: [f64; 3]) -> Vec<[f64; 3]> {
        let mut state = 1u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| offset.map(|o| o + reach * (unit() - 0.5))).collect()
    }

    #[test]
    fn equals_comparing_all_with_all() {
        // From a fluid to a gas, near and far, with distances on the grid of the numbers.
        for (reach, offset) in [(3.0, 0.0), (12.0, -5.0), (30.0, 1e6), (30.0, 2e15), (30.0, -4e15), (200.0, 1e17)] {
            let positions = cloud(1500, reach, [offset, -offset, 0.5 * offset]);
            for max_neighbors in [0, 1, 3, 20] {
                let view = Positions::from(&positions);
                let found = find(view, 1.0, max_neighbors);
                assert_eq!(found, brute(view, 1.0, max_neighbors), "{reach} {offset} {max_neighbors}");
            }
        }
        // Where a cell is a few steps of the numbers wide, and its edge is none of them.
        for (reach, offset) in [(4.0, 1e15), (4.0, -7e14), (4.0, 2.3e15)] {
            let positions = cloud(1500, reach, [offset; 3]);
            let view = Positions::from(&positions);
            assert_eq!(find(view, 0.3, 1), brute(view, 0.3, 1), "{offset}");
        }
        let sparse = cloud(1500, 12.0, [0.0; 3]);
        let count = find((&sparse).into(), 1.0, 0).iter().filter(|&&i| i).count();
        assert!((1..1499).contains(&count), "both kinds were seen: {count}");
    }

    #[test]
    fn a_lattice_is_decided_by_less_than() {
        let positions: Vec<[f32; 3]> =
            (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(|v| v as f32 * 0.5)).collect();
        assert!(find((&positions).into(), 0.5, 0).iter().all(|&i| i), "exactly so far apart are no neighbors");
        assert!(find((&positions).into(), 0.500_001, 0).iter().all(|&i| !i));
        // Three neighbors at a corner, four along an edge, five on a face, six within.
        let count = |most| find((&positions).into(), 0.6, most).iter().filter(|&&i| i).count();
        assert_eq!([2, 3, 4, 5, 6].map(count), [0, 8, 8 + 12 * 8, 8 + 12 * 8 + 6 * 64, 1000]);
    }

    #[test]
    fn few_particles() {
        assert!(find((&Vec::<[f32; 3]>::new()).into(), 1.0, 0).is_empty());
        assert_eq!(find((&[[3.0f32; 3]]).into(), 1.0, 0), [true]);
        assert_eq!(find((&[[3.0f32; 3]; 2]).into(), 1.0, 0), [false; 2], "coincident ones are neighbors");
        assert_eq!(find((&[[3.0f32; 3]; 2]).into(), 1.0, 1), [true; 2]);
        let far = [[f64::MAX, 0.0, -f64::MAX], [f64::MAX, 0.0, -f64::MAX], [0.0; 3], [-f64::MAX; 3]];
        assert_eq!(find((&far).into(), 1e-100, 0), [false, false, true, true]);
    }

    #[test]
    fn coincident_crowds_in_one_cell_end_soon() {
        // Two crowds within one bucket: whoever looks through all of the other one first does not end.
        let crowd = 200_000;
        let mut positions = vec![[0.1f32; 3]; crowd];
        positions.extend(vec![[1.9f32; 3]; crowd]);
        positions.push([1.0, 1.0, 1.0]);
        assert!(find((&positions).into(), 1.0, 0)[..2 * crowd].iter().all(|&i| !i));
    }

    #[test]
    fn strays_over_all_the_world_are_found() {
        let mut positions = cloud(20_000, 1e12, [0.0; 3]);
        positions.extend(cloud(1000, 5.0, [0.0; 3]));
        let found = find((&positions).into(), 1.0, 0);
        assert!(found[..20_000].iter().all(|&i| i));
        assert_eq!(found[20_000..], brute((&positions[20_000..]).into(), 1.0, 0));
    }

    #[test]
    fn bad_input_and_cancellation_are_errors() {
        let call = |positions: &[[f32; 3]], distance| {
            isolated(positions.into(), &IsolationParams { distance, max_neighbors: 0 }, &Control::default())
        };
        for distance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-200, 1e200] {
            assert!(matches!(call(&[[0.0; 3]], distance), Err(Error::Parameter { name: "distance", .. })));
        }
        let mut positions = vec![[0.0; 3]; 10_000];
        positions[8000][1] = f32::NAN;
        positions[9000][2] = f32::INFINITY;
        assert!(matches!(call(&positions, 1.0), Err(Error::NotFinite { index: 8000, .. })));
        let token = crate::CancelToken::new();
        token.cancel();
        let control = Control { cancel: Some(&token), on_stage: None };
        let params = IsolationParams::of(&Params::new(0.025));
        assert!((params.distance - 0.1).abs() < 1e-12);
        assert_eq!(isolated((&[[0.0f32; 3]]).into(), &params, &control), Err(Error::Cancelled));
    }
}
