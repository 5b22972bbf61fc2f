//! The real-time engine on the scenes of Rosenberg & Birdwell 2008: closed, and the same bytes whatever runs it.
//!
//! The scenes lie in the folder that `PELLICLE_DATA` names, or in `../shared/data` beside the workspace; without them the
//! tests say that they are skipped. What needs no data is below them.

use pellicle::{
    Error, Lanes, Mesh,
    realtime::{DrawOrder, Engine, Frame, Params, Reuse, Seeds, Sorting, Sweep, View},
    sink::{Buffers, CountOnly, Layout},
};
use pellicle_conformance::{Random, closed, in_pool, must, raw_particles, same_bytes, skip};
use pellicle_scenes::{Play, Show};

/// Particles strewn in a box, in clumps and alone.
fn strewn(count: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut random = Random::new(seed);
    let mut at = [0.0f32; 3];
    (0..count)
        .map(|i| {
            if i % 7 == 0 {
                at = std::array::from_fn(|a| random.between(-1.0, 1.0) as f32 * [25.0, 12.0, 18.0][a]);
            }
            at.map(|v| v + random.between(-1.5, 1.5) as f32)
        })
        .collect()
}

fn surface(positions: &[[f32; 3]], params: &Params, threads: usize) -> (Mesh, Frame) {
    in_pool(threads, || {
        let mut mesh = Mesh::default();
        let frame = Engine::new(params.clone()).expect("parameters").update(positions, &mut mesh).expect("a surface");
        (mesh, frame)
    })
}

/// Closed, and the same for every number of threads, vector unit and second use of an engine.
fn judge(positions: &[[f32; 3]], params: &Params) -> Frame {
    let (mesh, frame) = surface(positions, params, 1);
    must(closed(&mesh));
    assert_eq!(frame.unmatched, 0);
    assert!(frame.triangles > 100, "{frame:?}");
    must(same_bytes(&surface(positions, params, 2).0, &mesh).map_err(|e| format!("two threads: {e}")));
    must(same_bytes(&surface(positions, params, 3).0, &mesh).map_err(|e| format!("three threads: {e}")));
    for lanes in [Lanes::Avx512, Lanes::Avx2, Lanes::Portable] {
        let params = Params { lanes, ..params.clone() };
        let mut again = Mesh::default();
        match Engine::new(params).map(|mut engine| {
            engine.update(&positions[..positions.len() / 2], &mut again).expect("another surface first");
            engine.update(positions, &mut again).expect("a surface")
        }) {
            Ok(_) => must(same_bytes(&again, &mesh).map_err(|e| format!("{lanes:?}: {e}"))),
            Err(_) => skip(&format!("this machine has no {lanes:?}")),
        }
    }
    frame
}

macro_rules! scenes {
    ($($test:ident: $name:literal, $spacing:literal;)*) => { $(
        #[test]
        fn $test() {
            let Some(positions) = raw_particles($name) else { return };
            let params = Params::new(3.0, $spacing);
            let complete = judge(&positions, &params);
            // What the seeds of the published method miss.
            let (_, published) = surface(&positions, &Params { seeds: Seeds::Particles, ..params.clone() }, 1);
            println!("{}: {complete:?}\n{published:?}", stringify!($test));
            assert!(published.counts.cubes <= complete.counts.cubes);
            assert!(complete.counts.live_slices <= 2);
            for size in [16, 60] {
                let other = surface(&positions, &Params { block: [size; 3], ..params.clone() }, 2);
                must(closed(&other.0));
                assert_eq!((other.1.vertices, other.1.triangles), (complete.vertices, complete.triangles), "{size}");
            }
        }
    )* };
}

scenes! {
    fountain: "fountain_f0.xyz", 1.0;
    fountain_fine: "fountain_f1.xyz", 0.5;
    blob: "blob.xyz", 0.3;
    explosion_packed: "explosion_t0.xyz", 0.6;
    explosion_flung: "explosion_t1.xyz", 0.6;
    explosion_apart: "explosion_t2.xyz", 0.6;
}

#[test]
fn strewn_particles_at_all_scales() {
    for (seed, spacing) in [(1, 2.9), (2, 1.3), (3, 0.7)] {
        judge(&strewn(600, seed), &Params { block: [12, 16, 20], ..Params::new(3.0, spacing) });
    }
}

#[test]
fn the_world_has_no_bounds() {
    // The distance is a multiple of a block's, so that both clouds are cut alike.
    let params = Params { block: [32; 3], ..Params::new(3.0, 1.0) };
    let mut positions = strewn(100, 4);
    let near = surface(&positions, &params, 1);
    // Two clouds farther apart than any array could reach.
    positions.extend(strewn(100, 4).into_iter().map(|p| [p[0], p[1] + 1_048_576.0, p[2]]));
    let (mesh, frame) = surface(&positions, &params, 1);
    must(closed(&mesh));
    assert_eq!(frame.blocks, 2 * near.1.blocks);
    // Positions there have an eighth of a unit: the field is another.
    assert!(frame.triangles > 3 * near.1.triangles / 2);
}

#[test]
fn copies_side_by_side_need_no_more_memory_to_work_in() {
    let one = strewn(400, 5);
    let count = |copies: i32| {
        let positions: Vec<_> =
            (0..copies).flat_map(|c| one.iter().map(move |p| [p[0] + 4.0 * 39.0 * c as f32, p[1], p[2]])).collect();
        surface(&positions, &Params::new(3.0, 1.0), 1).1
    };
    let (one, ten, hundred) = (count(1), count(10), count(100));
    assert_eq!(hundred.triangles, 100 * one.triangles);
    for many in [ten, hundred] {
        assert_eq!(many.counts.render_bytes, one.counts.render_bytes);
        assert_eq!(many.counts.cache_bytes, one.counts.cache_bytes);
    }
}

/// The most bytes that `Counts::render_bytes` and `Counts::cache_bytes` can be by their documentation, for blocks that so many
/// particles reach at most.
fn bounds(params: &Params, particles: u64) -> [u64; 2] {
    let [x, y, _] = params.block.map(|cubes| cubes as u64 + 1);
    let bricks = x.div_ceil(4) * y.div_ceil(4);
    let touched = ((params.reach / params.spacing / 2.0) as u64 + 2).pow(2).min(bricks);
    [2 * 1152 * bricks + 20 * x * y + 16384, particles * (100 + 9 * touched) + 200 * bricks + 2048]
}

/// Particles that reach the block that the most reach.
fn fullest(positions: &[[f32; 3]], params: &Params) -> u64 {
    let mut counts = std::collections::HashMap::new();
    for p in positions {
        let range: [_; 3] = std::array::from_fn(|a| {
            let block = |at: f64| (at / (params.spacing * params.block[a] as f64)).floor() as i64;
            block(f64::from(p[a]) - params.reach - params.spacing)..=block(f64::from(p[a]) + params.reach)
        });
        for z in range[2].clone() {
            for y in range[1].clone() {
                range[0].clone().for_each(|x| *counts.entry([x, y, z]).or_insert(0) += 1);
            }
        }
    }
    counts.into_values().max().unwrap_or(0)
}

#[test]
fn fountains_side_by_side_on_no_blocks_border_need_what_a_block_gives() {
    let mut play = Play::new(Show::Fountain, 1);
    (0..150).for_each(|_| play.step());
    let one = &play.balls().positions;
    let params = Params::new(3.0, 1.0);
    let span = |a: usize| {
        let (low, high) = one.iter().fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p[a]), high.max(p[a])));
        high - low
    };
    // Out of each other's reach, and each cut into blocks in another way.
    let apart = [span(0) + 7.3, 1.7, span(2) + 9.1];
    let mut cubes = 0;
    for count in [1, 10, 100] {
        let places = (0..count).map(|c| [(c % 10) as f32 * apart[0], c as f32 * apart[1], (c / 10) as f32 * apart[2]]);
        let positions: Vec<[f32; 3]> =
            places.flat_map(|by| one.iter().map(move |p| std::array::from_fn(|a| p[a] + by[a]))).collect();
        let particles = fullest(&positions, &params);
        let [render, cache] = bounds(&params, particles);
        let [alone, beside] = [1, 2].map(|threads| surface(&positions, &params, threads).1);
        println!("{count}: {particles} in a block, {alone:?}; at most {render} and {cache}");
        assert_eq!((alone.counts, alone.triangles), (beside.counts, beside.triangles), "{count}");
        let used = alone.counts;
        assert!(used.render_bytes <= render && used.cache_bytes <= cache, "{count}: {used:?}, {render}, {cache}");
        // Bounds that are of use.
        assert!(3 * used.render_bytes > render && 8 * used.cache_bytes > cache, "{count}: {used:?}, {render}, {cache}");
        cubes = cubes.max(used.cubes / count as u64);
        assert!(used.cubes > 9 * cubes / 10 * count as u64, "all fountains are there: {used:?}");
    }
}

#[test]
fn buffers_are_never_overrun_and_say_what_they_lack() {
    let positions = strewn(300, 6);
    let mut engine = Engine::new(Params::new(3.0, 1.0)).expect("parameters");
    let (mut mesh, mut count) = (Mesh::default(), CountOnly::default());
    engine.update(&positions, &mut mesh).expect("a surface");
    engine.update(&positions, &mut count).expect("counts");
    assert_eq!((count.vertices, count.triangles), (mesh.vertices.len(), mesh.triangles.len()));
    // Normal before position, and bytes between that are not ours.
    let layout = Layout { stride: 40, position: 20, normal: Some(4), data: None };
    for (vertices, triangles) in
        [(count.vertices, count.triangles), (count.vertices / 2, count.triangles), (7, 5), (0, 0)]
    {
        let (mut bytes, mut indices) = (vec![0xa5u8; 40 * vertices], vec![77u32; 3 * triangles + 2]);
        let mut buffers = Buffers::new(layout, &mut bytes, &mut indices).expect("a layout");
        let result = engine.update(&positions, &mut buffers);
        assert_eq!((buffers.vertices_needed(), buffers.triangles_needed()), (count.vertices, count.triangles));
        let written = buffers.triangles_written();
        if vertices == count.vertices && triangles == count.triangles {
            result.expect("all fits");
            assert_eq!(written, triangles);
            assert_eq!(bytemuck_u32(&mesh.triangles), indices[..3 * triangles]);
        } else {
            assert!(matches!(result, Err(Error::Count { needed, available, .. }) if needed > available), "{result:?}");
        }
        for (i, vertex) in bytes.chunks(40).enumerate() {
            assert!(vertex[..4].iter().chain(&vertex[16..20]).chain(&vertex[32..]).all(|&b| b == 0xa5), "vertex {i}");
            let number = |at: usize| f32::from_le_bytes(vertex[at..at + 4].try_into().expect("four bytes"));
            assert_eq!([20, 24, 28].map(number), mesh.vertices[i]);
            assert_eq!([4, 8, 12].map(number), mesh.normals[i]);
        }
        assert!(indices[3 * written..].iter().all(|&i| i == 77), "behind what was written");
        assert!(indices[..3 * written].iter().all(|&i| (i as usize) < vertices));
    }
    let overlapping = Layout { normal: Some(8), ..Layout::POSITIONS_NORMALS };
    assert!(matches!(Buffers::new(overlapping, &mut [], &mut []), Err(Error::Parameter { .. })));
    let short = Layout { stride: 20, ..Layout::POSITIONS_NORMALS };
    assert!(matches!(Buffers::new(short, &mut [], &mut []), Err(Error::Parameter { .. })));
}

fn bytemuck_u32(triangles: &[[u32; 3]]) -> Vec<u32> {
    triangles.iter().flatten().copied().collect()
}

#[test]
fn a_viewers_order_is_the_same_for_every_number_of_threads() {
    let positions = strewn(500, 7);
    let view = View {
        eye: Some([3.0, 40.0, -30.0]),
        forward: [0.0, -1.0, 0.8],
        order: DrawOrder::BackToFront,
        sweep: Sweep::Rotated,
        sorting: Sorting::Exact,
    };
    let mesh = |threads, seeds| {
        in_pool(threads, || {
            let params = Params { block: [16; 3], seeds, ..Params::new(3.0, 1.0) };
            let mut engine = Engine::new(params).expect("parameters");
            engine.set_view(Some(view)).expect("a view");
            let mut mesh = Mesh::default();
            engine.update(&positions, &mut mesh).expect("a surface");
            mesh
        })
    };
    must(closed(&mesh(1, Seeds::Complete)));
    for seeds in [Seeds::Complete, Seeds::Particles] {
        must(same_bytes(&mesh(2, seeds), &mesh(1, seeds)));
    }
}

#[test]
fn bad_input_is_an_error() {
    let mut engine = Engine::new(Params::new(3.0, 1.0)).expect("parameters");
    let mut mesh = Mesh::default();
    let none: [[f32; 3]; 0] = [];
    assert_eq!(engine.update(&none, &mut mesh).expect("an empty surface").triangles, 0);
    assert!(matches!(engine.update(&[[0.0, f32::NAN, 0.0]], &mut mesh), Err(Error::NotFinite { index: 0, .. })));
    assert!(matches!(
        engine.update(&[[0.0; 3], [3e38, 0.0, 0.0]], &mut mesh),
        Err(Error::OutsideLattice { index: 1, .. })
    ));
    for params in [
        Params { iso: 0.0, ..Params::new(3.0, 1.0) },
        Params { block: [0, 32, 32], ..Params::new(3.0, 1.0) },
        Params { block: [32, 64, 32], ..Params::new(3.0, 1.0) },
        Params { block: [60; 3], seeds: Seeds::Particles, ..Params::new(3.0, 1.0) },
        Params::new(-1.0, 1.0),
        Params::new(3.0, f64::NAN),
        Params::new(3.0, 1e-3),
    ] {
        assert!(matches!(Engine::new(params.clone()), Err(Error::Parameter { .. })), "{params:?}");
    }
}

#[test]
fn blocks_that_did_not_change_are_used_again_and_nothing_shows() {
    let mut positions = strewn(800, 8);
    let fresh = Params { block: [16; 3], ..Params::new(3.0, 1.0) };
    let params = Params { reuse: Reuse::Unchanged, ..fresh.clone() };
    for threads in [1, 2] {
        in_pool(threads, || {
            let (mut engine, mut mesh) = (Engine::new(params.clone()).expect("parameters"), Mesh::default());
            let mut update = |positions: &[[f32; 3]], view: Option<View>| {
                engine.set_view(view).expect("a view");
                let frame = engine.update(positions, &mut mesh).expect("a surface");
                let (mut other, mut want) = (Engine::new(fresh.clone()).expect("parameters"), Mesh::default());
                other.set_view(view).expect("a view");
                other.update(positions, &mut want).expect("a surface");
                must(same_bytes(&mesh, &want));
                frame
            };
            let first = update(&positions, None);
            assert!(first.reused == 0 && first.blocks > 12 && first.kept_bytes > 0, "{first:?}");
            assert_eq!(update(&positions, None).reused, first.blocks);
            positions[17][0] += 0.01;
            let moved = update(&positions, None);
            assert!((1..=27).contains(&(moved.blocks - moved.reused)), "{moved:?}");
            // Blocks appear and vanish: neighbours may own other vertices then.
            let lost = positions.pop().expect("a particle");
            assert!(update(&positions, None).reused > 0);
            positions.push([lost[0] + 40.0, lost[1], lost[2]]);
            update(&positions, None);
            positions.pop();
            positions.push(lost);
            update(&positions, None);
            let view = View {
                eye: Some([0.0, 30.0, 5.0]),
                forward: [0.1, -1.0, 0.0],
                order: DrawOrder::BackToFront,
                sweep: Sweep::BestAxis,
                sorting: Sorting::Fast,
            };
            assert_eq!(update(&positions, Some(view)).reused, 0);
            let again = update(&positions, Some(view));
            assert_eq!(again.reused, again.blocks);
            update(&positions, Some(View { eye: Some([0.0, 30.0, 5.4]), ..view }));
            update(&positions, Some(View { sweep: Sweep::Rotated, ..view }));
            update(&positions, None);
        });
    }
}
