//! Regularised marching tetrahedra on the body-centred lattice: nodes near the surface are moved onto it, and stand for the
//! vertices of all their crossed edges. What is left are well-shaped triangles, about half as many.
//!
//! ```text
//! candidates   nodes with a crossed edge, a move of at most a quarter cell, and at most 3 of 7 pairs of opposed edges
//!              crossed, at which the surface is one disc
//! conflicts    candidates that cannot be snapped together; the one with the longest move gives way
//! snapped      what is left
//! ```
//!
//! Why it stays closed, manifold and of the same topology: merging vertices does not change a surface when the preimage of
//! every point is one piece without holes. The preimage of a snapped node is what the surface of plain tetrahedra has on
//! its crossed edges: one disc exactly if both the neighbours of the other sign and the rest of them are connected, in the
//! graph of the 14 neighbours. That of an edge between two snapped nodes of the same sign is a path exactly if the nodes
//! around that edge have one run of the other sign that does not go all the way round, or none; that of a triangle
//! between three is a point unless both its apexes are of the other sign. Two neighbours of different sign share a vertex and
//! cannot both be snapped. Of each such set one is dropped, so none remains whole.
//!
//! The move is a Newton step, along the gradient that fits the 14 differences best.
//!
//! Source: Treece, Prager, Gee, Regularised marching tetrahedra: improved iso-surface extraction, 1999. The limits (a
//! quarter, 3 of 7) are those of METHODS in use since; the conditions for several nodes at once and the rule for conflicts
//! are this project's.

use rayon::prelude::*;

use super::{
    count::{GROUP, Signs},
    source::{ABSENT, Source},
};
use crate::{Control, math::bits::ones};

/// Longest move, in units of cells.
const LONGEST_MOVE: f64 = 0.25;
/// Most pairs of opposed edges that are both crossed: beyond, a thin sheet passes on both sides.
const MOST_OPPOSED: usize = 3;

/// Neighbours of a node in the body-centred lattice: six along the axes, then eight of the other site.
const NEIGHBOURS: usize = 14;
const ALL: u32 = (1 << NEIGHBOURS) - 1;

/// Twice the step to each neighbour, in units of cells.
const STEPS: [[i32; 3]; NEIGHBOURS] = {
    let mut steps = [[0; 3]; NEIGHBOURS];
    let mut k = 0;
    while k < NEIGHBOURS {
        if k < 6 {
            steps[k][k / 2] = if k % 2 == 0 { -2 } else { 2 };
        } else {
            let o = k as i32 - 6;
            steps[k] = [2 * (o & 1) - 1, 2 * (o >> 1 & 1) - 1, 2 * (o >> 2) - 1];
        }
        k += 1;
    }
    steps
};

/// For each neighbour, those of the others that are its neighbours, too.
const ADJACENT: [u32; NEIGHBOURS] = {
    let mut table = [0; NEIGHBOURS];
    let mut k = 0;
    while k < NEIGHBOURS {
        let mut j = 0;
        while j < NEIGHBOURS {
            let mut i = 0;
            while i < NEIGHBOURS {
                let (a, b, s) = (STEPS[k], STEPS[j], STEPS[i]);
                if b[0] - a[0] == s[0] && b[1] - a[1] == s[1] && b[2] - a[2] == s[2] {
                    table[k] |= 1 << j;
                }
                i += 1;
            }
            j += 1;
        }
        k += 1;
    }
    table
};

/// The neighbour on the other side.
const fn opposed(k: usize) -> usize {
    if k < 6 { k ^ 1 } else { 6 + (7 - (k - 6)) }
}

/// Site and cell, as seen from a node of `site`, of a neighbour.
#[inline(always)]
fn step(site: usize, k: usize) -> (usize, [i32; 3]) {
    let s = STEPS[k];
    if k < 6 {
        (site, s.map(|v| v / 2))
    } else {
        // From a corner the middles lie at ±½ in cells −1 and 0, from a middle the corners in cells 0 and 1.
        (1 - site, s.map(|v| (v - 1) / 2 + site as i32))
    }
}

/// Whether a set of neighbours is one piece. No node is not.
fn is_connected(set: u32) -> bool {
    let mut grown = set & set.wrapping_neg();
    loop {
        let next = ones(grown.into()).fold(grown, |next, k| next | ADJACENT[k]) & set;
        if next == grown {
            return grown == set && set != 0;
        }
        grown = next;
    }
}

/// Whether nodes around an edge, given by those of the other sign and all of them, are in the way of snapping both its
/// ends: several runs, or one that goes all the way round.
fn is_pinched(other: u32, ring: u32) -> bool {
    let in_ring = other & ring;
    let neighbours: u32 = ones(in_ring.into()).map(|k| (ADJACENT[k] & in_ring).count_ones()).sum();
    // A path of n nodes has n − 1 sides, each counted twice here; a cycle has n.
    let runs = in_ring.count_ones() as i32 - neighbours as i32 / 2;
    in_ring == ring || runs > 1
}

/// Nodes that may be snapped and where to. Empty for plain tetrahedra.
#[derive(Default)]
pub(crate) struct Moves {
    /// For each brick the candidates of each site, and where their moves begin.
    bricks: Vec<([u64; 2], u32)>,
    /// In units of cells.
    moves: Vec<[f64; 3]>,
}

impl Moves {
    /// The moved place of a candidate, in units of cells.
    pub(super) fn position(&self, source: &dyn Source, brick: usize, site: usize, cell: usize) -> [f64; 3] {
        let first = source.first(brick);
        let at = source.position(
            site,
            [first[0] + (cell & 3) as i32, first[1] + (cell >> 2 & 3) as i32, first[2] + (cell >> 4) as i32],
        );
        let by = self.get(brick, site, cell).unwrap_or([0.0; 3]);
        std::array::from_fn(|a| at[a] + by[a])
    }

    /// The move of a node if it is a candidate.
    fn get(&self, brick: usize, site: usize, cell: usize) -> Option<[f64; 3]> {
        let (sets, first) = self.bricks[brick];
        if sets[site] >> cell & 1 == 0 {
            return None;
        }
        let before = (sets[site] & ((1 << cell) - 1)).count_ones() + if site == 1 { sets[0].count_ones() } else { 0 };
        Some(self.moves[(first + before) as usize])
    }
}

/// Nodes to snap of some bricks, a set each, and their moves.
type Found = (Vec<[u64; 2]>, Vec<[f64; 3]>);

/// Chooses the nodes to snap, marks them in `signs` and returns their moves. Cut short when cancelled, which the caller
/// must check.
pub(crate) fn regularise(source: &dyn Source, signs: &mut Signs<2>, control: &Control<'_>) -> Moves {
    let bricks = source.bricks();
    let groups = (0..bricks.div_ceil(GROUP)).into_par_iter();
    let found: Vec<Found> = groups
        .map(|group| {
            let (mut sets, mut moves) = (Vec::new(), Vec::new());
            let mut blocks = [[0.0; BLOCK]; 2];
            for brick in group * GROUP..bricks.min((group + 1) * GROUP) {
                let is_mixed = control.check().is_ok() && is_mixed(source, signs, brick);
                sets.push(if is_mixed { candidates(source, brick, &mut blocks, &mut moves) } else { [0; 2] });
            }
            (sets, moves)
        })
        .collect();
    let mut all = Moves::default();
    for (sets, moves) in found {
        let mut first = all.moves.len() as u32;
        for sets in sets {
            all.bricks.push((sets, first));
            first += sets[0].count_ones() + sets[1].count_ones();
        }
        all.moves.extend(moves);
    }
    let mut snapped = vec![[0; 2]; bricks];
    snapped.par_chunks_mut(GROUP).enumerate().for_each(|(group, to)| {
        for (i, to) in to.iter_mut().enumerate() {
            *to = keep(source, signs, &all, group * GROUP + i);
        }
    });
    signs.snapped = snapped;
    all
}

/// A brick and all around it: index 1 + d along each axis.
fn around(source: &dyn Source, brick: usize) -> [Option<usize>; 27] {
    std::array::from_fn(|i| {
        let d = [i % 3, i / 3 % 3, i / 9].map(|v| v as i32 - 1);
        if d == [0; 3] { Some(brick) } else { source.neighbour(brick, d) }
    })
}

/// Whether a brick or any around it has both signs.
fn is_mixed(source: &dyn Source, signs: &Signs<2>, brick: usize) -> bool {
    let sets = around(source, brick).into_iter().flatten().flat_map(|other| signs.inside[other]);
    let (any, all) = sets.fold((0, u64::MAX), |(any, all), set| (any | set, all & set));
    any != 0 && all != u64::MAX
}

/// Nodes along an axis that a brick's nodes and their neighbours take, from one below.
const SIDE: usize = 6;
const BLOCK: usize = SIDE * SIDE * SIDE;

fn candidates(
    source: &dyn Source,
    brick: usize,
    blocks: &mut [[f64; BLOCK]; 2],
    moves: &mut Vec<[f64; 3]>,
) -> [u64; 2] {
    for (site, block) in blocks.iter_mut().enumerate() {
        source.values(brick, site, -1, SIDE, block);
    }
    let first = source.first(brick);
    std::array::from_fn(|site| {
        let mut set = 0;
        for cell in 0..64usize {
            let at = [cell & 3, cell >> 2 & 3, cell >> 4];
            let own = blocks[site][1 + at[0] + SIDE * (1 + at[1] + SIDE * (1 + at[2]))];
            let values: [f64; NEIGHBOURS] = std::array::from_fn(|k| {
                let (site, d) = step(site, k);
                let [x, y, z]: [usize; 3] = std::array::from_fn(|a| (1 + at[a] as i32 + d[a]) as usize);
                blocks[site][x + SIDE * (y + SIDE * z)]
            });
            if let Some(by) = candidate(own, &values)
                && source.is_inner(site, std::array::from_fn(|a| first[a] + at[a] as i32))
            {
                set |= 1 << cell;
                moves.push(by);
            }
        }
        set
    })
}

/// The move of a node with these values around it, if it may be snapped.
fn candidate(own: f64, values: &[f64; NEIGHBOURS]) -> Option<[f64; 3]> {
    let inside = values.iter().enumerate().fold(0u32, |set, (k, &v)| set | u32::from(v > 0.0) << k);
    let other = if own > 0.0 { !inside & ALL } else { inside };
    if other == 0 || own == ABSENT || values.contains(&ABSENT) {
        return None;
    }
    let opposed_pairs =
        (0..NEIGHBOURS).filter(|&k| k < opposed(k) && other >> k & other >> opposed(k) & 1 == 1).count();
    if opposed_pairs > MOST_OPPOSED || !is_connected(other) || !is_connected(!other & ALL) {
        return None;
    }
    // Least squares: the sum of the steps' outer products is 4 times the unit matrix.
    let mut gradient = [0.0; 3];
    for (k, v) in values.iter().enumerate() {
        for a in 0..3 {
            gradient[a] += 0.125 * f64::from(STEPS[k][a]) * (v - own);
        }
    }
    let size = gradient.iter().map(|g| g * g).sum::<f64>();
    let by = gradient.map(|g| -own * g / size);
    let length_sq = by.iter().map(|v| v * v).sum::<f64>();
    // Written so that what is not a number fails.
    (length_sq <= LONGEST_MOVE * LONGEST_MOVE).then_some(by)
}

/// Who gives way: of several, the one with the greatest key.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Key(f64, [i32; 3], usize);

impl Key {
    fn new(by: [f64; 3], cell: [i32; 3], site: usize) -> Self {
        Self(by.iter().map(|v| v * v).sum(), cell, site)
    }
}

/// The candidates of a brick that stay.
fn keep(source: &dyn Source, signs: &Signs<2>, moves: &Moves, brick: usize) -> [u64; 2] {
    let (sets, _) = moves.bricks[brick];
    if sets == [0; 2] {
        return sets;
    }
    let (around, first) = (around(source, brick), source.first(brick));
    std::array::from_fn(|site| {
        ones(sets[site])
            .filter(|&cell| stays(signs, moves, &around, first, site, cell))
            .fold(0, |set, cell| set | 1 << cell)
    })
}

fn stays(
    signs: &Signs<2>,
    moves: &Moves,
    around: &[Option<usize>; 27],
    first: [i32; 3],
    site: usize,
    cell: usize,
) -> bool {
    let local = [cell & 3, cell >> 2 & 3, cell >> 4].map(|v| v as i32);
    let world = |at: [i32; 3]| std::array::from_fn(|a| first[a] + at[a]);
    let Some(by) = around[13].and_then(|brick| moves.get(brick, site, cell)) else { return false };
    let own = Key::new(by, world(local), site);
    let own_sign = around[13].map_or(0, |brick| signs.inside[brick][site] >> cell & 1);
    // Neighbours of the other sign, and those that are candidates and have precedence.
    let (mut other, mut ahead) = (0u32, 0u32);
    for k in 0..NEIGHBOURS {
        let (site, d) = step(site, k);
        let at: [i32; 3] = std::array::from_fn(|a| local[a] + d[a]);
        let index = [0, 1, 2].map(|a| (at[a].div_euclid(4) + 1) as usize);
        let Some(brick) = around[index[0] + 3 * (index[1] + 3 * index[2])] else { continue };
        let [x, y, z] = at.map(|v| v.rem_euclid(4) as usize);
        let cell = x + 4 * (y + 4 * z);
        other |= u32::from(signs.inside[brick][site] >> cell & 1 != own_sign) << k;
        if let Some(by) = moves.get(brick, site, cell) {
            ahead |= u32::from(Key::new(by, world(at), site) < own) << k;
        }
    }
    if ahead & other != 0 || ones(ahead.into()).any(|q| is_pinched(other, ADJACENT[q])) {
        return false;
    }
    let is_doubled = |q: usize, r: usize| {
        let apexes = ADJACENT[q] & ADJACENT[r];
        apexes & other == apexes
    };
    !ones(ahead.into()).any(|q| ones((ahead & ADJACENT[q]).into()).any(|r| is_doubled(q, r)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_link_of_a_node_is_a_sphere() {
        let edges: u32 = ADJACENT.iter().map(|set| set.count_ones()).sum::<u32>() / 2;
        assert_eq!((NEIGHBOURS as u32 + 24) - edges, 2, "14 corners, 36 edges, 24 triangles");
        for k in 0..NEIGHBOURS {
            assert_eq!(ADJACENT[k].count_ones(), if k < 6 { 4 } else { 6 });
            assert_eq!(STEPS[opposed(k)], STEPS[k].map(|v| -v));
            for j in ones(ADJACENT[k].into()) {
                assert_eq!((ADJACENT[k] & ADJACENT[j]).count_ones(), 2, "an edge has two triangles");
            }
        }
    }

    #[test]
    fn steps_lead_there_and_back() {
        for site in 0..2 {
            for k in 0..NEIGHBOURS {
                let (other, d) = step(site, k);
                let (back, e) = step(other, opposed(k));
                assert_eq!((back, [0, 1, 2].map(|a| d[a] + e[a])), (site, [0; 3]));
            }
        }
    }

    #[test]
    fn the_move_meets_a_plane_exactly() {
        let (normal, offset) = ([0.3, -0.2, 0.5], 0.05);
        let plane = |p: [f64; 3]| (0..3).map(|a| normal[a] * p[a]).sum::<f64>() - offset;
        let values = STEPS.map(|s| plane(s.map(|v| 0.5 * f64::from(v))));
        let by = candidate(plane([0.0; 3]), &values).expect("near enough");
        assert!(plane(by).abs() < 1e-15);
        assert!(candidate(4.0 * plane([0.0; 3]), &values.map(|v| v - 3.0 * offset)).is_none(), "too far");
    }

    #[test]
    fn pieces_and_rings_are_told_apart() {
        assert!(is_connected(1) && is_connected(ALL) && !is_connected(0));
        assert!(!is_connected(0b11), "opposed neighbours do not touch");
        let ring = ADJACENT[0];
        let around: Vec<usize> = ones(ring.into()).collect();
        assert!(!is_pinched(0, ring) && !is_pinched(1 << around[0], ring));
        assert!(is_pinched(ring, ring), "all the way round");
        let far =
            around.iter().find(|&&k| k != around[0] && ADJACENT[around[0]] >> k & 1 == 0).expect("a ring of four");
        assert!(is_pinched(1 << around[0] | 1 << far, ring), "two runs");
    }
}
