//! Lists against a search through all particles.

use super::*;
use crate::math::simd::Portable;

/// Particles around a block whose reaches differ, and some that touch it by a hair.
fn strewn(count: u32, reach: f32, varied: bool) -> Vec<Placed> {
    let mut state = 11u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    (0..count)
        .map(|index| Placed {
            node: [0, 1, 2].map(|a| (random() * 44.0) as i32 - 14 + [100, -60, 8][a]),
            offset: if index % 5 == 0 { [0.0; 3] } else { [random() - 0.5, random() - 0.5, random() - 0.5] },
            reach: if varied { reach * (0.1 + 0.9 * random()) } else { reach },
            strength: 1.0 + random(),
            index,
        })
        .collect()
}

/// What each particle leaves of its reach at a node, by 64-bit arithmetic.
fn rest(p: &Placed, node: [i32; 3]) -> f64 {
    let d = (0..3).map(|a| (f64::from(node[a] - p.node[a]) - f64::from(p.offset[a])).powi(2)).sum::<f64>();
    1.0 - d / f64::from(p.reach).powi(2)
}

/// The nodes of a brick that the block has.
fn nodes_of(extent: Extent, first: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let nodes = (0..64).map(|n| [n % 4, n / 4 % 4, n / 16]);
    nodes.filter(move |node| (0..3).all(|a| first[a] + node[a] < extent.nodes[a]))
}

#[test]
fn a_nodes_particles_are_exactly_those_within_reach_in_canonical_order() {
    let extent = Extent { first: [100, -60, 8], nodes: [17, 13, 9] };
    for (count, reach, varied) in
        [(60, 3.0, false), (200, 2.5, true), (120, 9.0, true), (40, 30.0, true), (300, 0.4, false)]
    {
        let particles = strewn(count, reach, varied);
        let members: Vec<u32> = (0..count).collect();
        let (mut heights, mut lists, mut near) = (Heights::default(), Lists::default(), Near::default());
        near.provide(count as usize + LANES);
        heights.sort(extent, &particles, &members);
        let (mut found, mut entries) = (0, 0);
        for layer in 0..extent.nodes[2].div_ceil(SIDE) {
            lists.begin(Portable, extent, layer, &particles, &heights);
            entries += lists.entries();
            for brick in 0..5 * 4 {
                let first = [4 * (brick % 5), 4 * (brick / 5), 4 * layer];
                let list = lists.list(brick);
                for node in nodes_of(extent, first) {
                    let at: [i32; 3] = std::array::from_fn(|a| extent.first[a] + (first[a] + node[a]) as i32);
                    list.find(node, &mut near);
                    let got: Vec<usize> = near.who().collect();
                    let doubtful = |i: &usize| rest(&particles[*i], at).abs() < 1e-5;
                    let mut want: Vec<usize> = (0..count as usize).filter(|&i| rest(&particles[i], at) > 0.0).collect();
                    want.sort_by_key(|&i| (particles[i].node[2], i));
                    let sure = |v: &[usize]| v.iter().copied().filter(|i| !doubtful(i)).collect::<Vec<_>>();
                    assert_eq!(sure(&got), sure(&want), "{count} {reach} at {at:?}");
                    for (&i, &u) in got.iter().zip(near.rests()) {
                        assert!((f64::from(u) - rest(&particles[i], at)).abs() < 1e-5);
                    }
                    found += got.len();
                }
            }
        }
        assert!(found > 0 && entries <= 64 * found, "{found} {entries}");
    }
}
