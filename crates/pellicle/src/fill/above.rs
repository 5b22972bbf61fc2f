//! Which of some points a field is above a threshold at.
//!
//! Source: this project; see `simd`.

use super::{Scratch, brick_box, brick_origin, corner, node_offset, simd::sum_all};
use crate::{
    field::Field,
    lattice::{BRICK, Coord},
    lookup::{cells::Cells, gather::Box3},
    math::simd::{Kernel, LANES, Simd},
};

/// Points within a brick's cells.
pub(crate) struct Points<'a> {
    pub(crate) cells: &'a Cells,
    pub(crate) columns: &'a [&'a [f32]],
    /// Distance of neighbouring nodes in support units.
    pub(crate) step: f64,
    pub(crate) octet: Coord,
    pub(crate) brick: usize,
    /// In half steps from the octet's corner; near ones side by side.
    pub(crate) points: &'a [[i32; 3]],
    pub(crate) threshold: f32,
    pub(crate) scratch: &'a mut Scratch,
    /// A bit for each point.
    pub(crate) above: &'a mut [u64],
}

/// [`Points`] with a field, of those that tell where they are [dense](Field::is_dense); only there a point counts.
pub(crate) struct Above<'a, F> {
    pub(crate) field: &'a F,
    pub(crate) of: Points<'a>,
}

impl<F: Field> Kernel for Above<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        if !F::WEIGHS {
            return;
        }
        let Self { field, of } = self;
        let Points { cells, columns, step, brick, .. } = of;
        let Scratch { octet: near, brick: nearer, .. } = of.scratch;
        let mut place = brick_box(brick, step);
        for a in 0..3 {
            place.high[a] = node_offset(brick_origin(brick)[a] + BRICK, step);
        }
        near.gather(s, cells, columns, F::REACH, corner(of.octet, step), place);
        for (i, group) in of.points.chunks(LANES).enumerate() {
            let mut lanes = [[0.0; LANES]; 3];
            let mut place = Box3 { low: [f32::MAX; 3], high: [f32::MIN; 3] };
            for a in 0..3 {
                for lane in 0..LANES {
                    // A short last group repeats its last point.
                    let at = node_offset(group[lane.min(group.len() - 1)][a], 0.5 * step);
                    lanes[a][lane] = at;
                    (place.low[a], place.high[a]) = (place.low[a].min(at), place.high[a].max(at));
                }
            }
            nearer.refine(s, near, F::COLUMNS, F::REACH, place);
            let at = [s.load(&lanes[0]), s.load(&lanes[1]), s.load(&lanes[2])];
            let sums = sum_all(s, field, nearer, at);
            let dense = field.is_dense(s, &sums);
            let above = s.gt(field.value(s, sums), s.splat(of.threshold));
            of.above[i / 4] |= u64::from(above & dense) << (LANES * (i % 4));
        }
    }
}
