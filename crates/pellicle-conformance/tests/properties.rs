//! Random particles and parameters: the mesh is closed, complete, and the same on every backend. Cases are the same in
//! every run.

use pellicle::{Band, Lanes, Params};
use pellicle_conformance::{Delivery, Memory, Scene, Subject, closed, same_bytes};
use proptest::{
    prelude::*,
    test_runner::{Config, RngAlgorithm, TestRng, TestRunner},
};

/// Particles of radius 1 in a box of up to 20 along each axis, some of them doubled, anywhere near the origin.
fn particles() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let size = prop::array::uniform3(0.5f64..20.0);
    let corner = prop::array::uniform3(-30.0f64..10.0);
    let units = prop::collection::vec((prop::array::uniform3(0.0f64..1.0), 1usize..4), 0..160);
    (size, corner, units).prop_map(|(size, corner, units)| {
        let place = |(unit, copies): ([f64; 3], usize)| {
            // Most stand alone, a third are doubled.
            let at: [f64; 3] = std::array::from_fn(|a| corner[a] + unit[a] * size[a]);
            std::iter::repeat_n(at, copies.saturating_sub(1).max(1))
        };
        units.into_iter().flat_map(place).collect()
    })
}

fn params() -> impl Strategy<Value = Params> {
    (1.2f64..3.0, 0.4f64..3.0, 0.05f64..1.3).prop_map(|(smoothing_length, cell_size, iso)| Params {
        smoothing_length,
        cell_size,
        iso,
        ..Params::new(1.0)
    })
}

fn scenes() -> impl Strategy<Value = Scene> {
    (particles(), params())
        .prop_map(|(positions, params)| Scene { params, ..Scene::new("random particles", positions) })
}

/// Runs 48 cases that never change.
fn hold(property: impl Fn(Scene) -> Result<(), String>) {
    let config = Config { cases: 48, failure_persistence: None, ..Config::default() };
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let run = |scene| property(scene).map_err(TestCaseError::fail);
    if let Err(e) = TestRunner::new_with_rng(config, rng).run(&scenes(), run) {
        panic!("{e}");
    }
}

fn mesh(scene: &Scene, subject: &Subject) -> Result<pellicle::Mesh, String> {
    subject.mesh(scene).map_err(|e| format!("{subject:?}: {e}"))
}

#[test]
fn meshes_are_closed_and_use_every_vertex() {
    hold(|scene| closed(&mesh(&scene, &Subject::default())?).map(drop));
}

#[test]
fn as_many_are_written_as_were_counted() {
    hold(|scene| {
        // Chunks assert that they fit together without gap and overlap.
        let chunks = Subject { delivery: Delivery::Chunks, ..Subject::default() };
        let view = (&scene.positions).into();
        let (mesh, stats) = chunks.mesh_of(view, &[], &scene.params).map_err(|e| e.to_string())?;
        let found = (mesh.vertices.len() as u64, mesh.triangles.len() as u64);
        if found == (stats.vertices, stats.triangles) { Ok(()) } else { Err(format!("{found:?}, {stats:?}")) }
    });
}

#[test]
fn the_band_loses_nothing() {
    hold(|scene| {
        let full = Subject { band: Band::Full, ..Subject::default() };
        same_bytes(&mesh(&scene, &Subject::default())?, &mesh(&scene, &full)?)
    });
}

#[test]
fn every_backend_gives_the_same_bytes() {
    let backends: Vec<Subject> = [
        Subject { lanes: Lanes::Avx512, ..Subject::default() },
        Subject { lanes: Lanes::Avx2, ..Subject::default() },
        Subject { lanes: Lanes::Portable, threads: 1, ..Subject::default() },
        Subject { threads: 7, ..Subject::default() },
        Subject { delivery: Delivery::Chunks, memory: Memory::Least, ..Subject::default() },
    ]
    .into_iter()
    .filter(Subject::available)
    .collect();
    hold(|scene| {
        let expected = mesh(&scene, &backends[0])?;
        backends[1..].iter().try_for_each(|subject| {
            same_bytes(&mesh(&scene, subject)?, &expected).map_err(|e| format!("{subject:?}: {e}"))
        })
    });
}
