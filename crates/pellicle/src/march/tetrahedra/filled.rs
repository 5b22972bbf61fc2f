//! The bricks that road A has filled near the surface of particles, as a source.
//!
//! A brick that is not filled has one sign, that of the nodes that touch it; the band sees to it that they agree, through
//! faces, edges and corners. So no crossed edge of a cell leads to a brick without values, and splits whose nodes are the
//! lattice's own, five and six, need nothing more.
//!
//! Those of the body-centred lattice have nodes in the middles of cells, too, worth the mean of the corners. The middle of a
//! cell that is crossed may differ from that of the next cell, which is not, and may reach into a brick without values.
//! [`Filled::missing`] names the bricks that are then to be filled: all that any neighbour of a crossed node needs. So
//! a vertex sees the same values whatever the band has left out.
//!
//! Source: this project.

use rayon::prelude::*;

use super::{
    source::{ABSENT, Presence, Source},
    star::{BLOCK, IN_BLOCK, SIDE, block_index},
};
use crate::{
    bricks::store::{Octet, Store},
    fill::{brick_origin, eighths::Known},
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
    fn values_at(&self, brick: usize, d: [i32; 3]) -> Option<Known<'a>> {
        let (octet, index) = self.octet(self.neighbour(brick, d)?);
        Some(self.store.values(octet, index))
    }

    /// Values of corners; [`ABSENT`] in bricks that are not filled.
    fn corners(&self, brick: usize, low: i32, side: usize, to: &mut [f64]) {
        let mut near: [Option<Option<Known<'_>>>; 27] = [None; 27];
        for (n, to) in to.iter_mut().enumerate() {
            let at = [n % side, n / side % side, n / (side * side)].map(|v| v as i32 + low);
            let d = at.map(|v| v.div_euclid(4));
            let index = ((d[0] + 1) + 3 * ((d[1] + 1) + 3 * (d[2] + 1))) as usize;
            let values = *near[index].get_or_insert_with(|| self.values_at(brick, d));
            let [x, y, z] = at.map(|v| v.rem_euclid(4) as usize);
            *to = values.map_or(ABSENT, |values| f64::from(values.at(x + 4 * (y + 4 * z))) - self.iso);
        }
    }

    /// Bricks, counted in bricks, that have to be filled before nodes in the middles of cells are asked for.
    pub(crate) fn missing(&self) -> Vec<Coord> {
        let of_bricks = (0..self.bricks.len()).into_par_iter().flat_map_iter(|brick| self.missing_around(brick));
        let mut all: Vec<Coord> = of_bricks.collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Those that the crossed nodes of a brick miss.
    fn missing_around(&self, brick: usize) -> Vec<Coord> {
        let mut corners = [0.0; WIDE * WIDE * WIDE];
        self.corners(brick, -1, WIDE, &mut corners);
        let is_any = |test: fn(f64) -> bool| corners.iter().any(|&v| test(v));
        let mut found = Vec::new();
        if !(is_any(|v| v == ABSENT) && is_any(|v| v > 0.0) && is_any(|v| v <= 0.0 && v != ABSENT)) {
            return found;
        }
        let first = self.first(brick);
        let mut seen = [[Seen::default(); BLOCK]; 2];
        for n in 0..BLOCK {
            let at = [n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)];
            for (site, seen) in seen.iter_mut().enumerate() {
                seen[n] = Seen::of(&corners, site, at);
            }
        }
        for n in 0..128 {
            let (site, at) = (n / 64, [n & 3, n >> 2 & 3, n >> 4 & 3].map(|v| v as i32));
            let index = block_index(at);
            let Some(sign) = seen[site][index].is_inside else { continue };
            let around = IN_BLOCK[site].map(|(site, further)| (site, index.wrapping_add_signed(further)));
            if around.iter().all(|&(site, there)| seen[site][there].is_inside != Some(!sign)) {
                continue;
            }
            for (site, there) in around {
                let low = [there % SIDE, there / SIDE % SIDE, there / (SIDE * SIDE)].map(|v| v as i32 - 1);
                for c in ones(seen[site][there].unknown.into()) {
                    let d = [c & 1, c >> 1 & 1, c >> 2].map(|v| v as i32);
                    found.push(std::array::from_fn(|a| (first[a] + low[a] + d[a]).div_euclid(4)));
                }
            }
        }
        found
    }
}

/// Corners along an axis that a brick's nodes, their neighbours and the cells of these take, from one below.
const WIDE: usize = 7;

/// A node, as far as it is known: a corner, or a cell's middle that stands for its corners.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// The corners that have no value.
    unknown: u8,
    /// Its sign; that of any of its corners where others have no value. `None` where none has.
    is_inside: Option<bool>,
}

impl Seen {
    /// The node of a site at a place counted from one below a brick's first.
    fn of(corners: &[f64; WIDE * WIDE * WIDE], site: usize, at: [usize; 3]) -> Self {
        let corner = |c: usize| corners[at[0] + (c & 1) + WIDE * (at[1] + (c >> 1 & 1) + WIDE * (at[2] + (c >> 2)))];
        if site == 0 {
            let is_known = corner(0) != ABSENT;
            return Self { unknown: u8::from(!is_known), is_inside: is_known.then_some(corner(0) > 0.0) };
        }
        let mut of_cell = [0.0; 8];
        let (mut unknown, mut is_inside) = (0, None);
        for (c, to) in of_cell.iter_mut().enumerate() {
            *to = corner(c);
            if *to == ABSENT {
                unknown |= 1 << c;
            } else {
                is_inside = Some(*to > 0.0);
            }
        }
        if unknown == 0 {
            is_inside = Some(mean(&of_cell) > 0.0);
        }
        Self { unknown, is_inside }
    }
}

/// Value of a cell's middle.
fn mean(c: &[f64; 8]) -> f64 {
    // In pairs, as for volumes.
    0.125 * ((c[0] + c[7]) + (c[1] + c[6]) + ((c[2] + c[5]) + (c[3] + c[4])))
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

    fn values(&self, brick: usize, site: usize, low: i32, side: usize, to: &mut [f64]) {
        if site == 0 {
            return self.corners(brick, low, side, to);
        }
        let mut corners = [0.0; WIDE * WIDE * WIDE];
        let wide = side + 1;
        let corners = &mut corners[..wide * wide * wide];
        self.corners(brick, low, wide, corners);
        for (n, to) in to.iter_mut().enumerate() {
            let at = [n % side, n / side % side, n / (side * side)];
            let mut of_cell = [0.0; 8];
            for (c, to) in of_cell.iter_mut().enumerate() {
                *to = corners[at[0] + (c & 1) + wide * (at[1] + (c >> 1 & 1) + wide * (at[2] + (c >> 2)))];
            }
            *to = mean(&of_cell);
        }
    }

    fn signs(&self, brick: usize, site: usize) -> u64 {
        let (octet, index) = self.octet(brick);
        let corners = self.store.set(octet, index, 0).unwrap_or(0);
        if site == 0 {
            return corners;
        }
        let mut values = [0.0; 64];
        self.values(brick, 1, 0, 4, &mut values);
        // A cell that lacks a value has one sign, also that of its first corner.
        let known = values.iter().enumerate().fold(0, |set, (n, &v)| set | u64::from(v != ABSENT) << n);
        values.iter().enumerate().fold(corners & !known, |set, (n, &v)| set | u64::from(v > 0.0) << n)
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
