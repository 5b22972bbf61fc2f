//! The engine against an evaluation of every node.

use super::*;
use crate::{
    Mesh,
    march::{slices::Seeds, tables::COUNTS},
    mesh::Report,
};

/// A sequence of numbers in 0..1.
fn random(mut state: u64) -> impl FnMut() -> f32 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn cloud(seed: u64, count: usize, size: [f32; 3]) -> Vec<[f32; 3]> {
    let mut random = random(seed);
    (0..count).map(|_| size.map(|side| (random() - 0.5) * side)).collect()
}

/// Triangles that marching cubes makes of the field at every node, and nodes so close to the isovalue that rounding decides.
fn every_node(positions: &[[f32; 3]], params: &Params) -> (usize, usize) {
    let reach = params.reach / params.spacing;
    let bound = |pick: fn(f64, f64) -> f64| -> [f64; 3] {
        std::array::from_fn(|a| positions.iter().map(|p| f64::from(p[a]) / params.spacing).reduce(pick).unwrap())
    };
    let low = bound(f64::min).map(|v| (v - reach).floor() as i32 - 1);
    let high = bound(f64::max).map(|v| (v + reach).ceil() as i32 + 1);
    let nodes: [usize; 3] = std::array::from_fn(|a| (high[a] - low[a] + 1) as usize);
    let mut values = vec![0.0f64; nodes.iter().product()];
    for p in positions {
        let p = p.map(|v| f64::from(v) / params.spacing);
        let range: [_; 3] = std::array::from_fn(|a| (p[a] - reach).ceil() as i32..=(p[a] + reach).floor() as i32);
        for z in range[2].clone() {
            for y in range[1].clone() {
                for x in range[0].clone() {
                    let d: f64 = (0..3).map(|a| (f64::from([x, y, z][a]) - p[a]).powi(2)).sum();
                    let at: [usize; 3] = std::array::from_fn(|a| ([x, y, z][a] - low[a]) as usize);
                    let value = (1.0 - d / (reach * reach)).max(0.0).powi(2) / 4.0;
                    values[at[0] + nodes[0] * (at[1] + nodes[1] * at[2])] += value;
                }
            }
        }
    }
    let (mut triangles, iso) = (0, params.iso);
    for z in 0..nodes[2] - 1 {
        for y in 0..nodes[1] - 1 {
            for x in 0..nodes[0] - 1 {
                let corner = |c: usize| (x + (c & 1)) + nodes[0] * ((y + (c >> 1 & 1)) + nodes[1] * (z + (c >> 2)));
                let case = (0..8).fold(0, |case, c| case | usize::from(values[corner(c)] > iso) << c);
                triangles += usize::from(COUNTS[case]);
            }
        }
    }
    (triangles, values.iter().filter(|&v| (v - iso).abs() < 1e-5 * iso).count())
}

fn surface(positions: &[[f32; 3]], params: Params) -> (Mesh, Frame) {
    let mut mesh = Mesh::default();
    let frame = Engine::new(params).unwrap().update(positions, &mut mesh).unwrap();
    (mesh, frame)
}

#[track_caller]
fn assert_closed(mesh: &Mesh, what: &str) {
    let report = Report::of(mesh);
    assert!(
        report.closed_manifold() && report.unused_vertices == 0 && report.signed_volume > 0.0,
        "{what}: {report:?}"
    );
}

#[test]
fn a_complete_search_finds_what_evaluating_every_node_finds() {
    for (seed, count, size, spacing) in
        [(1, 300, [20.0; 3], 1.0), (2, 900, [24.0, 24.0, 12.0], 1.0), (3, 40, [9.0; 3], 0.5), (4, 2000, [16.0; 3], 2.2)]
    {
        let positions = cloud(seed, count, size);
        for block in [[32; 3], [8, 12, 4], [60; 3]] {
            let params = Params { block, ..Params::new(3.0, spacing) };
            let (mesh, frame) = surface(&positions, params.clone());
            let (triangles, doubtful) = every_node(&positions, &params);
            let context =
                format!("{count} particles, spacing {spacing}, blocks {block:?}, {doubtful} doubtful: {frame:?}");
            assert_closed(&mesh, &context);
            assert_eq!(frame.unmatched, 0, "{context}");
            assert!(frame.triangles.abs_diff(triangles) <= 20 * doubtful, "{triangles} triangles expected, {context}");
        }
    }
}

#[test]
fn particles_seeds_find_blobs() {
    let positions = cloud(5, 60, [7.0; 3]);
    let params = Params { seeds: Seeds::Particles, block: [16; 3], ..Params::new(3.0, 0.5) };
    let (mesh, frame) = surface(&positions, params.clone());
    let (all, complete) = surface(&positions, Params { seeds: Seeds::Complete, ..params });
    assert_closed(&all, "complete");
    assert_closed(&mesh, "particles");
    assert_eq!(mesh.triangles.len(), all.triangles.len(), "{frame:?} {complete:?}");
    assert!(frame.counts.live_slices >= 2 && complete.counts.live_slices == 2);
}
