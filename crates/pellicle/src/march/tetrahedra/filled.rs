//! The bricks that road A has filled near the surface of particles, as a source.
//!
//! A brick that is not filled has one sign, that of the nodes that touch it; the band sees to it that they agree, through
//! faces, edges and corners. So no crossed edge of a cell leads to a brick without values, and splits whose nodes are the
//! lattice's own, five and six, need nothing more. Those with nodes in the middles of cells would need values beyond the
//! band.
//!
//! Source: this project.

use super::source::{ABSENT, Presence, Source};
use crate::{
    bricks::store::{Octet, Store},
    fill::{Values, brick_origin},
    lattice::{Coord, OCTET},
    lookup::directory::Cursor,
    math::bits::ones,
};

/// Filled bricks. Place is in units of cells times the spacing, counted from a node.
pub(crate) struct Filled<'a> {
    store: &'a Store<1>,
    iso: f64,
    spacing: f64,
    origin: Coord,
    /// Octet and brick of each.
    bricks: Vec<(u32, u8)>,
    /// The first brick of each octet.
    first: Vec<u32>,
}

impl<'a> Filled<'a> {
    pub(crate) fn new(store: &'a Store<1>, iso: f64, spacing: f64, origin: Coord) -> Self {
        let (mut bricks, mut first) = (Vec::with_capacity(store.len()), Vec::with_capacity(store.octets.len()));
        for octet in &store.octets {
            first.push(bricks.len() as u32);
            bricks.extend(ones(octet.filled.into()).map(|brick| (octet.index, brick as u8)));
        }
        Self { store, iso, spacing, origin, bricks, first }
    }

    fn octet(&self, brick: usize) -> (&'a Octet, usize) {
        let (octet, index) = self.bricks[brick];
        (&self.store.octets[octet as usize], index.into())
    }

    /// Values of a brick at offset `d` from another, if it is filled.
    fn values_at(&self, brick: usize, d: [i32; 3]) -> Option<&'a Values> {
        let (octet, index) = self.octet(self.neighbour(brick, d)?);
        Some(self.store.values(octet, index))
    }
}

impl Source for Filled<'_> {
    fn bricks(&self) -> usize {
        self.bricks.len()
    }

    fn first(&self, brick: usize) -> Coord {
        let (octet, index) = self.octet(brick);
        let within = brick_origin(index);
        std::array::from_fn(|a| octet.at[a] * OCTET + within[a])
    }

    fn neighbour(&self, brick: usize, d: [i32; 3]) -> Option<usize> {
        if d == [0; 3] {
            return Some(brick);
        }
        let (octet, index) = self.octet(brick);
        let at: Coord = std::array::from_fn(|a| (index >> a & 1) as i32 + d[a]);
        let step = at.map(|v| v.div_euclid(2));
        let index = (0..3).fold(0, |index, a| index | (at[a].rem_euclid(2) as usize) << a);
        let other = if step == [0; 3] {
            octet
        } else {
            self.store.find(&mut Cursor::default(), std::array::from_fn(|a| octet.at[a] + step[a]))?
        };
        let below = other.filled & ((1 << index) - 1);
        (other.filled >> index & 1 != 0).then(|| (self.first[other.index as usize] + below.count_ones()) as usize)
    }

    fn values(&self, brick: usize, _: usize, low: i32, side: usize, to: &mut [f64]) {
        let mut near: [Option<Option<&Values>>; 27] = [None; 27];
        for (n, to) in to.iter_mut().enumerate() {
            let at = [n % side, n / side % side, n / (side * side)].map(|v| v as i32 + low);
            let d = at.map(|v| v.div_euclid(4));
            let index = ((d[0] + 1) + 3 * ((d[1] + 1) + 3 * (d[2] + 1))) as usize;
            let values = *near[index].get_or_insert_with(|| self.values_at(brick, d));
            let [x, y, z] = at.map(|v| v.rem_euclid(4) as usize);
            *to = values.map_or(ABSENT, |values| f64::from(values[x + 4 * (y + 4 * z)]) - self.iso);
        }
    }

    fn signs(&self, brick: usize, _: usize) -> u64 {
        let (octet, index) = self.octet(brick);
        self.store.set(octet, index, 0).unwrap_or(0)
    }

    fn presence(&self, _: usize) -> Presence {
        Presence::ALL
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| (at[a] - f64::from(self.origin[a])) * self.spacing)
    }

    fn is_left_handed(&self) -> bool {
        false
    }
}
