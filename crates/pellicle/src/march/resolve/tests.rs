use std::collections::{BTreeMap, BTreeSet};

use super::*;

/// Components, Euler number and boundary loops of one resolved cell.
fn topology(cell: &Resolved) -> (usize, i64, usize) {
    let triangles = &cell.triangles[..cell.len];
    let vertices: BTreeSet<u8> = triangles.iter().flatten().copied().collect();
    let halves: BTreeSet<(u8, u8)> = triangles.iter().flat_map(|t| (0..3).map(|i| (t[i], t[(i + 1) % 3]))).collect();
    assert_eq!(halves.len(), 3 * triangles.len(), "a half edge runs twice: {triangles:?}");
    let boundary: BTreeMap<u8, u8> = halves.iter().filter(|(a, b)| !halves.contains(&(*b, *a))).copied().collect();
    let edges = (halves.len() + boundary.len()) / 2;
    let mut seen = BTreeSet::new();
    let mut loops = 0;
    for &first in boundary.keys() {
        if seen.insert(first) {
            loops += 1;
            let mut at = boundary[&first];
            while seen.insert(at) {
                at = boundary[&at];
            }
        }
    }
    let mut label: BTreeMap<u8, u8> = vertices.iter().map(|&v| (v, v)).collect();
    for _ in 0..12 {
        for &(a, b) in &halves {
            let low = label[&a].min(label[&b]);
            label.insert(a, low);
            label.insert(b, low);
        }
    }
    let components = label.values().collect::<BTreeSet<_>>().len();
    (components, vertices.len() as i64 - edges as i64 + triangles.len() as i64, loops)
}

fn case_of(values: &[f64; 8]) -> u8 {
    (0..8).fold(0, |case, c| case | u8::from(values[c] > 0.0) << c)
}

fn check(values: [f64; 8], want: (usize, i64, usize)) {
    // Every rotation and reflection of the cube, and the sign turned where no face or saddle is in question.
    for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for flip in 0..8usize {
            let moved: [f64; 8] = std::array::from_fn(|c| {
                let from = (0..3).fold(0, |n, a| n | (c >> axes[a] & 1) << a);
                values[from ^ flip]
            });
            for sign in [1.0, -1.0] {
                let moved = moved.map(|v| v * sign);
                let cell = resolve(case_of(&moved), &moved, Level::Topological);
                assert_eq!(topology(&cell), want, "{moved:?}");
            }
        }
    }
}

#[test]
fn tunnels_of_single_cells() {
    // Case 4: opposite corners, near enough to join inside, and not.
    check([9.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 9.0], (1, 0, 2));
    check([1.0, -9.0, -9.0, -9.0, -9.0, -9.0, -9.0, 1.0], (2, 2, 2));
    // Case 13: one, three and four discs, and a tunnel beside a disc.
    check([6.69, -9.02, -1.63, 2.18, -8.61, 5.72, 4.8, -3.1], (1, 1, 1));
    check([10.01, -1.31, -1.25, 6.41, -10.39, 4.81, 3.17, -5.22], (3, 3, 3));
    check([5.16, -10.16, -10.22, 2.0, -7.29, 8.24, 3.96, -8.43], (4, 4, 4));
    check([3.09, -2.93, -2.62, 3.47, -2.54, 3.98, 1.95, -3.33], (2, 1, 3));
}

#[test]
fn every_case_with_random_values_keeps_the_rules() {
    let mut seed = 7u64;
    let mut found = BTreeMap::new();
    for case in 0..=255u8 {
        // Corners that alternate have the most ways to be joined.
        let alternates = (0..8).all(|c: u32| case >> c & 1 == (c.count_ones() as u8 & 1) ^ case & 1);
        for round in 0..if alternates { 4000 } else { 400 } {
            let values: [f64; 8] = std::array::from_fn(|c| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let size = 1.0 + (seed >> 54) as f64 * if round % 2 == 0 { 0.01 } else { 1.0 };
                if case >> c & 1 == 1 { size } else { -size }
            });
            for level in [Level::Consistent, Level::Topological] {
                let cell = resolve(case, &values, level);
                let (components, euler, loops) = topology(&cell);
                let crossed = (0..12).filter(|&e| {
                    let low = edge_corner(e);
                    (case >> low ^ case >> (low | 1 << (e / 4))) & 1 == 1
                });
                let used: BTreeSet<u8> = cell.triangles[..cell.len].iter().flatten().copied().collect();
                assert_eq!(used.len(), crossed.count() + cell.inner_len);
                // Discs and annuli only, and edges within a face only along the boundary.
                assert_eq!(euler, 2 * components as i64 - loops as i64);
                let halves: BTreeSet<_> =
                    cell.triangles[..cell.len].iter().flat_map(|t| (0..3).map(|i| (t[i], t[(i + 1) % 3]))).collect();
                for &(a, b) in &halves {
                    let in_face = a < 12 && b < 12 && !may_join(a, b);
                    assert_eq!(halves.contains(&(b, a)), !in_face, "case {case}: edge {a} {b}");
                }
                *found.entry((components, euler, loops)).or_insert(0) += 1;
            }
        }
    }
    // One annulus, a disc and an annulus, three discs and four discs all occur.
    for kind in [(1, 0, 2), (2, 1, 3), (3, 3, 3), (4, 4, 4)] {
        assert!(found.contains_key(&kind), "{kind:?} in {found:?}");
    }
}
