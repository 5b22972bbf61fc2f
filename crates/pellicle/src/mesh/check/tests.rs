//! Each defect on the smallest mesh that has it, and the topology of shapes that everyone knows.

use super::*;

fn mesh(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
    Mesh { vertices: vertices.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() }
}

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn tetrahedron() -> Mesh {
    mesh(&CORNERS, &FACES)
}

/// `n` × `m` quads around a torus of radii 2 and 1, each split in two.
fn torus(n: u32, m: u32) -> Mesh {
    let turn = |i: u32, n: u32| (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
    let mut torus = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let ((su, cu), (sv, cv)) = (turn(i, n), turn(j, m));
            torus.vertices.push([((2.0 + cv) * cu) as f32, ((2.0 + cv) * su) as f32, sv as f32]);
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            torus.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            torus.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    torus
}

#[test]
fn tetrahedron_is_closed_and_outward() {
    let report = Report::of(&tetrahedron());
    assert!(report.closed_manifold());
    assert_eq!((report.components, report.euler_characteristic, report.genus()), (1, 2, 0.0));
    assert!((report.signed_volume - 1.0 / 6.0).abs() < 1e-15);
    assert!((report.area - (1.5 + 0.75f64.sqrt())).abs() < 1e-15);
    assert_eq!((report.unused_vertices, report.nan_vertices, report.zero_area_triangles), (0, 0, 0));
}

#[test]
fn tetrahedron_inside_out_is_closed_with_negative_volume() {
    let flipped = mesh(&CORNERS, &FACES.map(|[a, b, c]| [a, c, b]));
    let report = Report::of(&flipped);
    assert!(report.closed_manifold());
    assert!(report.signed_volume < 0.0);
}

#[test]
fn torus_has_genus_one() {
    let report = Report::of(&torus(64, 48));
    assert!(report.closed_manifold());
    assert_eq!((report.components, report.euler_characteristic, report.genus()), (1, 0, 1.0));
    let volume = 4.0 * std::f64::consts::PI.powi(2);
    assert!((report.signed_volume / volume - 1.0).abs() < 0.01, "{}", report.signed_volume);
}

#[test]
fn two_pieces_are_two_components() {
    let mut two = tetrahedron();
    two.vertices.extend(CORNERS);
    two.triangles.extend(FACES.map(|t| t.map(|v| v + 4)));
    let report = Report::of(&two);
    assert!(report.closed_manifold());
    assert_eq!((report.components, report.euler_characteristic, report.genus()), (2, 4, 0.0));
}

#[test]
fn empty_mesh_is_closed() {
    let report = Report::of(&Mesh::default());
    assert!(report.closed_manifold());
    assert_eq!(report, Report::default());
}

#[test]
fn missing_triangle_is_a_boundary() {
    let report = Report::of(&mesh(&CORNERS, &FACES[..3]));
    assert!(!report.closed_manifold());
    assert_eq!(report.boundary_half_edges, 3);
    assert_eq!((report.duplicate_half_edges, report.non_manifold_edges, report.non_manifold_vertices), (0, 0, 0));
    assert_eq!(report.euler_characteristic, 1);
}

#[test]
fn flipped_triangle_runs_along_half_edges_twice() {
    let mut flipped = FACES;
    flipped[3].swap(1, 2);
    let report = Report::of(&mesh(&CORNERS, &flipped));
    assert!(!report.closed_manifold());
    assert_eq!((report.duplicate_half_edges, report.boundary_half_edges, report.non_manifold_edges), (3, 3, 0));
}

#[test]
fn two_tetrahedra_on_one_edge_make_it_non_manifold() {
    // The second shares vertices 0 and 1: four triangle sides on that edge, two in each direction.
    let mut vertices = CORNERS.to_vec();
    vertices.extend([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    let second = FACES.map(|t| t.map(|v| if v < 2 { v } else { v + 2 }));
    let report = Report::of(&mesh(&vertices, &[FACES, second].concat()));
    assert!(!report.closed_manifold());
    assert_eq!((report.non_manifold_edges, report.duplicate_half_edges, report.boundary_half_edges), (1, 2, 0));
    assert_eq!(report.non_manifold_vertices, 0, "the fans at both ends are joined through the edge");
}

#[test]
fn two_tetrahedra_on_one_vertex_make_it_non_manifold() {
    let mut vertices = CORNERS.to_vec();
    vertices.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    let second = FACES.map(|t| t.map(|v| if v == 0 { 0 } else { v + 3 }));
    let report = Report::of(&mesh(&vertices, &[FACES, second].concat()));
    assert!(!report.closed_manifold());
    assert_eq!((report.non_manifold_vertices, report.non_manifold_edges, report.boundary_half_edges), (1, 0, 0));
    assert_eq!(report.components, 1);
}

#[test]
fn repeated_index_is_found_though_no_half_edge_is_open() {
    let mut triangles = FACES.to_vec();
    triangles.push([1, 1, 1]);
    let report = Report::of(&mesh(&CORNERS, &triangles));
    assert!(!report.closed_manifold());
    assert_eq!((report.repeated_index_triangles, report.boundary_half_edges), (1, 0));
    assert_eq!(report.zero_area_triangles, 1);
}

#[test]
fn collapsed_triangle_counts_its_edges_once() {
    // (0, 0, 1) with an edge from 0 to 0, and one between 0 and 1 walked there and back.
    let report = Report::of(&mesh(&CORNERS[..2], &[[0, 0, 1]]));
    assert_eq!((report.repeated_index_triangles, report.boundary_half_edges), (1, 0));
    assert_eq!(report.euler_characteristic, 1);
}

#[test]
fn index_past_the_end_stops_the_judgement() {
    let report = Report::of(&mesh(&CORNERS, &[[0, 1, 4]]));
    assert!(!report.closed_manifold());
    assert_eq!((report.out_of_range_triangles, report.components, report.boundary_half_edges), (1, 0, 0));
}

#[test]
fn unused_vertex_is_no_component() {
    let mut lone = tetrahedron();
    lone.vertices.insert(0, [9.0; 3]);
    lone.triangles.iter_mut().flatten().for_each(|v| *v += 1);
    let report = Report::of(&lone);
    assert!(report.closed_manifold());
    assert_eq!((report.unused_vertices, report.components, report.euler_characteristic), (1, 1, 2));
}

#[test]
fn vertices_that_are_not_finite_are_counted_once_each() {
    let mut broken = tetrahedron();
    broken.vertices[1] = [f32::NAN, f32::INFINITY, 0.0];
    broken.vertices[2][2] = f32::NEG_INFINITY;
    let report = Report::of(&broken);
    assert_eq!(report.nan_vertices, 2);
    assert!(report.area.is_nan());
    assert!(report.closed_manifold(), "topology does not depend on positions");
}

#[test]
fn measures_ignore_the_origin() {
    let mut far = tetrahedron();
    far.origin = [1e9, -1e9, 1e9];
    assert_eq!(Report::of(&far), Report::of(&tetrahedron()));
}

#[test]
fn same_report_for_any_thread_count() {
    let mesh = torus(300, 200);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| Report::of(&mesh))
    };
    let one = on(1);
    for threads in [2, 7] {
        let many = on(threads);
        assert_eq!(one, many);
        assert_eq!(one.area.to_bits(), many.area.to_bits());
        assert_eq!(one.signed_volume.to_bits(), many.signed_volume.to_bits());
    }
}
