use super::*;
use crate::{Params, VertexAttribute, mesh::Report, reconstruct};

/// A ragged body of particles with droplets, tunnels and cavities, with places and ids as attributes.
fn tangled(seed: usize) -> Mesh {
    let positions: Vec<[f32; 3]> = (0..400)
        .map(|i| [i * 37 + seed, i * i * 53 + 7 * seed, i * 101 + i / 7 * seed].map(|v| (v % 97) as f32 * 0.006))
        .collect();
    let mut mesh = reconstruct(&positions, &Params { normals: true, ..Params::new(0.025) }).unwrap();
    let ids = (0..mesh.vertices.len()).map(|v| v as f32).collect();
    mesh.attributes = vec![
        VertexAttribute::new("place", 3, mesh.vertices.as_flattened().to_vec()),
        VertexAttribute { carry: Carry::Nearest, ..VertexAttribute::new("id", 1, ids) },
    ];
    mesh
}

fn run(mesh: &Mesh, normal: [f64; 3], offset: f64) -> Mesh {
    let mut mesh = mesh.clone();
    cut(&mut mesh, &Plane { normal, offset }, &Control::default()).unwrap();
    mesh
}

#[test]
fn a_closed_manifold_stays_one_and_both_halves_make_the_whole() {
    for seed in 0..12 {
        let mesh = tangled(seed);
        let whole = Report::of(&mesh).signed_volume;
        for (normal, offset) in
            [([0.0, 0.0, 1.0], 0.29), ([0.0, -1.0, 0.0], -0.3), ([1.0, 2.0, -0.5], 0.8), ([-0.3, 0.1, 0.2], -0.02)]
        {
            let sides = [run(&mesh, normal, offset), run(&mesh, normal.map(|n: f64| -n), -offset)];
            let reports = sides.each_ref().map(Report::of);
            for report in &reports {
                assert!(report.closed_manifold() && report.unused_vertices == 0, "{seed} {normal:?} {report:?}");
                assert!(report.signed_volume > 0.1 * whole);
            }
            let both = reports[0].signed_volume + reports[1].signed_volume;
            assert!((both / whole - 1.0).abs() < 1e-5, "{both} {whole}");
        }
    }
}

#[test]
fn caps_lie_in_the_plane_to_the_last_bit_and_carry_what_is_there() {
    let mesh = tangled(1);
    let offset = 0.300_01f32;
    let found = run(&mesh, [0.0, 1.0, 0.0], offset.into());
    let on_cap = |v: usize| found.vertices[v][1] == offset;
    let caps: Vec<usize> = (0..found.vertices.len()).filter(|&v| on_cap(v)).collect();
    assert!(caps.len() > 100 && found.vertices.iter().all(|v| v[1] <= offset));
    for v in caps {
        assert_eq!(found.normals[v], [0.0, 1.0, 0.0]);
        for a in 0..3 {
            assert!((found.attributes[0].values[3 * v + a] - found.vertices[v][a]).abs() < 1e-6);
        }
        let id = found.attributes[1].values[v];
        let whose = mesh.vertices[id as usize];
        assert!(id.fract() == 0.0 && (0..3).all(|a| (whose[a] - found.vertices[v][a]).abs() < 0.0126));
    }
    // What is beyond is gone, what is flush stays: a second time nothing happens.
    assert_eq!(run(&found, [0.0, 2.0, 0.0], 2.0 * f64::from(offset)), found);
    let nothing = run(&mesh, [1.0, 0.0, 0.0], -9.0);
    assert!(nothing.vertices.is_empty() && nothing.triangles.is_empty() && nothing.attributes.len() == 2);
    assert_eq!(run(&mesh, [1.0, 0.0, 0.0], 9.0), mesh);
}

#[test]
fn threads_do_not_show_and_borders_stay_open() {
    let mesh = tangled(3);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&mesh, [0.3, 0.2, 1.0], 0.4))
    };
    assert_eq!(with(1), with(3));
    let mut open = mesh.clone();
    open.triangles.remove(7);
    // A hole on the side that stays, and one on the side that goes.
    let z = open.vertices[mesh.triangles[7][0] as usize][2];
    for (offset, holes) in [(f64::from(z) + 0.03, 3), (f64::from(z) - 0.03, 0)] {
        let report = Report::of(&run(&open, [0.0, 0.0, 1.0], offset));
        assert_eq!(report.boundary_half_edges, holes);
    }
}

#[test]
fn wrong_input_is_refused() {
    let mut mesh = tangled(0);
    let control = Control::default();
    for (normal, offset) in [([0.0; 3], 0.0), ([f64::NAN, 0.0, 1.0], 0.0), ([1.0, 0.0, 0.0], f64::INFINITY)] {
        assert!(matches!(cut(&mut mesh, &Plane { normal, offset }, &control), Err(Error::Parameter { .. })));
    }
    mesh.vertices[3] = [f32::NAN; 3];
    cut(&mut mesh, &Plane { normal: [0.0, 0.0, 1.0], offset: 0.3 }, &control).unwrap();
    mesh.triangles[0][0] = u32::MAX;
    assert!(cut(&mut mesh, &Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 }, &control).is_err());
}
