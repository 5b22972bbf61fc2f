//! Numbers with known answers: radius, normals, attributes, invariance under moves by whole octets.

use pellicle::{Attribute, Lanes, Mesh, Params, Positions, mesh::Report};
use pellicle_conformance::{
    Scene, Subject, must, same_bytes,
    scenes::{self, lone_radius},
};

/// The mesh with normals and attributes.
fn mesh_with(scene: &Scene, attributes: &[Attribute<'_>], subject: &Subject) -> Mesh {
    let params = Params { normals: true, ..subject.params(scene) };
    let mesh = subject.mesh_of((&scene.positions).into(), attributes, &params);
    must(mesh.map_err(|e| format!("{}: {e}", scene.name))).0
}

fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

#[test]
fn vertices_of_a_lone_particle_approach_its_sphere_with_second_order() {
    let error = |cell_size: f64| {
        let scene = scenes::one().cell_size(cell_size);
        let radius = lone_radius(scene.params.iso) * scene.params.support();
        let mesh = Subject::default().mesh(&scene).expect("a mesh");
        let distance = |v: usize| {
            dot(subtract(mesh.position(v), scene.positions[0]), subtract(mesh.position(v), scene.positions[0])).sqrt()
        };
        (0..mesh.vertices.len()).map(|v| (distance(v) - radius).abs()).fold(0.0, f64::max) / radius
    };
    let errors = [0.4, 0.2, 0.1, 0.05].map(error);
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / 3.0, "halving the cell must quarter the error, or nearly: {errors:?}");
    }
    assert!(errors[3] < 3e-4, "{errors:?}");
}

#[test]
fn area_and_volume_of_a_lone_particle_approach_its_sphere_with_second_order() {
    let errors = [0.4, 0.2, 0.1].map(|cell_size| {
        let scene = scenes::one().cell_size(cell_size);
        let report = Report::of(&Subject::default().mesh(&scene).expect("a mesh"));
        let ((volume, _), (area, _)) = (scene.known.volume.expect("known"), scene.known.area.expect("known"));
        [1.0 - report.signed_volume / volume, 1.0 - report.area / area]
    });
    for pair in errors.windows(2) {
        for (finer, coarser) in pair[1].iter().zip(pair[0]) {
            assert!(*finer > 0.0 && *finer < coarser / 3.0, "{errors:?}");
        }
    }
}

#[test]
fn volume_of_a_ball_is_that_of_its_particles() {
    // At the default isovalue the surface lies close to the outermost particles' own cubes, whatever the radius.
    for radius in [0.8, 1.2, 1.6] {
        let ball = scenes::lattice_points(radius, |p| dot(p, p) < radius * radius);
        let scene = Scene::new("ball", ball);
        let report = Report::of(&Subject::default().mesh(&scene).expect("a mesh"));
        let share = report.signed_volume / (scene.positions.len() as f64 * scenes::SPACING.powi(3));
        assert!((share - 1.0).abs() < 0.03, "radius {radius}: {share}");
    }
}

#[test]
fn normals_of_a_lone_particle_point_away_from_it() {
    let scene = scenes::one();
    let mesh = mesh_with(&scene, &[], &Subject::default());
    assert_eq!(mesh.normals.len(), mesh.vertices.len());
    for (v, normal) in mesh.normals.iter().enumerate() {
        let normal = normal.map(f64::from);
        let away = subtract(mesh.position(v), scene.positions[0]);
        let cosine = dot(normal, away) / dot(away, away).sqrt();
        assert!((cosine - 1.0).abs() < 1e-6, "vertex {v}: {normal:?}, {away:?}");
    }
}

#[test]
fn normals_are_the_gradient_of_the_field() {
    let scene = scenes::torus();
    let mesh = mesh_with(&scene, &[], &Subject::default());
    let field = Field::of(&scene);
    for v in (0..mesh.vertices.len()).step_by(37) {
        let gradient = field.gradient(mesh.position(v));
        let length = dot(gradient, gradient).sqrt();
        let cosine = -dot(gradient, mesh.normals[v].map(f64::from)) / length;
        assert!((cosine - 1.0).abs() < 1e-5, "vertex {v}: cosine {cosine}, gradient {gradient:?}");
    }
}

/// The field, summed over all particles in `f64`.
struct Field<'a> {
    scene: &'a Scene,
    weights: Vec<f64>,
}

impl<'a> Field<'a> {
    fn of(scene: &'a Scene) -> Self {
        let mut field = Field { scene, weights: vec![1.0; scene.positions.len()] };
        field.weights = scene.positions.iter().map(|&p| 1.0 / field.at(p)).collect();
        field
    }

    fn at(&self, at: [f64; 3]) -> f64 {
        let term = |(&p, w): (&[f64; 3], &f64)| {
            let d = subtract(at, p);
            w * scenes::half_spline(dot(d, d).sqrt() / self.scene.params.support())
        };
        self.scene.positions.iter().zip(&self.weights).map(term).sum()
    }

    /// By central differences.
    fn gradient(&self, at: [f64; 3]) -> [f64; 3] {
        let h = 1e-4 * self.scene.params.support();
        std::array::from_fn(|a| {
            let moved = |by: f64| std::array::from_fn(|i| at[i] + if i == a { by } else { 0.0 });
            (self.at(moved(h)) - self.at(moved(-h))) / (2.0 * h)
        })
    }
}

#[test]
fn vertices_lie_on_the_isosurface() {
    let scene = scenes::torus().cell_size(0.25);
    let mesh = Subject::default().mesh(&scene).expect("a mesh");
    let field = Field::of(&scene);
    for v in (0..mesh.vertices.len()).step_by(101) {
        let value = field.at(mesh.position(v));
        assert!((value - scene.params.iso).abs() < 0.01, "vertex {v}: {value}");
    }
}

#[test]
fn normals_are_unit_and_agree_with_the_triangles() {
    for scene in [scenes::ball(), scenes::torus(), scenes::sheet(), scenes::shell(), scenes::far_from_the_origin()] {
        let mesh = mesh_with(&scene, &[], &Subject::default());
        let mut against = 0;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].map(f64::from));
            let (u, v) = (subtract(b, a), subtract(c, a));
            let face: [f64; 3] =
                std::array::from_fn(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]);
            against += triangle.iter().filter(|&&v| dot(face, mesh.normals[v as usize].map(f64::from)) < 0.0).count();
        }
        // Slivers may lean over.
        assert!(against * 500 <= mesh.triangles.len() * 3, "{}: {against} corners", scene.name);
        for normal in &mesh.normals {
            let n = normal.map(f64::from);
            assert!((dot(n, n) - 1.0).abs() < 1e-5, "{}: {normal:?}", scene.name);
        }
    }
}

#[test]
fn a_constant_attribute_stays_constant_and_a_linear_one_nearly_linear() {
    let scene = scenes::ball();
    let constant = vec![7.25f32; scene.positions.len()];
    let linear: Vec<f32> = scene.positions.iter().flat_map(|p| [p[0] as f32, (2.0 * p[1] - p[2]) as f32]).collect();
    let attributes = [Attribute::new("constant", 1, &constant), Attribute::new("linear", 2, &linear)];
    let mesh = mesh_with(&scene, &attributes, &Subject::default());
    assert_eq!(mesh.attributes[0].values.len(), mesh.vertices.len());
    assert!(mesh.attributes[0].values.iter().all(|v| (v / 7.25 - 1.0).abs() < 1e-5));
    for v in 0..mesh.vertices.len() {
        let at = mesh.position(v);
        let found = &mesh.attributes[1].values[2 * v..2 * v + 2];
        // At a surface all particles are on one side: the mean lags by up to a spacing.
        assert!((f64::from(found[0]) - at[0]).abs() < scenes::SPACING, "{at:?}: {found:?}");
        assert!((f64::from(found[1]) - (2.0 * at[1] - at[2])).abs() < 2.5 * scenes::SPACING, "{at:?}: {found:?}");
    }
}

#[test]
fn velocity_of_a_lone_particle_is_exact() {
    let velocity = [1.5f32, -2.25, 1e-3];
    let attributes = [Attribute::new("velocity", 3, &velocity)];
    let mesh = mesh_with(&scenes::one(), &attributes, &Subject::default());
    for found in mesh.attributes[0].values.chunks_exact(3) {
        for a in 0..3 {
            assert!((found[a] / velocity[a] - 1.0).abs() < 3e-7, "{found:?}");
        }
    }
}

#[test]
fn normals_and_attributes_are_the_same_bytes_on_every_backend() {
    let scene = scenes::torus();
    let values: Vec<f32> = scene.positions.iter().flat_map(|p| p.map(|v| v as f32 * 3.7)).collect();
    let attributes = [Attribute::new("velocity", 3, &values)];
    let expected = mesh_with(&scene, &attributes, &Subject::reference());
    assert_eq!(expected.normals.len(), expected.vertices.len());
    use pellicle_conformance::{Delivery::Chunks, Memory::Least};
    for subject in [
        Subject::default(),
        Subject { threads: 7, ..Subject::default() },
        Subject { delivery: Chunks, ..Subject::default() },
        Subject { delivery: Chunks, memory: Least, ..Subject::default() },
        Subject { lanes: Lanes::Portable, ..Subject::default() },
        Subject { lanes: Lanes::Avx2, ..Subject::default() },
    ] {
        if subject.available() {
            let found = mesh_with(&scene, &attributes, &subject);
            must(same_bytes(&found, &expected).map_err(|e| format!("{subject:?}: {e}")));
        }
    }
}

#[test]
fn moving_by_whole_chunks_and_octets_keeps_every_triangle() {
    // Lengths are powers of two, so that the move is exact: the lattice is the world's, not the data's.
    let positions: Vec<[f64; 3]> =
        scenes::ball().positions.iter().map(|p| p.map(|v| (v * 160.0).round() / 512.0)).collect();
    let params = Params::new(1.0 / 32.0);
    let mesh = |shift: f64| {
        let moved: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|v| v + shift)).collect();
        pellicle::reconstruct(&moved, &params).expect("a mesh")
    };
    let here = mesh(0.0);
    for shift in [64.0, -1024.0, 1048576.0] {
        let there = mesh(shift);
        assert_eq!(there.triangles, here.triangles, "moved by {shift}");
        for v in 0..here.vertices.len() {
            let (a, b) = (here.position(v), there.position(v));
            let near = |i: usize| (b[i] - shift - a[i]).abs() < 1e-3 * params.spacing();
            assert!((0..3).all(near), "moved by {shift}: {a:?} {b:?}");
        }
    }
}

#[test]
fn strided_and_packed_positions_give_the_same_bytes() {
    let scene = scenes::torus();
    let single: Vec<[f32; 3]> = scene.positions.iter().map(|p| p.map(|v| v as f32)).collect();
    let subject = Subject::default();
    let mesh = |positions: Positions<'_>| subject.mesh_of(positions, &[], &scene.params).expect("a mesh").0;
    let expected = mesh((&single).into());
    // Numbers between the positions must not matter, not even those that are none.
    let records: Vec<f32> = single.iter().flat_map(|p| [p[0], p[1], p[2], f32::NAN, 1e30]).collect();
    let doubles: Vec<f64> = records.iter().map(|&v| f64::from(v)).collect();
    let wide: Vec<[f64; 3]> = single.iter().map(|p| p.map(f64::from)).collect();
    must(same_bytes(&mesh(Positions::strided_f32(&records, 5).expect("a view")), &expected));
    must(same_bytes(&mesh(Positions::strided_f32(&records[..records.len() - 2], 5).expect("a cut view")), &expected));
    must(same_bytes(&mesh(Positions::strided_f64(&doubles, 5).expect("a view")), &expected));
    must(same_bytes(&mesh((&wide).into()), &expected));
}
