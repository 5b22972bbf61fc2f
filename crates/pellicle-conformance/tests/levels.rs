//! Level of detail: whatever levels the blocks have, the surface is closed, and the same for any number of threads.

use pellicle::{
    Error, Mesh,
    mesh::Report,
    realtime::{DrawOrder, Engine, MOST_LEVELS, Metaball, Params, Particles, Region, Sorting, Sweep, View},
    sink::{Buffers, Layout},
};
use pellicle_conformance::{in_pool, lonely};
use pellicle_scenes::{Balls, ISO, Play, Random, Show};

/// How levels are wished for.
#[derive(Debug, Clone, Copy)]
enum Wish {
    /// One level for all.
    All(u8),
    /// By the distance from a point and the distance up to which cells are finest.
    From([f64; 3], f64),
    /// At random, block by block.
    Random(u64),
}

impl Wish {
    fn level(self, block: &Region) -> u8 {
        match self {
            Self::All(level) => level,
            Self::From(eye, near) => block.level_by_distance(eye, near),
            Self::Random(seed) => {
                let bits = block.low.iter().fold(seed, |h, v| (h ^ v.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15));
                ((bits >> 40) % 4) as u8
            }
        }
    }
}

#[track_caller]
fn made<T>(result: Result<T, Error>) -> T {
    result.expect("good input")
}

fn params(spacing: f64, block: usize) -> Params {
    Params { iso: ISO.into(), block: [block; 3], ..Params::new(3.0, spacing) }
}

fn particles(balls: &Balls) -> Particles<'_> {
    Particles { strengths: Some(&balls.strengths), ..Particles::from(&balls.positions) }
}

/// Meshes by one engine with a wish; the number of blocks at each level.
fn mesh(engine: &mut Engine, balls: &Balls, wish: Wish) -> (Mesh, [usize; MOST_LEVELS]) {
    let mut mesh = Mesh::default();
    let frame = made(engine.update_with_levels(particles(balls), |block| wish.level(block), &mut mesh));
    assert_eq!((frame.vertices, frame.triangles), (mesh.vertices.len(), mesh.triangles.len()));
    assert_eq!(frame.levels.iter().sum::<usize>(), frame.blocks);
    (mesh, frame.levels)
}

#[track_caller]
fn assert_closed(mesh: &Mesh, what: impl std::fmt::Debug) -> Report {
    let report = Report::of(mesh);
    assert!(report.closed_manifold(), "{what:?}: {report:?}");
    assert_eq!((report.nan_vertices, report.unused_vertices), (0, 0), "{what:?}");
    assert!(report.signed_volume > 0.0, "{what:?}: {report:?}");
    let lengths = mesh.normals.iter().map(|n| n.iter().map(|v| v * v).sum::<f32>());
    assert!(lengths.clone().all(|l| (l - 1.0).abs() < 1e-4), "{what:?}: unit normals");
    report
}

/// Every `step`th frame of a show, under several wishes.
fn play(show: Show, spacing: f64, step: usize) {
    let mut engine = made(Engine::new(params(spacing, 8)));
    let mut play = Play::new(show, 1);
    let mut mixed = 0;
    for frame in 0..pellicle_scenes::FRAMES {
        if frame % step == step - 1 {
            let balls = play.balls();
            let eye = balls.positions[0].map(f64::from);
            for wish in [Wish::From(eye, 4.0), Wish::Random(frame as u64), Wish::Random(!(frame as u64))] {
                let (mesh, levels) = mesh(&mut engine, balls, wish);
                assert_closed(&mesh, (show, frame, wish, levels));
                mixed += usize::from(levels.iter().filter(|&&n| n > 0).count() > 1);
            }
        }
        play.step();
    }
    // Of three wishes a frame; where a show takes few blocks, they may all get one level.
    assert!(mixed >= pellicle_scenes::FRAMES / step / 2, "levels were mixed in {mixed} meshes");
}

#[test]
fn fountain() {
    play(Show::Fountain, 0.75, 30);
}

#[test]
fn blob() {
    play(Show::Blob, 0.3, 30);
}

#[test]
fn explosion() {
    play(Show::Explosion, 0.6, 30);
}

#[test]
fn monster() {
    play(Show::Monster, 0.4, 30);
}

#[test]
fn every_frame_of_every_show() {
    for (show, spacing) in [(Show::Fountain, 1.0), (Show::Blob, 0.5), (Show::Explosion, 0.75), (Show::Monster, 0.5)] {
        play(show, spacing, 1);
    }
}

/// A frame in the middle of a show.
fn middle(show: Show) -> Balls {
    let mut play = Play::new(show, 1);
    (0..120).for_each(|_| play.step());
    play.balls().clone()
}

#[test]
fn every_field_is_closed_with_levels_mixed() {
    let balls = middle(Show::Blob);
    for (field, iso) in [
        (Metaball::Triquet, 0.2),
        (Metaball::Wyvill, 0.5),
        (Metaball::InverseSquare { radius: 0.3 }, 1.0),
        (Metaball::Sph, 0.6),
    ] {
        let mut engine = made(Engine::new(Params { field, iso, ..params(0.4, 8) }));
        for seed in 0..4 {
            let (mesh, levels) = mesh(&mut engine, &balls, Wish::Random(seed));
            assert!(levels[0] > 0 && levels[1] > 0);
            assert_closed(&mesh, (field, seed));
        }
    }
}

#[test]
fn one_level_is_the_surface_without_levels() {
    for show in Show::ALL {
        let balls = middle(show);
        let mut engine = made(Engine::new(params(0.5, 16)));
        let mut plain = Mesh::default();
        made(engine.update(particles(&balls), &mut plain));
        let (finest, _) = mesh(&mut engine, &balls, Wish::All(0));
        // Nodes are looked up in other ways, so values differ in the last bits.
        assert_eq!(lonely(&finest, &plain, 0.5, 2e-3), [] as [[f64; 3]; 0], "{show:?}: the finest level");
        assert_eq!(lonely(&plain, &finest, 0.5, 2e-3), [] as [[f64; 3]; 0], "{show:?}: the finest level");
        assert_eq!(finest.triangles.len(), plain.triangles.len());
        // Level 1 everywhere has the topology of twice the spacing; values differ in the last bits.
        let mut twice = made(Engine::new(params(1.0, 8)));
        made(twice.update(particles(&balls), &mut plain));
        let (coarse, levels) = mesh(&mut engine, &balls, Wish::All(1));
        assert_eq!(levels[1], levels.iter().sum());
        let (a, b) = (Report::of(&coarse), Report::of(&plain));
        assert_eq!((a.vertices, a.euler_characteristic), (b.vertices, b.euler_characteristic), "{show:?}");
        assert!((a.signed_volume / b.signed_volume - 1.0).abs() < 1e-4, "{show:?}: {a:?} {b:?}");
    }
}

#[test]
fn same_bytes_for_any_number_of_threads_and_any_history() {
    let balls = [middle(Show::Fountain), middle(Show::Monster)];
    let make = |threads: usize| {
        in_pool(threads, || {
            let mut engine = made(Engine::new(params(0.5, 16)));
            // The second frame is made by an engine that has made others before.
            [0, 1, 0].map(|i| mesh(&mut engine, &balls[i], Wish::From([0.0; 3], 3.0)).0)
        })
    };
    let one = make(1);
    assert_eq!(one[0], one[2]);
    assert!(one == make(2) && one == make(5));
}

#[test]
fn a_viewers_order_is_closed_and_the_same_for_any_number_of_threads() {
    for show in Show::ALL {
        let balls = middle(show);
        let make = |threads: usize, view: Option<View>, wish: Wish| {
            in_pool(threads, || {
                let mut engine = made(Engine::new(params(0.5, 8)));
                made(engine.set_view(view));
                mesh(&mut engine, &balls, wish).0
            })
        };
        let eye = balls.positions[0].map(|v| f64::from(v) + 9.0);
        for (seed, sweep, order) in [
            (1, Sweep::BestAxis, DrawOrder::BackToFront),
            (2, Sweep::BestAxis, DrawOrder::FrontToBack),
            (3, Sweep::Rotated, DrawOrder::BackToFront),
            (4, Sweep::Rotated, DrawOrder::FrontToBack),
        ] {
            let view = View { eye: Some(eye), forward: [-1.0, -0.7, -0.3], order, sweep, sorting: Sorting::Fast };
            for wish in [Wish::From(eye, 7.0), Wish::Random(seed)] {
                let one = make(1, Some(view), wish);
                assert_closed(&one, (show, view, wish));
                assert!(make(2, Some(view), wish) == one && make(3, Some(view), wish) == one, "{show:?} {view:?}");
            }
        }
    }
}

#[test]
fn buffers_of_the_caller_hold_the_same_surface() {
    let balls = middle(Show::Blob);
    let mut engine = made(Engine::new(params(0.4, 8)));
    let (mesh, _) = mesh(&mut engine, &balls, Wish::Random(3));
    let layout = Layout { stride: 32, position: 4, normal: Some(16), data: None };
    let (mut vertices, mut indices) = (vec![7u8; 32 * mesh.vertices.len()], vec![0u32; 3 * mesh.triangles.len()]);
    let mut buffers = made(Buffers::new(layout, &mut vertices, &mut indices));
    made(engine.update_with_levels(particles(&balls), |block| Wish::Random(3).level(block), &mut buffers));
    for (bytes, (position, normal)) in vertices.chunks_exact(32).zip(mesh.vertices.iter().zip(&mesh.normals)) {
        let number = |at: usize| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        assert_eq!([4, 8, 12].map(number), *position);
        assert_eq!([16, 20, 24].map(number), *normal);
        assert_eq!(bytes[..4], [7; 4]);
    }
    assert_eq!(indices, mesh.triangles.as_flattened());
    // One vertex too few: counted to the end, refused with the number.
    let mut short = made(Buffers::new(layout, &mut vertices[..32 * (mesh.vertices.len() - 1)], &mut indices));
    let error = engine.update_with_levels(particles(&balls), |block| Wish::Random(3).level(block), &mut short);
    assert!(error.is_err_and(|e| e.to_string().contains(&mesh.vertices.len().to_string())));
    assert_eq!(short.vertices_needed(), mesh.vertices.len());
}

#[test]
fn random_particles_with_reaches_of_their_own_are_closed() {
    let mut random = Random::new(11);
    for round in 0..6 {
        let mut number = |low: f64, high: f64| low + (high - low) * random.unit();
        let n = 40 + 100 * round;
        let positions: Vec<[f32; 3]> = (0..n).map(|_| [0; 3].map(|_| number(-9.0, 9.0) as f32)).collect();
        let reaches: Vec<f32> = (0..n).map(|_| number(0.4, 3.0) as f32).collect();
        let mut engine = made(Engine::new(params(0.35, 8)));
        for seed in 0..3 {
            let mut mesh = Mesh::default();
            let given = Particles { reaches: Some(&reaches), ..Particles::from(&positions) };
            made(engine.update_with_levels(given, |block| Wish::Random(seed).level(block), &mut mesh));
            assert_closed(&mesh, (round, seed));
        }
    }
}
