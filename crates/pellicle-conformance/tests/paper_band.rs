//! The narrow band of Akinci et al. 2012: the triangles of the full evaluation wherever a cell's nodes are marked, and none
//! elsewhere; no second layer inside; the same bytes for threads, vector units and blocks. Closedness is not asked for.

use std::collections::BTreeMap;

use pellicle::{Band, Control, Lanes, Mesh, Positions, ScalarField, surface_particles};
use pellicle_conformance::{
    Delivery, Memory, Random, Scene, Subject,
    cavities::{self, HOLES},
    must, same_bytes,
    scenes::{self, RADIUS, SPACING},
};

fn paper(name: &str) -> Subject {
    Subject { band: Band::Paper, ..Subject::with_field(name) }
}

/// Cells by their first node.
type Cell = [i64; 3];

/// Whether a node lies within two spacings of a surface particle, along each axis: looked up in buckets as wide.
struct Marked {
    buckets: BTreeMap<Cell, Vec<[f64; 3]>>,
    spacing: f64,
}

impl Marked {
    fn of(scene: &Scene) -> Self {
        let surface = surface_particles((&scene.positions).into(), scene.params.particle_radius, &Control::default());
        let mut buckets: BTreeMap<Cell, Vec<_>> = BTreeMap::new();
        for (p, _) in scene.positions.iter().zip(surface.expect("surface particles")).filter(|(_, found)| *found) {
            buckets.entry(p.map(|v| (v / (2.0 * SPACING)).floor() as i64)).or_default().push(*p);
        }
        Self { buckets, spacing: scene.params.spacing() }
    }

    /// Whether a node is marked when boxes are wider by `slack`.
    fn node(&self, node: Cell, slack: f64) -> bool {
        let at = node.map(|n| n as f64 * self.spacing);
        let bucket = at.map(|v| (v / (2.0 * SPACING)).floor() as i64);
        (0..27).any(|i| {
            let near = std::array::from_fn(|a| bucket[a] + [i % 3, i / 3 % 3, i / 9][a] - 1);
            let close = |p: &[f64; 3]| (0..3).all(|a| (p[a] - at[a]).abs() <= 2.0 * SPACING + slack);
            self.buckets.get(&near).is_some_and(|points| points.iter().any(close))
        })
    }

    /// Whether all nodes of a cell are marked; nothing where rounding decides.
    fn cell(&self, cell: Cell) -> Option<bool> {
        let all = |slack| (0..8).all(|c| self.node(std::array::from_fn(|a| cell[a] + (c >> a & 1)), slack));
        let surely = all(-1e-9);
        (surely == all(1e-9)).then_some(surely)
    }
}

/// A triangle as its corners' bits: each mesh winds it the same way from the same corner.
type Key = [[u32; 3]; 3];

/// How often each triangle occurs, and the cell that it lies in; no cell where it lies so near a face that rounding decides.
fn triangles(mesh: &Mesh, spacing: f64) -> BTreeMap<Key, (usize, Option<Cell>)> {
    let mut found = BTreeMap::new();
    for triangle in &mesh.triangles {
        let key = triangle.map(|v| mesh.vertices[v as usize].map(f32::to_bits));
        let middle: [f64; 3] = std::array::from_fn(|a| {
            triangle.iter().map(|&v| mesh.position(v as usize)[a]).sum::<f64>() / (3.0 * spacing)
        });
        let clear = middle.iter().all(|v| (v - v.round()).abs() > 1e-4);
        found.entry(key).or_insert((0, clear.then(|| middle.map(|v| v.floor() as i64)))).0 += 1;
    }
    found
}

/// The paper's mesh against the full one, triangle by triangle. Returns how many it has, and how many it leaves out.
fn compare(scene: &Scene, name: &str) -> [usize; 2] {
    let mesh = |band| must(Subject { band, ..paper(name) }.mesh(scene).map_err(|e| format!("{}: {e}", scene.name)));
    let spacing = scene.params.spacing();
    let (paper, full) = (triangles(&mesh(Band::Paper), spacing), triangles(&mesh(Band::Full), spacing));
    let marked = Marked::of(scene);
    for key in paper.keys() {
        assert!(full.contains_key(key), "{}, {name}: a triangle that the full evaluation has not", scene.name);
    }
    let mut counts = [0; 2];
    for (key, (count, cell)) in full {
        let found = paper.get(&key).map_or(0, |found| found.0);
        counts[0] += found;
        counts[1] += count - found;
        if let Some((cell, expected)) = cell.and_then(|cell| marked.cell(cell).map(|marked| (cell, marked))) {
            assert_eq!(found, if expected { count } else { 0 }, "{}, {name}: cell {cell:?}", scene.name);
        }
    }
    counts
}

fn scenes_near_the_origin() -> Vec<Scene> {
    let mut random = Random::new(5);
    vec![
        scenes::none(),
        scenes::one(),
        scenes::two_apart(),
        scenes::coincident_hundred(),
        scenes::torus(),
        scenes::negative_coordinates(),
        cavities::bulk(10, 0.15, HOLES[2], &mut random).cell_size(1.0),
        cavities::thin_sheet(0.1, &mut random).cell_size(0.75),
        cavities::spray(120, 0.1, &mut random).cell_size(1.0),
        cavities::hollow(0.7, 1.0, &mut random).cell_size(2.0),
    ]
}

#[test]
fn triangles_are_those_of_the_full_evaluation_in_marked_cells_with_every_field() {
    let mut all = [0; 2];
    for name in ScalarField::NAMES {
        for scene in scenes_near_the_origin() {
            let counts = compare(&scene, name);
            all = [all[0] + counts[0], all[1] + counts[1]];
        }
    }
    println!("{} triangles, {} left out", all[0], all[1]);
    assert!(all[0] > 10_000 && all[1] > 0, "{all:?}: some of each kind, or nothing was tested");
}

#[test]
fn the_bytes_are_the_same_on_every_backend_with_every_field() {
    for name in ScalarField::NAMES {
        let own = paper(name);
        let mut all = scenes_near_the_origin();
        all.push(scenes::far_from_the_origin());
        all.push(scenes::stray_particle());
        for scene in all {
            let mesh = |subject: &Subject| must(subject.mesh(&scene).map_err(|e| format!("{}: {e}", scene.name)));
            let want = mesh(&Subject { lanes: Lanes::Portable, threads: 1, ..own });
            for subject in [
                own,
                Subject { lanes: Lanes::Avx2, threads: 1, ..own },
                Subject { threads: 7, delivery: Delivery::Chunks, ..own },
                Subject { memory: Memory::Least, delivery: Delivery::Chunks, ..own },
            ] {
                if subject.available() {
                    let same = same_bytes(&mesh(&subject), &want);
                    must(same.map_err(|e| format!("{}, {subject:?}: {e}", scene.name)));
                }
            }
        }
    }
}

/// A jittered block, deep enough to have an inside that nothing marks.
fn pool() -> Scene {
    const SIDE: i32 = 20;
    let mut random = Random::new(9);
    let place = |i: i32| [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
    let positions = (0..SIDE.pow(3))
        .map(|i| {
            let jitter = random.in_cube(0.1 * SPACING);
            std::array::from_fn(|a| (f64::from(place(i)[a]) + 0.5) * SPACING + jitter[a])
        })
        .collect();
    Scene::new("pool", positions).cell_size(1.0)
}

/// Vertices that lie three spacings or more below the pool's faces.
fn vertices_inside(mesh: &Mesh) -> usize {
    let inside = |v: f64| v > 3.0 * SPACING && v < 17.0 * SPACING;
    (0..mesh.vertices.len()).filter(|&v| mesh.position(v).into_iter().all(inside)).count()
}

#[test]
fn no_second_layer_appears_inside_a_pool() {
    let scene = pool();
    let surface = surface_particles((&scene.positions).into(), RADIUS, &Control::default()).expect("surface particles");
    let share = surface.iter().filter(|found| **found).count() as f64 / surface.len() as f64;
    // One layer of 20³ is 27 %.
    assert!(share > 0.25 && share < 0.5, "{share}");
    for name in ScalarField::NAMES {
        let mesh = must(paper(name).mesh(&scene).map_err(|e| e.to_string()));
        assert!(mesh.triangles.len() > 1000, "{name}");
        assert_eq!(vertices_inside(&mesh), 0, "{name}");
        // Without the inner particles there would be one: so the test can see it.
        let alone: Vec<_> = scene.positions.iter().zip(&surface).filter(|(_, s)| **s).map(|(p, _)| *p).collect();
        let wrong = Subject::with_field(name).mesh(&Scene { positions: alone, ..scene.clone() });
        assert!(vertices_inside(&must(wrong.map_err(|e| e.to_string()))) > 100, "{name}");
    }
}

#[test]
fn radii_of_their_own_widen_the_boxes() {
    let scene = pool();
    let radii: Vec<f32> = scene.positions.iter().map(|p| (RADIUS * (1.0 + 0.1 * p[0])) as f32).collect();
    for name in ScalarField::NAMES {
        let run = |subject: Subject| {
            let positions = Positions::from(&scene.positions).with_radii(&radii);
            subject.mesh_of(positions, &[], &subject.params(&scene)).expect("a mesh")
        };
        let (mesh, stats) = run(paper(name));
        let (common, _) =
            paper(name).mesh_of((&scene.positions).into(), &[], &paper(name).params(&scene)).expect("a mesh");
        assert!(mesh.triangles.len() > 1000 && vertices_inside(&mesh) == 0, "{name}");
        assert!(mesh != common && stats.surface_particles > 0 && stats.surface_nodes > 0, "{name}");
        let little = Subject { memory: Memory::Least, delivery: Delivery::Chunks, threads: 3, ..paper(name) };
        must(same_bytes(&run(little).0, &mesh));
    }
}

#[test]
fn a_reconstructor_forgets_the_marks_of_the_frame_before() {
    let scene = scenes::ball();
    let mut reconstructor = pellicle::Reconstructor::new();
    let control = Control::default();
    for band in [Band::Auto, Band::Paper, Band::Auto, Band::Full] {
        let params = pellicle::Params { band, ..scene.params.clone() };
        let surface = reconstructor.extract((&scene.positions).into(), &[], &params, &control).expect("a surface");
        assert_eq!(surface.stats().surface_nodes > 0, band == Band::Paper);
        let alone = pellicle::reconstruct(&scene.positions, &params).expect("a mesh");
        must(same_bytes(&surface.to_mesh().expect("a mesh"), &alone));
    }
}
