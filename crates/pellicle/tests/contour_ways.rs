//! The ways out of the volume road, normals, streams, and the known answers of the test data.

use std::collections::BTreeMap;

use pellicle::{
    Border, Contour, ContourParams, ContourStream, Control, Error, Level, Mesh, StreamShape, VertexNormals, VertexPool,
    Volume, contour, mesh::Report,
};

/// Noise over waves: all kinds of cells, of whole numbers.
fn noise(dims: [usize; 3]) -> Vec<i16> {
    let mut seed = 3u32;
    (0..dims.iter().product())
        .map(|n| {
            let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let wave = at.iter().map(|&i| if i / 4 % 2 == 0 { 1 } else { -1 }).product::<i32>() * 30;
            (wave + (seed >> 25) as i32 - 64) as i16
        })
        .collect()
}

fn params(level: Level, normals: VertexNormals) -> ContourParams {
    ContourParams { level, normals, ..ContourParams::default() }
}

#[test]
fn all_levels_are_closed_and_manifold_and_the_same_for_every_thread_count() {
    let dims = [37, 25, 70];
    let samples = noise(dims);
    let volume = Volume::new(&samples, dims).expect("fits");
    let mut triangles = Vec::new();
    for level in [Level::Classic, Level::Consistent, Level::Topological] {
        for iso in [-0.5, 0.0, 20.0] {
            let mesh = contour(&volume, iso, &params(level, VertexNormals::Gradient)).expect("good");
            let report = Report::of(&mesh);
            assert!(report.closed_manifold(), "{level:?} {iso}: {report:?}");
            triangles.push(report.triangles);
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
            assert_eq!(
                one.install(|| contour(&volume, iso, &params(level, VertexNormals::Gradient)).expect("good")),
                mesh
            );
        }
    }
    assert!(triangles[0] != triangles[3] && triangles[3] != triangles[6], "levels differ on noise: {triangles:?}");
}

#[test]
fn several_isovalues_are_each_what_they_are_alone() {
    let dims = [30, 31, 32];
    let samples = noise(dims);
    let volume = Volume::new(&samples, dims).expect("fits");
    let params = params(Level::Topological, VertexNormals::Off);
    let isos = [-10.0, 0.0, 33.3, 1000.0];
    let surfaces = Contour::extract(&volume, &isos, &params, &Control::default()).expect("good");
    for (n, &iso) in isos.iter().enumerate() {
        assert_eq!(surfaces.mesh(n), contour(&volume, iso, &params).expect("good"));
    }
}

/// Two balls, one of them noisy, in an empty box: some rows have a dense surface, most have a sparse one or none.
fn mostly_empty(dims: [usize; 3]) -> Vec<f64> {
    let [x, y, z] = dims;
    let mut samples = vec![-1.0; x * y * z];
    for (n, to) in samples.iter_mut().enumerate() {
        let at = [n % x, n / x % y, n / (x * y)].map(|v| v as f64);
        let ball = |c: [f64; 3], r: f64| r - (0..3).map(|a| (at[a] - c[a]).powi(2)).sum::<f64>().sqrt();
        let value = ball([20.3, 30.1, 15.2], 12.0).max(ball([90.0, 20.0, 30.0], 7.5));
        let noise = (n.wrapping_mul(2_654_435_761) >> 7 & 1023) as f64 / 512.0 - 1.0;
        *to = if value > -2.0 && at[0] > 80.0 { value + noise } else { value };
    }
    samples[x * y * 3 + 5 * x + 17] = f64::NAN;
    samples
}

#[test]
fn vertices_made_early_are_those_made_late() {
    let dims = [120, 61, 47];
    let samples = mostly_empty(dims);
    let mask: Vec<bool> = (0..samples.len()).map(|n| n % 911 != 3).collect();
    let plain = Volume::new(&samples, dims).expect("volume");
    let isos = [0.0, 0.75, -3.0];
    for (name, volume) in [
        ("closed", plain),
        ("open", plain.with_border(Border::Open)),
        ("masked", plain.with_mask(&mask).expect("mask")),
        ("mirrored", plain.with_directions([[0.0, -0.3, 0.0], [0.5, 0.0, 0.0], [0.0, 0.1, 1.0]]).expect("directions")),
    ] {
        let extract = |max_memory| {
            let params = ContourParams { max_memory, ..params(Level::Classic, VertexNormals::Gradient) };
            Contour::extract(&volume, &isos, &params, &Control::default()).expect(name)
        };
        // Nothing is kept early where memory has a limit.
        let late = extract(Some(u64::MAX));
        for threads in [1, 3] {
            let early = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            let early = early.install(|| extract(None));
            assert!(early.working_bytes() > late.working_bytes() + 12 * 500, "{name}: some are kept");
            let vertices: usize = (0..isos.len()).map(|surface| early.vertices(surface)).sum();
            assert!(early.working_bytes() < late.working_bytes() + 12 * vertices as u64, "{name}: some are not");
            for surface in 0..isos.len() {
                assert_eq!(early.mesh(surface), late.mesh(surface), "{name} {surface}, {threads} threads");
            }
        }
    }
}

/// Marches slab by slab, `at_once` slabs a push, `batch` slabs a piece.
fn streamed(
    samples: &[i16],
    shape: &StreamShape,
    [at_once, batch]: [usize; 2],
    params: &ContourParams,
) -> (Mesh, usize) {
    let mut stream = ContourStream::<i16>::new(shape, 0.0, params).expect("good").with_batch(batch);
    let mut mesh = Mesh { origin: shape.origin, ..Mesh::default() };
    let mut pieces = 1;
    for slabs in samples.chunks(shape.dims[0] * shape.dims[1] * at_once) {
        if let Some(piece) = stream.push(slabs).expect("fits") {
            piece.append_to(&mut mesh).expect("small");
            pieces += 1;
        }
    }
    stream.finish().expect("complete").append_to(&mut mesh).expect("small");
    (mesh, pieces)
}

#[test]
fn a_volume_slab_by_slab_gives_the_same_bytes() {
    let dims = [40, 37, 31];
    let samples = noise(dims);
    for border in [Border::Closed, Border::Open] {
        let volume = Volume::new(&samples, dims).expect("fits").with_border(border);
        let volume = volume.with_origin([1.0, 2.0, 3.0]).expect("good");
        let volume = volume.with_directions([[0.5, 0.0, 0.1], [0.0, -0.7, 0.0], [0.0, 0.2, 1.5]]).expect("good");
        let params = params(Level::Topological, VertexNormals::Gradient);
        let want = contour(&volume, 0.0, &params).expect("good");
        for [at_once, batch] in [[1, 1], [1, 4], [7, 5], [31, 9]] {
            let (got, pieces) = streamed(&samples, &StreamShape::of(&volume), [at_once, batch], &params);
            assert!(got == want, "{border:?}, {at_once} slabs at once, {batch} a piece");
            assert!(pieces + 2 > 31 / batch.max(at_once), "{pieces} pieces");
        }
    }
}

#[test]
fn a_stream_with_a_limit_takes_no_more_slabs_together_than_fit() {
    let dims = [64; 3];
    let inside = |n: usize| {
        let at = [n % 64, n / 64 % 64, n / 4096].map(|i| i as i32 - 32);
        (625 - at.iter().map(|x| x * x).sum::<i32>()) as i16
    };
    let samples: Vec<i16> = (0..64 * 64 * 64).map(inside).collect();
    let shape = StreamShape::new(dims);
    let free = params(Level::Classic, VertexNormals::Gradient);
    let (want, pieces) = streamed(&samples, &shape, [1, 64], &free);
    assert_eq!(pieces, 1, "without a limit all at once");
    // The samples alone are 512 KiB, and the surface is as much again.
    let (got, pieces) = streamed(&samples, &shape, [1, 64], &ContourParams { max_memory: Some(900_000), ..free });
    assert!(got == want && pieces > 4, "{pieces} pieces");
}

#[test]
fn streams_refuse_what_does_not_fit() {
    let shape = StreamShape::new([4, 5, 3]);
    let mut stream = ContourStream::<u8>::new(&shape, 0.5, &ContourParams::default()).expect("good");
    assert!(matches!(stream.push(&[0; 21]), Err(Error::Length { .. })));
    assert!(stream.push(&[1; 40]).expect("fits").is_none());
    assert!(matches!(stream.push(&[0; 40]), Err(Error::Length { .. })));
    assert!(matches!(stream.finish(), Err(Error::Length { found: 2, expected: 3, .. })));
    assert!(ContourStream::<u8>::new(&StreamShape::new([4, 5, 1]), 0.5, &ContourParams::default()).is_err());
    assert!(ContourStream::<u8>::new(&shape, f64::NAN, &ContourParams::default()).is_err());
    assert!(ContourStream::<u8>::new(&shape, 0.5, &params(Level::Classic, VertexNormals::Faces)).is_err());
}

/// A ball around the middle, of the distance squared, in an oblique volume.
fn ball(n: usize) -> Vec<f32> {
    let c = 0.5 * (n - 1) as f32;
    let d = |i: usize| (i as f32 - c).powi(2);
    let radius = 0.35 * n as f32;
    (0..n * n * n).map(|i| radius * radius - d(i % n) - d(i / n % n) - d(i / (n * n))).collect()
}

#[test]
fn normals_are_those_of_the_surface_also_in_oblique_and_mirrored_volumes() {
    let samples = ball(40);
    for directions in [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]],
        [[2.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.0, 0.25, 0.5]],
    ] {
        let volume = Volume::new(&samples, [40; 3]).expect("fits").with_directions(directions).expect("good");
        for (kind, most) in [(VertexNormals::Gradient, 0.01), (VertexNormals::Faces, 0.35)] {
            let mesh = contour(&volume, 0.0, &params(Level::Classic, kind)).expect("good");
            // In node coordinates the ball is round: its normal is the radius, through the inverse transpose.
            let d: [[f64; 3]; 3] = directions;
            for (v, n) in mesh.vertices.iter().zip(&mesh.normals) {
                let solve = |p: [f64; 3]| {
                    // By elimination: the directions are triangular.
                    let (a, b, c) = (d[0], d[1], d[2]);
                    let k = p[2] / c[2];
                    let j = (p[1] - k * c[1]) / b[1];
                    [(p[0] - j * b[0] - k * c[0]) / a[0], j, k]
                };
                let at = solve(v.map(f64::from)).map(|x| x - 19.5);
                // d/dx of |at|² / 2 is the sum of at times the rows of the inverse.
                let rows: [[f64; 3]; 3] =
                    std::array::from_fn(|a| solve(std::array::from_fn(|b| if a == b { 1.0 } else { 0.0 })));
                let want: [f64; 3] = std::array::from_fn(|a| (0..3).map(|i| at[i] * rows[a][i]).sum());
                let length = want.iter().map(|x| x * x).sum::<f64>().sqrt();
                let off = (0..3).map(|a| (want[a] / length - f64::from(n[a])).powi(2)).sum::<f64>().sqrt();
                assert!(off < most, "{kind:?}: {n:?} instead of {want:?}");
            }
        }
    }
}

#[test]
fn caps_have_the_normals_of_the_border() {
    let samples = vec![1.0f32; 125];
    let mesh =
        contour(&Volume::new(&samples, [5; 3]).expect("fits"), 0.0, &params(Level::Classic, VertexNormals::Gradient))
            .expect("good");
    for (v, n) in mesh.vertices.iter().zip(&mesh.normals) {
        let axis = n.iter().position(|x| x.abs() == 1.0).expect("parallel to an axis");
        assert_eq!(v[axis], if n[axis] > 0.0 { 4.0 } else { 0.0 });
    }
}

/// Positions of triangles as bits, and how often each comes.
fn triangles_of(positions: impl Iterator<Item = [[f32; 3]; 3]>) -> BTreeMap<[[u32; 3]; 3], usize> {
    let mut count = BTreeMap::new();
    for triangle in positions {
        *count.entry(triangle.map(|v| v.map(f32::to_bits))).or_insert(0) += 1;
    }
    count
}

#[test]
fn soup_and_welded_slices_hold_the_mesh() {
    let dims = [33, 34, 35];
    let samples = noise(dims);
    let volume = Volume::new(&samples, dims).expect("fits");
    for level in [Level::Classic, Level::Topological] {
        let surface = Contour::extract(&volume, &[0.0], &params(level, VertexNormals::Gradient), &Control::default())
            .expect("good");
        let mesh = surface.mesh(0);
        let (n, t) = (mesh.vertices.len(), mesh.triangles.len());
        let (mut vertices, mut normals, mut triangles) =
            (vec![[9.0; 3]; n + 5], vec![[9.0; 3]; n + 5], vec![[9; 3]; t + 5]);
        surface.write_welded(0, &mut vertices, Some(&mut normals), &mut triangles).expect("fits");
        assert!(vertices[..n] == mesh.vertices && normals[..n] == mesh.normals && triangles[..t] == mesh.triangles);
        assert!(vertices[n..] == [[9.0; 3]; 5] && triangles[t..] == [[9; 3]; 5]);
        let short = surface.write_welded(0, &mut vertices[..n - 1], None, &mut triangles);
        assert_eq!(short, Err(Error::Capacity { what: "vertices", needed: n as u64, available: n as u64 - 1 }));

        let (mut positions, mut normals) = (vec![[0.0; 3]; 3 * t], vec![[0.0; 3]; 3 * t]);
        surface.write_soup(0, &mut positions, Some(&mut normals)).expect("fits");
        let want: Vec<[f32; 3]> = mesh.triangles.iter().flatten().map(|&v| mesh.vertices[v as usize]).collect();
        assert!(positions == want);
        let unit = normals.iter().filter(|n| (n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-5).count();
        assert!(unit > 3 * t * 9 / 10);
        assert!(surface.write_soup(0, &mut positions[1..], None).is_err());
    }
}

#[test]
fn a_pool_holds_the_triangles_of_the_mesh_and_is_never_overrun() {
    let dims = [33, 34, 35];
    let samples = noise(dims);
    let volume = Volume::new(&samples, dims).expect("fits");
    let surface = Contour::extract(&volume, &[0.0], &ContourParams::default(), &Control::default()).expect("good");
    let mesh = surface.mesh(0);
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    let real = |t: &[[f32; 3]; 3]| t[0] != t[1] || t[1] != t[2];
    let want = triangles_of(mesh.triangles.iter().map(corners).filter(real));
    for (stride, normal_stride, skip) in [(3, 3, 0), (4, 3, 1), (8, 5, 3), (3, 4, 2)] {
        let room = 3 * mesh.triangles.len() + 192 * 80;
        let (mut positions, mut normals) = (vec![7.0f32; room * stride + skip], vec![7.0f32; room * normal_stride]);
        let pool = VertexPool::new(&mut positions[skip..], stride, Some((&mut normals, normal_stride))).expect("good");
        let used = surface.write_pool(0, &pool).expect("fits");
        assert_eq!(used.triangles, mesh.triangles.len());
        assert!(used.vertices >= 3 * used.triangles && used.vertices <= pool.capacity());
        drop(pool);
        let at = |v: usize| -> [f32; 3] { std::array::from_fn(|a| positions[skip + v * stride + a]) };
        let drawn = (0..used.vertices / 3).map(|t| [at(3 * t), at(3 * t + 1), at(3 * t + 2)]).filter(real);
        assert!(triangles_of(drawn) == want, "stride {stride}");
        assert!(positions[skip + used.vertices * stride..].iter().all(|&x| x == 7.0));
        assert!(normals[used.vertices * normal_stride..].iter().all(|&x| x == 7.0));
    }
    let mut small = vec![7.0f32; 3 * 192 * 10 + 3 * 192 / 2];
    let pool = VertexPool::new(&mut small[..3 * 192 * 10], 3, None).expect("good");
    let error = surface.write_pool(0, &pool).expect_err("too small");
    let Error::Capacity { needed, available, .. } = error else { panic!("{error:?}") };
    assert!(needed >= 3 * mesh.triangles.len() as u64 && available <= 1920, "{needed} {available}");
    drop(pool);
    assert!(small[3 * 192 * 10..].iter().all(|&x| x == 7.0));
    assert!(VertexPool::new(&mut small, 2, None).is_err());
}
