//! Classify, count, sum: where every brick's vertices and triangles will go.
//!
//! Source: this project; see [`super`].

use rayon::prelude::*;

use super::{
    clusters::{Claims, Clusters},
    source::{Presence, Source},
    splits::{Node, Split},
    tables::{CASES, CORNER_SLOT, Case, ENDS},
};
use crate::{
    Control, Error,
    lattice::{Coord, morton},
    math::bits::{corner_sets, ones, side_mask},
};

/// No part, or no brick.
pub(crate) const NONE: u32 = u32::MAX;
/// Bricks or parts that one task handles.
pub(crate) const GROUP: usize = 64;

/// Cells whose coordinates in their brick sum to an even number.
const EVEN: u64 = {
    let (mut set, mut n) = (0u64, 0u32);
    while n < 64 {
        set |= (((n & 3) + (n >> 2 & 3) + (n >> 4)) % 2 == 0) as u64 * (1 << n);
        n += 1;
    }
    set
};

/// The even cells of a brick that begins at this cell.
pub(crate) fn even_cells(first: Coord) -> u64 {
    if first.iter().fold(0, |sum, c| sum ^ c) & 1 == 0 { EVEN } else { !EVEN }
}

/// For each site and each of the eight offsets: one bit a cell, its node at that offset.
pub(crate) type Sets<const SITES: usize> = [[u64; 8]; SITES];

/// The set of one node.
#[inline(always)]
pub(crate) fn set<const SITES: usize>(sets: &Sets<SITES>, node: Node) -> u64 {
    sets[usize::from(node.site)][usize::from(node.offset)]
}

/// A brick with vertices or triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part<const SITES: usize, const EDGES: usize> {
    pub(crate) brick: u32,
    /// Crossed edges of each kind, those that belong to a cluster left out.
    pub(crate) edges: [u64; EDGES],
    /// Nodes of each site that have a cluster.
    pub(crate) clusters: [u64; SITES],
    /// Number of the first vertex, and of the first triangle.
    pub(crate) first_vertex: u32,
    pub(crate) first_triangle: u64,
}

impl<const SITES: usize, const EDGES: usize> Part<SITES, EDGES> {
    fn vertices(&self) -> u64 {
        self.edges.iter().chain(&self.clusters).map(|set| u64::from(set.count_ones())).sum()
    }
}

/// Signs of all bricks of a source.
pub(crate) struct Signs<const SITES: usize> {
    pub(crate) inside: Vec<[u64; SITES]>,
}

impl<const SITES: usize> Signs<SITES> {
    /// Reads all samples once. Cut short when cancelled, which the caller must check.
    pub(crate) fn of(source: &dyn Source, control: &Control<'_>) -> Self {
        let mut inside = vec![[0; SITES]; source.bricks()];
        inside.par_chunks_mut(GROUP).enumerate().for_each(|(group, to)| {
            if control.check().is_ok() {
                for (i, to) in to.iter_mut().enumerate() {
                    *to = std::array::from_fn(|site| source.signs(group * GROUP + i, site));
                }
            }
        });
        Self { inside }
    }

    /// Signs at the eight offsets of a brick's cells; `None` when all are alike.
    pub(crate) fn sets(&self, source: &dyn Source, brick: usize) -> Option<Sets<SITES>> {
        let own = self.inside[brick];
        let bricks: [[u64; SITES]; 8] = std::array::from_fn(|c| match above(source, brick, c) {
            Some(other) => self.inside[other],
            // What touches the gap tells its sign.
            None => own.map(|set| if set & TOUCHING[c] != 0 { u64::MAX } else { 0 }),
        });
        let (any, all) = bricks.iter().flatten().fold((0, u64::MAX), |(any, all), set| (any | set, all & set));
        (any != 0 && all != u64::MAX)
            .then(|| std::array::from_fn(|site| corner_sets(&std::array::from_fn(|c| bricks[c][site]))))
    }
}

/// The nodes that touch the brick at offset `c`.
const TOUCHING: [u64; 8] = {
    let mut table = [0; 8];
    let mut c = 0;
    while c < 8 {
        table[c] = side_mask([(c & 1) as i32, (c >> 1 & 1) as i32, (c >> 2) as i32]);
        c += 1;
    }
    table
};

/// The brick at offset `c` from a brick, itself for 0.
pub(crate) fn above(source: &dyn Source, brick: usize, c: usize) -> Option<usize> {
    if c == 0 { Some(brick) } else { source.neighbour(brick, std::array::from_fn(|a| (c >> a & 1) as i32)) }
}

/// Which nodes at the eight offsets of a brick's cells take part; `None` when all do.
struct Present {
    sites: [[u64; 8]; 2],
    interior: [u64; 8],
}

impl Present {
    fn of(source: &dyn Source, brick: usize) -> Option<Self> {
        let none = Presence { sites: [0; 2], interior: 0 };
        let bricks: [Presence; 8] =
            std::array::from_fn(|c| above(source, brick, c).map_or(none, |other| source.presence(other)));
        if source.presence(brick) == Presence::ALL && bricks.iter().all(|p| *p == Presence::ALL || *p == none) {
            // A source whose bricks all take part has no border.
            return None;
        }
        let sets = |of: fn(&Presence) -> u64| corner_sets(&std::array::from_fn(|c| of(&bricks[c])));
        Some(Self { sites: [sets(|p| p.sites[0]), sets(|p| p.sites[1])], interior: sets(|p| p.interior) })
    }

    /// Cells whose nodes all exist, the middles among them not all on the border.
    fn all(&self, nodes: &[Node]) -> u64 {
        let exist = nodes.iter().fold(u64::MAX, |set, n| set & self.sites[usize::from(n.site)][usize::from(n.offset)]);
        let middles = nodes.iter().filter(|n| n.site == 1);
        if middles.clone().count() < 2 {
            return exist;
        }
        exist & middles.fold(0, |set, n| set | self.interior[usize::from(n.offset)])
    }
}

/// Cells whose tetrahedron number `t` takes part and has both signs, and those of them that make a quadrangle.
#[inline(always)]
fn mixed<const SITES: usize>(sets: &Sets<SITES>, corners: &[Node; 4]) -> (u64, u64) {
    let [a, b, c, d] = corners.map(|node| set(sets, node));
    let mixed = (a | b | c | d) & !(a & b & c & d);
    (mixed, mixed & !(a ^ b ^ c ^ d))
}

/// What counting and writing know of one brick.
pub(crate) struct Brick<'a, const SITES: usize, const EDGES: usize, const TETS: usize> {
    pub(crate) signs: Sets<SITES>,
    /// Of the brick and those above it, where there are clusters.
    pub(crate) claims: Option<[Option<&'a Claims<SITES, EDGES>>; 8]>,
    /// For each tetrahedron, the cells where it has both signs and takes part.
    pub(crate) mixed: [u64; TETS],
    /// Cells of even parity.
    pub(crate) even: u64,
}

/// A counted surface. Vertices by kind of edge and cell, then those of clusters by site and cell; triangles by cell and tetrahedron; bricks in
/// Morton order.
pub(crate) struct Counted<const SITES: usize, const EDGES: usize, const TETS: usize> {
    pub(crate) split: &'static Split<SITES, EDGES, TETS>,
    pub(crate) signs: Signs<SITES>,
    pub(crate) clusters: Clusters<SITES, EDGES>,
    /// With an end that holds the totals.
    pub(crate) parts: Vec<Part<SITES, EDGES>>,
    /// The part of each brick.
    pub(crate) slots: Vec<u32>,
}

impl<const SITES: usize, const EDGES: usize, const TETS: usize> Counted<SITES, EDGES, TETS> {
    /// Counts.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`, [`Error::Cancelled`].
    pub(crate) fn new(
        source: &dyn Source,
        split: &'static Split<SITES, EDGES, TETS>,
        signs: Signs<SITES>,
        clusters: Clusters<SITES, EDGES>,
        control: &Control<'_>,
    ) -> Result<Self, Error> {
        let mut counted = Self { split, signs, clusters, parts: Vec::new(), slots: vec![NONE; source.bricks()] };
        let found: Vec<Vec<(Part<SITES, EDGES>, u64)>> = (0..source.bricks().div_ceil(GROUP))
            .into_par_iter()
            .map(|group| {
                if control.check().is_err() {
                    return Vec::new();
                }
                let bricks = group * GROUP..source.bricks().min((group + 1) * GROUP);
                bricks.filter_map(|brick| counted.count(source, brick)).collect()
            })
            .collect();
        control.check()?;
        let mut found: Vec<_> = found.into_iter().flatten().collect();
        found.par_sort_by_cached_key(|(part, _)| morton(source.first(part.brick as usize).map(|c| c.div_euclid(4))));
        counted.place(found)?;
        Ok(counted)
    }

    /// Number of vertices.
    pub(crate) fn vertices(&self) -> usize {
        self.parts.last().map_or(0, |end| end.first_vertex as usize)
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        self.parts.last().map_or(0, |end| end.first_triangle as usize)
    }

    /// Signs and crossed tetrahedra of a brick; `None` where nothing is crossed.
    pub(crate) fn brick(
        &self,
        source: &dyn Source,
        brick: usize,
    ) -> Option<(Brick<'_, SITES, EDGES, TETS>, [u64; EDGES])> {
        let signs = self.signs.sets(source, brick)?;
        let claims = self.clusters.above(source, brick);
        let even = even_cells(source.first(brick));
        let present = Present::of(source, brick);
        let by_parity = |work: &dyn Fn(usize) -> u64| (work(0) & even) | (work(1) & !even);
        let present_of = |nodes: &[Node]| present.as_ref().map_or(u64::MAX, |present| present.all(nodes));
        let mixed = std::array::from_fn(|t| {
            by_parity(&|parity| {
                let corners = &self.split.tetrahedra[parity][t].corners;
                mixed(&signs, corners).0 & present_of(corners)
            })
        });
        let own = self.clusters.of(brick);
        let edges = std::array::from_fn(|kind| {
            by_parity(&|parity| {
                let ends = self.split.edges[parity][kind];
                let free = own.map_or(u64::MAX, |own| !(own.ends[0][kind] | own.ends[1][kind]));
                (set(&signs, ends[0]) ^ set(&signs, ends[1])) & free & present_of(&ends)
            })
        });
        Some((Brick { signs, claims, mixed, even }, edges))
    }

    fn count(&self, source: &dyn Source, index: usize) -> Option<(Part<SITES, EDGES>, u64)> {
        let clusters = self.clusters.of(index).map_or([0; SITES], |own| own.nodes);
        let (edges, triangles) = match self.brick(source, index) {
            Some((brick, edges)) if brick.claims.is_some() => (edges, self.count_merged(&brick)),
            Some((brick, edges)) => (edges, self.count_plain(&brick)),
            // A cluster's crossed edges may all lead to bricks below.
            None => ([0; EDGES], 0),
        };
        let part = Part { brick: index as u32, edges, clusters, first_vertex: 0, first_triangle: 0 };
        (part.vertices() > 0 || triangles > 0).then_some((part, triangles))
    }

    /// A mixed tetrahedron has one triangle, and another where the signs are two and two.
    fn count_plain(&self, brick: &Brick<'_, SITES, EDGES, TETS>) -> u64 {
        let mut triangles = 0;
        for (t, &mixed_cells) in brick.mixed.iter().enumerate() {
            let quads = |parity: usize| mixed(&brick.signs, &self.split.tetrahedra[parity][t].corners).1;
            let quads = mixed_cells & ((quads(0) & brick.even) | (quads(1) & !brick.even));
            triangles += u64::from(mixed_cells.count_ones() + quads.count_ones());
        }
        triangles
    }

    fn count_merged(&self, brick: &Brick<'_, SITES, EDGES, TETS>) -> u64 {
        let mut triangles = 0;
        for (t, &mixed_cells) in brick.mixed.iter().enumerate() {
            for cell in ones(mixed_cells) {
                triangles += u64::from(brick.case(self.split, t, cell).len);
            }
        }
        triangles
    }

    /// Gives every part its place.
    fn place(&mut self, found: Vec<(Part<SITES, EDGES>, u64)>) -> Result<(), Error> {
        let (mut vertices, mut triangles) = (0u64, 0u64);
        self.parts.reserve_exact(found.len() + 1);
        for (i, (mut part, count)) in found.into_iter().enumerate() {
            self.slots[part.brick as usize] = i as u32;
            (part.first_vertex, part.first_triangle) = (vertices as u32, triangles);
            vertices += part.vertices();
            triangles += count;
            self.parts.push(part);
        }
        if vertices > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed: vertices, available: u32::MAX.into() });
        }
        self.parts.push(Part {
            brick: NONE,
            edges: [0; EDGES],
            clusters: [0; SITES],
            first_vertex: vertices as u32,
            first_triangle: triangles,
        });
        Ok(())
    }
}

/// For each cell and offset: the brick above that the cell at that offset lies in (bits 6..), and its number there.
pub(crate) static ABOVE: [[u16; 8]; 64] = {
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

impl<const SITES: usize, const EDGES: usize, const TETS: usize> Brick<'_, SITES, EDGES, TETS> {
    /// Case of a cell's tetrahedron number `t`, with clusters in the place of their crossings.
    #[inline(always)]
    pub(crate) fn case(&self, split: &Split<SITES, EDGES, TETS>, t: usize, cell: usize) -> Case {
        let tetrahedron = &split.tetrahedra[self.parity(cell)][t];
        let signs = (0..4).fold(0, |bits, c| bits | (set(&self.signs, tetrahedron.corners[c]) >> cell & 1) << c);
        let case = CASES[signs as usize];
        let Some(claims) = &self.claims else { return case };
        let mut slots = [0, 1, 2, 3, 4, 5];
        for (edge, (to, ends)) in tetrahedron.edges.iter().zip(slots.iter_mut().zip(ENDS)) {
            let owner = ABOVE[cell][usize::from(edge.owner)];
            let end = claims[usize::from(owner >> 6)]
                .and_then(|claims| claims.end(edge.kind.into(), usize::from(owner & 63)));
            if let Some(end) = end {
                *to = (CORNER_SLOT + ends[end ^ usize::from(edge.is_reversed)]) as u8;
            }
        }
        case.merged(&slots)
    }

    /// 0 for an even cell, 1 for an odd one.
    #[inline(always)]
    pub(crate) fn parity(&self, cell: usize) -> usize {
        (!self.even >> cell & 1) as usize
    }
}
