//! Classify, count, sum: where every octet's vertices and triangles will go.
//!
//! Source: this project; see [`super`].

use rayon::prelude::*;

use super::{above, signs};
use crate::{
    Error,
    bricks::{
        marks::Marks,
        store::{Octet, Store, grow},
    },
    lattice::morton,
    march::tables::COUNTS,
    math::{
        bits::{corner_sets, ones, transpose8},
        ranges::{PerItem, for_each_part},
        simd::{Kernel, Simd, Unit},
    },
};

/// Crossed edges of one brick along x, y, z, and the number of its first vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Crossings {
    pub(crate) edges: [u64; 3],
    pub(crate) base: u32,
}

impl Crossings {
    /// Number of vertices.
    pub(crate) fn vertices(&self) -> u32 {
        self.edges.iter().map(|set| set.count_ones()).sum()
    }
}

/// One octet that has crossings or triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Its index in the store.
    pub(crate) octet: u32,
    pub(crate) first_vertex: u32,
    pub(crate) first_triangle: u64,
}

/// A counted surface: all that emitting needs besides signs and values. Reusable.
#[derive(Default)]
pub(crate) struct Counted {
    /// In Morton order, with an end that holds the totals.
    pub(crate) parts: Vec<Part>,
    /// Crossings of the filled bricks, octet after octet of the store.
    crossings: Vec<Crossings>,
    /// Where each octet's begin, and the end.
    first: Vec<u32>,
    triangles: Vec<u32>,
    order: Vec<(u128, u32)>,
}

/// The eight bits of each of 64 cells, by transposing the eight corner sets byte by byte.
#[inline(always)]
pub(crate) fn cases(corners: &[u64; 8]) -> [[u8; 8]; 8] {
    std::array::from_fn(|group| {
        let rows = corners.map(|set| (set >> (8 * group)) as u8);
        transpose8(u64::from_le_bytes(rows)).to_le_bytes()
    })
}

/// Cells whose corners have both signs.
#[inline(always)]
pub(crate) fn crossed_cells(corners: &[u64; 8]) -> u64 {
    let any = corners.iter().fold(0, |a, b| a | b);
    let all = corners.iter().fold(u64::MAX, |a, b| a & b);
    any & !all
}

impl Counted {
    /// Number of vertices.
    pub(crate) fn vertices(&self) -> usize {
        self.parts.last().map_or(0, |end| end.first_vertex as usize)
    }

    /// Number of bricks that hold a crossing.
    pub(crate) fn crossed_bricks(&self) -> usize {
        let parts = self.parts.split_last().map_or(&[][..], |(_, parts)| parts);
        let octets = parts.iter().map(|part| &self.crossings[self.of_octet(part.octet)]);
        octets.flatten().filter(|brick| brick.edges != [0; 3]).count()
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> u64 {
        self.parts.last().map_or(0, |end| end.first_triangle)
    }

    /// Crossings of a brick of octet `octet` of the store.
    #[inline(always)]
    pub(crate) fn crossings(&self, octet: &Octet, brick: usize) -> &Crossings {
        let below = (octet.filled & ((1 << brick) - 1)).count_ones();
        &self.crossings[(self.first[octet.index as usize] + below) as usize]
    }

    /// Crossings of all the filled bricks of an octet, in order.
    fn of_octet(&self, octet: u32) -> std::ops::Range<usize> {
        self.first[octet as usize] as usize..self.first[octet as usize + 1] as usize
    }

    /// Counts the crossings and triangles of all filled bricks, as far as marks let them take part.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn count(&mut self, unit: Unit, store: &Store<1>, marks: &Marks) -> Result<(), Error> {
        let n = store.octets.len();
        self.first.clear();
        self.first.push(0);
        self.first.extend(store.octets.iter().scan(0, |sum, octet| {
            *sum += octet.filled.count_ones();
            Some(*sum)
        }));
        grow(&mut self.crossings, store.len(), Crossings::default());
        grow(&mut self.triangles, n.next_multiple_of(GROUP), 0);
        let (first, groups) = (&self.first, n.div_ceil(GROUP));
        let start = |group: usize| first[(group * GROUP).min(n)] as usize;
        let data = (&mut self.crossings[..store.len()], PerItem(&mut self.triangles[..groups * GROUP], GROUP));
        for_each_part(0..groups, data, &start, &|group, (crossings, triangles): (&mut [_], PerItem<'_, _>)| {
            let octets = &store.octets[group * GROUP..n.min((group + 1) * GROUP)];
            unit.run(CountOctets { store, marks, octets, crossings, triangles: triangles.0 });
        });
        self.order.clear();
        self.order.extend(store.octets.iter().enumerate().map(|(i, octet)| (morton(octet.at), i as u32)));
        self.order.par_sort_unstable();
        self.place()
    }

    /// Gives every octet with something in it its place, in Morton order.
    fn place(&mut self) -> Result<(), Error> {
        self.parts.clear();
        let (mut vertices, mut triangles) = (0u64, 0u64);
        for &(_, octet) in &self.order {
            let (first_vertex, first_triangle) = (vertices, triangles);
            let bricks = self.of_octet(octet);
            for brick in &mut self.crossings[bricks] {
                brick.base = vertices as u32;
                vertices += u64::from(brick.vertices());
            }
            triangles += u64::from(self.triangles[octet as usize]);
            if vertices > first_vertex || triangles > first_triangle {
                self.parts.push(Part { octet, first_vertex: first_vertex as u32, first_triangle });
            }
        }
        if vertices > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed: vertices, available: u32::MAX.into() });
        }
        self.parts.push(Part { octet: u32::MAX, first_vertex: vertices as u32, first_triangle: triangles });
        Ok(())
    }
}

/// Octets that one task counts.
const GROUP: usize = 16;

/// Crossings of some octets' bricks, and the number of triangles of each octet.
struct CountOctets<'a> {
    store: &'a Store<1>,
    marks: &'a Marks,
    octets: &'a [Octet],
    crossings: &'a mut [Crossings],
    triangles: &'a mut [u32],
}

impl Kernel for CountOctets<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let mut crossings = self.crossings.iter_mut();
        for (octet, triangles) in self.octets.iter().zip(self.triangles) {
            let above = above(self.store, octet);
            *triangles = 0;
            for (brick, crossings) in ones(octet.filled.into()).zip(&mut crossings) {
                *crossings = Crossings::default();
                let Some(signs) = signs(self.store, &above, brick) else { continue };
                let corners = corner_sets(&signs);
                let crossed = crossed_cells(&corners);
                if crossed == 0 {
                    continue;
                }
                let mark = self.marks.of(octet, brick);
                crossings.edges = [0, 1, 2].map(|axis| (corners[0] ^ corners[1 << axis]) & mark.edges[axis]);
                let cases = cases(&corners);
                for cell in ones(crossed & mark.cells) {
                    *triangles += u32::from(COUNTS[usize::from(cases[cell / 8][cell % 8])]);
                }
            }
        }
    }
}
