use super::*;
use crate::{Carry, Params, VertexAttribute, mesh::Comparison, mesh::Report, reconstruct};

/// A ragged body of particles with droplets, tunnels and cavities.
fn tangled(seed: usize) -> Mesh {
    let positions: Vec<[f32; 3]> = (0..400)
        .map(|i| [i * 37 + seed, i * i * 53 + 7 * seed, i * 101 + i / 7 * seed].map(|v| (v % 97) as f32 * 0.006))
        .collect();
    reconstruct(&positions, &Params::new(0.025)).unwrap()
}

fn run(mesh: &Mesh, target: Target) -> Mesh {
    let mut mesh = mesh.clone();
    decimate(&mut mesh, target, &Control::default()).unwrap();
    mesh
}

#[test]
fn a_closed_manifold_keeps_its_topology_and_meets_the_count() {
    for seed in 0..10 {
        let mesh = tangled(seed);
        let before = Report::of(&mesh);
        for target in [Target::Share(0.5), Target::Share(0.2), Target::Triangles(0)] {
            let after = Report::of(&run(&mesh, target));
            assert!(after.closed_manifold(), "{after:?}");
            assert_eq!(after.components, before.components);
            assert_eq!(after.euler_characteristic, before.euler_characteristic);
            assert_eq!((after.zero_area_triangles, after.unused_vertices), (0, 0));
            let (left, _) = target.limits(before.triangles);
            assert!(after.triangles <= left + 2 || left == 0, "{} {left}", after.triangles);
            if left > 0 {
                assert!(after.triangles + 2 > left);
                let lost = (after.signed_volume / before.signed_volume - 1.0).abs();
                assert!(lost < if 3 * left > before.triangles { 0.01 } else { 0.04 }, "{target:?} {lost}");
            }
        }
    }
}

#[test]
fn threads_do_not_show() {
    let mesh = tangled(3);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&mesh, Target::default()))
    };
    assert_eq!(with(1), with(3));
}

/// A flat square of n × n quads, open, with its vertices' places as an attribute.
fn square(n: u32) -> Mesh {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let vertices: Vec<[f32; 3]> = (0..=n).flat_map(|i| (0..=n).map(move |j| [i as f32, j as f32, 0.0])).collect();
    let quads = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Mesh {
        triangles: triangles.collect(),
        normals: vec![[0.0, 0.0, 1.0]; vertices.len()],
        attributes: vec![VertexAttribute::new("x", 2, vertices.iter().flat_map(|v| [v[0], v[1]]).collect())],
        vertices,
        ..Mesh::default()
    }
}

#[test]
fn a_border_stays_and_what_vertices_carry_is_interpolated() {
    let mesh = square(20);
    let found = run(&mesh, Target::Share(0.3));
    assert!(found.triangles.len() <= 240);
    let report = Report::of(&found);
    assert_eq!(report.boundary_half_edges, 80);
    assert!((report.area - 400.0).abs() < 1e-3);
    assert!(found.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    // Along an edge, so off by no more than the place is off it.
    for (v, x) in found.vertices.iter().zip(found.attributes[0].values.chunks(2)) {
        assert!(v[2] == 0.0 && (v[0] - x[0]).abs() < 1.0 && (v[1] - x[1]).abs() < 1.0, "{v:?} {x:?}");
    }
}

#[test]
fn ids_stay_ids() {
    let mut mesh = tangled(2);
    let values = (0..mesh.vertices.len()).map(|v| v as f32).collect();
    mesh.attributes = vec![VertexAttribute { carry: Carry::Nearest, ..VertexAttribute::new("id", 1, values) }];
    let found = run(&mesh, Target::Share(0.3));
    let mut known = vec![false; mesh.vertices.len()];
    for &id in &found.attributes[0].values {
        // Every vertex has the id of one that it stands for, and no two have the same.
        assert!(id.fract() == 0.0 && !std::mem::replace(&mut known[id as usize], true), "{id}");
    }
}

#[test]
fn a_collapse_that_turns_a_triangle_over_is_refused() {
    let mesh = square(4);
    let shrinking = Shrinking::new(&mesh, f64::INFINITY);
    // The edge from (1, 1) to (2, 1); the vertices around it lie within 0..=3 by 0..=2.
    let may = |place| shrinking.may_collapse(&mesh, [6, 11], place);
    assert!(may([1.5, 1.0, 0.0]) && may([1.2, 1.1, 0.3]));
    for beyond in [[1.5, 2.6, 0.0], [3.7, 1.0, 0.0], [1.5, -0.6, 0.1]] {
        assert!(!may(beyond), "{beyond:?}");
    }
}

#[test]
fn an_error_in_world_units_is_kept_to_and_used() {
    let mesh = tangled(1);
    let spacing = Params::new(0.025).spacing();
    let fine = run(&mesh, Target::Error(0.02 * spacing));
    let coarse = run(&mesh, Target::Error(0.2 * spacing));
    assert!(coarse.triangles.len() < fine.triangles.len() && fine.triangles.len() < mesh.triangles.len());
    let far = |found: &Mesh| Comparison::of(found, &mesh, 20_000).hausdorff();
    assert!(
        far(&fine) < 0.15 * spacing && far(&coarse) < spacing,
        "{} {}",
        far(&fine) / spacing,
        far(&coarse) / spacing
    );
    assert_eq!(run(&mesh, Target::Share(1.0)), mesh);
}

#[test]
fn what_cannot_collapse_stays_and_wrong_input_is_refused() {
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mut mesh = Mesh { vertices, triangles, ..Mesh::default() };
    assert_eq!(run(&mesh, Target::Triangles(0)), mesh);
    assert_eq!(run(&Mesh::default(), Target::Triangles(0)), Mesh::default());
    let mut refuse = |target| decimate(&mut mesh, target, &Control::default()).unwrap_err();
    assert!(matches!(refuse(Target::Share(1.5)), Error::Parameter { name: "share", .. }));
    assert!(matches!(refuse(Target::Error(f64::NAN)), Error::Parameter { name: "error", .. }));
    mesh.triangles[0][0] = 9;
    assert!(matches!(decimate(&mut mesh, Target::Share(0.5), &Control::default()), Err(Error::Count { .. })));
    let nan = Mesh { vertices: vec![[f32::NAN; 3]; 5], ..tangled(0) };
    assert!(decimate(&mut nan.clone(), Target::Share(0.5), &Control::default()).is_err());
}
