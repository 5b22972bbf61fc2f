use std::collections::BTreeSet;

use super::*;
use crate::march::tables::{CASES, edge_between as cube_edge};

type HalfEdges = BTreeSet<(u8, u8)>;

/// Sides of the triangles of a case.
fn half_edges(case: usize) -> Vec<(u8, u8)> {
    let entry = &TRANSITIONS[case];
    let triangles = &entry.triangles[..entry.len.into()];
    triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect()
}

/// Those within one face.
fn on_face(case: usize, face: usize) -> HalfEdges {
    let holds = |e: u8| FACES_OF[usize::from(e)] >> face & 1 == 1;
    half_edges(case).into_iter().filter(|&(a, b)| holds(a) && holds(b)).collect()
}

/// The two nodes of an edge.
fn ends(edge: u8) -> [u8; 2] {
    let pairs = RINGS.iter().flat_map(|&(ring, len)| (0..len).map(move |i| [ring[i], ring[(i + 1) % len]]));
    pairs.into_iter().find(|&[a, b]| edge_between(a, b) == edge).expect("an edge lies on a ring")
}

#[test]
fn every_edge_lies_on_two_faces_and_has_its_ends() {
    for edge in 0..EDGES {
        assert_eq!(FACES_OF[edge].count_ones(), 2, "edge {edge}");
        let (along_v, low) = edge_ends(edge);
        let step = if low < 9 { [1, 3] } else { [1, 2] }[usize::from(along_v)];
        assert_eq!(edge_between(low as u8, (low + step) as u8), edge as u8);
    }
}

#[test]
fn every_case_uses_exactly_its_crossed_edges() {
    for (case, entry) in TRANSITIONS.iter().enumerate() {
        let used = half_edges(case).iter().fold(0u16, |set, &(e, _)| set | 1 << e);
        let crossed = (0..EDGES as u8).filter(|&e| {
            let [a, b] = ends(e);
            inside(case as u16, a) != inside(case as u16, b)
        });
        assert_eq!(used, crossed.fold(0, |set, e| set | 1 << e), "case {case}");
        assert_eq!(used, entry.edges, "case {case}");
    }
}

#[test]
fn the_longest_case_fills_the_table() {
    assert_eq!(TRANSITIONS.iter().map(|entry| entry.len).max(), Some(MOST as u8));
}

#[test]
fn within_a_cell_every_edge_of_a_triangle_is_made_once_each_way() {
    for case in 0..512 {
        let list = half_edges(case);
        let halves: HalfEdges = list.iter().copied().collect();
        assert_eq!(halves.len(), list.len(), "case {case}: doubled");
        for &(a, b) in &halves {
            assert_ne!(a, b, "case {case}");
            let in_face = FACES_OF[usize::from(a)] & FACES_OF[usize::from(b)] != 0;
            assert_eq!(halves.contains(&(b, a)), !in_face, "case {case}: edge {a} {b}");
        }
    }
}

#[test]
fn every_case_is_a_set_of_discs() {
    for (case, entry) in TRANSITIONS.iter().enumerate() {
        // Each loop of n vertices takes n - 2 triangles; count the loops by following the segments.
        let next = segments(case as u16);
        let mut left = entry.edges;
        let mut loops = 0;
        while left != 0 {
            loops += 1;
            let first = left.trailing_zeros() as u8;
            let mut edge = first;
            loop {
                left &= !(1 << edge);
                edge = next[usize::from(edge)];
                if edge == first {
                    break;
                }
            }
        }
        assert_eq!(u32::from(entry.len), entry.edges.count_ones() - 2 * loops, "case {case}");
    }
}

/// Sides of a cube's triangles within the face z = `side`, edges named by `name`.
fn cube_half_edges(case: usize, side: usize, name: impl Fn(usize, usize) -> u8) -> HalfEdges {
    let corners: [usize; 4] = std::array::from_fn(|c| c + 4 * side);
    let named = |edge: u8| {
        let pairs = [(0, 1), (1, 3), (2, 3), (0, 2)];
        pairs.into_iter().find(|&(a, b)| cube_edge(corners[a], corners[b]) == edge.into()).map(|(a, b)| name(a, b))
    };
    let entry = &CASES[case];
    let sides = entry.triangles[..entry.len.into()].iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
    sides.filter_map(|(a, b)| Some((named(a)?, named(b)?))).collect()
}

#[test]
fn the_fine_side_agrees_with_the_fine_cells() {
    for case in 0..512usize {
        for quad in 0..4usize {
            let node = |c: usize| (quad % 2 + c % 2) + 3 * (quad / 2 + c / 2);
            let face = (0..4).fold(0, |set, c| set | (case >> node(c) & 1) << c);
            let here: HalfEdges = on_face(case, quad).into_iter().map(|(a, b)| (b, a)).collect();
            for above in 0..16 {
                let cube = cube_half_edges(face | above << 4, 0, |a, b| edge_between(node(a) as u8, node(b) as u8));
                assert_eq!(here, cube, "case {case}, quad {quad}, above {above}");
            }
        }
    }
}

#[test]
fn the_coarse_side_agrees_with_the_coarse_cell() {
    for case in 0..512usize {
        let face = (0..4).fold(0, |set, c| set | (case >> (2 * (c % 2) + 6 * (c / 2)) & 1) << c);
        let here: HalfEdges = on_face(case, 4).into_iter().map(|(a, b)| (b, a)).collect();
        for below in 0..16 {
            let cube = cube_half_edges(face << 4 | below, 1, |a, b| edge_between(9 + a as u8, 9 + b as u8));
            assert_eq!(here, cube, "case {case}, below {below}");
        }
    }
}

/// What a side face draws, its crossed edges named along the walk that begins with the two coarse nodes: 0 is the coarse
/// edge, 1 and 2 the fine ones.
fn side_half_edges(case: usize, side: usize) -> ([bool; 3], HalfEdges) {
    let (ring, _) = RINGS[5 + side];
    let name = |edge: u8| {
        let edges = [edge_between(ring[0], ring[1]), edge_between(ring[2], ring[3]), edge_between(ring[3], ring[4])];
        edges.iter().position(|&e| e == edge).expect("an edge of this side") as u8
    };
    let signs = [ring[2], ring[3], ring[4]].map(|node| inside(case as u16, node));
    (signs, on_face(case, 5 + side).into_iter().map(|(a, b)| (name(a), name(b))).collect())
}

#[test]
fn sides_agree_with_any_side_they_can_meet() {
    // A side face meets the side of another cell that sees its three samples in the opposite order, whichever sides they
    // are: in a row of cells, around an edge of a block, or reflected. It must draw the reverse there.
    let mut drawn = std::collections::BTreeMap::new();
    for case in 0..512 {
        for side in 0..4 {
            let (signs, halves) = side_half_edges(case, side);
            assert_eq!(drawn.entry(signs).or_insert_with(|| halves.clone()), &halves, "case {case}, side {side}");
        }
    }
    assert_eq!(drawn.len(), 8);
    for (signs, halves) in &drawn {
        let mut seen_from_there = *signs;
        seen_from_there.reverse();
        // Seen from the other cell, the first fine edge is the second.
        let renamed = |e: u8| [0, 2, 1][usize::from(e)];
        let reversed: HalfEdges = halves.iter().map(|&(a, b)| (renamed(b), renamed(a))).collect();
        assert_eq!(drawn[&seen_from_there], reversed, "{signs:?}");
        // One walk enters and leaves at most one run: copies of a sample are neighbours on the ring.
        assert!(halves.len() <= 1);
    }
}

#[test]
fn a_single_inside_corner_faces_outward() {
    let entry = &TRANSITIONS[1];
    // Two fine and two coarse edges leave the corner: a strip.
    assert_eq!((entry.edges, entry.len), (1 << 0 | 1 << 6 | 1 << 12 | 1 << 14, 2));
    for t in &entry.triangles[..2] {
        let [a, b, c] = t.map(place);
        let (p, q): (Vec<i32>, Vec<i32>) = (0..3).map(|i| (b[i] - a[i], c[i] - a[i])).unzip();
        let normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2]];
        assert!(normal.iter().all(|&n| n > 0), "{normal:?}");
    }
}
