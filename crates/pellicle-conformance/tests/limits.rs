//! Bad input, memory limits and cancellation: an error that says what and where, and everything usable after.

use std::sync::Mutex;

use pellicle::{Attribute, Band, CancelToken, Control, Error, Params, Positions, Reconstructor, Stage};
use pellicle_conformance::{
    Delivery, Memory, Random, Scene, Subject, cavities, closed, in_pool, must, same_bytes,
    scenes::{self, RADIUS},
};

fn refusal(positions: &[[f64; 3]], params: &Params) -> Error {
    pellicle::reconstruct(positions, params).expect_err("must be refused")
}

#[test]
fn positions_that_are_no_numbers_are_refused_with_their_index() {
    let good = scenes::torus().positions;
    for (value, index) in [(f64::NAN, 0), (f64::INFINITY, 17), (f64::NEG_INFINITY, good.len() - 1)] {
        for axis in 0..3 {
            let mut positions = good.clone();
            positions[index][axis] = value;
            let found = refusal(&positions, &Params::new(RADIUS));
            assert!(matches!(found, Error::NotFinite { index: i, .. } if i == index), "{found:?}");
        }
    }
    let mut positions = good;
    positions[300][1] = f64::NAN;
    positions[200][2] = f64::INFINITY;
    let found = refusal(&positions, &Params::new(RADIUS));
    assert!(matches!(found, Error::NotFinite { index: 200, .. }), "the first one is named: {found:?}");
}

#[test]
fn positions_beyond_the_lattice_are_refused_with_their_index() {
    for value in [3e38, -3e38, 1e300, 1e12] {
        let mut positions = scenes::torus().positions;
        positions[123][2] = value;
        let found = refusal(&positions, &Params::new(RADIUS));
        assert!(matches!(found, Error::OutsideLattice { index: 123, .. }), "{found:?}");
    }
    let single = [[0.0f32; 3], [3e38, 0.0, 0.0]];
    let found = pellicle::reconstruct(&single, &Params::new(RADIUS)).expect_err("must be refused");
    assert!(matches!(found, Error::OutsideLattice { index: 1, .. }), "{found:?}");
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let positions = scenes::two_touching().positions;
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let with = |change: fn(&mut Params, f64)| {
            let mut params = Params::new(RADIUS);
            change(&mut params, value);
            match refusal(&positions, &params) {
                Error::Parameter { name, .. } => name,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(with(|p, v| p.particle_radius = v), "particle_radius");
        assert_eq!(with(|p, v| p.smoothing_length = v), "smoothing_length");
        assert_eq!(with(|p, v| p.cell_size = v), "cell_size");
        assert_eq!(with(|p, v| p.iso = v), "iso");
    }
}

#[test]
fn attributes_and_views_of_the_wrong_length_are_refused() {
    let scene = scenes::torus();
    let values = vec![0.0f32; 3 * scene.positions.len() - 1];
    for components in [0, 1, 2, 3, 4] {
        let attributes = [Attribute::new("a", components, &values)];
        let found = Subject::default().mesh_of((&scene.positions).into(), &attributes, &scene.params);
        assert!(matches!(found, Err(Error::Length { .. })), "{components}: {found:?}");
    }
    assert!(matches!(Positions::strided_f32(&[0.0; 9], 2), Err(Error::Parameter { name: "stride", .. })));
    assert!(Positions::strided_f64(&[0.0; 11], 4).is_ok());
    assert!(matches!(Positions::strided_f64(&[0.0; 10], 4), Err(Error::Length { .. })));
}

#[test]
fn a_radius_far_too_small_is_refused_or_meshed() {
    let found = refusal(&scenes::torus().positions, &Params::new(1e-30));
    assert!(matches!(found, Error::OutsideLattice { index: 0, .. }), "{found:?}");
    // At the origin even the smallest particle can be placed.
    let mesh = pellicle::reconstruct(&[[0.0f64; 3]], &Params::new(1e-30)).expect("a mesh");
    assert!(!mesh.triangles.is_empty());
    // Its area and volume underflow, so only its indices are judged.
    assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
}

#[test]
fn a_cell_of_a_hundred_radii_gives_a_closed_mesh() {
    for cell_size in [5.0, 10.0, 100.0] {
        for scene in [scenes::none(), scenes::ball(), cavities::bulk(14, 0.2, cavities::Hole::One, &mut Random::new(1))]
        {
            let scene = scene.cell_size(cell_size);
            must(closed(&Subject::default().mesh(&scene).expect("a mesh")));
            let on_a_node = Scene::new("on a node", vec![[0.0; 3]]).cell_size(cell_size);
            let report = must(closed(&Subject::default().mesh(&on_a_node).expect("a mesh")));
            assert_eq!((report.components, report.euler_characteristic, report.triangles), (1, 2, 8));
        }
    }
}

#[test]
fn an_isovalue_above_every_value_gives_an_empty_mesh() {
    let mut scene = scenes::torus();
    scene.params.iso = 1e30;
    assert_eq!(Subject::default().mesh(&scene).expect("a mesh").triangles, [[0; 3]; 0]);
}

/// Thousands of particles, and enough vertices for more than eight blocks.
fn large() -> Scene {
    cavities::bulk(14, 0.2, cavities::Hole::Random(0.1), &mut Random::new(5)).cell_size(0.3)
}

#[test]
fn eight_blocks_and_more_give_the_same_bytes() {
    let scene = large();
    let expected = Subject::reference().mesh(&scene).expect("a mesh");
    for (threads, delivery) in
        [(1, Delivery::Chunks), (2, Delivery::Chunks), (2, Delivery::Whole), (7, Delivery::Whole)]
    {
        let subject = Subject { threads, delivery, memory: Memory::Least, ..Subject::default() };
        let (mesh, stats) = subject.mesh_of((&scene.positions).into(), &[], &scene.params).expect("a mesh");
        if delivery == Delivery::Chunks {
            assert!(stats.blocks >= 8, "{stats:?}");
        }
        must(same_bytes(&mesh, &expected).map_err(|e| format!("{subject:?}: {e}")));
    }
    let (_, stats) = Subject::default().mesh_of((&scene.positions).into(), &[], &scene.params).expect("a mesh");
    assert_eq!(stats.blocks, 1);
}

#[test]
fn whole_meshes_in_blocks_have_the_same_bytes() {
    // Between the least memory and what all values need lies a limit that cuts blocks and still holds the whole mesh.
    let scene = large();
    let expected = Subject::reference().mesh(&scene).expect("a mesh");
    let mut blocks = 0;
    for limit in (1..40).map(|step| step << 18) {
        let params = Params { max_memory: Some(limit), ..scene.params.clone() };
        match Subject::default().mesh_of((&scene.positions).into(), &[], &params) {
            Ok((mesh, stats)) => {
                must(same_bytes(&mesh, &expected));
                blocks = blocks.max(stats.blocks);
            }
            Err(Error::Memory { needed, available, .. }) => assert!(needed > available, "{needed} {available}"),
            Err(other) => panic!("{other}"),
        }
    }
    assert!(blocks >= 8, "{blocks}");
}

#[test]
fn what_a_refusal_asks_for_is_enough_after_a_few_steps() {
    for band in [Band::Auto, Band::Full] {
        let scene = large();
        let mut params = Params { band, max_memory: Some(0), ..scene.params.clone() };
        let mut asked = Vec::new();
        loop {
            assert!(asked.len() < 12, "{band:?}: {asked:?}");
            match pellicle::reconstruct(&scene.positions, &params) {
                Ok(_) => break,
                Err(Error::Memory { needed, available, .. }) => {
                    assert!(needed > available);
                    asked.push(needed);
                    // What the message tells the user: raise the limit to at least this.
                    params.max_memory = Some(needed);
                }
                Err(other) => panic!("{other}"),
            }
        }
        assert!(asked.windows(2).all(|pair| pair[0] < pair[1]), "{band:?}: {asked:?}");
    }
}

#[test]
fn cancelling_at_any_stage_stops_and_leaves_the_reconstructor_usable() {
    let scene = scenes::torus();
    let expected = Subject::reference().mesh(&scene).expect("a mesh");
    let mut reconstructor = Reconstructor::new();
    for stop_at in [Stage::Sort, Stage::Density, Stage::Active, Stage::Fill, Stage::Count, Stage::Emit] {
        let token = CancelToken::new();
        let stages = Mutex::new(Vec::new());
        let on_stage = |stage| {
            stages.lock().expect("no panic").push(stage);
            if stage == stop_at {
                token.cancel();
            }
        };
        let control = Control { cancel: Some(&token), on_stage: Some(&on_stage) };
        let result =
            in_pool(2, || reconstructor.extract((&scene.positions).into(), &[], &scene.params, &control)?.to_mesh());
        assert_eq!(result, Err(Error::Cancelled), "{stop_at:?}");
        assert_eq!(stages.lock().expect("no panic").last(), Some(&stop_at), "nothing begins after it");
        let after = reconstructor
            .extract((&scene.positions).into(), &[], &scene.params, &Control::default())
            .and_then(|surface| surface.to_mesh());
        must(same_bytes(&after.expect("a mesh"), &expected).map_err(|e| format!("after {stop_at:?}: {e}")));
    }
}

#[test]
fn cancelling_between_chunks_and_errors_of_the_writer_stop() {
    let scene = large();
    let mut reconstructor = Reconstructor::new();
    let token = CancelToken::new();
    let control = Control { cancel: Some(&token), ..Control::default() };
    let surface = reconstructor.extract((&scene.positions).into(), &[], &scene.params, &control).expect("a surface");
    let full_disk = surface.for_each_chunk(|_| Err(Error::Count { what: "disk", needed: 2, available: 1 }));
    assert_eq!(full_disk, Err(Error::Count { what: "disk", needed: 2, available: 1 }));
    let written = Mutex::new(0);
    let stopped = surface.for_each_chunk(|_| {
        *written.lock().expect("no panic") += 1;
        token.cancel();
        Ok::<(), Error>(())
    });
    assert_eq!(stopped, Err(Error::Cancelled));
    assert!(*written.lock().expect("no panic") < 8, "chunks in work may end, no new ones begin");
}

#[test]
fn cancelling_from_another_thread_stops_at_any_moment() {
    let scene = large();
    let expected = Subject::reference().mesh(&scene).expect("a mesh");
    let mut reconstructor = Reconstructor::new();
    let mut cancelled = 0;
    for wait in 0..24 {
        let token = CancelToken::new();
        let control = Control { cancel: Some(&token), ..Control::default() };
        let result = std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(std::time::Duration::from_micros(1 << (wait % 12)));
                token.cancel();
            });
            reconstructor.extract((&scene.positions).into(), &[], &scene.params, &control)?.to_mesh()
        });
        match result {
            Err(Error::Cancelled) => cancelled += 1,
            Ok(mesh) => must(same_bytes(&mesh, &expected)),
            Err(other) => panic!("{other}"),
        }
    }
    assert!(cancelled > 0, "the token never stopped anything");
}

#[test]
fn scratch_of_earlier_frames_never_shows() {
    let mut reconstructor = Reconstructor::new();
    let control = Control::default();
    for scene in
        [large(), scenes::none(), scenes::torus().cell_size(0.3), scenes::one(), scenes::ball().cell_size(1.5), large()]
    {
        let surface =
            reconstructor.extract((&scene.positions).into(), &[], &scene.params, &control).expect("a surface");
        let mesh = surface.to_mesh().expect("a mesh");
        must(
            same_bytes(&mesh, &Subject::reference().mesh(&scene).expect("a mesh"))
                .map_err(|e| format!("{}: {e}", scene.name)),
        );
    }
}
