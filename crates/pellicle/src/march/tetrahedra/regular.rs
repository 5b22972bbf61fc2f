//! Regularised marching tetrahedra on the body-centred lattice: crossings that lie near the same node share one vertex. What
//! is left are well-shaped triangles, about a quarter as many.
//!
//! ```text
//! choose    every crossing belongs to the end of its edge that is nearer; those of a node are its cluster        choose
//! check     clusters whose merging would change the surface's topology: of each such set the smallest gives way  gives_way
//! again     around those that gave way, until none does
//! gather    who claims the crossings of each brick's edges                                                       gather
//! ```
//!
//! Why it stays closed, manifold and of the same topology: merging vertices does not change a surface when what becomes one
//! point was one piece without holes, wherever the point lies:
//!
//! - on a vertex: among the node's 14 neighbours those of the cluster are connected, and so are the rest of them
//!   (in a triangulated sphere the one has no holes exactly if the other is connected);
//! - on an edge: what becomes it is a strip of triangles, a path or a ring of them; it is one path exactly if two
//!   triangles remain on the edge, since every path leaves one at each of its ends and a ring none;
//! - on a triangle: no other becomes the same.
//!
//! All three are judged from a node, its 14 neighbours and the 24 tetrahedra around it, and any violation concerns a node
//! that sees it.
//!
//! Source: Treece, Prager, Gee, Regularised marching tetrahedra: improved iso-surface extraction, 1999. The conditions for
//! several clusters at once and the rule who gives way are this project's.

use rayon::prelude::*;

use super::{
    choose::{Masks, Mixed, around, cell_at, choose, locate},
    clusters::{Claims, Clusters},
    count::Signs,
    source::Source,
    splits::{BCC, doubled},
    star::{AROUND, DIRECTIONS, NEIGHBOURS, member, neighbour_at, opposed, step},
    tables::{CASES, ENDS},
};
use crate::{Control, math::bits::ones};

/// Chooses the clusters. Cut short when cancelled, which the caller must check.
pub(crate) fn regularise(source: &dyn Source, signs: &Signs<2>, control: &Control<'_>) -> Clusters<2, 14> {
    let mut mixed = choose(source, signs, control);
    let mut active: Vec<u32> = (0..mixed.bricks.len() as u32).collect();
    while !active.is_empty() && control.check().is_ok() {
        let gone: Vec<(u32, [u64; 2])> = active
            .par_iter()
            .map(|&slot| (slot, Near::new(source, signs, &mixed, slot).all_that_give_way()))
            .filter(|(_, gone)| *gone != [0; 2])
            .collect();
        active.clear();
        for (slot, gone) in gone {
            for (masks, set) in mixed.masks[slot as usize].iter_mut().zip(gone) {
                ones(set).for_each(|cell| masks[cell] = 0);
            }
            active.extend(mixed.around(source, mixed.bricks[slot as usize]).into_iter().flatten());
        }
        active.sort_unstable();
        active.dedup();
    }
    gather(source, mixed)
}

/// A brick with what lies around it.
struct Near<'a> {
    signs: &'a Signs<2>,
    masks: &'a [Masks],
    own: usize,
    bricks: [Option<usize>; 27],
    slots: [Option<u32>; 27],
}

/// Labels of the vertices around a node: a member of the node's star for the vertex of its cluster, and beyond these a
/// number for the edge of a crossing of its own.
type Label = u8;
/// Members of a star.
const MEMBERS: usize = NEIGHBOURS + 1;
const LABELS: usize = MEMBERS + MEMBERS * MEMBERS;

impl<'a> Near<'a> {
    fn new(source: &dyn Source, signs: &'a Signs<2>, mixed: &'a Mixed, slot: u32) -> Self {
        let brick = mixed.bricks[slot as usize];
        let (bricks, slots) = (around(source, brick), mixed.around(source, brick));
        Self { signs, masks: &mixed.masks, own: slot as usize, bricks, slots }
    }

    /// The brick's nodes whose clusters give way, by site.
    fn all_that_give_way(&self) -> [u64; 2] {
        let mut gone = [0; 2];
        for (site, masks) in self.masks[self.own].iter().enumerate() {
            for (cell, &mask) in masks.iter().enumerate() {
                gone[site] |= u64::from(mask != 0 && self.gives_way(site, cell)) << cell;
            }
        }
        gone
    }

    /// Signs and masks of a node and its neighbours: those inside as a set of members.
    fn star(&self, site: usize, cell: usize) -> (u32, [u16; MEMBERS]) {
        let at = cell_at(cell);
        let (mut inside, mut masks) = (0, [0; MEMBERS]);
        for m in 0..MEMBERS {
            let (site, d) = if m == 0 { (site, [0; 3]) } else { step(site, m - 1) };
            let (index, cell) = locate([at[0] + d[0], at[1] + d[1], at[2] + d[2]]);
            let bit = self.bricks[index].map_or(inside & 1, |b| (self.signs.inside[b][site] >> cell & 1) as u32);
            inside |= bit << m;
            masks[m] = self.slots[index].map_or(0, |slot| self.masks[slot as usize][site][cell]);
        }
        (inside, masks)
    }

    /// Whether a node's cluster breaks a condition, alone or with others, and is the smallest of those that do.
    fn gives_way(&self, site: usize, cell: usize) -> bool {
        let (inside, masks) = self.star(site, cell);
        let label = |a: usize, b: usize| -> Label {
            let direction = usize::from(DIRECTIONS[a][b]);
            if masks[a] >> direction & 1 == 1 {
                a as Label
            } else if masks[b] >> opposed(direction) & 1 == 1 {
                b as Label
            } else {
                (MEMBERS + a.min(b) * MEMBERS + a.max(b)) as Label
            }
        };
        // Triangles of the merged surface at this node's vertex, by the other two, and which others it touches at all.
        let (mut pairs, mut len) = ([[0 as Label; 2]; 48], 0);
        let (mut touched, mut counts) = ([false; LABELS], [0u8; LABELS]);
        for corners in &AROUND[site] {
            let case = CASES[(0..4).fold(0, |bits, c| bits | (inside >> corners[c] & 1) << c) as usize];
            for slots in &case.triangles[..case.len.into()] {
                let [a, b, c] = slots.map(|slot| {
                    let [from, to] = ENDS[usize::from(slot)];
                    label(corners[from].into(), corners[to].into())
                });
                let (y, z) = match (a, b, c) {
                    (0, y, z) | (z, 0, y) | (y, z, 0) => (y, z),
                    _ => continue,
                };
                touched[usize::from(y)] = true;
                touched[usize::from(z)] = true;
                if y != 0 && z != 0 && y != z {
                    pairs[len] = [y.min(z), y.max(z)];
                    len += 1;
                    counts[usize::from(y)] += 1;
                    counts[usize::from(z)] += 1;
                }
            }
        }
        let pairs = &pairs[..len];
        let is_smallest = |others: &[Label]| {
            let key = |m: usize| (masks[m].count_ones(), member(m));
            others.iter().map(|&label| usize::from(label)).all(|m| m >= MEMBERS || key(0) < key(m))
        };
        let breaks_edge = |y: usize| touched[y] && counts[y] != 2 && is_smallest(&[y as Label]);
        let breaks_triangle = |i: usize| pairs[..i].contains(&pairs[i]) && is_smallest(&pairs[i]);
        (1..LABELS).any(breaks_edge) || (0..len).any(breaks_triangle)
    }
}

/// From a node of each site to each neighbour: the kind of the edge, its owner's cell counted from the node's, and which of
/// its ends the node is.
static EDGE_TO: [[(u8, [i8; 3], u8); NEIGHBOURS]; 2] = {
    let mut table = [[(0, [0; 3], 0); NEIGHBOURS]; 2];
    let mut kind = 0;
    while kind < 14 {
        let ends = BCC.edges[0][kind];
        let mut end = 0;
        while end < 2 {
            let (from, to) = (doubled(ends[end]), doubled(ends[1 - end]));
            let o = ends[end].offset as i8;
            match neighbour_at([to[0] - from[0], to[1] - from[1], to[2] - from[2]]) {
                Some(k) => {
                    table[ends[end].site as usize][k] = (kind as u8, [-(o & 1), -(o >> 1 & 1), -(o >> 2)], end as u8);
                }
                None => panic!("the ends of an edge are neighbours"),
            }
            end += 1;
        }
        kind += 1;
    }
    table
};

/// The clusters that are left, as claims on the edges of each brick.
fn gather(source: &dyn Source, mixed: Mixed) -> Clusters<2, 14> {
    let mut claims: Vec<Claims<2, 14>> = mixed.bricks.par_iter().map(|&brick| claims(source, &mixed, brick)).collect();
    let mut positions = Vec::new();
    for ((claims, masks), (nodes, places)) in claims.iter_mut().zip(&mixed.masks).zip(&mixed.places) {
        claims.first = positions.len();
        let mut places = places.iter();
        for site in 0..2 {
            for (cell, &place) in ones(nodes[site]).zip(&mut places) {
                if masks[site][cell] != 0 {
                    claims.nodes[site] |= 1 << cell;
                    positions.push(place);
                }
            }
        }
    }
    Clusters { slots: mixed.slots, claims, positions }
}

fn claims(source: &dyn Source, mixed: &Mixed, brick: usize) -> Claims<2, 14> {
    let slots = mixed.around(source, brick);
    let mut claims = Claims { ends: [[0; 14]; 2], nodes: [0; 2], first: 0 };
    // Nodes of the brick, and those above it to which its edges lead.
    for n in 0..125 {
        let at = [n % 5, n / 5 % 5, n / 25];
        let (index, cell) = locate(at);
        let Some(masks) = slots[index].map(|slot| &mixed.masks[slot as usize]) else { continue };
        for site in 0..2 {
            for k in ones(masks[site][cell].into()) {
                let (kind, d, end) = EDGE_TO[site][k];
                let owner: [i32; 3] = std::array::from_fn(|a| at[a] + i32::from(d[a]));
                if owner.iter().all(|v| (0..4).contains(v)) {
                    claims.ends[usize::from(end)][usize::from(kind)] |= 1 << locate(owner).1;
                }
            }
        }
    }
    claims
}
