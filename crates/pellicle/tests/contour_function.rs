//! Marching cubes on functions: the bytes of a volume that holds the same values, without the volume.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use pellicle::{
    Border, Contour, ContourParams, ContourStream, Control, Domain, Error, Function, Level, Mesh, StreamShape,
    VertexNormals, VertexPool, Volume, Warp, contour, contour_function, mesh::Report,
};

/// Waves as short as a few cells, and noise: all kinds of cells.
fn rough(p: [f64; 3]) -> f64 {
    let bits = p
        .map(f64::to_bits)
        .iter()
        .fold(7u64, |hash, &v| (hash ^ v).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
    let wave = p.map(|v| (5.0 * v).rem_euclid(2.0) - 1.0).iter().product::<f64>();
    wave + (bits >> 40) as f64 / f64::from(1 << 24) - 0.5
}

fn sphere(p: [f64; 3]) -> f64 {
    1.0 - p.iter().map(|v| v * v).sum::<f64>().sqrt()
}

const BOX: [[f64; 3]; 2] = [[-1.0, -1.3, -1.7], [1.0, 1.3, 1.7]];

fn domain(border: Border) -> Domain<'static> {
    Domain { border, ..Domain::covering(BOX, 0.061) }
}

/// The function at the domain's nodes.
fn values(function: &dyn Function, domain: &Domain<'_>) -> ([usize; 3], Vec<f64>) {
    let dims = domain.cells.map(|n| n + 1);
    let at = |n: usize| {
        let node = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
        function.value([0, 1, 2].map(|a| domain.low[a] + node[a] as f64 * domain.spacing[a]))
    };
    (dims, (0..dims.iter().product()).map(at).collect())
}

fn params(level: Level, normals: VertexNormals) -> ContourParams {
    ContourParams { level, normals, ..ContourParams::default() }
}

#[test]
fn the_same_bytes_as_of_a_volume_with_the_same_values() {
    for border in [Border::Closed, Border::Open] {
        let domain = domain(border);
        let (dims, values) = values(&rough, &domain);
        let volume = Volume::new(&values, dims).expect("fits").with_border(border);
        let volume = volume.with_origin(domain.low).expect("finite").with_spacing(domain.spacing).expect("good");
        for level in [Level::Classic, Level::Consistent, Level::Topological] {
            let params = params(level, VertexNormals::Faces);
            let isos = [-0.1, 0.0, 0.3, 77.0];
            let want = Contour::extract(&volume, &isos, &params, &Control::default()).expect("good");
            assert!(want.triangles(1) > 20_000);
            // All at once, and window by window of a single slab.
            for max_memory in [None, Some(2_000_000)] {
                let params = ContourParams { max_memory, ..params.clone() };
                let got = Contour::of_function(&rough, &domain, &isos, &params, &Control::default()).expect("good");
                for surface in 0..isos.len() {
                    assert_eq!(got.mesh(surface), want.mesh(surface), "{border:?} {level:?} {max_memory:?} {surface}");
                }
            }
        }
    }
}

#[test]
fn the_same_bytes_for_every_thread_count_and_window() {
    let params = params(Level::Topological, VertexNormals::Gradient);
    let mesh = |threads, max_memory| {
        let params = ContourParams { max_memory, ..params.clone() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let surface = Contour::of_function(&rough, &domain(Border::Closed), &[0.0], &params, &Control::default());
            surface.expect("good").mesh(0)
        })
    };
    let want = mesh(1, None);
    assert!(Report::of(&want).closed_manifold());
    for (threads, max_memory) in [(3, None), (1, Some(1_000_000)), (2, Some(1_500_000))] {
        assert_eq!(mesh(threads, max_memory), want, "{threads} threads, {max_memory:?}");
    }
}

#[test]
fn a_node_is_asked_once_and_a_vertex_twice() {
    struct Counted(AtomicUsize);
    impl Function for Counted {
        fn value(&self, at: [f64; 3]) -> f64 {
            self.0.fetch_add(1, Relaxed);
            sphere(at)
        }
    }
    let (function, domain) = (Counted(AtomicUsize::new(0)), domain(Border::Closed));
    for max_memory in [None, Some(150_000)] {
        function.0.store(0, Relaxed);
        let params = ContourParams { max_memory, ..ContourParams::default() };
        let surface = Contour::of_function(&function, &domain, &[0.0], &params, &Control::default()).expect("good");
        assert_eq!(function.0.load(Relaxed), domain.cells.iter().map(|n| n + 1).product::<usize>());
        function.0.store(0, Relaxed);
        let mesh = surface.mesh(0);
        assert_eq!(function.0.load(Relaxed), 2 * mesh.vertices.len());
    }
}

#[test]
fn every_way_out_is_there() {
    let domain = domain(Border::Closed);
    for level in [Level::Classic, Level::Topological] {
        let params = ContourParams { max_memory: Some(2_000_000), ..params(level, VertexNormals::Gradient) };
        let surface = Contour::of_function(&rough, &domain, &[0.0], &params, &Control::default()).expect("good");
        let mesh = surface.mesh(0);
        let (n, t) = (mesh.vertices.len(), mesh.triangles.len());
        let (mut vertices, mut normals, mut triangles) =
            (vec![[9.0; 3]; n + 1], vec![[9.0; 3]; n + 1], vec![[9; 3]; t]);
        surface.write_welded(0, &mut vertices, Some(&mut normals), &mut triangles).expect("fits");
        assert_eq!((&vertices[..n], vertices[n], &normals[..n]), (&mesh.vertices[..], [9.0; 3], &mesh.normals[..]));
        assert_eq!(triangles, mesh.triangles);
        let corners: Vec<[f32; 3]> = mesh.triangles.iter().flatten().map(|&v| mesh.vertices[v as usize]).collect();
        let mut soup = vec![[0.0; 3]; 3 * t];
        surface.write_soup(0, &mut soup, None).expect("fits");
        assert!(soup == corners, "soup is the mesh's triangles in order");
        let mut memory = vec![0.0f32; 6 * (3 * t + 400_000)];
        let pool = VertexPool::new(&mut memory, 6, None).expect("good");
        let used = surface.write_pool(0, &pool).expect("fits");
        drop(pool);
        assert!(used.triangles == t && used.vertices >= 3 * t);
        let sorted = |mut triangles: Vec<[u32; 9]>| {
            triangles.sort_unstable();
            triangles
        };
        let bits = |corners: &[[f32; 3]]| -> [u32; 9] { std::array::from_fn(|i| corners[i / 3][i % 3].to_bits()) };
        let pooled: Vec<[f32; 3]> = memory.chunks_exact(6).take(used.vertices).map(|v| [v[0], v[1], v[2]]).collect();
        let is_triangle = |t: &&[[f32; 3]]| t[0] != t[1] || t[1] != t[2];
        let pooled = sorted(pooled.chunks_exact(3).filter(is_triangle).map(bits).collect());
        let want = sorted(corners.chunks_exact(3).filter(is_triangle).map(bits).collect());
        assert!(pooled == want, "the pool has the same set of triangles");
    }
}

#[test]
fn normals_are_the_functions_and_on_caps_the_borders() {
    let shifted = |p: [f64; 3]| sphere([p[0] - 0.4, p[1], p[2]]);
    let mesh =
        contour_function(&shifted, &domain(Border::Closed), 0.0, &params(Level::Classic, VertexNormals::Gradient))
            .expect("good");
    assert!(Report::of(&mesh).closed_manifold());
    let (mut on_cap, mut round) = (0, 0);
    let last = domain(Border::Closed);
    let high = last.low[0] + last.spacing[0] * last.cells[0] as f64;
    for v in 0..mesh.vertices.len() {
        let (at, normal) = (mesh.position(v), mesh.normals[v].map(f64::from));
        let centre = [at[0] - 0.4, at[1], at[2]];
        let along = (0..3).map(|a| centre[a] * normal[a]).sum::<f64>();
        if (at[0] - high).abs() < 1e-6 && normal[0] > 0.999 {
            on_cap += 1;
            assert_eq!(normal, [1.0, 0.0, 0.0]);
        } else {
            round += 1;
            assert!((along - centre.iter().map(|c| c * c).sum::<f64>().sqrt()).abs() < 1e-4, "{at:?} {normal:?}");
        }
    }
    assert!(on_cap > 300 && round > 3000, "{on_cap} {round}");
}

/// x and y swapped, which mirrors, and z bent.
struct Bent;

impl Warp for Bent {
    fn to_world(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [y, x, z + 0.1 * z * z]
    }
}

#[test]
fn warped_domains_place_vertices_in_the_world() {
    for (level, border) in [(Level::Classic, Border::Closed), (Level::Topological, Border::Closed)] {
        let domain = Domain { border, ..Domain::covering([[-1.2; 3], [1.2; 3]], 0.05) }.warped(&Bent);
        let mesh = contour_function(&sphere, &domain, 0.0, &params(level, VertexNormals::Gradient)).expect("good");
        let report = Report::of(&mesh);
        assert!(report.closed_manifold() && report.euler_characteristic == 2);
        assert!((report.signed_volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{report:?}");
        for v in 0..mesh.vertices.len() {
            let at = mesh.position(v);
            assert!(sphere(at).abs() < 2e-3, "{at:?}");
            let along: f64 = (0..3).map(|a| at[a] * f64::from(mesh.normals[v][a])).sum();
            assert!(along > 0.99);
        }
        let surface =
            Contour::of_function(&sphere, &domain, &[0.0], &params(level, VertexNormals::Off), &Control::default());
        let mut soup = vec![[0.0; 3]; 3 * mesh.triangles.len()];
        surface.expect("good").write_soup(0, &mut soup, None).expect("fits");
        let corners: Vec<[f32; 3]> = mesh.triangles.iter().flatten().map(|&v| mesh.vertices[v as usize]).collect();
        assert!(soup == corners);
    }
    // Caps in the bent world.
    let domain = Domain::covering([[-0.5; 3], [0.5; 3]], 0.1).warped(&Bent);
    let mesh = contour_function(&|_: [f64; 3]| 1.0, &domain, 0.0, &params(Level::Classic, VertexNormals::Gradient));
    let mesh = mesh.expect("good");
    let report = Report::of(&mesh);
    assert!(report.closed_manifold() && report.signed_volume > 0.9);
    for v in 0..mesh.vertices.len() {
        let at = mesh.position(v);
        let along: f64 = (0..3).map(|a| at[a] * f64::from(mesh.normals[v][a])).sum();
        assert!(along > 0.3, "{at:?} {:?}", mesh.normals[v]);
    }
}

#[test]
fn no_value_is_outside() {
    let holed = |p: [f64; 3]| if p[0] > 0.3 { f64::NAN } else { sphere(p) };
    for level in [Level::Classic, Level::Topological] {
        let mesh = contour_function(&holed, &domain(Border::Closed), 0.0, &params(level, VertexNormals::Gradient));
        let mesh: Mesh = mesh.expect("good");
        assert!(Report::of(&mesh).closed_manifold() && !mesh.triangles.is_empty());
        assert!(mesh.vertices.iter().chain(&mesh.normals).flatten().all(|v| v.is_finite()));
    }
}

#[test]
fn what_cannot_be_done_is_refused() {
    let good = domain(Border::Closed);
    let refused =
        |domain: &Domain<'_>, iso| contour_function(&sphere, domain, iso, &ContourParams::default()).expect_err("bad");
    assert!(matches!(refused(&good, f64::NAN), Error::Parameter { name: "iso", .. }));
    assert!(matches!(refused(&Domain { cells: [0, 1, 1], ..good }, 0.0), Error::Dims { .. }));
    assert!(matches!(refused(&Domain { cells: [1 << 29, 1 << 29, 1], ..good }, 0.0), Error::Count { .. }));
}

/// Raises a limit to what is asked for until it is enough.
fn enough(mut work: impl FnMut(u64) -> Result<(), Error>) -> u64 {
    let mut limit = 1000;
    // What is needed at least is told: the pieces to come may be larger.
    for _ in 0..40 {
        match work(limit) {
            Ok(()) => return limit,
            Err(Error::Memory { needed, available, .. }) => {
                assert!(available == limit && needed > limit);
                limit = needed;
            }
            Err(error) => panic!("{error}"),
        }
    }
    panic!("the number needed is never told");
}

#[test]
fn limits_of_memory_are_held_or_refused_with_the_number_needed() {
    let domain = domain(Border::Closed);
    let (dims, values) = values(&rough, &domain);
    let volume = Volume::new(&values, dims).expect("fits");
    let within = |limit| ContourParams { max_memory: Some(limit), ..ContourParams::default() };
    let want = contour(&volume, 0.0, &ContourParams::default()).expect("good");
    let mesh_bytes = 12 * (want.vertices.len() + want.triangles.len()) as u64;
    let limit = enough(|limit| contour(&volume, 0.0, &within(limit)).map(|mesh| assert_eq!(mesh, want)));
    assert!((mesh_bytes..2 * mesh_bytes).contains(&limit), "{limit} {mesh_bytes}");
    let limit = enough(|limit| contour_function(&rough, &domain, 0.0, &within(limit)).map(drop));
    assert!((mesh_bytes..2 * mesh_bytes).contains(&limit), "{limit} {mesh_bytes}");
    let shape = StreamShape::of(&volume);
    let limit = enough(|limit| {
        let mut stream = ContourStream::<f64>::new(&shape, 0.0, &within(limit))?;
        let mut mesh = Mesh::default();
        for slab in values.chunks(dims[0] * dims[1]) {
            if let Some(piece) = stream.push(slab)? {
                piece.append_to(&mut mesh)?;
            }
        }
        stream.finish()?.append_to(&mut mesh)?;
        assert!(mesh.vertices == want.vertices && mesh.triangles == want.triangles);
        Ok(())
    });
    assert!(limit < mesh_bytes / 2, "{limit} {mesh_bytes}");
}
