//! Every field on road A: all scenes on each vector unit, threads, blocks; cavities and real frames, band against full
//! evaluation; particles with radii of their own; normals against the field's slope.

use pellicle::{Attribute, Band, Carry, Lanes, Mesh, Params, Positions, ScalarField, SolenthalerParams};
use pellicle_conformance::{
    Defect, Delivery, Memory, Random, Scene, Subject,
    cavities::{self, HOLES},
    closed, must, particle_file, same_bytes, scenes,
};

/// All fields but the default one, which has its own tests.
fn fields() -> impl Iterator<Item = &'static str> {
    ScalarField::NAMES.into_iter().filter(|&name| name != "sph")
}

/// The same field on other backends.
fn backends(subject: Subject) -> [Subject; 4] {
    [
        subject,
        Subject { lanes: Lanes::Avx2, threads: 1, ..subject },
        Subject { lanes: Lanes::Portable, threads: 7, delivery: Delivery::Chunks, ..subject },
        Subject { memory: Memory::Least, delivery: Delivery::Chunks, ..subject },
    ]
}

#[test]
fn every_scene_is_closed_and_the_same_bytes_with_every_field_on_every_backend() {
    for name in fields() {
        for scene in [
            scenes::none(),
            scenes::one(),
            scenes::two_touching(),
            scenes::two_apart(),
            scenes::coincident_pair(),
            scenes::coincident_hundred(),
            scenes::ball(),
            scenes::torus(),
            scenes::shell(),
            scenes::sheet(),
            scenes::slab_at_nodes(),
            scenes::far_from_the_origin(),
            scenes::negative_coordinates(),
            scenes::stray_particle(),
        ] {
            let own = Subject::with_field(name);
            let mesh = |subject: &Subject| {
                let mesh = subject.mesh(&scene).map_err(|e| format!("{}, {subject:?}: {e}", scene.name));
                must(mesh)
            };
            let want = mesh(&Subject { field: own.field, ..Subject::reference() });
            must(closed(&want).map_err(|e| format!("{}, {name}: {e}", scene.name)));
            assert_eq!(want.triangles.is_empty(), scene.positions.is_empty(), "{}, {name}", scene.name);
            for subject in backends(own).into_iter().filter(Subject::available) {
                let same = same_bytes(&mesh(&subject), &want);
                must(same.map_err(|e| format!("{}, {subject:?}: {e}", scene.name)));
            }
        }
    }
}

/// The band's mesh is that of the full evaluation, byte for byte, and closed.
fn compare(scene: &Scene, name: &str) -> Result<Mesh, Defect> {
    let mesh = |band| {
        let subject = Subject { band, ..Subject::with_field(name) };
        subject.mesh(scene).map_err(|e| format!("{}, {name}: {e}", scene.name))
    };
    let (auto, full) = (mesh(Band::Auto)?, mesh(Band::Full)?);
    same_bytes(&auto, &full).map_err(|e| format!("{}, {name}, cell {}: {e}", scene.name, scene.params.cell_size))?;
    closed(&full).map_err(|e| format!("{}, {name}: {e}", scene.name))?;
    Ok(full)
}

#[track_caller]
fn lose_nothing(scenes: &[Scene]) {
    let mut lost = Vec::new();
    for name in fields() {
        lost.extend(scenes.iter().filter_map(|scene| compare(scene, name).err()));
    }
    assert!(lost.is_empty(), "{}", lost.join("\n"));
}

#[test]
fn cavities_are_found_by_every_field() {
    let mut all = Vec::new();
    for (i, hole) in HOLES.into_iter().enumerate() {
        for (j, cell_size) in [0.5, 1.0].into_iter().enumerate() {
            let scene = cavities::bulk(10, 0.15, hole, &mut Random::new((2 * i + j) as u64));
            all.push(scene.cell_size(cell_size));
        }
    }
    lose_nothing(&all);
}

#[test]
fn cavities_are_found_with_thresholds_of_ones_own() {
    for (t_low, t_high) in [(0.4, 3.5), (0.4, 2.0), (0.2, 1.3), (0.0, 1.05), (0.5, 4.0)] {
        let field = ScalarField::Solenthaler(SolenthalerParams { t_low, t_high, ..SolenthalerParams::default() });
        for (i, hole) in HOLES.into_iter().enumerate() {
            let scene = cavities::bulk(10, 0.15, hole, &mut Random::new(i as u64)).cell_size(1.0);
            let mesh = |band| {
                must(Subject { band, field: Some(field), ..Subject::default() }.mesh(&scene).map_err(|e| e.to_string()))
            };
            let same = same_bytes(&mesh(Band::Auto), &mesh(Band::Full));
            must(same.map_err(|e| format!("{}, thresholds {t_low} and {t_high}: {e}", scene.name)));
        }
    }
}

#[test]
fn thin_sparse_and_crowded_places_are_found_by_every_field() {
    let mut all = Vec::new();
    for seed in 0..3 {
        let mut random = Random::new(seed);
        all.push(cavities::isolated_groups(&mut random));
        all.push(cavities::thin_sheet(0.1 * seed as f64, &mut random).cell_size(0.75));
        all.push(cavities::clusters(&mut random));
        all.push(cavities::spray(120, random.between(0.01, 0.3), &mut random).cell_size(1.0));
        all.push(cavities::hollow(random.between(0.4, 0.9), random.between(0.5, 3.0), &mut random));
    }
    lose_nothing(&all);
}

#[test]
fn real_frames_lose_nothing_with_any_field() {
    let Some(file) = particle_file("hemi_t0.60.ply") else { return };
    for name in fields() {
        frame(&file, 0.025, name, 1.0);
    }
}

/// A band that took for inside what is interpolated so between samples lost cavities of these.
#[test]
fn frames_with_the_smallest_cavities_lose_nothing() {
    for (file, name, cell_size) in [
        ("cbd_t1.75.vtk", "solenthaler", 2.0),
        ("cbd_t1.75.vtk", "solenthaler", 1.0),
        ("cbd_t1.10.xyz", "zhu-bridson", 0.5),
    ] {
        let Some(path) = particle_file(file) else { return };
        frame(&path, 0.025, name, cell_size);
    }
}

/// Half an hour: only when asked for.
#[test]
#[ignore = "half an hour: cargo xtask test --all"]
fn all_real_frames_lose_nothing_with_any_field() {
    let all = [
        "cbd_t0.00.npy",
        "cbd_t0.50.bgeo",
        "cbd_t1.10.xyz",
        "cbd_t1.75.vtk",
        "cbd_t4.00.vtu",
        "cbd_t6.00.ply",
        "hemi_t0.35.vtk",
        "hemi_t0.60.ply",
        "hemi_t1.50.csv",
        "drop_t0.10.npy",
        "drop_t0.20.bgeo",
        "drop_t0.30.xyz",
        "drop_t0.80.xyz",
    ];
    for file in all {
        let Some(path) = particle_file(file) else { return };
        let radius = if file.starts_with("drop") { 0.02 } else { 0.025 };
        for name in fields() {
            frame(&path, radius, name, 1.0);
            frame(&path, radius, name, 0.5);
        }
    }
}

fn frame(file: &std::path::Path, radius: f64, name: &str, cell_size: f64) {
    let particles = pellicle_io::read_particles(file, &Default::default()).expect("the frame can be read");
    let field = ScalarField::from_name(name).expect("a field");
    let mesh = |band| {
        let params = Params { cell_size, band, ..Params::with_field(radius, field) };
        Subject::default().mesh_of(particles.positions.view(), &[], &params).expect("a mesh")
    };
    let ((auto, stats), (full, of_full)) = (mesh(Band::Auto), mesh(Band::Full));
    let file = file.display();
    println!("{file}, {name}, cell {cell_size}: {} of {} bricks", stats.bricks_filled, of_full.bricks_filled);
    must(same_bytes(&auto, &full).map_err(|e| format!("{file}, {name}, cell {cell_size}: {e}")));
    must(closed(&full));
    assert!(stats.bricks_filled <= of_full.bricks_filled, "{file}, {name}: the band fills more than there is");
}

/// The ball's particles, with radii that grow along x.
fn graded() -> (Scene, Vec<f32>) {
    let scene = scenes::ball();
    let radii = scene.positions.iter().map(|p| (0.1 + 0.03 * p[0]) as f32).collect();
    (scene, radii)
}

#[test]
fn radii_of_their_own_are_the_same_bytes_on_every_backend_and_in_the_band() {
    let (scene, radii) = graded();
    for name in ScalarField::NAMES {
        let subject = Subject::with_field(name);
        let run = |subject: &Subject| {
            let positions = Positions::from(&scene.positions).with_radii(&radii);
            subject.mesh_of(positions, &[], &subject.params(&scene)).expect("a mesh").0
        };
        let want = run(&Subject { field: subject.field, ..Subject::reference() });
        must(closed(&want));
        for subject in backends(subject) {
            if subject.available() {
                must(same_bytes(&run(&subject), &want).map_err(|e| format!("{name}, {subject:?}: {e}")));
            }
        }
    }
}

#[test]
fn equal_radii_of_their_own_are_one_common_radius() {
    let scene = scenes::torus();
    let radii = vec![scenes::RADIUS as f32; scene.positions.len()];
    for name in ScalarField::NAMES {
        let subject = Subject::with_field(name);
        let run =
            |positions| must(closed(&subject.mesh_of(positions, &[], &subject.params(&scene)).expect("a mesh").0));
        let (common, own) = (run((&scene.positions).into()), run(Positions::from(&scene.positions).with_radii(&radii)));
        let ratio = own.signed_volume / common.signed_volume;
        assert!((ratio - 1.0).abs() < 1e-4, "{name}: {ratio}");
    }
}

#[test]
fn a_wrong_radius_is_named() {
    let scene = scenes::ball();
    let mut radii = vec![0.1f32; scene.positions.len()];
    let run = |radii: &[f32]| {
        let positions = Positions::from(&scene.positions).with_radii(radii);
        Subject::default().mesh_of(positions, &[], &scene.params).map(drop)
    };
    assert!(matches!(run(&radii[1..]), Err(pellicle::Error::Length { .. })));
    for wrong in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        radii[17] = wrong;
        assert!(matches!(run(&radii), Err(pellicle::Error::Radius { index: 17, .. })), "{wrong}");
    }
}

#[test]
fn normals_lean_as_triangles_do_with_every_field() {
    for name in ScalarField::NAMES {
        let subject = Subject::with_field(name);
        let scene = scenes::torus();
        let params = Params { normals: true, ..subject.params(&scene) };
        let mesh = subject.mesh_of((&scene.positions).into(), &[], &params).expect("a mesh").0;
        let (mut against, mut sum) = (0, 0.0);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].map(f64::from));
            let (u, v): ([f64; 3], [f64; 3]) =
                (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
            let face: [f64; 3] =
                std::array::from_fn(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]);
            let length = face.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-30);
            for &corner in triangle {
                let normal = mesh.normals[corner as usize].map(f64::from);
                let square: f64 = normal.iter().map(|v| v * v).sum();
                assert!((square - 1.0).abs() < 1e-4, "{name}: {normal:?}");
                let cosine = (0..3).map(|i| normal[i] * face[i]).sum::<f64>() / length;
                against += usize::from(cosine < 0.0);
                sum += cosine;
            }
        }
        let corners = 3 * mesh.triangles.len();
        println!("{name}: mean cosine {}, {against} of {corners} corners against", sum / corners as f64);
        assert!(against * 200 <= corners && sum > 0.95 * corners as f64, "{name}: {against} of {corners}");
    }
}

#[test]
fn attributes_are_means_or_the_nearest_particles() {
    let scene = scenes::ball();
    let constant = vec![7.25f32; scene.positions.len()];
    let ids: Vec<f32> = (0..scene.positions.len()).map(|i| i as f32).collect();
    let attributes = [
        Attribute::new("constant", 1, &constant),
        Attribute { carry: Carry::Nearest, ..Attribute::new("id", 1, &ids) },
    ];
    for name in ScalarField::NAMES {
        let subject = Subject::with_field(name);
        let mesh = subject.mesh_of((&scene.positions).into(), &attributes, &subject.params(&scene)).expect("a mesh").0;
        assert!(mesh.attributes[0].values.iter().all(|v| (v / 7.25 - 1.0).abs() < 1e-5), "{name}");
        for (v, id) in mesh.attributes[1].values.iter().enumerate().step_by(97) {
            let at = mesh.position(v);
            let to = |p: &[f64; 3]| (0..3).map(|a| (p[a] - at[a]).powi(2)).sum::<f64>().sqrt();
            let least = scene.positions.iter().map(to).fold(f64::MAX, f64::min);
            let found = to(&scene.positions[*id as usize]);
            // Anisotropic particles are where smoothing has moved them.
            let slack = if name == "anisotropic" { scenes::SPACING } else { 1e-5 };
            assert!(found <= least + slack, "{name}, vertex {v}: {found}, {least}");
        }
    }
}
