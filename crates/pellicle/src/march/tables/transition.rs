//! The table of transition cells, generated from its rule when the crate is compiled.
//!
//! A transition cell lies between one face of a coarse cell and the four faces of the fine cells across it. It is a flat
//! box: nine samples on its fine side, four on its coarse side, which are copies of the fine corners, so that 512 cases
//! tell everything. Axes u, v span the face, w points from the coarse to the fine side, and u, v, w are right-handed.
//!
//! ```text
//!  6 ── 7 ── 8        11 ─────── 12     nodes: fine u + 3v, coarse 9 + u + 2v
//!  │    │    │         │         │      edges: fine ones along u are u + 2v, along v 6 + u + 3v;
//!  3 ── 4 ── 5         │         │             coarse ones along u are 12 + v, along v 14 + u;
//!  │    │    │         │         │             those between the sides join copies of one sample: never crossed
//!  0 ── 1 ── 2         9 ─────── 10     faces: 4 fine, 1 coarse, 4 at the sides with 2 coarse and 3 fine nodes
//! ```
//!
//! The rule is that of the cube's table ([`super`]): on each face walk the nodes counter-clockwise as seen from outside;
//! each run of inside nodes gives one segment. A face's segments depend on its nodes alone, so the fine side agrees with the
//! fine cells, the coarse side with the coarse cell, and the sides with the transition cells beside it. The segments link
//! up to loops. A loop is triangulated without a diagonal that joins two vertices of one face, so that no edge of a
//! triangle is made twice; among those triangulations, the one with the least sum of squared diagonals is taken, vertices
//! at the middle of their edges and the cell a quarter as high as wide.
//!
//! Source: transition cells are Lengyel, Transition cells for dynamic multiresolution marching cubes, 2010; the rule by
//! runs of inside nodes is this project's.

use super::NONE;

/// Edges that can be crossed.
pub(crate) const EDGES: usize = 16;
/// Most triangles of a case.
pub(crate) const MOST: usize = 9;
const FACES: usize = 9;

/// How one case is triangulated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transition {
    /// Bit e set where edge e is crossed.
    pub(crate) edges: u16,
    /// Number of triangles.
    pub(crate) len: u8,
    /// Edges whose vertices make the triangles, counter-clockwise seen from outside the surface.
    pub(crate) triangles: [[u8; 3]; MOST],
}

/// All 512 cases, bit n set where fine node n is inside.
#[allow(long_running_const_eval)]
pub(crate) static TRANSITIONS: [Transition; 512] = {
    let mut cases = [Transition { edges: 0, len: 0, triangles: [[0; 3]; MOST] }; 512];
    let mut case = 0;
    while case < 512 {
        cases[case] = triangulate(case as u16);
        case += 1;
    }
    cases
};

/// Nodes of each face, counter-clockwise seen from outside the cell, and how many they are.
const RINGS: [([u8; 5], usize); FACES] = [
    ([0, 1, 4, 3, 0], 4),
    ([1, 2, 5, 4, 0], 4),
    ([3, 4, 7, 6, 0], 4),
    ([4, 5, 8, 7, 0], 4),
    ([9, 11, 12, 10, 0], 4),
    ([9, 10, 2, 1, 0], 5),
    ([10, 12, 8, 5, 2], 5),
    ([12, 11, 6, 7, 8], 5),
    ([11, 9, 0, 3, 6], 5),
];

const fn inside(case: u16, node: u8) -> bool {
    let fine = match node {
        0..9 => node,
        9 => 0,
        10 => 2,
        11 => 6,
        _ => 8,
    };
    case >> fine & 1 == 1
}

/// The edge between two neighbours of a ring.
const fn edge_between(a: u8, b: u8) -> u8 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    match (low < 9, high < 9, high - low) {
        (true, true, 1) => low % 3 + 2 * (low / 3),
        (true, true, _) => 6 + low,
        (true, false, _) => NONE,
        (_, _, 1) => 12 + (low - 9) / 2,
        _ => 14 + (low - 9),
    }
}

/// Of an edge: whether it lies along v (else u), and its lower node.
pub(crate) const fn edge_ends(edge: usize) -> (bool, usize) {
    match edge {
        0..6 => (false, edge % 2 + 3 * (edge / 2)),
        6..12 => (true, edge - 6),
        12..14 => (false, 9 + 2 * (edge - 12)),
        _ => (true, 9 + edge - 14),
    }
}

/// The faces that hold each edge, bit by bit.
const FACES_OF: [u16; EDGES] = {
    let mut faces = [0; EDGES];
    let mut face = 0;
    while face < FACES {
        let (ring, len) = RINGS[face];
        let mut i = 0;
        while i < len {
            let edge = edge_between(ring[i], ring[(i + 1) % len]);
            if edge != NONE {
                faces[edge as usize] |= 1 << face;
            }
            i += 1;
        }
        face += 1;
    }
    faces
};

/// For each edge where a segment starts, the edge where it ends.
const fn segments(case: u16) -> [u8; EDGES] {
    let mut next = [NONE; EDGES];
    let mut face = 0;
    while face < FACES {
        let (ring, len) = RINGS[face];
        let mut i = 0;
        while i < len {
            let (a, b) = (ring[i], ring[(i + 1) % len]);
            if !inside(case, a) && inside(case, b) {
                // The walk enters a run between a and b; follow it to where it leaves.
                let mut j = i + 1;
                while inside(case, ring[(j + 1) % len]) {
                    j += 1;
                }
                next[edge_between(a, b) as usize] = edge_between(ring[j % len], ring[(j + 1) % len]);
            }
            i += 1;
        }
        face += 1;
    }
    next
}

const fn triangulate(case: u16) -> Transition {
    let next = segments(case);
    let mut out = Transition { edges: 0, len: 0, triangles: [[0; 3]; MOST] };
    let mut first = 0;
    while first < EDGES {
        if next[first] != NONE && out.edges >> first & 1 == 0 {
            let (mut ring, mut len) = ([0; EDGES], 0);
            let mut edge = first as u8;
            while out.edges >> edge & 1 == 0 {
                out.edges |= 1 << edge;
                ring[len] = edge;
                len += 1;
                edge = next[edge as usize];
            }
            fill_ring(&ring, len, &mut out);
        }
        first += 1;
    }
    out
}

/// More than any sum of squared diagonals.
const NEVER: u32 = 1 << 24;

/// Twice the nominal place of an edge's vertex: a fine cell is 4 wide, the transition cell 2 high.
const fn place(edge: u8) -> [i32; 3] {
    let e = edge as i32;
    match edge {
        0..6 => [4 * (e % 2) + 2, 4 * (e / 2), 2],
        6..12 => [4 * ((e - 6) % 3), 4 * ((e - 6) / 3) + 2, 2],
        12..14 => [4, 8 * (e - 12), 0],
        _ => [8 * (e - 14), 4, 0],
    }
}

/// The squared length of a diagonal, or [`NEVER`] within one face.
const fn diagonal(a: u8, b: u8) -> u32 {
    if FACES_OF[a as usize] & FACES_OF[b as usize] != 0 {
        return NEVER;
    }
    let (p, q) = (place(a), place(b));
    let (x, y, z) = (p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    (x * x + y * y + z * z) as u32
}

/// Appends the triangles of a loop: the least sum of squared diagonals, by dynamic programming over its pieces.
const fn fill_ring(ring: &[u8; EDGES], len: usize, out: &mut Transition) {
    // Of the piece from i to j: the cost of its inner diagonals, and the corner of the triangle on its side i, j.
    let mut cost = [[0u32; EDGES]; EDGES];
    let mut apex = [[0usize; EDGES]; EDGES];
    let mut gap = 2;
    while gap < len {
        let mut i = 0;
        while i + gap < len {
            let j = i + gap;
            let (mut best, mut k) = (u32::MAX, i + 1);
            while k < j {
                let left = if k > i + 1 { diagonal(ring[i], ring[k]) } else { 0 };
                let right = if j > k + 1 { diagonal(ring[k], ring[j]) } else { 0 };
                let sum = cost[i][k] + cost[k][j] + left + right;
                if sum < best {
                    (best, apex[i][j]) = (sum, k);
                }
                k += 1;
            }
            cost[i][j] = best;
            i += 1;
        }
        gap += 1;
    }
    assert!(cost[0][len - 1] < NEVER, "every loop has a triangulation without a diagonal within a face");
    let (mut stack, mut depth) = ([(0, 0); EDGES], 1);
    stack[0] = (0, len - 1);
    while depth > 0 {
        depth -= 1;
        let (i, j) = stack[depth];
        if j > i + 1 {
            let k = apex[i][j];
            out.triangles[out.len as usize] = [ring[i], ring[k], ring[j]];
            out.len += 1;
            stack[depth] = (k, j);
            stack[depth + 1] = (i, k);
            depth += 2;
        }
    }
}

#[cfg(test)]
mod tests;
