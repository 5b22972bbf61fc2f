use super::*;
use crate::math::simd::Portable;

/// Particles in and around a block of 12³ nodes, with one reach or many.
fn particles(count: usize, reaches: &[f32]) -> Vec<Placed> {
    let mut state = 12345u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    (0..count)
        .map(|i| Placed {
            node: std::array::from_fn(|_| (random() * 18.0) as i32 - 3),
            offset: std::array::from_fn(|_| random() - 0.5),
            reach: reaches[i % reaches.len()],
            strength: 1.0 + i as f32,
            index: i as u32,
        })
        .collect()
}

fn distance_sq(p: &Placed, node: [i32; 3]) -> f64 {
    (0..3).map(|a| (f64::from(node[a] - p.node[a]) - f64::from(p.offset[a])).powi(2)).sum()
}

fn check(reaches: &[f32], border: Border) {
    let particles = particles(400, reaches);
    let of: Vec<u32> = (0..400).collect();
    let extent = Extent { first: [0; 3], nodes: [12; 3] };
    let (mut columns, mut near) = (Columns::default(), Near::default());
    columns.build(extent, border, &particles, &of, true);
    columns.prepare(&mut near);
    let (mut found, mut expected) = (0, 0);
    // Up, then down again: the cursors must follow.
    for z in (0..12).chain((0..12).rev()) {
        for column in 0..144 {
            columns.find(Portable, column, z, Want { varied: true, who: true }, &mut near);
            let (x, y) = ((column % 12) as i32, (column / 12) as i32);
            let mut got: Vec<u32> = near.who().map(|w| columns.particles()[w].index).collect();
            for (lane, who) in near.who().enumerate() {
                assert_eq!(near.strength[lane], columns.particles()[who].strength);
            }
            got.sort_unstable();
            let inside = |v: i32| border == Border::Open || (1..11).contains(&v);
            let want: Vec<u32> = particles
                .iter()
                .filter(|p| inside(x) && inside(y) && distance_sq(p, [x, y, z]) < f64::from(p.reach).powi(2))
                .map(|p| p.index)
                .collect();
            // Only what lies at the reach itself, within rounding, may go either way.
            for odd in got.iter().filter(|i| !want.contains(i)).chain(want.iter().filter(|i| !got.contains(i))) {
                let p = &particles[*odd as usize];
                assert!(
                    (distance_sq(p, [x, y, z]) / f64::from(p.reach).powi(2) - 1.0).abs() < 1e-5,
                    "{odd} at {x} {y} {z}"
                );
            }
            found += got.len();
            expected += want.len();
        }
    }
    assert!(expected > 30 && found.abs_diff(expected) <= 4, "{found} {expected}");
    assert_eq!(near.kept, found as u64, "a field is evaluated for no particle out of reach");
}

#[test]
fn a_look_up_finds_exactly_the_particles_within_reach() {
    check(&[3.0], Border::Open);
    check(&[3.0, 1.2, 2.4], Border::Open);
    check(&[0.4], Border::Open);
}

#[test]
fn an_empty_border_holds_nothing() {
    check(&[3.0, 2.0], Border::Empty);
}

#[test]
fn a_node_finds_the_same_in_every_block() {
    let particles = particles(400, &[3.0]);
    let of: Vec<u32> = (0..400).collect();
    let bits = |first: Coord, node: Coord| {
        let (mut columns, mut near) = (Columns::default(), Near::default());
        columns.build(Extent { first, nodes: [12, 10, 11] }, Border::Open, &particles, &of, false);
        columns.prepare(&mut near);
        let [x, y, z]: [i32; 3] = std::array::from_fn(|a| node[a] - first[a]);
        columns.find(Portable, (x + 12 * y) as usize, z, Want { varied: false, who: true }, &mut near);
        let who: Vec<u32> = near.who().map(|w| columns.particles()[w].index).collect();
        (near.u[..near.len].iter().map(|u| u.to_bits()).collect::<Vec<_>>(), who)
    };
    for node in [[4, 5, 6], [7, 4, 3], [5, 5, 5]] {
        let here = bits([0; 3], node);
        assert!(here.0.len() > 3);
        for first in [[-3, 1, 2], [2, -2, -4], [1, 1, -5]] {
            assert_eq!(bits(first, node), here, "{node:?} from {first:?}");
        }
    }
}
