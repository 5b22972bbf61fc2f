//! What vertices get from the particles around them: normals and interpolated attributes.
//!
//! An octet's vertices lie in its bricks or up to one node above, or so many more around as is said, so its candidates serve
//! all of them; a vector holds 16
//! vertices of one brick. The order of the sums is canonical, as for node values.
//!
//! Source: attributes are the mean of the particles, weighted by what each contributes to the field (Shepard 1968; with the SPH
//! field Σ V_j W a_j / Σ V_j W), the mean that renderers expect of a velocity; or the nearest particle's.

use std::ops::Range;

use super::{Scratch, brick_origin, corner, node_offset};
use crate::{
    Attribute, Carry,
    field::{Field, Row, normal},
    lattice::{BRICK, Coord, OCTET},
    lookup::{
        cells::Cells,
        gather::{Box3, Candidates, MAX_COLUMNS},
    },
    math::{
        bits::ones,
        simd::{Kernel, LANES, Simd},
    },
};

/// The vertices of one octet, and the particles that they depend on.
pub(crate) struct OctetVertices<'a> {
    pub(crate) cells: &'a Cells,
    /// Distance of neighbouring nodes in support units.
    pub(crate) step: f64,
    pub(crate) octet: Coord,
    /// Vertices of each brick.
    pub(crate) counts: [u32; 8],
    /// How many steps vertices may lie outside of the cells between their brick's nodes and those above.
    pub(crate) beyond: i32,
    /// Node that `vertices` count from.
    pub(crate) origin: Coord,
    /// One over the support radius in world units.
    pub(crate) per_unit: f64,
    pub(crate) vertices: &'a [[f32; 3]],
    pub(crate) scratch: &'a mut Scratch,
}

impl OctetVertices<'_> {
    /// Calls `work` for every 16 vertices, with their range, their positions in the octet's frame and the candidates.
    #[inline(always)]
    fn for_each_group<S: Simd>(
        self,
        s: S,
        columns: &[&[f32]],
        reach: Option<usize>,
        mut work: impl FnMut(Range<usize>, [S::F; 3], &Candidates),
    ) {
        let Scratch { octet: near, brick: nearer, .. } = self.scratch;
        // A vertex on an upward edge of the last node lies up to one step above it.
        let place = Box3 {
            low: [node_offset(-self.beyond, self.step); 3],
            high: [node_offset(OCTET + self.beyond, self.step); 3],
        };
        near.gather(s, self.cells, columns, reach, corner(self.octet, self.step), place);
        let shift: [f64; 3] = std::array::from_fn(|a| {
            (f64::from(self.octet[a]) * f64::from(OCTET) - f64::from(self.origin[a])) * self.step
        });
        let mut first = 0;
        for brick in ones(self.counts.iter().enumerate().fold(0, |set, (b, &n)| set | u64::from(n > 0) << b)) {
            let low = brick_origin(brick);
            let place = Box3 {
                low: [0, 1, 2].map(|a| node_offset(low[a] - self.beyond, self.step)),
                high: [0, 1, 2].map(|a| node_offset(low[a] + BRICK + self.beyond, self.step)),
            };
            nearer.refine(s, near, columns.len(), reach, place);
            let end = first + self.counts[brick] as usize;
            for start in (first..end).step_by(LANES) {
                let range = start..(start + LANES).min(end);
                let mut lanes = [[0.0; LANES]; 3];
                for lane in 0..LANES {
                    // A short last group repeats its last vertex.
                    let vertex = self.vertices[(start + lane).min(end - 1)];
                    for a in 0..3 {
                        lanes[a][lane] = (f64::from(vertex[a]) * self.per_unit - shift[a]) as f32;
                    }
                }
                work(range, [s.load(&lanes[0]), s.load(&lanes[1]), s.load(&lanes[2])], nearer);
            }
            first = end;
        }
    }
}

/// Distance vectors and squared distances from a candidate to 16 points.
///
/// Without a closure over the axes: the array's own functions need not be inlined, and then run without the vector unit's
/// instructions, many times slower.
#[inline(always)]
pub(super) fn distance<S: Simd>(s: S, at: [S::F; 3], near: [&[f32]; 3], particle: usize) -> ([S::F; 3], S::F) {
    let d = [
        s.sub(at[0], s.splat(near[0][particle])),
        s.sub(at[1], s.splat(near[1][particle])),
        s.sub(at[2], s.splat(near[2][particle])),
    ];
    let dist_sq = s.add(s.add(s.mul(d[0], d[0]), s.mul(d[1], d[1])), s.mul(d[2], d[2]));
    (d, dist_sq)
}

/// Unit normals of an octet's vertices.
pub(crate) struct Normals<'a, F> {
    pub(crate) of: OctetVertices<'a>,
    pub(crate) field: &'a F,
    pub(crate) columns: &'a [&'a [f32]],
    pub(crate) to: &'a mut [[f32; 3]],
}

impl<F: Field> Kernel for Normals<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { of, field, columns, to } = self;
        of.for_each_group(s, columns, F::REACH, |range, at, near| {
            let columns = near.columns(F::COLUMNS);
            let mut slope = field.flat(s);
            for particle in 0..near.len() {
                let (d, dist_sq) = distance(s, at, near.axes(), particle);
                field.add_slope(s, &mut slope, d, dist_sq, Row { columns: &columns, particle });
            }
            let mut bend = field.bend(s, &slope);
            if F::BENDS {
                for particle in 0..near.len() {
                    let (d, dist_sq) = distance(s, at, near.axes(), particle);
                    field.add_bend(s, &mut bend, d, dist_sq, Row { columns: &columns, particle });
                }
            }
            let gradient = field.gradient(s, slope, bend);
            let mut lanes = [[0.0; LANES]; 3];
            for (lanes, axis) in lanes.iter_mut().zip(normal(s, gradient)) {
                s.store(axis, lanes);
            }
            for (lane, to) in to[range].iter_mut().enumerate() {
                *to = std::array::from_fn(|a| lanes[a][lane]);
            }
        });
    }
}

/// One attribute, carried to an octet's vertices.
pub(crate) struct Interpolate<'a, F> {
    pub(crate) of: OctetVertices<'a>,
    pub(crate) field: &'a F,
    pub(crate) columns: &'a [&'a [f32]],
    pub(crate) attribute: &'a Attribute<'a>,
    /// As many values for each vertex as the attribute has components.
    pub(crate) to: &'a mut [f32],
}

/// Components summed side by side.
const BATCH: usize = 4;

impl<F: Field> Kernel for Interpolate<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { of, field, columns, attribute, to } = self;
        let components = attribute.components;
        // The caller's index is one more column.
        let mut with_index = [&[][..]; MAX_COLUMNS];
        with_index[..F::COLUMNS].copy_from_slice(&columns[..F::COLUMNS]);
        with_index[F::COLUMNS] = of.cells.order_bits();
        of.for_each_group(s, &with_index[..=F::COLUMNS], F::REACH, |range, at, near| {
            let columns = near.columns(F::COLUMNS + 1);
            let index = columns[F::COLUMNS];
            if attribute.carry == Carry::Nearest {
                for (vertex, particle) in range.zip(nearest(s, at, near)) {
                    let Some(bits) = index.get(particle) else { return };
                    let from = &attribute.values[bits.to_bits() as usize * components..][..components];
                    to[vertex * components..][..components].copy_from_slice(from);
                }
                return;
            }
            if attribute.carry == Carry::NormalSpeed {
                let mut lanes = [0.0; LANES];
                s.store(normal_speed(s, field, at, near, &columns, attribute.values), &mut lanes);
                for (vertex, speed) in range.zip(lanes) {
                    to[vertex] = speed;
                }
                return;
            }
            for first in (0..components).step_by(BATCH) {
                let batch = BATCH.min(components - first);
                let (mut total, mut sums) = (s.splat(f32::MIN_POSITIVE), [s.splat(0.0); BATCH]);
                for particle in 0..near.len() {
                    let (d, dist_sq) = distance(s, at, near.axes(), particle);
                    let w = field.weight(s, d, dist_sq, Row { columns: &columns, particle });
                    total = s.add(total, w);
                    let from = index[particle].to_bits() as usize * components + first;
                    for (sum, &value) in sums.iter_mut().zip(&attribute.values[from..from + batch]) {
                        *sum = s.add(*sum, s.mul(w, s.splat(value)));
                    }
                }
                let mut lanes = [0.0; LANES];
                for (c, sum) in sums.into_iter().enumerate().take(batch) {
                    s.store(s.div(sum, total), &mut lanes);
                    for (vertex, value) in range.clone().zip(lanes) {
                        to[vertex * components + first + c] = value;
                    }
                }
            }
        });
    }
}

/// Speed of the surface along its outward normal at 16 points; 0 where there is no gradient. The last column is the
/// caller's index of a particle.
#[inline(always)]
fn normal_speed<S: Simd, F: Field>(
    s: S,
    field: &F,
    at: [S::F; 3],
    near: &Candidates,
    columns: &[&[f32]; MAX_COLUMNS],
    velocities: &[f32],
) -> S::F {
    let zero = s.splat(0.0);
    let mut slope = field.flat(s);
    let (mut total, mut mean, mut rate) = (s.splat(f32::MIN_POSITIVE), [zero; 3], zero);
    for particle in 0..near.len() {
        let (d, dist_sq) = distance(s, at, near.axes(), particle);
        let row = Row { columns, particle };
        field.add_slope(s, &mut slope, d, dist_sq, row);
        let v = &velocities[columns[F::COLUMNS][particle].to_bits() as usize * 3..][..3];
        if F::ADDITIVE {
            let mut own = field.flat(s);
            field.add_slope(s, &mut own, d, dist_sq, row);
            let bend = field.bend(s, &own);
            let own = field.gradient(s, own, bend);
            rate = s.add(rate, along(s, own, v));
        } else {
            let w = field.weight(s, d, dist_sq, row);
            total = s.add(total, w);
            mean[0] = s.add(mean[0], s.mul(w, s.splat(v[0])));
            mean[1] = s.add(mean[1], s.mul(w, s.splat(v[1])));
            mean[2] = s.add(mean[2], s.mul(w, s.splat(v[2])));
        }
    }
    let mut bend = field.bend(s, &slope);
    if F::BENDS {
        for particle in 0..near.len() {
            let (d, dist_sq) = distance(s, at, near.axes(), particle);
            field.add_bend(s, &mut bend, d, dist_sq, Row { columns, particle });
        }
    }
    let gradient = field.gradient(s, slope, bend);
    let n = normal(s, gradient);
    if F::ADDITIVE {
        let size_sq = dot(s, gradient, gradient);
        let size = s.sqrt(s.max(size_sq, s.splat(f32::MIN_POSITIVE)));
        s.div(s.sub(zero, rate), size)
    } else {
        s.div(dot(s, mean, n), total)
    }
}

/// Product of two vectors at 16 points.
#[inline(always)]
fn dot<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.add(s.add(s.mul(a[0], b[0]), s.mul(a[1], b[1])), s.mul(a[2], b[2]))
}

/// The same with one vector for all.
#[inline(always)]
fn along<S: Simd>(s: S, a: [S::F; 3], v: &[f32]) -> S::F {
    dot(s, a, [s.splat(v[0]), s.splat(v[1]), s.splat(v[2])])
}

/// The nearest candidate of each of 16 points; of equally near ones the first in canonical order.
#[inline(always)]
fn nearest<S: Simd>(s: S, at: [S::F; 3], near: &Candidates) -> [usize; LANES] {
    let (mut least, mut found) = (s.splat(f32::MAX), s.splat(0.0));
    for particle in 0..near.len() {
        let (_, dist_sq) = distance(s, at, near.axes(), particle);
        let closer = s.gt(least, dist_sq);
        least = s.select(closer, dist_sq, least);
        found = s.select(closer, s.splat(f32::from_bits(particle as u32)), found);
    }
    let mut lanes = [0.0; LANES];
    s.store(found, &mut lanes);
    lanes.map(|bits| bits.to_bits() as usize)
}
