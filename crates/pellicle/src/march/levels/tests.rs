use super::*;
use crate::{
    Mesh,
    bricks::levels::Levels,
    march::slices::{DrawOrder, Sight, Sorting},
    mesh::Report,
};

/// Any function of a node.
struct Nodes<F>(F);

impl<F: Fn(Coord) -> f32 + Sync> Source for Nodes<F> {
    type Scratch = ();
    type Corner = ();
    type Vertex = ();

    fn values(&self, _: &mut (), _: usize, grid: Grid, to: &mut [f32]) {
        for (i, to) in to.iter_mut().enumerate() {
            let pitch = grid.n + 1;
            *to = self.0(grid.node([i % pitch, i / pitch % pitch, i / pitch / pitch]));
        }
    }

    fn shade(&self, scratch: &mut (), block: usize, grid: Grid, _: &NodeSet, to: &mut Samples<()>) {
        self.values(scratch, block, grid, &mut to.values[..grid.len()]);
        for (i, to) in to.outward[..grid.len()].iter_mut().enumerate() {
            let pitch = grid.n + 1;
            let node = grid.node([i % pitch, i / pitch % pitch, i / pitch / pitch]);
            *to = std::array::from_fn(|axis| {
                let (mut low, mut high) = (node, node);
                low[axis] -= 1;
                high[axis] += 1;
                self.0(low) - self.0(high)
            });
        }
    }

    fn mix(&self, _: [(); 2], _: f32) {}
}

/// Blocks with levels, and a field of whose nodes those greater than 0 are inside.
fn mesh(side: usize, levels: Levels, field: impl Fn(Coord) -> f32 + Sync) -> Mesh {
    seen(side, levels, None, field).0
}

/// The same in the order of a viewer, and where each block's triangles begin, and the end.
fn seen(side: usize, levels: Levels, sight: Option<Sight>, field: impl Fn(Coord) -> f32 + Sync) -> (Mesh, Vec<usize>) {
    let mut surface = Surface::default();
    (surface.rows.side, surface.rows.levels) = (side, levels);
    let (mut pool, source) = (Vec::new(), Nodes(field));
    fit_pool(&mut pool);
    surface.count(&source, 0.0, &pool).expect("few vertices");
    let all = 0..surface.blocks();
    let (vertices, triangles) = (surface.vertices(&all).len(), surface.triangles(&all).len());
    let mut mesh = Mesh {
        vertices: vec![[f32::NAN; 3]; vertices],
        normals: vec![[f32::NAN; 3]; vertices],
        triangles: vec![[u32::MAX; 3]; triangles],
        ..Mesh::default()
    };
    let place = Place { iso: 0.0, origin: [0; 3], spacing: 1.0, axes: None };
    let to = Vertices { positions: &mut mesh.vertices, normals: Some(&mut mesh.normals), data: None };
    surface.write_vertices(all.clone(), &source, place, &pool, to);
    surface.write_triangles(all, sight, &mut mesh.triangles);
    (mesh, (0..=surface.blocks()).map(|end| surface.triangles(&(0..end)).len()).collect())
}

#[track_caller]
fn assert_closed(mesh: &Mesh, what: impl std::fmt::Debug) -> Report {
    let report = Report::of(mesh);
    assert!(report.closed_manifold(), "{what:?}: {report:?}");
    assert_eq!((report.nan_vertices, report.unused_vertices), (0, 0), "{what:?}");
    report
}

/// A hash of three numbers.
fn hash(seed: u32, at: Coord) -> u32 {
    at.iter().fold(seed ^ 0x9e37_79b9, |h, &v| {
        let h = (h ^ v as u32).wrapping_mul(0x85eb_ca6b);
        let h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
        h ^ h >> 16
    })
}

/// A random number in −1..1 for each node, the same at every level.
fn noise(seed: u32) -> impl Fn(Coord) -> f32 + Sync {
    move |node| hash(seed, node) as f32 / (1u32 << 31) as f32 - 1.0
}

/// Blocks of a cube.
fn cube(side: i32) -> impl Iterator<Item = Coord> {
    (0..side.pow(3)).map(move |i| [i % side, i / side % side, i / side / side])
}

fn levels(blocks: impl IntoIterator<Item = Coord>, coarsest: u8, wish: impl FnMut(Coord) -> u8) -> Levels {
    let mut levels = Levels::default();
    levels.list(blocks, coarsest, wish);
    levels
}

/// A ball around the middle of `blocks` blocks of `side` cells: distance from its surface, positive inside.
fn ball(side: usize, blocks: i32, radius: f32) -> impl Fn(Coord) -> f32 + Sync {
    let middle = side as f32 * blocks as f32 / 2.0;
    move |node| {
        let d = node.map(|v| v as f32 - middle);
        radius - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
    }
}

#[test]
fn all_patterns_of_two_levels_around_a_corner_are_closed_whatever_the_signs() {
    for pattern in 0..256u32 {
        for seed in 0..4 {
            let wish = |b: Coord| (pattern >> (b[0] + 2 * b[1] + 4 * b[2]) & 1) as u8;
            // One coarse cell a block is the hardest: all its nodes are on the border.
            let side = [2, 4, 6, 2][seed as usize];
            assert_closed(&mesh(side, levels(cube(2), 1, wish), noise(seed + 4 * pattern)), (pattern, seed));
        }
    }
}

#[test]
fn all_patterns_of_two_levels_around_a_corner_close_a_ball() {
    for pattern in 0..256u32 {
        let wish = |b: Coord| (pattern >> (b[0] + 2 * b[1] + 4 * b[2]) & 1) as u8;
        let report = assert_closed(&mesh(16, levels(cube(2), 1, wish), ball(16, 2, 11.3)), pattern);
        assert_eq!((report.components, report.euler_characteristic), (1, 2), "{pattern}");
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 11.3f64.powi(3);
        // Chords of coarse cells lose 1.84 %, of fine ones a quarter of that.
        let lost = 1.0 - report.signed_volume / exact;
        assert!(lost > 0.003 && lost < 0.019, "{pattern}: {lost}");
    }
}

#[test]
fn random_levels_of_many_blocks_are_closed_whatever_the_signs() {
    for seed in 0..60 {
        let wish = |b: Coord| (hash(seed, b) >> 7 & 3) as u8;
        let levels = levels(cube(4), 3, wish);
        for block in 0..levels.len() {
            for near in levels.near[block].iter().filter(|&&near| near != u32::MAX) {
                assert!(levels.level[block].abs_diff(levels.level[*near as usize]) <= 1);
            }
        }
        assert_closed(&mesh(8, levels, noise(seed)), seed);
    }
}

#[test]
fn every_block_around_one_may_be_finer_or_coarser() {
    // The middle one at level 1, those around it at 0, 1, 2 at random: three levels meet it.
    let mut seen = [[false; 27]; 3];
    for seed in 0..80 {
        let wish = |b: Coord| if b == [1; 3] { 1 } else { (hash(seed, b) >> 9) as u8 % 3 };
        let levels = levels(cube(3), 2, wish);
        for (block, at) in levels.at.iter().enumerate() {
            seen[usize::from(levels.level[block])][(at[0] + 3 * at[1] + 9 * at[2]) as usize] = true;
        }
        assert_closed(&mesh(4, levels, noise(seed)), seed);
    }
    assert!(seen[0].iter().filter(|&&s| s).count() >= 26 && seen[1].iter().all(|&s| s), "{seen:?}");
}

#[test]
fn blocks_that_are_absent_cut_the_surface_off_and_close_it() {
    for seed in 0..40 {
        let listed = cube(3).filter(|&b| hash(seed + 99, b) & 3 != 0);
        let wish = |b: Coord| (hash(seed, b) >> 7 & 1) as u8;
        assert_closed(&mesh(4, levels(listed, 1, wish), noise(seed)), seed);
    }
    let report = assert_closed(&mesh(8, levels(cube(2), 1, |b| b[0] as u8), |_| 1.0), "all inside");
    assert_eq!(report.euler_characteristic, 2);
    // A box whose edges are bevelled by a cell.
    assert!(report.signed_volume > 0.95 * 4096.0 && report.signed_volume < 4096.0, "{}", report.signed_volume);
}

#[test]
fn one_level_everywhere_is_marching_cubes_on_one_lattice() {
    // The same surface whatever the blocks, and none of its vertices off a lattice edge.
    let one = assert_closed(&mesh(32, levels(cube(1), 0, |_| 0), ball(32, 1, 11.3)), "one block");
    for (side, level) in [(8, 0), (4, 0), (16, 0)] {
        let mesh = mesh(side, levels(cube(32 / side as i32), level, |_| level), ball(32, 1, 11.3));
        let many = assert_closed(&mesh, side);
        assert_eq!((many.vertices, many.triangles), (one.vertices, one.triangles));
        assert!((many.signed_volume - one.signed_volume).abs() < 1e-3);
        for v in &mesh.vertices {
            assert!(v.iter().filter(|x| x.fract() == 0.0).count() >= 2, "{v:?}");
        }
    }
}

#[test]
fn planes_stay_planes_across_levels() {
    // Vertices move along the surface only, so that a plane has no dent where levels meet.
    for normal in [[1.0f32, 0.0, 0.0], [0.3, 0.9, 0.2], [1.0, 1.0, 1.0], [-0.2, 0.1, 0.97]] {
        let length = normal.iter().map(|v| v * v).sum::<f32>().sqrt();
        let height = move |p: [f32; 3]| (0..3).map(|a| (p[a] - 16.3) * normal[a] / length).sum::<f32>();
        let wish = |b: Coord| u8::from((b[0] + b[1] + b[2]) % 2 == 0);
        let mesh = mesh(8, levels(cube(4), 1, wish), move |n| -height(n.map(|v| v as f32)));
        assert_closed(&mesh, normal);
        let inner = |p: &&[f32; 3]| p.iter().all(|&v| v > 3.0 && v < 29.0);
        let worst = mesh.vertices.iter().filter(inner).map(|&p| height(p).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-4, "{normal:?}: {worst}");
    }
}

#[test]
fn a_viewer_changes_the_order_of_triangles_alone() {
    for seed in 0..12 {
        let list = || levels(cube(3), 2, |b| (hash(seed, b) >> 7) as u8 % 3);
        let plain = mesh(8, list(), noise(seed));
        let cube = [[40, 60, -30], [-9, 12, 12], [11, 12, 13]][seed as usize % 3].map(i64::from);
        let order = [DrawOrder::BackToFront, DrawOrder::FrontToBack][seed as usize / 3 % 2];
        let (mut other, _) = seen(8, list(), Some(Sight { order, cube, sorting: Sorting::Fast }), noise(seed));
        assert_ne!(other.triangles, plain.triangles);
        let mut triangles = plain.triangles.clone();
        triangles.sort_unstable();
        other.triangles.sort_unstable();
        assert!(other.triangles == triangles && other.vertices == plain.vertices, "{seed}");
    }
}

/// Edges, by vertices, that have a triangle on one side only; panics if one has two on the same side.
fn open_edges(triangles: &[[u32; 3]]) -> usize {
    let edges = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let sides: std::collections::HashSet<_> = edges.collect();
    assert_eq!(sides.len(), 3 * triangles.len(), "each edge once each way");
    sides.iter().filter(|&&(a, b)| !sides.contains(&(b, a))).count()
}

#[test]
fn what_is_hidden_leaves_the_rest_as_it_was() {
    let mut lost_transitions = 0;
    for seed in 0..30 {
        let list = || levels(cube(3), 2, |b| (hash(seed, b) >> 7) as u8 % 3);
        let hidden: Vec<bool> = cube(3).map(|b| hash(seed + 77, b) & 3 == 0).collect();
        let (full, starts) = seen(8, list(), None, noise(seed));
        let (some, _) = seen(8, Levels { hidden: hidden.clone(), ..list() }, None, noise(seed));
        // A triangle by the bits of its corners' places.
        let key = |mesh: &Mesh, t: [u32; 3]| t.map(|v| mesh.vertices[v as usize].map(f32::to_bits));
        let left: std::collections::HashSet<_> = some.triangles.iter().map(|&t| key(&some, t)).collect();
        let (kept, list) = (|t: [u32; 3]| left.contains(&key(&full, t)), list());
        let mut same = Vec::new();
        for block in 0..list.len() {
            let triangles = &full.triangles[starts[block]..starts[block + 1]];
            let stays = triangles.iter().copied().filter(|&t| kept(t));
            same.extend(stays.clone());
            let finer_hidden = list.near[block].iter().any(|&near| {
                near != u32::MAX && hidden[near as usize] && list.level[near as usize] < list.level[block]
            });
            match (hidden[block], finer_hidden) {
                (true, _) => assert_eq!(stays.count(), 0, "{seed}"),
                (_, false) => assert_eq!(stays.count(), triangles.len(), "{seed}"),
                _ => lost_transitions += triangles.len() - stays.count(),
            }
        }
        assert_eq!(same.len(), some.triangles.len(), "{seed}: nothing but what was there");
        // Shared by index where it was, and no vertex is there for nothing.
        assert_eq!(open_edges(&some.triangles), open_edges(&same), "{seed}");
        let used: std::collections::HashSet<_> = same.iter().flatten().collect();
        assert_eq!((used.len(), some.vertices.iter().flatten().any(|v| v.is_nan())), (some.vertices.len(), false));
    }
    assert!(lost_transitions > 100, "{lost_transitions}");
}

/// Least and largest coordinates of a triangle.
fn extremes(mesh: &Mesh, triangle: [u32; 3]) -> [[f32; 3]; 2] {
    let corners = triangle.map(|v| mesh.vertices[v as usize]);
    let over = |f: fn(f32, f32) -> f32| std::array::from_fn(|a| f(f(corners[0][a], corners[1][a]), corners[2][a]));
    [over(f32::min), over(f32::max)]
}

#[test]
fn within_a_block_nothing_comes_before_what_it_hides() {
    // Vertices on the coarse block's border move by half a finest cell along each axis at most, and then to the surface.
    const MOVED: f32 = 0.9;
    let side = 16;
    for (seed, viewer) in [[90, 70, 130], [-40, 99, 7], [5, -60, -50], [9, 8, 6]].into_iter().enumerate() {
        for order in [DrawOrder::BackToFront, DrawOrder::FrontToBack] {
            let wish = |b: Coord| u8::from(b == [0; 3]);
            let sight = Sight { order, cube: viewer, sorting: Sorting::Fast };
            let (mesh, starts) = seen(side, levels(cube(2), 1, wish), Some(sight), noise(seed as u32));
            let boxes: Vec<_> = mesh.triangles[..starts[1]].iter().map(|&t| extremes(&mesh, t)).collect();
            let behind = |p: &[[f32; 3]; 2], q: &[[f32; 3]; 2]| {
                (0..3).all(|a| {
                    // The viewer's cell of two.
                    let eye = 2.0 * viewer[a].div_euclid(2) as f32;
                    q[0][a] > eye + 2.0 + MOVED && p[0][a] >= q[1][a] + MOVED
                        || q[1][a] < eye - MOVED && p[1][a] <= q[0][a] - MOVED
                })
            };
            let mut judged = 0;
            for (i, first) in boxes.iter().enumerate() {
                for second in &boxes[i + 1..] {
                    let (far, near) = if order == DrawOrder::BackToFront { (first, second) } else { (second, first) };
                    assert!(!behind(near, far), "{order:?} from {viewer:?}: {near:?} is behind {far:?}");
                    judged += usize::from(behind(far, near));
                }
            }
            assert!(boxes.len() > 1000 && judged > 300, "{} triangles, {judged} pairs", boxes.len());
        }
    }
}

#[test]
fn transition_cells_come_on_their_side_of_their_cells() {
    let (side, height) = (16, 6.3);
    for face in 0..6 {
        // A plane that the face cuts at a right angle, and lines of cells in it that lead to the face.
        let (axis, up, along) = (face / 2, (face / 2 + 1) % 3, (face / 2 + 2) % 3);
        let (out, edge) = if face % 2 == 0 { (-1, 0.0) } else { (1, side as f32) };
        let mut fine = [0; 3];
        fine[axis] = out;
        for (beyond, order) in [1, -1]
            .into_iter()
            .flat_map(|beyond| [DrawOrder::BackToFront, DrawOrder::FrontToBack].map(|order| (beyond, order)))
        {
            let mut viewer = [3; 3];
            (viewer[axis], viewer[up]) = (i64::from(100 * beyond * out), 60);
            let list = levels([[0; 3], fine], 1, |b| u8::from(b == [0; 3]));
            let (mesh, starts) = seen(side, list, Some(Sight { order, cube: viewer, sorting: Sorting::Fast }), |n| {
                height - n[up] as f32
            });
            let mut lines = [const { Vec::new() }; 8];
            for &triangle in &mesh.triangles[..starts[1]] {
                let [low, high] = extremes(&mesh, triangle);
                let inner = low[along] > 0.9 && high[along] < side as f32 - 0.9;
                if (low[up] - height).abs().max((high[up] - height).abs()) < 1e-3 && inner {
                    let deepest = out as f32 * (edge - if out > 0 { low[axis] } else { high[axis] });
                    // How deep in the coarse block: a transition cell's triangles at most half a finest cell.
                    let part = i32::from(deepest < 0.6);
                    let line = (0.25 * (low[along] + high[along])) as usize;
                    lines[line.min(7)].push(part);
                }
            }
            for line in &lines[1..7] {
                let ends_with_transition = (beyond == 1) == (order == DrawOrder::BackToFront);
                assert!(line.contains(&0) && line.contains(&1), "{face}: {line:?}");
                let sorted = line.windows(2).all(|w| if ends_with_transition { w[0] <= w[1] } else { w[0] >= w[1] });
                assert!(sorted, "face {face}, viewer {viewer:?}, {order:?}: {line:?}");
            }
        }
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| mesh(8, levels(cube(4), 2, |b| (hash(5, b) >> 7) as u8 % 3), noise(5)))
    };
    let one = make(1);
    assert_eq!((make(2), make(5)), (one.clone(), one));
}
