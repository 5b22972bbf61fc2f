//! A node of the body-centred lattice and its 14 neighbours: who touches whom, and the 24 tetrahedra around the node.
//!
//! The neighbours and the triangles between them are the *link* of the node, a triangulated sphere: 14 corners, 36 edges,
//! 24 triangles. A *star* numbers the node itself 0 and its neighbours from 1 on.
//!
//! Source: this project; the lattice is that of [`super::splits::BCC`].

use super::splits::{BCC, Node, doubled};
use crate::math::bits::ones;

/// Neighbours of a node: six along the axes, then eight of the other site.
pub(super) const NEIGHBOURS: usize = 14;
/// All neighbours, as a set.
pub(super) const ALL: u32 = (1 << NEIGHBOURS) - 1;

/// Twice the step to each neighbour, in units of cells.
pub(super) const STEPS: [[i32; 3]; NEIGHBOURS] = {
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

/// The neighbour at this step, if there is one.
pub(super) const fn neighbour_at(step: [i32; 3]) -> Option<usize> {
    let mut k = 0;
    while k < NEIGHBOURS {
        if STEPS[k][0] == step[0] && STEPS[k][1] == step[1] && STEPS[k][2] == step[2] {
            return Some(k);
        }
        k += 1;
    }
    None
}

/// The neighbour on the other side.
pub(super) const fn opposed(k: usize) -> usize {
    if k < 6 { k ^ 1 } else { 6 + (7 - (k - 6)) }
}

/// Site and cell, as seen from a node of `site`, of a neighbour.
#[inline(always)]
pub(super) const fn step(site: usize, k: usize) -> (usize, [i32; 3]) {
    let [x, y, z] = STEPS[k];
    if k < 6 {
        (site, [x / 2, y / 2, z / 2])
    } else {
        // From a corner the middles lie at ±½ in cells −1 and 0, from a middle the corners in cells 0 and 1.
        let s = site as i32;
        (1 - site, [(x - 1) / 2 + s, (y - 1) / 2 + s, (z - 1) / 2 + s])
    }
}

/// Twice the place of a member of a star, in units of cells.
pub(super) const fn member(m: usize) -> [i32; 3] {
    if m == 0 { [0; 3] } else { STEPS[m - 1] }
}

/// The direction from one member of a star to another, as the number of a neighbour; [`APART`] where they do not touch.
pub(super) static DIRECTIONS: [[u8; NEIGHBOURS + 1]; NEIGHBOURS + 1] = {
    let mut table = [[APART; NEIGHBOURS + 1]; NEIGHBOURS + 1];
    let mut a = 0;
    while a <= NEIGHBOURS {
        let mut b = 0;
        while b <= NEIGHBOURS {
            let (from, to) = (member(a), member(b));
            if let Some(k) = neighbour_at([to[0] - from[0], to[1] - from[1], to[2] - from[2]]) {
                table[a][b] = k as u8;
            }
            b += 1;
        }
        a += 1;
    }
    table
};
/// No direction.
const APART: u8 = u8::MAX;

/// Nodes along an axis that a brick's nodes and their neighbours take, from one below.
pub(super) const SIDE: usize = 6;
/// Nodes of one site in such a block.
pub(super) const BLOCK: usize = SIDE * SIDE * SIDE;

/// The place in a block of the node that lies so many cells from a brick's first.
#[inline(always)]
pub(super) const fn block_index([x, y, z]: [i32; 3]) -> usize {
    (x + 1) as usize + SIDE * ((y + 1) as usize + SIDE * (z + 1) as usize)
}

/// From a node of each site to each neighbour: its site, and how much further it stands in a block.
pub(super) static IN_BLOCK: [[(usize, isize); NEIGHBOURS]; 2] = {
    let mut table = [[(0, 0); NEIGHBOURS]; 2];
    let mut site = 0;
    while site < 2 {
        let mut k = 0;
        while k < NEIGHBOURS {
            let (other, [x, y, z]) = step(site, k);
            table[site][k] = (other, x as isize + SIDE as isize * (y as isize + SIDE as isize * z as isize));
            k += 1;
        }
        site += 1;
    }
    table
};

/// For each neighbour, those of the others that are its neighbours, too.
const ADJACENT: [u32; NEIGHBOURS] = {
    let mut table = [0; NEIGHBOURS];
    let mut k = 0;
    while k < NEIGHBOURS {
        let mut j = 0;
        while j < NEIGHBOURS {
            let (a, b) = (STEPS[k], STEPS[j]);
            if neighbour_at([b[0] - a[0], b[1] - a[1], b[2] - a[2]]).is_some() {
                table[k] |= 1 << j;
            }
            j += 1;
        }
        k += 1;
    }
    table
};

/// Tetrahedra around a node.
pub(super) const TETRAHEDRA: usize = 24;

/// For each site the tetrahedra around a node, as members of its star, with corners in the order that the split has them,
/// on which depends how a quadrangle is cut.
pub(super) static AROUND: [[[u8; 4]; TETRAHEDRA]; 2] = {
    let mut table = [[[0; 4]; TETRAHEDRA]; 2];
    let mut site = 0;
    while site < 2 {
        let (mut found, mut from) = (0, 0);
        // Tetrahedra of the node's cell and of the seven below it.
        while from < 8 {
            let below = [from & 1, from >> 1 & 1, from >> 2];
            let mut t = 0;
            while t < BCC.tetrahedra[0].len() {
                if let Some(members) = members(site, below, &BCC.tetrahedra[0][t].corners) {
                    table[site][found] = members;
                    found += 1;
                }
                t += 1;
            }
            from += 1;
        }
        assert!(found == TETRAHEDRA);
        site += 1;
    }
    table
};

/// The corners of a tetrahedron of the cell that lies `below` that of a node, as members of the node's star.
const fn members(site: usize, below: [i32; 3], corners: &[Node; 4]) -> Option<[u8; 4]> {
    let (mut to, mut is_around, mut c) = ([0; 4], false, 0);
    while c < 4 {
        let at = doubled(corners[c]);
        let s = site as i32;
        let step = [at[0] - 2 * below[0] - s, at[1] - 2 * below[1] - s, at[2] - 2 * below[2] - s];
        match neighbour_at(step) {
            Some(k) => to[c] = k as u8 + 1,
            None if step[0] == 0 && step[1] == 0 && step[2] == 0 => is_around = true,
            None => return None,
        }
        c += 1;
    }
    if is_around { Some(to) } else { None }
}

/// Whether a set of neighbours is one piece. No node is not.
pub(super) fn is_connected(set: u32) -> bool {
    set != 0 && piece(set) == set
}

/// The piece of a set that holds its first node.
pub(super) fn piece(set: u32) -> u32 {
    let mut grown = set & set.wrapping_neg();
    loop {
        let next = ones(grown.into()).fold(grown, |next, k| next | ADJACENT[k]) & set;
        if next == grown {
            return grown;
        }
        grown = next;
    }
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
    fn a_block_is_walked_as_the_lattice_is() {
        for site in 0..2 {
            for k in 0..NEIGHBOURS {
                let (other, [x, y, z]) = step(site, k);
                let there = block_index([2 + x, 3 + y, z]);
                assert_eq!((other, there as isize - block_index([2, 3, 0]) as isize), IN_BLOCK[site][k]);
            }
        }
    }

    #[test]
    fn the_tetrahedra_around_a_node_are_it_and_the_triangles_of_its_link() {
        for of_site in &AROUND {
            let mut triangles = std::collections::BTreeSet::new();
            for t in of_site {
                let others: Vec<usize> = t.iter().filter(|&&m| m != 0).map(|&m| usize::from(m) - 1).collect();
                let [a, b, c] = others[..] else { panic!("the node and three of its neighbours") };
                assert!(ADJACENT[a] >> b & ADJACENT[b] >> c & ADJACENT[c] >> a & 1 == 1);
                triangles.insert(1u32 << a | 1 << b | 1 << c);
            }
            assert_eq!(triangles.len(), TETRAHEDRA);
        }
    }

    #[test]
    fn pieces_are_told_apart() {
        assert!(is_connected(1) && is_connected(ALL) && !is_connected(0));
        assert!(!is_connected(0b11), "opposed neighbours do not touch");
        assert!(
            is_connected(ADJACENT[0]) && !is_connected(!ADJACENT[0] & ALL),
            "a ring parts its inside from the rest"
        );
        assert_eq!(piece(0b11), 1);
    }
}
