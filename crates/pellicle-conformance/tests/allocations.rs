//! What the library allocates, counted: a second frame next to nothing, and a limit is held. In a process of its own,
//! whose allocator counts.

use std::sync::Mutex;

use pellicle::{Control, Error, Mesh, Params, Reconstructor, realtime, sink};
use pellicle_conformance::{
    Random, Scene,
    allocations::{Counting, count},
    cavities::{Hole, bulk},
    in_pool, scenes,
};

/// One test at a time: the counts are the process's.
static ALONE: Mutex<()> = Mutex::new(());

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn alone() -> std::sync::MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Two frames of the same particles, a little moved in between.
fn frames() -> [Scene; 2] {
    let scene = |by: f64| bulk(30, 0.2, Hole::Random(0.05), &mut Random::new(1)).moved([by; 3]);
    [scene(0.0), scene(0.002)]
}

#[test]
fn a_second_frame_allocates_next_to_nothing() {
    let _alone = alone();
    let [first, second] = frames();
    for threads in [1, 2] {
        for normals in [false, true] {
            in_pool(threads, || {
                let params = Params { normals, ..first.params.clone() };
                let control = Control::default();
                let (mut reconstructor, mut mesh) = (Reconstructor::new(), Mesh::default());
                let mut run = |scene: &Scene| {
                    count(|| {
                        let positions = (&scene.positions).into();
                        let surface = reconstructor.extract(positions, &[], &params, &control).expect("a surface");
                        surface.write_mesh(&mut mesh).expect("a mesh");
                    })
                    .1
                };
                let cold = run(&first);
                // A thread that had nothing to do so far grows its own memory once: the least of a few counts.
                let mut least =
                    |scene: &Scene| (0..5).map(|_| run(scene)).min_by_key(|count| count.bytes).expect("counts");
                let (same, moved) = (least(&first), least(&second));
                println!("{threads} threads, normals {normals}: first {cold:?}\n  same {same:?}\n  moved {moved:?}");
                assert!(same.bytes * 50 < cold.bytes, "the same frame again: {same:?}, first {cold:?}");
                assert!(moved.bytes * 50 < cold.bytes, "a moved frame: {moved:?}, first {cold:?}");
            });
        }
    }
}

#[test]
fn a_memory_limit_is_held() {
    let _alone = alone();
    let scene = bulk(56, 0.2, Hole::Random(0.05), &mut Random::new(1));
    in_pool(2, || {
        let mut limit = 0;
        let mut tried = Vec::new();
        loop {
            let params = Params { max_memory: Some(limit), ..scene.params.clone() };
            let (result, used) = count(|| {
                let mut reconstructor = Reconstructor::new();
                let control = Control::default();
                let surface = reconstructor.extract((&scene.positions).into(), &[], &params, &control)?;
                surface.for_each_chunk(|_| Ok::<(), Error>(()))?;
                Ok(surface.stats().blocks)
            });
            tried.push((limit, used.peak));
            match result {
                Err(Error::Memory { needed, available, .. }) => limit += (needed - available).max(limit / 16),
                other => {
                    assert!(other.expect("a surface") >= 8, "the least memory must cut blocks");
                    break;
                }
            }
        }
        println!("limit, peak in bytes: {tried:?}");
        let &(limit, peak) = tried.last().expect("one try");
        // Chunks under way and each thread's scratch come on top: they do not grow with the scene.
        assert!(peak as f64 <= 1.05 * limit as f64 + 2e6, "limit {limit}, peak {peak}");
    });
}

#[test]
fn cells_far_too_small_are_refused_before_memory_is_taken() {
    let _alone = alone();
    // Small enough to show, large enough to survive when it fails.
    let limit = 1 << 20;
    for cell_size in [0.05, 0.02, 0.01] {
        let scene = scenes::one().cell_size(cell_size);
        let params = Params { max_memory: Some(limit), ..scene.params.clone() };
        let (result, used) = count(|| pellicle::reconstruct(&scene.positions, &params));
        println!("cell {cell_size}: peak {} bytes, {:?}", used.peak, result.as_ref().err());
        assert!(matches!(result, Err(Error::Memory { .. })), "cell {cell_size}");
        assert!(used.peak < 4 * limit as i64, "cell {cell_size}: {used:?} under a limit of {limit}");
    }
}

#[test]
fn the_engine_allocates_nothing_once_it_is_warm() {
    let _alone = alone();
    let [first, second] = frames();
    let view = realtime::View {
        eye: Some([2.0, 3.0, -1.0]),
        forward: [-2.0, -3.0, 1.0],
        order: realtime::DrawOrder::BackToFront,
        sweep: realtime::Sweep::BestAxis,
        sorting: realtime::Sorting::Exact,
    };
    let ways = [(realtime::Seeds::Complete, None), (realtime::Seeds::Particles, Some(view))];
    for (threads, (seeds, view)) in [1, 2].into_iter().flat_map(|threads| ways.map(|way| (threads, way))) {
        in_pool(threads, || {
            let params = realtime::Params { seeds, ..realtime::Params::new(0.2, 0.05) };
            let mut engine = realtime::Engine::new(params).expect("parameters");
            engine.set_view(view).expect("a view");
            let (mut vertices, mut indices) = (vec![0u8; 24 << 20], vec![0u32; 6 << 20]);
            let mut run = |scene: &Scene| {
                let positions = &scene.positions;
                let mut buffers =
                    sink::Buffers::new(sink::Layout::POSITIONS_NORMALS, &mut vertices, &mut indices).expect("a layout");
                count(|| engine.update(positions, &mut buffers).expect("a surface")).1
            };
            let cold = run(&first);
            run(&second);
            run(&first);
            let warm = [run(&first), run(&second), run(&first)];
            println!("{threads} threads: cold {cold:?}, warm {warm:?}");
            assert!(cold.calls > 100, "{cold:?}");
            assert!(warm.iter().all(|w| w.calls == 0), "{warm:?}");
        });
    }
}

#[test]
fn levels_allocate_nothing_once_they_are_warm() {
    let _alone = alone();
    let [first, second] = frames();
    let view = realtime::View {
        eye: Some([2.0, 3.0, -1.0]),
        forward: [-2.0, -3.0, 1.0],
        order: realtime::DrawOrder::BackToFront,
        sweep: realtime::Sweep::Rotated,
        sorting: realtime::Sorting::Fast,
    };
    for (threads, view) in [(1, None), (2, None), (1, Some(view)), (2, Some(view))] {
        in_pool(threads, || {
            let params = realtime::Params { block: [16; 3], ..realtime::Params::new(0.2, 0.05) };
            let mut engine = realtime::Engine::new(params).expect("parameters");
            engine.set_view(view).expect("a view");
            let (mut vertices, mut indices) = (vec![0u8; 24 << 20], vec![0u32; 6 << 20]);
            let mut run = |scene: &Scene| {
                let mut buffers =
                    sink::Buffers::new(sink::Layout::POSITIONS_NORMALS, &mut vertices, &mut indices).expect("a layout");
                let wish = |block: &realtime::Region| block.level_by_distance([0.0; 3], 0.5);
                let update = || engine.update_with_levels(&scene.positions, wish, &mut buffers).expect("a surface");
                let (frame, used) = count(update);
                assert!(frame.levels[0] > 0 && frame.levels[1] > 0, "{:?}", frame.levels);
                used
            };
            let cold = run(&first);
            run(&second);
            run(&first);
            let warm = [run(&first), run(&second), run(&first)];
            println!("{threads} threads: cold {cold:?}, warm {warm:?}");
            assert!(cold.calls > 100, "{cold:?}");
            assert!(warm.iter().all(|w| w.calls == 0), "{warm:?}");
        });
    }
}

/// A sphere in 1, 8 and 64 times as many cells: besides the mesh, memory grows with its surface at most.
#[test]
fn contouring_a_function_holds_its_surface_and_no_volume() {
    let _alone = alone();
    let sphere = |p: [f64; 3]| 1.0 - p.iter().map(|v| v * v).sum::<f64>();
    let besides = [100, 200, 400].map(|cells| {
        let domain = pellicle::Domain::covering([[-1.2; 3], [1.2; 3]], 2.4 / f64::from(cells));
        let params = pellicle::ContourParams::default();
        let contour = || pellicle::contour_function(&sphere, &domain, 0.0, &params).expect("fits");
        let (mesh, count) = in_pool(1, || count(contour));
        let held = 12 * (mesh.vertices.len() + mesh.triangles.len()) as i64;
        println!("{cells}: {count:?}, the mesh {held}");
        count.peak - held
    });
    let nodes = 401i64.pow(3);
    assert!(besides[2] < nodes / 4, "{besides:?} beside {nodes} nodes");
    assert!(besides[2] < 5 * besides[1].max(1 << 18), "{besides:?}");
}
