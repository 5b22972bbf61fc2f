//! What vertices get from the particles around them: normals and interpolated attributes.
//!
//! An octet's vertices lie in its bricks or up to one node above, so its candidates serve all of them; a vector holds 16
//! vertices of one brick. The order of the sums is canonical, as for node values.
//!
//! Source: attributes are the kernel-weighted mean Σ V_j W a_j / Σ V_j W (Shepard 1968 with SPH weights), the mean that
//! renderers expect of a velocity.

use std::ops::Range;

use super::{Scratch, brick_origin, corner, node_offset};
use crate::{
    Attribute,
    field::{Field, Row, kernel::half_spline},
    lattice::{BRICK, Coord, OCTET},
    lookup::{
        cells::Cells,
        gather::{Box3, Candidates},
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
        mut work: impl FnMut(Range<usize>, [S::F; 3], &Candidates),
    ) {
        let Scratch { octet: near, brick: nearer, .. } = self.scratch;
        // A vertex on an upward edge of the last node lies up to one step above it.
        let high = [node_offset(OCTET, self.step); 3];
        near.gather(s, self.cells, columns, corner(self.octet, self.step), Box3 { low: [0.0; 3], high });
        let shift: [f64; 3] = std::array::from_fn(|a| {
            (f64::from(self.octet[a]) * f64::from(OCTET) - f64::from(self.origin[a])) * self.step
        });
        let mut first = 0;
        for brick in ones(self.counts.iter().enumerate().fold(0, |set, (b, &n)| set | u64::from(n > 0) << b)) {
            let low = brick_origin(brick);
            let place = Box3 {
                low: low.map(|n| node_offset(n, self.step)),
                high: low.map(|n| node_offset(n + BRICK, self.step)),
            };
            nearer.refine(s, near, columns.len(), place);
            let end = first + self.counts[brick] as usize;
            for start in (first..end).step_by(LANES) {
                let range = start..(start + LANES).min(end);
                let at = std::array::from_fn(|a| {
                    // A short last group repeats its last vertex.
                    let lanes: [f32; LANES] = std::array::from_fn(|lane| {
                        let vertex = self.vertices[(start + lane).min(end - 1)];
                        (f64::from(vertex[a]) * self.per_unit - shift[a]) as f32
                    });
                    s.load(&lanes)
                });
                work(range, at, nearer);
            }
            first = end;
        }
    }
}

/// Distance vectors and squared distances from a candidate to 16 points.
#[inline(always)]
fn distance<S: Simd>(s: S, at: [S::F; 3], near: [&[f32]; 3], particle: usize) -> ([S::F; 3], S::F) {
    let d: [S::F; 3] = std::array::from_fn(|a| s.sub(at[a], s.splat(near[a][particle])));
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
        of.for_each_group(s, columns, |range, at, near| {
            let columns = near.columns(F::COLUMNS);
            let mut gradient = [s.splat(0.0); 3];
            for particle in 0..near.len() {
                let (d, dist_sq) = distance(s, at, near.axes(), particle);
                field.add_gradient(s, &mut gradient, d, dist_sq, Row { columns: &columns, particle });
            }
            let mut lanes = [[0.0; LANES]; 3];
            for (lanes, axis) in lanes.iter_mut().zip(field.normal(s, gradient)) {
                s.store(axis, lanes);
            }
            for (lane, to) in to[range].iter_mut().enumerate() {
                *to = std::array::from_fn(|a| lanes[a][lane]);
            }
        });
    }
}

/// One attribute, interpolated to an octet's vertices.
pub(crate) struct Interpolate<'a> {
    pub(crate) of: OctetVertices<'a>,
    /// Volume weight of every particle.
    pub(crate) weights: &'a [f32],
    pub(crate) attribute: &'a Attribute<'a>,
    /// As many values for each vertex as the attribute has components.
    pub(crate) to: &'a mut [f32],
}

/// Components summed side by side.
const BATCH: usize = 4;

impl Kernel for Interpolate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { of, weights, attribute, to } = self;
        let components = attribute.components;
        let columns = [weights, of.cells.order_bits()];
        of.for_each_group(s, &columns, |range, at, near| {
            let [weight, index] = near.first_columns();
            for first in (0..components).step_by(BATCH) {
                let batch = BATCH.min(components - first);
                let (mut total, mut sums) = (s.splat(f32::MIN_POSITIVE), [s.splat(0.0); BATCH]);
                for particle in 0..near.len() {
                    let (_, dist_sq) = distance(s, at, near.axes(), particle);
                    let w = s.mul(s.splat(weight[particle]), half_spline(s, dist_sq));
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
