//! The speed of the surface along its normal, against bodies that move as a whole and that grow.

use pellicle::{Attribute, Control, Error, Mesh, Params, Reconstructor, ScalarField, mesh::Report};

/// A ball of jittered particles of unit spacing.
fn ball(radius: i32) -> Vec<[f32; 3]> {
    let grid = (-radius..=radius)
        .flat_map(|x| (-radius..=radius).flat_map(move |y| (-radius..=radius).map(move |z| [x, y, z])));
    let jitter = |v: i32, i: i32| ((v * 7919 + i * 101) % 13) as f32 * 0.004;
    grid.filter(|p| p.iter().map(|v| v * v).sum::<i32>() <= radius * radius)
        .map(|p| [0, 1, 2].map(|a| p[a] as f32 + jitter(p[a], p[(a + 1) % 3])))
        .collect()
}

fn surface(positions: &[[f32; 3]], velocities: &[f32], params: &Params) -> Mesh {
    let attributes = [Attribute::normal_speed("normal_velocity", velocities)];
    let control = Control::default();
    let mut reconstructor = Reconstructor::new();
    let surface = reconstructor.extract(positions.into(), &attributes, params, &control).unwrap();
    surface.to_mesh().unwrap()
}

fn fields() -> Vec<(Params, bool)> {
    let with = |name: &str| {
        let field = ScalarField::from_name(name).unwrap_or_else(|| panic!("no field {name}"));
        let is_additive = matches!(field, ScalarField::Sph | ScalarField::Anisotropic(_) | ScalarField::Metaball(_));
        (Params { normals: true, cell_size: 1.0, ..Params::with_field(0.5, field) }, is_additive)
    };
    ScalarField::NAMES.into_iter().map(with).collect()
}

#[test]
fn a_body_that_moves_as_a_whole_has_the_normal_part_of_its_velocity() {
    let positions = ball(5);
    let velocity = [3.0, -2.0, 0.5f32];
    let velocities: Vec<f32> = positions.iter().flat_map(|_| velocity).collect();
    let fields = fields();
    for (params, _) in fields {
        let mesh = surface(&positions, &velocities, &params);
        let speeds = &mesh.attributes[0];
        assert_eq!((speeds.components, speeds.values.len()), (1, mesh.vertices.len()));
        for (speed, normal) in speeds.values.iter().zip(&mesh.normals) {
            let wanted: f32 = (0..3).map(|a| velocity[a] * normal[a]).sum();
            assert!((speed - wanted).abs() < 2e-3, "{:?}: {speed} {wanted}", params.field);
        }
    }
}

/// Mean distance of the surface from the origin: of a ball its radius.
fn mean_radius(mesh: &Mesh) -> f64 {
    mesh.vertices.iter().map(|v| v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt()).sum::<f64>()
        / mesh.vertices.len() as f64
}

#[test]
fn a_ball_that_grows_has_the_speed_of_its_radius() {
    let positions = ball(6);
    let velocities: Vec<f32> = positions.iter().flatten().map(|x| 0.5 * x).collect();
    for (params, is_additive) in fields() {
        let mesh = surface(&positions, &velocities, &params);
        let values = &mesh.attributes[0].values;
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
        if !matches!(params.field, ScalarField::Metaball(_)) {
            // Particles are farther in than the surface, and volumes do not know that the ball grows.
            let radius = mean_radius(&mesh);
            let wanted = if is_additive { 0.5 * radius..0.5 * radius * 2.0 } else { 0.6 * radius..1.05 * radius };
            assert!(wanted.contains(&(2.0 * mean)), "{:?}: {mean} {radius}", params.field);
            continue;
        }
        // Metaballs bring the same wherever they are: over the surface the speeds add up to how the volume grows.
        // On finer cells, since vertices lie on chords.
        let (step, params) = (2e-2, Params { cell_size: 0.5, ..params });
        let mesh = surface(&positions, &velocities, &params);
        let volume = |scale: f32| {
            let moved: Vec<[f32; 3]> = positions.iter().map(|p| p.map(|x| x * scale)).collect();
            Report::of(&surface(&moved, &velocities, &params)).signed_volume
        };
        let grown = (volume(1.0 + 0.5 * step) - volume(1.0 - 0.5 * step)) / f64::from(2.0 * step);
        let found = integral(&mesh);
        assert!((found / grown - 1.0).abs() < 0.03, "{:?}: {found} {grown}", params.field);
    }
}

/// The integral of the speed over the surface.
fn integral(mesh: &Mesh) -> f64 {
    let speed = |v: u32| f64::from(mesh.attributes[0].values[v as usize]);
    let of_triangle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.position(v as usize));
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let area = 0.5 * normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        area * t.iter().map(|&v| speed(v)).sum::<f64>() / 3.0
    };
    mesh.triangles.iter().map(of_triangle).sum()
}

/// The cubic spline of support 2 and its slope, the reference.
fn spline(d: f64) -> [f64; 2] {
    let (near, far) = ((1.0 - d).max(0.0), (2.0 - d).max(0.0));
    let factor = 0.25 / std::f64::consts::PI;
    [factor * (far.powi(3) - 4.0 * near.powi(3)), factor * (12.0 * near.powi(2) - 3.0 * far.powi(2))]
}

#[test]
fn of_the_sph_field_it_is_the_formula() {
    let positions: Vec<[f64; 3]> = ball(4).iter().map(|p| p.map(f64::from)).collect();
    let speed_of = |p: &[f64; 3]| [p[1] * p[1], 1.0 - p[0], 0.3 * p[2] * p[0]];
    let velocities: Vec<f32> = positions.iter().flat_map(|p| speed_of(p).map(|v| v as f32)).collect();
    let narrow: Vec<[f32; 3]> = positions.iter().map(|p| p.map(|x| x as f32)).collect();
    let mesh = surface(&narrow, &velocities, &Params { cell_size: 1.0, ..Params::new(0.5) });
    let away = |p: &[f64; 3], q: &[f64; 3]| [0, 1, 2].map(|a| p[a] - q[a]);
    let size = |d: [f64; 3]| d.iter().map(|x| x * x).sum::<f64>().sqrt();
    // The mass of a particle is 1: its spacing cubed.
    let volume = |p: &[f64; 3]| 1.0 / positions.iter().map(|q| spline(size(away(p, q)))[0]).sum::<f64>();
    let volumes: Vec<f64> = positions.iter().map(volume).collect();
    let mut largest = 0.0f64;
    for (vertex, &found) in mesh.vertices.iter().zip(&mesh.attributes[0].values).step_by(37) {
        let at = vertex.map(f64::from);
        let (mut gradient, mut rate) = ([0.0; 3], 0.0);
        for (q, volume) in positions.iter().zip(&volumes) {
            let d = away(&at, q);
            let (far, v) = (size(d), speed_of(q));
            for a in 0..3 {
                let own = volume * spline(far)[1] * d[a] / far;
                gradient[a] += own;
                rate -= own * v[a];
            }
        }
        let wanted = rate / size(gradient);
        assert!((f64::from(found) - wanted).abs() < 1e-3 * (1.0 + wanted.abs()), "{found} {wanted}");
        largest = largest.max(wanted.abs());
    }
    assert!(largest > 3.0);
}

#[test]
fn threads_do_not_show_and_other_than_velocities_are_refused() {
    let positions = ball(5);
    let velocities: Vec<f32> = positions.iter().flatten().map(|x| x * x).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| surface(&positions, &velocities, &Params::new(0.5)))
    };
    assert_eq!(run(1), run(3));
    let attributes = [Attribute { components: 1, ..Attribute::normal_speed("v", &velocities[..positions.len()]) }];
    let (params, control, mut reconstructor) = (Params::new(0.5), Control::default(), Reconstructor::new());
    let wrong = reconstructor.extract((&positions[..]).into(), &attributes, &params, &control);
    assert!(matches!(wrong.err(), Some(Error::Length { expected: 3, .. })));
}
