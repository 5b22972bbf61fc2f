//! The engine against an evaluation of every node.

use super::*;
use crate::{
    Mesh,
    march::{
        slices::{DrawOrder, Seeds, Sorting},
        tables::COUNTS,
    },
    mesh::Report,
};

/// A sequence of numbers in 0..1.
fn random(mut state: u64) -> impl FnMut() -> f32 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn cloud(seed: u64, count: usize, size: [f32; 3]) -> Vec<[f32; 3]> {
    let mut random = random(seed);
    (0..count).map(|_| size.map(|side| (random() - 0.5) * side)).collect()
}

/// Triangles that marching cubes makes of the field at every node, and nodes so close to the isovalue that rounding decides.
fn every_node(positions: &[[f32; 3]], params: &Params) -> (usize, usize) {
    let reach = params.reach / params.spacing;
    let bound = |pick: fn(f64, f64) -> f64| -> [f64; 3] {
        std::array::from_fn(|a| positions.iter().map(|p| f64::from(p[a]) / params.spacing).reduce(pick).unwrap())
    };
    let low = bound(f64::min).map(|v| (v - reach).floor() as i32 - 1);
    let high = bound(f64::max).map(|v| (v + reach).ceil() as i32 + 1);
    let nodes: [usize; 3] = std::array::from_fn(|a| (high[a] - low[a] + 1) as usize);
    let mut values = vec![0.0f64; nodes.iter().product()];
    for p in positions {
        let p = p.map(|v| f64::from(v) / params.spacing);
        let range: [_; 3] = std::array::from_fn(|a| (p[a] - reach).ceil() as i32..=(p[a] + reach).floor() as i32);
        for z in range[2].clone() {
            for y in range[1].clone() {
                for x in range[0].clone() {
                    let d: f64 = (0..3).map(|a| (f64::from([x, y, z][a]) - p[a]).powi(2)).sum();
                    let at: [usize; 3] = std::array::from_fn(|a| ([x, y, z][a] - low[a]) as usize);
                    let value = (1.0 - d / (reach * reach)).max(0.0).powi(2) / 4.0;
                    values[at[0] + nodes[0] * (at[1] + nodes[1] * at[2])] += value;
                }
            }
        }
    }
    let (mut triangles, iso) = (0, params.iso);
    for z in 0..nodes[2] - 1 {
        for y in 0..nodes[1] - 1 {
            for x in 0..nodes[0] - 1 {
                let corner = |c: usize| (x + (c & 1)) + nodes[0] * ((y + (c >> 1 & 1)) + nodes[1] * (z + (c >> 2)));
                let case = (0..8).fold(0, |case, c| case | usize::from(values[corner(c)] > iso) << c);
                triangles += usize::from(COUNTS[case]);
            }
        }
    }
    (triangles, values.iter().filter(|&v| (v - iso).abs() < 1e-5 * iso).count())
}

fn surface(positions: &[[f32; 3]], params: Params) -> (Mesh, Frame) {
    let mut mesh = Mesh::default();
    let frame = Engine::new(params).unwrap().update(positions, &mut mesh).unwrap();
    (mesh, frame)
}

#[track_caller]
fn assert_closed(mesh: &Mesh, what: &str) {
    let report = Report::of(mesh);
    assert!(
        report.closed_manifold() && report.unused_vertices == 0 && report.signed_volume > 0.0,
        "{what}: {report:?}"
    );
}

#[test]
fn a_complete_search_finds_what_evaluating_every_node_finds() {
    for (seed, count, size, spacing) in
        [(1, 300, [20.0; 3], 1.0), (2, 900, [24.0, 24.0, 12.0], 1.0), (3, 40, [9.0; 3], 0.5), (4, 2000, [16.0; 3], 2.2)]
    {
        let positions = cloud(seed, count, size);
        for block in [[39; 3], [32; 3], [8, 12, 4], [63, 62, 61], [13, 31, 6], [1, 2, 3]] {
            let params = Params { block, ..Params::new(3.0, spacing) };
            let (mesh, frame) = surface(&positions, params.clone());
            let (triangles, doubtful) = every_node(&positions, &params);
            let context =
                format!("{count} particles, spacing {spacing}, blocks {block:?}, {doubtful} doubtful: {frame:?}");
            assert_closed(&mesh, &context);
            assert_eq!(frame.unmatched, 0, "{context}");
            assert!(frame.triangles.abs_diff(triangles) <= 20 * doubtful, "{triangles} triangles expected, {context}");
        }
    }
}

#[test]
fn particles_seeds_find_blobs() {
    let positions = cloud(5, 60, [7.0; 3]);
    let params = Params { seeds: Seeds::Particles, block: [16; 3], ..Params::new(3.0, 0.5) };
    let (mesh, frame) = surface(&positions, params.clone());
    let (all, complete) = surface(&positions, Params { seeds: Seeds::Complete, ..params });
    assert_closed(&all, "complete");
    assert_closed(&mesh, "particles");
    assert_eq!(mesh.triangles.len(), all.triangles.len(), "{frame:?} {complete:?}");
    assert!(frame.counts.live_slices >= 2 && complete.counts.live_slices == 2);
}

/// Vertices in a canonical order, to compare surfaces whose triangles come in different orders.
fn sorted_vertices(mesh: &Mesh) -> Vec<[i64; 3]> {
    let mut vertices: Vec<_> =
        (0..mesh.vertices.len()).map(|v| mesh.position(v).map(|x| (x * 1e3).round() as i64)).collect();
    vertices.sort_unstable();
    vertices
}

fn views() -> impl Iterator<Item = View> {
    let places = [(None, [0.0, 0.0, -1.0]), (None, [1.0, 0.4, -0.2]), (Some([3.0, -20.0, 7.0]), [-0.1, 1.0, -0.3])];
    places.into_iter().flat_map(|(eye, forward)| {
        [DrawOrder::BackToFront, DrawOrder::FrontToBack].into_iter().flat_map(move |order| {
            [Sweep::BestAxis, Sweep::Rotated].map(|sweep| View { eye, forward, order, sweep, sorting: Sorting::Fast })
        })
    })
}

fn seen(positions: &[[f32; 3]], params: Params, view: View) -> Mesh {
    let (mut mesh, mut engine) = (Mesh::default(), Engine::new(params).unwrap());
    engine.set_view(Some(view)).unwrap();
    engine.update(positions, &mut mesh).unwrap();
    mesh
}

#[test]
fn a_viewer_changes_the_order_of_triangles_and_nothing_else() {
    let positions = cloud(6, 200, [14.0, 20.0, 10.0]);
    let params = Params { block: [8, 13, 18], ..Params::new(3.0, 1.0) };
    let (plain, _) = surface(&positions, params.clone());
    let volume = Report::of(&plain).signed_volume;
    for view in views() {
        let mesh = seen(&positions, params.clone(), view);
        assert_closed(&mesh, &format!("{view:?}"));
        let report = Report::of(&mesh);
        assert!((report.signed_volume / volume - 1.0).abs() < 0.02, "{view:?}: {} {volume}", report.signed_volume);
        if view.sweep == Sweep::BestAxis {
            assert_eq!(sorted_vertices(&mesh).len(), sorted_vertices(&plain).len(), "{view:?}");
            // A mirrored cube's polygons are cut along other diagonals.
            assert!((report.signed_volume / volume - 1.0).abs() < 2e-3, "{view:?}");
        }
        assert_outward(&mesh, &positions, view);
    }
}

/// A step along a normal leaves the field weaker.
#[track_caller]
fn assert_outward(mesh: &Mesh, positions: &[[f32; 3]], view: View) {
    for (normal, vertex) in mesh.normals.iter().zip(&mesh.vertices).step_by(50) {
        let field = |by: f32| -> f32 {
            let at: [f32; 3] = std::array::from_fn(|a| vertex[a] + by * normal[a]);
            let u = |p: &[f32; 3]| 1.0 - (0..3).map(|a| (at[a] - p[a]).powi(2)).sum::<f32>() / 9.0;
            positions.iter().map(|p| u(p).max(0.0).powi(2) / 4.0).sum()
        };
        assert!(field(0.05) < field(-0.05), "{view:?} at {vertex:?}");
    }
}

#[test]
fn a_viewer_changes_the_order_with_levels_too() {
    let positions = cloud(6, 200, [14.0, 20.0, 10.0]);
    let mut engine = Engine::new(Params { block: [8; 3], ..Params::new(3.0, 0.5) }).unwrap();
    let mut make = |view: Option<View>| {
        let mut mesh = Mesh::default();
        engine.set_view(view).unwrap();
        let wish = |region: &Region| u8::from(region.low[1] + region.high[1] > 0.0);
        let frame = engine.update_with_levels(&positions, wish, &mut mesh).unwrap();
        assert!(frame.levels[0] > 8 && frame.levels[1] > 8, "{frame:?}");
        mesh
    };
    let plain = make(None);
    let volume = Report::of(&plain).signed_volume;
    for view in views() {
        let mesh = make(Some(view));
        assert_closed(&mesh, &format!("{view:?}"));
        let report = Report::of(&mesh);
        assert!((report.signed_volume / volume - 1.0).abs() < 0.02, "{view:?}: {} {volume}", report.signed_volume);
        if view.sweep == Sweep::BestAxis {
            // Blocks, and so their levels, are the same.
            assert_eq!(mesh.vertices.len(), plain.vertices.len(), "{view:?}");
        }
        assert_outward(&mesh, &positions, view);
    }
}

#[test]
fn in_exact_order_seeds_from_particles_give_what_a_complete_search_gives() {
    let positions = cloud(5, 60, [7.0; 3]);
    let complete = Params { block: [16; 3], ..Params::new(3.0, 0.5) };
    let seeded = Params { seeds: Seeds::Particles, ..complete.clone() };
    let mut out_of_order = 0;
    for view in views() {
        let want = seen(&positions, complete.clone(), view);
        let fast = seen(&positions, seeded.clone(), view);
        let exact = seen(&positions, seeded.clone(), View { sorting: Sorting::Exact, ..view });
        assert_closed(&exact, &format!("{view:?}"));
        // Values differ in the last bits.
        let middles = |mesh: &Mesh| -> Vec<[f64; 3]> {
            let middle = |t: &[u32; 3]| {
                let corners = t.map(|v| mesh.position(v as usize));
                std::array::from_fn(|a| corners.iter().map(|c| c[a]).sum::<f64>() / 3.0)
            };
            mesh.triangles.iter().map(middle).collect()
        };
        let [want, fast, exact] = [&want, &fast, &exact].map(middles);
        let differ = |mesh: &[[f64; 3]]| {
            assert_eq!(mesh.len(), want.len(), "{view:?}");
            let apart = |(p, q): (&[f64; 3], &[f64; 3])| (0..3).any(|a| (p[a] - q[a]).abs() > 1e-3);
            mesh.iter().zip(&want).filter(|&(p, q)| apart((p, q))).count()
        };
        assert_eq!(differ(&exact), 0, "{view:?}, of {} triangles", want.len());
        out_of_order += usize::from(differ(&fast) > 0);
    }
    assert!(out_of_order > 3, "the fast variant has another order: {out_of_order}");
}

#[test]
fn slabs_come_in_the_viewers_order() {
    let positions = cloud(7, 150, [10.0; 3]);
    let params = Params { block: [60; 3], ..Params::new(3.0, 1.0) };
    for view in views() {
        let mesh = seen(&positions, params.clone(), view);
        let axes = view.axes();
        let corners = |t: &[u32; 3]| t.map(|v| axes.map(|axis| dot(axis, mesh.position(v as usize))));
        // Within a block, a slab is one cell deep.
        let mut highest = std::collections::HashMap::new();
        for corners in mesh.triangles.iter().map(corners) {
            let middle: [f64; 3] = std::array::from_fn(|a| corners.iter().map(|c| c[a]).sum::<f64>() / 3.0);
            let depth = corners.iter().map(|c| c[2]).fold(f64::MAX, f64::min);
            let highest = highest.entry(middle.map(|v| (v / 60.0).floor() as i64)).or_insert(f64::MIN);
            assert!(depth > *highest - 1.001, "{view:?}: {depth} after {highest}");
            *highest = highest.max(depth);
        }
    }
}

#[test]
fn a_block_that_is_not_visible_is_left_out_and_the_rest_stays() {
    let positions = cloud(8, 300, [30.0, 8.0, 8.0]);
    let params = Params { block: [8; 3], ..Params::new(3.0, 1.0) };
    let mut engine = Engine::new(params).unwrap();
    let (mut all, mut some) = (Mesh::default(), Mesh::default());
    engine.update(&positions, &mut all).unwrap();
    let frame = engine.update_visible(&positions, &mut some, |corners| corners.iter().any(|c| c[0] > 1.0)).unwrap();
    assert_eq!(frame.unmatched, 0);
    assert!(some.triangles.len() > all.triangles.len() / 4 && some.triangles.len() < all.triangles.len());
    let right =
        |mesh: &Mesh| mesh.triangles.iter().filter(|t| t.iter().all(|&v| mesh.vertices[v as usize][0] >= 0.0)).count();
    assert_eq!(right(&all), right(&some));
}

#[test]
fn with_levels_a_block_that_is_not_visible_is_left_out_too() {
    let positions = cloud(8, 300, [30.0, 8.0, 8.0]);
    let mut engine = Engine::new(Params { block: [8; 3], ..Params::new(3.0, 0.5) }).unwrap();
    let (mut all, mut some) = (Mesh::default(), Mesh::default());
    let wish = |region: &Region| u8::from(region.low[1] + region.high[1] > 0.0);
    let full = engine.update_with_levels(&positions, wish, &mut all).unwrap();
    let visible = |corners: &[[f64; 3]; 8]| corners.iter().any(|c| c[0] > 1.0);
    let frame = engine.update_visible_with_levels(&positions, visible, wish, &mut some).unwrap();
    assert!(frame.blocks < full.blocks && frame.levels[0] > 0 && frame.levels[1] > 0, "{frame:?} {full:?}");
    assert!(some.triangles.len() > all.triangles.len() / 4 && some.triangles.len() < all.triangles.len());
    let mut right = [&all, &some].map(|mesh| {
        let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices[v as usize].map(f32::to_bits)));
        corners.filter(|c| c.iter().all(|p| f32::from_bits(p[0]) > 1.1)).collect::<Vec<_>>()
    });
    right.iter_mut().for_each(|triangles| triangles.sort_unstable());
    assert!(right[0] == right[1] && right[0].len() > 1000, "{}", right[0].len());
    // Everything left out is nothing at all.
    let frame = engine.update_visible_with_levels(&positions, |_| false, wish, &mut some).unwrap();
    assert_eq!((frame.blocks, some.vertices.len(), some.triangles.len()), (0, 0, 0));
}

/// Triquet's metaballs, told by a user, who lets particles of odd numbers count half.
struct Halves;

impl CustomField for Halves {
    fn value(&self, particle: usize, rest: f32) -> f32 {
        rest * rest / if particle % 2 == 1 { 8.0 } else { 4.0 }
    }

    fn slope(&self, particle: usize, rest: f32) -> f32 {
        rest / if particle % 2 == 1 { 4.0 } else { 2.0 }
    }
}

/// The least number of a particle near a vertex.
struct Least;

impl Skin for Least {
    type Corner = usize;
    type Vertex = usize;

    fn corner(&self, near: crate::march::slices::Neighbours<'_>) -> usize {
        near.map(|n| n.particle).min().unwrap_or(usize::MAX)
    }

    fn vertex(&self, ends: [usize; 2], _: f32) -> usize {
        ends[0].min(ends[1])
    }
}

#[test]
fn a_field_of_the_users_goes_with_levels_and_his_data() {
    let positions = cloud(9, 150, [10.0, 14.0, 8.0]);
    let strengths: Vec<f32> = (0..150).map(|i| if i % 2 == 1 { 0.5 } else { 1.0 }).collect();
    let params = Params { block: [8; 3], ..Params::new(3.0, 0.5) };
    let (mut engine, mut with) = (Engine::with_skin(params.clone(), Least).unwrap(), Engine::new(params).unwrap());
    let wish = |region: &Region| u8::from(region.low[1] + region.high[1] > 0.0);
    for view in std::iter::once(None).chain(views().map(Some)) {
        engine.set_view(view).unwrap();
        with.set_view(view).unwrap();
        let (mut custom, mut built_in) = (crate::sink::Shaded::default(), Mesh::default());
        let frame = engine.update_custom_with_levels(&positions, &Halves, wish, &mut custom).unwrap();
        let particles = Particles { strengths: Some(&strengths), ..Particles::from(&positions) };
        let other = with.update_with_levels(particles, wish, &mut built_in).unwrap();
        assert!(frame.levels[0] > 0 && frame.levels == other.levels, "{frame:?}");
        assert_eq!((frame.vertices, frame.triangles), (other.vertices, other.triangles), "{view:?}");
        assert_closed(&custom.mesh, "the user's field");
        for (vertex, &least) in custom.mesh.vertices.iter().zip(&custom.data) {
            let near = |p: &[f32; 3]| (0..3).map(|a| (vertex[a] - p[a]).powi(2)).sum::<f32>().sqrt() < 4.8;
            assert!(near(&positions[least]), "a particle within reach of one end: {least}");
        }
    }
}

#[test]
fn reaches_and_strengths_of_particles_count() {
    let positions = [[0.5f32, 0.5, 0.5], [12.0, 0.3, 0.7], [24.0, 0.1, 0.2]];
    let (reaches, strengths) = ([3.0f32, 1.5, 3.0], [1.0f32, 1.0, 4.0]);
    let particles = Particles { positions: (&positions).into(), reaches: Some(&reaches), strengths: Some(&strengths) };
    let mut mesh = Mesh::default();
    let mut engine = Engine::new(Params::new(3.0, 0.1)).unwrap();
    engine.update(particles, &mut mesh).unwrap();
    assert_closed(&mesh, "three balls");
    // u²/4 · strength = 0.2 where d = R √(1 − √(0.8/strength)).
    for (i, (p, (reach, strength))) in positions.iter().zip(reaches.iter().zip(strengths)).enumerate() {
        let radius = reach * (1.0 - (0.8 / strength).sqrt()).sqrt();
        let near = mesh.vertices.iter().filter(|v| (v[0] - p[0]).abs() < 4.0);
        for v in near {
            let d = (0..3).map(|a| (v[a] - p[a]).powi(2)).sum::<f32>().sqrt();
            assert!((d - radius).abs() < 0.01, "ball {i}: {d}, {radius} expected");
        }
    }
    for (reaches, strengths) in [([3.0, 3.1, 3.0], [1.0; 3]), ([3.0; 3], [1.0, -1.0, 1.0]), ([0.0; 3], [1.0; 3])] {
        let particles =
            Particles { positions: (&positions).into(), reaches: Some(&reaches), strengths: Some(&strengths) };
        assert!(matches!(engine.update(particles, &mut mesh), Err(Error::Parameter { .. })));
    }
}

#[test]
fn the_sph_field_is_that_of_the_bulk_road() {
    let positions: Vec<[f32; 3]> =
        (0..512).map(|i| [i % 8, i / 8 % 8, i / 64].map(|v| v as f32 * 0.1 + 0.013 * (i % 7) as f32)).collect();
    let bulk = crate::Params { cell_size: 1.0, ..crate::Params::new(0.05) };
    let params = Params { field: Metaball::Sph, iso: bulk.iso, ..Params::new(bulk.support(), bulk.spacing()) };
    let (here, _) = surface(&positions, params);
    let there = crate::reconstruct(&positions, &bulk).unwrap();
    assert_closed(&here, "SPH");
    assert_eq!((here.vertices.len(), here.triangles.len()), (there.vertices.len(), there.triangles.len()));
    let sorted = |mesh: &Mesh| {
        let mut vertices: Vec<[f64; 3]> = (0..mesh.vertices.len()).map(|v| mesh.position(v)).collect();
        vertices.sort_by(|a, b| {
            (0..3)
                .map(|i| (a[i] * 1e4).round().total_cmp(&(b[i] * 1e4).round()))
                .find(|o| o.is_ne())
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        vertices
    };
    let far =
        sorted(&here).iter().zip(sorted(&there)).filter(|(a, b)| (0..3).any(|i| (a[i] - b[i]).abs() > 1e-5)).count();
    assert!(far * 100 <= here.vertices.len(), "{far} of {} vertices differ", here.vertices.len());
}

/// A field that panics for the particle of a number.
struct Fails(usize);

impl CustomField for Fails {
    fn value(&self, particle: usize, rest: f32) -> f32 {
        assert_ne!(particle, self.0);
        rest * rest / 4.0
    }

    fn slope(&self, _: usize, rest: f32) -> f32 {
        rest / 2.0
    }
}

#[test]
fn a_panic_of_the_users_field_ends_a_frame_on_all_threads_and_the_next_one_is_right() {
    let positions = cloud(9, 500, [60.0, 60.0, 60.0]);
    let mut engine = Engine::new(Params { block: [7; 3], ..Params::new(3.0, 1.0) }).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let mut frame = |fails: usize| {
        let mut mesh = Mesh::default();
        pool.install(|| engine.update_custom(&positions, &Fails(fails), &mut mesh)).unwrap();
        mesh
    };
    let whole = frame(usize::MAX);
    for fails in [0, 250, 499] {
        let failed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| frame(fails)));
        assert!(failed.is_err(), "particle {fails}");
        assert_eq!(frame(usize::MAX), whole, "after particle {fails}");
    }
}

#[test]
fn with_levels_blocks_have_the_largest_power_of_two_of_cubes_that_fits() {
    assert_eq!(Engine::new(Params::new(3.0, 0.5)).unwrap().coarsest_level(), 5);
    let positions = cloud(10, 60, [12.0; 3]);
    let [eight, thirteen] = [8, 13].map(|side| {
        let mut engine = Engine::new(Params { block: [side; 3], ..Params::new(3.0, 0.5) }).unwrap();
        assert_eq!(engine.coarsest_level(), 3);
        let mut mesh = Mesh::default();
        engine.update_with_levels(&positions, |region| u8::from(region.low[1] > 0.0), &mut mesh).unwrap();
        mesh
    });
    assert_eq!(eight, thirteen);
}
