//! The volume road from outside: what holds for every kind of view.

use pellicle::{Border, ContourParams, Error, Lanes, Mesh, Samples, Volume, contour, mesh::Report};

const N: [usize; 3] = [23, 70, 17];

/// A ball, a torus-like ring and noise, of whole numbers between -100 and 100.
fn blobs(dims: [usize; 3]) -> Vec<i8> {
    let mut seed = 1u32;
    (0..dims.iter().product())
        .map(|n| {
            let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
            let d = |a: usize, c: f64| at[a] as f64 - c * dims[a] as f64;
            let ball = 40.0 - d(0, 0.5).powi(2) - 0.1 * d(1, 0.5).powi(2) - d(2, 0.5).powi(2);
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (ball + f64::from(seed >> 24) / 4.0 - 32.0).clamp(-100.0, 100.0) as i8
        })
        .collect()
}

fn mesh(volume: &Volume<'_>, iso: f64) -> Mesh {
    contour(volume, iso, &ContourParams::default()).expect("good input")
}

#[test]
fn every_type_of_samples_gives_the_same_bytes() {
    let samples = blobs(N);
    let want = mesh(&Volume::new(&samples, N).expect("fits"), 0.5);
    assert!(Report::of(&want).closed_manifold());
    assert!(want.triangles.len() > 5000);
    let check = |samples: Samples<'_>, shift: f64| {
        let got = mesh(&Volume::new(samples, N).expect("fits"), 0.5 + shift);
        assert_eq!(got, want, "{:?}", std::mem::discriminant(&samples));
    };
    check((&samples.iter().map(|&v| (i16::from(v) + 100) as u8).collect::<Vec<_>>()).into(), 100.0);
    check((&samples.iter().map(|&v| i16::from(v)).collect::<Vec<_>>()).into(), 0.0);
    check((&samples.iter().map(|&v| (i16::from(v) + 100) as u16).collect::<Vec<_>>()).into(), 100.0);
    check((&samples.iter().map(|&v| i32::from(v)).collect::<Vec<_>>()).into(), 0.0);
    check((&samples.iter().map(|&v| (i32::from(v) + 100) as u32).collect::<Vec<_>>()).into(), 100.0);
    check((&samples.iter().map(|&v| i64::from(v)).collect::<Vec<_>>()).into(), 0.0);
    check((&samples.iter().map(|&v| (i64::from(v) + 100) as u64).collect::<Vec<_>>()).into(), 100.0);
    check((&samples.iter().map(|&v| f32::from(v)).collect::<Vec<_>>()).into(), 0.0);
    check((&samples.iter().map(|&v| f64::from(v)).collect::<Vec<_>>()).into(), 0.0);
}

#[test]
fn every_unit_and_thread_count_gives_the_same_bytes() {
    let samples = blobs(N);
    let volume = Volume::new(&samples, N).expect("fits");
    let want = mesh(&volume, 0.0);
    for lanes in [Lanes::Portable, Lanes::Avx2, Lanes::Avx512] {
        let params = ContourParams { lanes, ..ContourParams::default() };
        match contour(&volume, 0.0, &params) {
            Ok(got) => assert_eq!(got, want, "{lanes:?}"),
            Err(error) => assert!(matches!(error, Error::Parameter { name: "lanes", .. })),
        }
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        assert_eq!(pool.install(|| mesh(&volume, 0.0)), want, "{threads} threads");
    }
}

/// The samples spread with gaps and turned round along some axes.
#[test]
fn every_layout_along_the_rows_gives_the_same_bytes() {
    let samples = blobs(N);
    let want = mesh(&Volume::new(&samples, N).expect("fits"), 0.0);
    let spaced = [3 * N[0] + 1, N[1] + 2];
    for turned in 0..8usize {
        let mut spread = vec![99i8; spaced[0] * spaced[1] * N[2]];
        let step = [3isize, spaced[0] as isize, (spaced[0] * spaced[1]) as isize];
        let strides: [isize; 3] = std::array::from_fn(|a| if turned >> a & 1 == 1 { -step[a] } else { step[a] });
        let first = (0..3).map(|a| if strides[a] < 0 { (N[a] as isize - 1) * step[a] } else { 0 }).sum::<isize>();
        for (n, &v) in samples.iter().enumerate() {
            let at = [n % N[0], n / N[0] % N[1], n / (N[0] * N[1])];
            let element = first + (0..3).map(|a| at[a] as isize * strides[a]).sum::<isize>();
            spread[element as usize] = v;
        }
        let volume = Volume::strided(&spread, N, first as usize, strides).expect("fits");
        assert_eq!(mesh(&volume, 0.0), want, "turned {turned}");
    }
}

/// The same volume with its axes stored in another order: the same surface, in another order.
#[test]
fn every_order_of_axes_gives_the_same_surface() {
    let samples = blobs(N);
    let volume = Volume::new(&samples, N).expect("fits").with_spacing([0.5, 0.25, 1.0]).expect("good");
    let want = Report::of(&mesh(&volume, 0.0));
    for axes in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let mut stored = vec![0i8; samples.len()];
        let mut strides = [0isize; 3];
        let mut step = 1;
        for a in axes {
            strides[a] = step;
            step *= N[a] as isize;
        }
        for (n, &v) in samples.iter().enumerate() {
            let at = [n % N[0], n / N[0] % N[1], n / (N[0] * N[1])];
            stored[(0..3).map(|a| at[a] as isize * strides[a]).sum::<isize>() as usize] = v;
        }
        let volume =
            Volume::strided(&stored, N, 0, strides).expect("fits").with_spacing([0.5, 0.25, 1.0]).expect("good");
        let got = Report::of(&mesh(&volume, 0.0));
        assert!(got.closed_manifold(), "{axes:?}");
        assert_eq!((got.vertices, got.triangles, got.components), (want.vertices, want.triangles, want.components));
        assert!((got.signed_volume - want.signed_volume).abs() < 0.01 * want.signed_volume, "{axes:?}");
        assert!(want.signed_volume > 0.0);
    }
}

#[test]
fn oblique_and_left_handed_directions_keep_the_outside_outside() {
    let dims = [20, 21, 22];
    let samples: Vec<f32> = (0..dims.iter().product::<usize>())
        .map(|n| {
            let at = [n % 20, n / 20 % 21, n / 420];
            49.0 - at.iter().zip([9.5, 10.0, 10.5]).map(|(&i, c)| (i as f32 - c).powi(2)).sum::<f32>()
        })
        .collect();
    let volume = Volume::new(&samples, dims).expect("fits");
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 343.0;
    for directions in [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, 2.0, 0.0], [1.0, 0.0, 0.5], [0.25, 0.0, -1.0]],
        [[0.0, 0.0, 3.0], [0.3, 2.0, 0.0], [1.0, 0.0, 1.0]],
    ] {
        let d: [[f64; 3]; 3] = directions;
        let det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0])
            + d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
        let report = Report::of(&mesh(&volume.with_directions(d).expect("good"), 0.0));
        assert!(report.closed_manifold());
        let off = report.signed_volume / (ball * det.abs()) - 1.0;
        assert!(off.abs() < 0.02, "{directions:?}: off by {off}");
    }
}

#[test]
fn a_closed_border_caps_in_its_planes_and_an_open_one_ends_there() {
    let samples = vec![1u8; 4 * 5 * 6];
    let volume = Volume::new(&samples, [4, 5, 6]).expect("fits");
    let report = Report::of(&mesh(&volume, 0.5));
    assert!(report.closed_manifold());
    assert_eq!((report.components, report.genus()), (1, 0.0));
    assert!((report.signed_volume - 60.0).abs() < 1e-9);
    let open = volume.with_border(Border::Open);
    assert!(mesh(&open, 0.5).triangles.is_empty());
    // A plane across it: a disc, cut at the border.
    let ramp: Vec<u8> = (0..120).map(|n| (n / 20) as u8).collect();
    let report = Report::of(&mesh(&Volume::new(&ramp, [4, 5, 6]).expect("fits").with_border(Border::Open), 2.5));
    assert_eq!((report.components, report.euler_characteristic, report.area), (1, 1, 12.0));
    assert_eq!(report.non_manifold_edges + report.non_manifold_vertices + report.duplicate_half_edges, 0);
}

#[test]
fn absent_nodes_are_outside_and_the_surface_ends_before_them() {
    let mut samples = vec![2.0f32; 6 * 6 * 6];
    let mut present = vec![true; 216];
    for n in 0..216 {
        if n / 36 > 3 {
            present[n] = false;
        }
    }
    let report =
        Report::of(&mesh(&Volume::new(&samples, [6; 3]).expect("fits").with_mask(&present).expect("fits"), 0.0));
    assert!(report.closed_manifold());
    assert!((report.signed_volume - 75.0).abs() < 1e-9);
    for n in 144..216 {
        samples[n] = f32::NAN;
    }
    let with_nan = mesh(&Volume::new(&samples, [6; 3]).expect("fits"), 0.0);
    let report = Report::of(&with_nan);
    assert!(report.closed_manifold());
    assert!((report.signed_volume - 75.0).abs() < 1e-9 && report.nan_vertices == 0);
    samples[100] = f32::INFINITY;
    samples[20] = f32::NEG_INFINITY;
    let report = Report::of(&mesh(&Volume::new(&samples, [6; 3]).expect("fits"), 0.0));
    assert!(report.closed_manifold());
    assert_eq!(report.nan_vertices, 0);
}

#[test]
fn samples_on_the_isovalue_and_plateaus_are_closed_and_manifold() {
    let samples: Vec<i8> = blobs(N).iter().map(|v| v.signum()).collect();
    for iso in [-1.0, 0.0] {
        let report = Report::of(&mesh(&Volume::new(&samples, N).expect("fits"), iso));
        assert!(report.closed_manifold() && report.triangles > 0, "{report:?}");
    }
}

#[test]
fn isovalues_outside_of_the_range_give_nothing_and_those_that_are_no_number_an_error() {
    let samples = blobs(N);
    let volume = Volume::new(&samples, N).expect("fits").with_border(Border::Open);
    assert_eq!(volume.range(), Some((-100.0, 67.0)));
    for iso in [-1e9, 127.0, 1e300] {
        assert!(mesh(&volume, iso).triangles.is_empty());
    }
    let params = ContourParams::default();
    for iso in [f64::NAN, f64::INFINITY] {
        assert!(matches!(contour(&volume, iso, &params), Err(Error::Parameter { name: "iso", .. })));
    }
}

#[test]
fn one_cell_is_a_volume() {
    for case in 0..256u32 {
        let samples: [i16; 8] = std::array::from_fn(|c| if case >> c & 1 == 1 { 3 } else { -1 });
        let report = Report::of(&mesh(&Volume::new(&samples, [2; 3]).expect("fits"), 0.0));
        assert!(report.closed_manifold() || case == 0, "case {case}: {report:?}");
    }
}
