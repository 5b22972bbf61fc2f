//! Classify, count, sum: where every octet's vertices and triangles will go.

use rayon::prelude::*;

use super::{above, signs};
use crate::{
    Error,
    bricks::store::Store,
    lattice::morton,
    march::tables::COUNTS,
    math::{
        bits::{corner_sets, ones, transpose8},
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
    /// Crossings of the bricks of each octet of the store.
    crossings: Vec<[Crossings; 8]>,
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
        let octets = parts.iter().map(|part| &self.crossings[part.octet as usize]);
        octets.flatten().filter(|brick| brick.edges != [0; 3]).count()
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> u64 {
        self.parts.last().map_or(0, |end| end.first_triangle)
    }

    /// Crossings of a brick of octet `octet` of the store.
    #[inline(always)]
    pub(crate) fn crossings(&self, octet: u32, brick: usize) -> &Crossings {
        &self.crossings[octet as usize][brick]
    }

    /// Counts the crossings and triangles of all filled bricks.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn count(&mut self, unit: Unit, store: &Store<1>) -> Result<(), Error> {
        let n = store.octets.len();
        self.crossings.resize(n.max(self.crossings.len()), Default::default());
        self.triangles.resize(n.max(self.triangles.len()), 0);
        let outputs = self.crossings[..n].par_iter_mut().zip(&mut self.triangles[..n]);
        outputs.enumerate().with_min_len(16).for_each(|(octet, (crossings, triangles))| {
            *triangles = unit.run(CountOctet { store, octet, crossings });
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
            for brick in &mut self.crossings[octet as usize] {
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

/// Crossings of one octet's bricks, and the number of its triangles.
struct CountOctet<'a> {
    store: &'a Store<1>,
    octet: usize,
    crossings: &'a mut [Crossings; 8],
}

impl Kernel for CountOctet<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> u32 {
        *self.crossings = Default::default();
        let octet = &self.store.octets[self.octet];
        let above = above(self.store, octet);
        let mut triangles = 0;
        for brick in ones(octet.filled.into()) {
            let Some(signs) = signs(self.store, &above, brick) else { continue };
            let corners = corner_sets(&signs);
            let crossed = crossed_cells(&corners);
            if crossed == 0 {
                continue;
            }
            self.crossings[brick].edges = [1, 2, 4].map(|c| corners[0] ^ corners[c]);
            let cases = cases(&corners);
            for cell in ones(crossed) {
                triangles += u32::from(COUNTS[usize::from(cases[cell / 8][cell % 8])]);
            }
        }
        triangles
    }
}
