//! Tetrahedra through the public interface: volumes of any layout, functions, warped domains, what converges and how well
//! shaped triangles are.

use pellicle::mesh::{Deviation, Quality, Report};
use pellicle::{
    Border, Control, Domain, Error, Mesh, Tetrahedra, TetrahedraParams, Volume, Warp, contour_function_tetrahedra,
    contour_tetrahedra,
};

const BOX: [[f64; 3]; 2] = [[-1.3; 3], [1.3; 3]];

fn sphere(p: [f64; 3]) -> f64 {
    1.0 - p.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn of_function(function: &dyn pellicle::Function, domain: &Domain<'_>, split: Tetrahedra) -> Mesh {
    let params = TetrahedraParams { split, normals: true };
    contour_function_tetrahedra(function, domain, 0.0, &params, &Control::default()).expect("good")
}

fn of_volume(volume: &Volume<'_>, iso: f64, split: Tetrahedra) -> Mesh {
    contour_tetrahedra(volume, iso, split, &Control::default()).expect("good")
}

#[test]
fn positions_and_areas_converge_with_second_order() {
    for split in Tetrahedra::ALL {
        let errors = [0.13, 0.065].map(|spacing| {
            let mesh = of_function(&sphere, &Domain::covering(BOX, spacing), split);
            let report = Report::of(&mesh);
            assert!(report.closed_manifold() && report.euler_characteristic == 2, "{split:?} {report:?}");
            let distance = Deviation::by(&mesh, 20_000, |p| sphere(p).abs());
            [distance.rms, (report.area / (4.0 * std::f64::consts::PI) - 1.0).abs()]
        });
        for i in 0..2 {
            let order = (errors[0][i] / errors[1][i]).log2();
            assert!((1.6..2.6).contains(&order), "{split:?}: order {order} {errors:?}");
        }
    }
}

#[test]
fn regularised_triangles_are_fewer_and_better() {
    let domain = Domain::covering(BOX, 0.1);
    let [plain, regular] = [Tetrahedra::BodyCentred, Tetrahedra::Regularised].map(|split| {
        let mesh = of_function(&sphere, &domain, split);
        (Quality::of(&mesh), Deviation::by(&mesh, 20_000, |p| sphere(p).abs()).max)
    });
    assert!(regular.0.triangles < plain.0.triangles / 3, "{} {}", regular.0.triangles, plain.0.triangles);
    let (plain_ratio, ratio) = (plain.0.radius_ratio, regular.0.radius_ratio);
    assert!(plain_ratio.mean < 0.75 && ratio.mean > 0.9, "{ratio:?} {plain_ratio:?}");
    assert!(ratio.p5 > 0.7 && ratio.min > 0.5, "{ratio:?}");
    assert!(regular.0.min_angle.min > 25.0, "{:?}", regular.0.min_angle);
    // Chords of triangles that are twice as long.
    assert!(regular.1 < 5.0 * plain.1, "{} {}", regular.1, plain.1);
}

#[test]
fn a_field_that_is_far_from_linear_over_a_cell_has_its_vertices_on_the_surface() {
    // Six cells across the ball; linear crossings are off by up to 0.15 of a cell.
    let inverse = |p: [f64; 3]| 1.0 / p.iter().map(|v| v * v).sum::<f64>();
    let domain = Domain::covering([[-1.6, -1.5, -1.4], [1.5, 1.6, 1.55]], 0.34);
    for split in Tetrahedra::ALL {
        let params = TetrahedraParams { split, normals: false };
        let mesh = contour_function_tetrahedra(&inverse, &domain, 1.0, &params, &Control::default()).expect("good");
        let off = |v: usize| (mesh.position(v).iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0).abs();
        let worst = (0..mesh.vertices.len()).map(off).fold(0.0, f64::max);
        let allowed = if split == Tetrahedra::Regularised { 3e-3 } else { 1e-4 };
        assert!(mesh.triangles.len() > 100 && worst < allowed, "{split:?}: {worst}");
    }
}

#[test]
fn normals_point_outward() {
    let mesh = of_function(&sphere, &Domain::covering(BOX, 0.2), Tetrahedra::Six);
    for (v, n) in (0..mesh.vertices.len()).map(|i| (mesh.position(i), mesh.normals[i])) {
        let along: f64 = (0..3).map(|a| v[a] * f64::from(n[a])).sum();
        assert!(along > 0.99 * v.iter().map(|x| x * x).sum::<f64>().sqrt());
    }
}

/// The same solid in every layout.
#[test]
fn layouts_types_and_directions_give_the_same_surface() {
    let dims = [9usize, 8, 7];
    let value = |i: usize, j: usize, k: usize| {
        let d = [i as f64 - 4.2, j as f64 - 3.4, k as f64 - 3.1];
        (100.0 - 9.0 * d.iter().map(|v| v * v).sum::<f64>()).round()
    };
    let nodes = |order: [usize; 3]| {
        let [a, b, c] = order.map(|axis| dims[axis]);
        (0..a * b * c).map(move |n| {
            let mut at = [0; 3];
            (at[order[0]], at[order[1]], at[order[2]]) = (n % a, n / a % b, n / (a * b));
            value(at[0], at[1], at[2])
        })
    };
    let plain: Vec<f64> = nodes([0, 1, 2]).collect();
    let small: Vec<i16> = nodes([0, 1, 2]).map(|v| v as i16).collect();
    let turned: Vec<f32> = nodes([2, 0, 1]).map(|v| v as f32).collect();
    let mirrored: Vec<f64> = plain.iter().rev().copied().collect();
    for split in Tetrahedra::ALL {
        let volumes = [
            Volume::new(&plain, dims),
            Volume::new(&small, dims),
            Volume::strided(&turned, dims, 0, [7, 63, 1]),
            Volume::strided(&mirrored, dims, 503, [-1, -9, -72]),
        ];
        let meshes = volumes.map(|volume| of_volume(&volume.expect("good"), 20.0, split));
        assert!(Report::of(&meshes[0]).closed_manifold() && meshes[0].triangles.len() > 100);
        for mesh in &meshes[1..] {
            assert_eq!(mesh, &meshes[0], "{split:?}");
        }
        // A left-handed frame, sheared and moved.
        let oblique = Volume::new(&plain, dims)
            .and_then(|v| v.with_directions([[0.0, 2.0, 0.0], [1.0, 0.5, 0.0], [0.0, 0.0, 1.0]]))
            .and_then(|v| v.with_origin([10.0, -5.0, 1e6]))
            .expect("spans space");
        assert!(oblique.is_left_handed());
        let (report, straight) = (Report::of(&of_volume(&oblique, 20.0, split)), Report::of(&meshes[0]));
        assert!(report.closed_manifold());
        assert!((report.signed_volume / (2.0 * straight.signed_volume) - 1.0).abs() < 1e-5, "{split:?} {report:?}");
    }
}

#[test]
fn nan_masked_and_infinite_samples_are_outside() {
    let dims = [6, 6, 6];
    let mut samples = vec![1.0f32; 216];
    for i in [43, 44, 80, 129] {
        samples[i] = f32::NAN;
    }
    samples[172] = f32::INFINITY;
    samples[86] = f32::NEG_INFINITY;
    let present: Vec<bool> = (0..216).map(|i| i % 31 != 7).collect();
    for split in Tetrahedra::ALL {
        for border in [Border::Closed, Border::Open] {
            let volume = Volume::new(&samples, dims).expect("good").with_border(border);
            for volume in [volume, volume.with_mask(&present).expect("as long")] {
                let report = Report::of(&of_volume(&volume, 0.0, split));
                assert_eq!((report.nan_vertices, report.duplicate_half_edges, report.non_manifold_edges), (0, 0, 0));
                assert_eq!(report.closed_manifold(), border == Border::Closed || report.boundary_half_edges == 0);
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused_and_what_is_empty_is_empty() {
    let samples = [0.0f64; 8];
    let volume = Volume::new(&samples, [2; 3]).expect("good");
    for split in Tetrahedra::ALL {
        assert!(of_volume(&volume, 0.0, split).triangles.is_empty(), "equal is outside");
        assert!(!of_volume(&volume, -1.0, split).triangles.is_empty());
        let error = contour_tetrahedra(&volume, f64::NAN, split, &Control::default());
        assert!(matches!(error, Err(Error::Parameter { name: "iso", .. })));
        let huge = Domain::covering([[0.0; 3], [1e6; 3]], 0.1);
        let params = TetrahedraParams { split, normals: false };
        let error = contour_function_tetrahedra(&sphere, &huge, 0.0, &params, &Control::default());
        assert!(matches!(error, Err(Error::Count { .. })), "{error:?}");
    }
    let cancel = pellicle::CancelToken::new();
    cancel.cancel();
    let control = Control { cancel: Some(&cancel), ..Control::default() };
    assert_eq!(contour_tetrahedra(&volume, 0.0, Tetrahedra::Five, &control), Err(Error::Cancelled));
}

/// Cylinder coordinates: angle and height and radius, a map that turns right hands into left ones.
struct Tube;

impl Warp for Tube {
    fn to_world(&self, [radius, height, angle]: [f64; 3]) -> [f64; 3] {
        let radius = 3.0 + radius;
        [radius * angle.cos(), radius * angle.sin(), height]
    }
}

#[test]
fn a_warped_lattice_gives_a_closed_surface_of_the_worlds_function() {
    let ball = |p: [f64; 3]| sphere([p[0] - 3.0, p[1], p[2]]);
    let low = [-1.2, -1.2, -0.5];
    let domain =
        Domain { low, spacing: [0.06, 0.06, 0.025], cells: [40; 3], border: Border::Closed, warp: Some(&Tube) };
    for split in Tetrahedra::ALL {
        let mesh = of_function(&ball, &domain, split);
        let report = Report::of(&mesh);
        assert!(report.closed_manifold(), "{split:?}");
        assert!((report.signed_volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{split:?} {report:?}");
        assert!(Deviation::by(&mesh, 20_000, |p| ball(p).abs()).max < 5e-3, "{split:?}");
    }
}

#[test]
fn particles_by_tetrahedra_are_closed_with_the_cubes_volume_normals_and_attributes() {
    use pellicle::{Attribute, Params, Reconstructor};
    let positions: Vec<[f32; 3]> =
        (0..600).map(|i| [i % 10, i / 10 % 10, i / 100].map(|v| v as f32 * 0.1 + (v * i % 7) as f32 * 0.01)).collect();
    let heights: Vec<f32> = positions.iter().map(|p| p[2]).collect();
    let attributes = [Attribute::new("height", 1, &heights)];
    let params = Params { normals: true, ..Params::new(0.05) };
    let mut reconstructor = Reconstructor::new();
    let control = Control::default();
    let cubes = reconstructor.extract((&positions).into(), &attributes, &params, &control).expect("good");
    let cubes = Report::of(&cubes.to_mesh().expect("good"));
    for split in Tetrahedra::ALL {
        let sampled = reconstructor.sort((&positions).into(), &attributes, &params, &control).expect("good");
        let (mesh, stats) = sampled.weigh().expect("good").sample().expect("good").tetrahedra(split).expect("good");
        assert_eq!((stats.particles, stats.vertices), (600, mesh.vertices.len() as u64));
        let report = Report::of(&mesh);
        assert!(report.closed_manifold() && report.unused_vertices == 0, "{split:?} {report:?}");
        assert!((report.signed_volume / cubes.signed_volume - 1.0).abs() < 0.01, "{split:?} {report:?} {cubes:?}");
        for (i, n) in mesh.normals.iter().enumerate() {
            let (v, height) = (mesh.position(i), mesh.attributes[0].values[i]);
            assert!((n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-4);
            assert!((f64::from(height) - v[2]).abs() < 0.12, "{v:?} {height}");
        }
    }
}

/// The band must not show: particles with holes, thin parts and loners, on a coarse lattice.
#[test]
fn particles_by_tetrahedra_are_the_same_from_the_band_and_from_everywhere() {
    use pellicle::{Band, MetaballKernel, MetaballParams, Params, Reconstructor, ScalarField, ZhuBridsonParams};
    let positions: Vec<[f32; 3]> = (0..300u32)
        .map(|i| [2654435761u32, 2246822519, 3266489917].map(|m| (i.wrapping_mul(m) >> 16) as f32 / 65536.0 * 0.9))
        .collect();
    let mut reconstructor = Reconstructor::new();
    let mut of = |split, params: &Params| {
        let control = Control::default();
        let sampled = reconstructor.sort((&positions).into(), &[], params, &control).expect("good");
        let sampled = sampled.weigh().expect("good").sample().expect("good");
        let (mesh, _) = sampled.tetrahedra(split).expect("good");
        (Report::of(&mesh), mesh)
    };
    let zhu_bridson = ScalarField::ZhuBridson(ZhuBridsonParams::default());
    let metaball = ScalarField::Metaball(MetaballParams { kernel: MetaballKernel::InverseSquare { radius: 0.5 } });
    for field in [ScalarField::Sph, zhu_bridson, metaball] {
        let mut topology = Vec::new();
        for split in [Tetrahedra::BodyCentred, Tetrahedra::Simplex, Tetrahedra::Regularised] {
            let params = Params::with_field(0.04, field);
            let (report, mesh) = of(split, &params);
            assert!(report.closed_manifold() && report.triangles > 1000, "{split:?} {report:?}");
            let (_, everywhere) = of(split, &Params { band: Band::Full, ..params });
            let sorted = |mesh: &Mesh| {
                let mut all: Vec<[u32; 9]> = mesh
                    .triangles
                    .iter()
                    .map(|t| {
                        let corners = t.map(|v| mesh.vertices[v as usize].map(f32::to_bits)).concat();
                        std::array::from_fn(|i| corners[i])
                    })
                    .collect();
                all.sort_unstable();
                all
            };
            assert_eq!(mesh.origin, everywhere.origin);
            assert!(sorted(&mesh) == sorted(&everywhere), "{split:?}: another surface");
            topology.push((report.euler_characteristic, report.components));
        }
        assert!(topology.iter().all(|t| *t == topology[0]), "{topology:?}");
    }
}
