//! Lists against a search through all particles.

use super::*;
use crate::lookup::columns::Want;

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

#[test]
fn a_nodes_particles_are_exactly_those_within_reach_in_canonical_order() {
    let extent = Extent { first: [100, -60, 8], nodes: [17, 13, 9] };
    for (count, reach, varied) in [(60, 3.0, false), (200, 2.5, true), (30, 9.0, true), (300, 0.4, false)] {
        let particles = strewn(count, reach, varied);
        let members: Vec<u32> = (0..count).collect();
        let (mut heights, mut lists, mut near) = (Heights::default(), Lists::default(), Near::default());
        near.provide(count as usize + LANES);
        heights.sort(extent, &particles, &members);
        let (mut found, mut entries) = (0, 0);
        for layer in 0..extent.nodes[2].div_ceil(SIDE) {
            lists.enter(extent, layer, &particles, &heights, Want { varied: true, who: true });
            entries += lists.entries();
            for brick in 0..5 * 4 {
                let first = [4 * (brick % 5), 4 * (brick / 5), 4 * layer];
                let list = lists.list(brick);
                for node in (0..64).map(|n| [n % 4, n / 4 % 4, n / 16]) {
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
        assert!(found > 20 && entries <= 64 * found, "{found} {entries}");
    }
}

#[test]
fn extremes_hold_for_every_node_of_a_brick() {
    use crate::math::simd::Portable;
    let extent = Extent { first: [100, -60, 8], nodes: [9; 3] };
    let particles = strewn(120, 6.0, true);
    let members: Vec<u32> = (0..120).collect();
    let (mut heights, mut lists) = (Heights::default(), Lists::default());
    heights.sort(extent, &particles, &members);
    let mut seen = 0;
    for layer in 0..3 {
        lists.enter(extent, layer, &particles, &heights, Want { varied: false, who: true });
        for brick in 0..9 {
            let list = lists.list(brick);
            for (i, &who) in list.who.iter().enumerate() {
                let [near, far] = list.extremes(Portable, i / LANES * LANES);
                let (near, far) = (f64::from(near[i % LANES]), f64::from(far[i % LANES]));
                for node in (0..64).map(|n| [n % 4, n / 4 % 4, n / 16]) {
                    let first = [4 * (brick % 3), 4 * (brick / 3), 4 * layer];
                    let at = std::array::from_fn(|a| extent.first[a] + (first[a] + node[a]) as i32);
                    let u = rest(&particles[who as usize], at);
                    assert!(near >= u.min(1.0) && far <= u.max(0.0), "{near} {u} {far}");
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 1000);
}
