//! Write vertices and triangles of counted bricks to their places.
//!
//! Source: this project; see [`super`].

use super::{
    count::{ABOVE, Brick, Counted, GROUP, NONE, above, even_cells},
    crossing::{Crossing, refine},
    source::Source,
    splits::Node,
    tables::CORNER_SLOT,
};
use crate::{
    lattice::Coord,
    math::{bits::ones, ranges::for_each_part},
};

/// Nodes along an axis that a brick's edges reach.
const SIDE: usize = 5;

/// Values of a brick's nodes and of those that its edges reach, by site.
struct Block<const SITES: usize> {
    first: Coord,
    values: [[f64; SIDE * SIDE * SIDE]; SITES],
}

impl<const SITES: usize> Block<SITES> {
    fn load(&mut self, source: &dyn Source, brick: usize) {
        self.first = source.first(brick);
        for (site, to) in self.values.iter_mut().enumerate() {
            source.values(brick, site, 0, SIDE, to);
        }
    }

    /// Site, place and value of a node of a cell.
    fn node(&self, source: &dyn Source, cell: usize, node: Node) -> (usize, [f64; 3], f64) {
        let (site, o) = (usize::from(node.site), usize::from(node.offset));
        let at = [(cell & 3) + (o & 1), (cell >> 2 & 3) + (o >> 1 & 1), (cell >> 4) + (o >> 2)];
        let position = source.position(site, std::array::from_fn(|a| self.first[a] + at[a] as i32));
        (site, position, self.values[site][at[0] + SIDE * (at[1] + SIDE * at[2])])
    }
}

impl<const SITES: usize, const EDGES: usize, const TETS: usize> Counted<SITES, EDGES, TETS> {
    /// Groups of parts that are written together.
    fn groups(&self) -> usize {
        (self.parts.len() - 1).div_ceil(GROUP)
    }

    fn first_of(&self, group: usize) -> usize {
        (group * GROUP).min(self.parts.len() - 1)
    }

    /// Writes all vertices, in parallel.
    pub(crate) fn write_vertices(&self, source: &dyn Source, to: &mut [[f32; 3]]) {
        let start = |group: usize| self.parts[self.first_of(group)].first_vertex as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [[f32; 3]]| {
            let mut block = Block { first: [0; 3], values: [[0.0; SIDE * SIDE * SIDE]; SITES] };
            let mut crossings = Vec::new();
            let mut to = to.iter_mut();
            for part in &self.parts[self.first_of(group)..self.first_of(group + 1)] {
                let brick = part.brick as usize;
                block.load(source, brick);
                let even = even_cells(block.first);
                crossings.clear();
                for (kind, &cells) in part.edges.iter().enumerate() {
                    for cell in ones(cells) {
                        let [a, b] = self.split.edges[(!even >> cell & 1) as usize][kind];
                        let (a, b) = (block.node(source, cell, a), block.node(source, cell, b));
                        crossings.push(Crossing::between(source, a, b));
                    }
                }
                refine(source, &mut crossings);
                for (crossing, to) in crossings.iter().zip(&mut to) {
                    *to = source.place(crossing.place()).map(|v| v as f32);
                }
                for (&at, to) in self.clusters.positions(brick).iter().zip(&mut to) {
                    *to = source.place(at).map(|v| v as f32);
                }
            }
        });
    }

    /// Writes all triangles, in parallel.
    pub(crate) fn write_triangles(&self, source: &dyn Source, to: &mut [[u32; 3]]) {
        let flip = source.is_left_handed();
        let start = |group: usize| self.parts[self.first_of(group)].first_triangle as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [[u32; 3]]| {
            let mut to = to.iter_mut();
            for part in &self.parts[self.first_of(group)..self.first_of(group + 1)] {
                let Some((brick, _)) = self.brick(source, part.brick as usize) else { continue };
                let numbers = Numbers::new(self, source, part.brick as usize);
                let crossed = brick.mixed.iter().fold(0, |any, cells| any | cells);
                for cell in ones(crossed) {
                    for t in 0..TETS {
                        if brick.mixed[t] >> cell & 1 == 1 {
                            self.write_tetrahedron(&brick, &numbers, t, cell, flip, &mut to);
                        }
                    }
                }
            }
        });
    }

    #[inline(always)]
    fn write_tetrahedron<'a>(
        &self,
        brick: &Brick<'_, SITES, EDGES, TETS>,
        numbers: &Numbers<SITES, EDGES>,
        t: usize,
        cell: usize,
        flip: bool,
        to: &mut impl Iterator<Item = &'a mut [u32; 3]>,
    ) {
        let tetrahedron = &self.split.tetrahedra[brick.parity(cell)][t];
        let case = brick.case(self.split, t, cell);
        let vertex = |slot: u8| {
            let slot = usize::from(slot);
            if slot < CORNER_SLOT {
                let edge = tetrahedron.edges[slot];
                numbers.edge(ABOVE[cell][usize::from(edge.owner)], edge.kind.into())
            } else {
                let node = tetrahedron.corners[slot - CORNER_SLOT];
                numbers.node(ABOVE[cell][usize::from(node.offset)], node.site.into())
            }
        };
        for (from, to) in case.triangles[..case.len.into()].iter().zip(to) {
            let [a, b, c] = from.map(vertex);
            *to = if flip { [a, c, b] } else { [a, b, c] };
        }
    }
}

/// Numbers of the vertices of a brick and those above it.
struct Numbers<const SITES: usize, const EDGES: usize> {
    edges: [[(u64, u32); EDGES]; 8],
    nodes: [[(u64, u32); SITES]; 8],
}

impl<const SITES: usize, const EDGES: usize> Numbers<SITES, EDGES> {
    fn new<const TETS: usize>(counted: &Counted<SITES, EDGES, TETS>, source: &dyn Source, brick: usize) -> Self {
        let mut numbers = Self { edges: [[(0, 0); EDGES]; 8], nodes: [[(0, 0); SITES]; 8] };
        for c in 0..8 {
            let slot = above(source, brick, c).map_or(NONE, |other| counted.slots[other]);
            if slot == NONE {
                continue;
            }
            let part = &counted.parts[slot as usize];
            let mut first = part.first_vertex;
            let sets = part.edges.iter().chain(&part.clusters);
            for (to, &set) in numbers.edges[c].iter_mut().chain(&mut numbers.nodes[c]).zip(sets) {
                *to = (set, first);
                first += set.count_ones();
            }
        }
        numbers
    }

    /// Number of the vertex on an edge of a kind whose owner is given as in [`ABOVE`].
    #[inline(always)]
    fn edge(&self, owner: u16, kind: usize) -> u32 {
        rank(self.edges[usize::from(owner >> 6)][kind], owner)
    }

    /// Number of the vertex of a node's cluster.
    #[inline(always)]
    fn node(&self, owner: u16, site: usize) -> u32 {
        rank(self.nodes[usize::from(owner >> 6)][site], owner)
    }
}

#[inline(always)]
fn rank((set, first): (u64, u32), owner: u16) -> u32 {
    first + (set & ((1 << (owner & 63)) - 1)).count_ones()
}
