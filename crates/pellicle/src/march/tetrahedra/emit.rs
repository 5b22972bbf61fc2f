//! Write vertices and triangles of counted bricks to their places.
//!
//! Source: this project; see [`super`].

use super::{
    count::{Brick, Counted, GROUP, NONE, above, even_cells},
    regular::Moves,
    source::{ABSENT, Source},
    splits::Node,
    tables::{CASES, CORNER_SLOT},
};
use crate::{
    lattice::Coord,
    math::{bits::ones, ranges::for_each_part},
};

/// Nodes along an axis that a brick's edges reach.
const SIDE: usize = 5;

/// For each cell and offset: the brick above that the cell at that offset lies in (bits 6..), and its number there.
static ABOVE: [[u16; 8]; 64] = {
    let mut table = [[0; 8]; 64];
    let mut cell = 0;
    while cell < 64 {
        let mut c = 0;
        while c < 8 {
            let at = [(cell & 3) + (c & 1), (cell >> 2 & 3) + (c >> 1 & 1), (cell >> 4) + (c >> 2)];
            let brick = at[0] >> 2 | (at[1] >> 2) << 1 | (at[2] >> 2) << 2;
            table[cell][c] = (brick << 6 | at[0] & 3 | (at[1] & 3) << 2 | (at[2] & 3) << 4) as u16;
            c += 1;
        }
        cell += 1;
    }
    table
};

/// Where on an edge between relative values, one above 0 and one not, the surface crosses it.
#[inline(always)]
fn part(a: f64, b: f64) -> f64 {
    // Values so large that their difference is not finite meet in the middle.
    let t = a / (a - b);
    if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

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

    /// Where the edge between two nodes of a cell is crossed, in units of cells.
    fn crossing(&self, source: &dyn Source, cell: usize, ends: [Node; 2]) -> [f64; 3] {
        let [mut a, mut b] = ends.map(|node| self.node(source, cell, node));
        if a.2 <= b.2 {
            std::mem::swap(&mut a, &mut b);
        }
        let t = if b.2 == ABSENT { source.end((a.0, a.1), (b.0, b.1)) } else { part(a.2, b.2) };
        std::array::from_fn(|i| a.1[i] + t * (b.1[i] - a.1[i]))
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
    pub(crate) fn write_vertices(&self, source: &dyn Source, moves: &Moves, to: &mut [[f32; 3]]) {
        let start = |group: usize| self.parts[self.first_of(group)].first_vertex as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [[f32; 3]]| {
            let mut block = Block { first: [0; 3], values: [[0.0; SIDE * SIDE * SIDE]; SITES] };
            let mut to = to.iter_mut();
            for part in &self.parts[self.first_of(group)..self.first_of(group + 1)] {
                let brick = part.brick as usize;
                block.load(source, brick);
                let even = even_cells(block.first);
                for (kind, &cells) in part.edges.iter().enumerate() {
                    for (cell, to) in ones(cells).zip(&mut to) {
                        let ends = self.split.edges[(!even >> cell & 1) as usize][kind];
                        *to = source.place(block.crossing(source, cell, ends)).map(|v| v as f32);
                    }
                }
                for (site, &cells) in part.snapped.iter().enumerate() {
                    for (cell, to) in ones(cells).zip(&mut to) {
                        let at = moves.position(source, brick, site, cell);
                        *to = source.place(at).map(|v| v as f32);
                    }
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
        brick: &Brick<SITES, TETS>,
        numbers: &Numbers<SITES, EDGES>,
        t: usize,
        cell: usize,
        flip: bool,
        to: &mut impl Iterator<Item = &'a mut [u32; 3]>,
    ) {
        let tetrahedron = &self.split.tetrahedra[brick.parity(cell)][t];
        let case = &CASES[brick.case(self.split, t, cell)];
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
            let sets = part.edges.iter().chain(&part.snapped);
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

    /// Number of a snapped node.
    #[inline(always)]
    fn node(&self, owner: u16, site: usize) -> u32 {
        rank(self.nodes[usize::from(owner >> 6)][site], owner)
    }
}

#[inline(always)]
fn rank((set, first): (u64, u32), owner: u16) -> u32 {
    first + (set & ((1 << (owner & 63)) - 1)).count_ones()
}
