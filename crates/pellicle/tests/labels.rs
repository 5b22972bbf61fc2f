//! Boundaries between labels: closed for each label, without gaps between them, the same bytes always.

use std::collections::BTreeMap;

use pellicle::{
    Border, ContourParams, Control, Error, LabelParams, Samples, Volume, contour, contour_labels,
    mesh::{LabelMesh, Report},
};

/// Noise of `labels` labels from 0 on, in blobs of `coarse` samples.
fn noise(dims: [usize; 3], labels: u32, coarse: usize) -> Vec<u8> {
    let at = |n: usize| [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])].map(|i| (i / coarse) as u32);
    let hash = |[i, j, k]: [u32; 3]| {
        let mixed = (i.wrapping_mul(0x9e37_79b1) ^ j.wrapping_mul(0x85eb_ca77) ^ k.wrapping_mul(0xc2b2_ae3d))
            .wrapping_mul(0x27d4_eb2f);
        (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d) >> 16
    };
    (0..dims.iter().product()).map(|n| (hash(at(n)) % labels) as u8).collect()
}

fn between(volume: &Volume<'_>) -> LabelMesh {
    contour_labels(volume, &LabelParams::default(), &Control::default()).expect("good")
}

/// Every label closed, outward, a manifold; together they fill what the outside bounds.
fn check(found: &LabelMesh) {
    let mut sum = 0.0;
    let mut triangles = 0;
    for (label, mesh) in found.surfaces() {
        let report = Report::of(&mesh);
        assert!(report.closed_manifold(), "label {label}: {report:?}");
        assert!(report.signed_volume > 0.0 && report.unused_vertices == 0, "label {label}: {report:?}");
        assert_eq!(mesh, found.surface(label));
        sum += report.signed_volume;
        triangles += report.triangles;
    }
    let outer = found.sides.iter().filter(|sides| sides[1] == LabelMesh::OUTSIDE).count();
    assert_eq!(triangles, 2 * (found.sides.len() - outer) + outer);
    let mut shell = found.mesh.clone();
    let mut sides = found.sides.iter();
    shell.triangles.retain(|_| sides.next().is_some_and(|sides| sides[1] == LabelMesh::OUTSIDE));
    let whole = Report::of(&shell).signed_volume;
    assert!((sum - whole).abs() < 1e-6 * whole, "the labels have {sum}, what is around them {whole}");
    assert!(
        found
            .sides
            .iter()
            .all(|&[behind, before]| behind != LabelMesh::OUTSIDE && (before == LabelMesh::OUTSIDE || before < behind))
    );
}

#[test]
fn every_label_of_random_grids_is_closed_and_nothing_is_left_between() {
    for (labels, coarse) in [(2, 1), (3, 1), (8, 1), (50, 1), (6, 2), (5, 4)] {
        let dims = [67, 9, 11];
        let samples = noise(dims, labels, coarse);
        let found = between(&Volume::new(&samples, dims).expect("fits"));
        assert_eq!(found.labels.len(), labels as usize);
        check(&found);
    }
}

#[test]
fn around_an_edge_every_label_has_two_triangles_or_none() {
    let dims = [12, 13, 14];
    let found = between(&Volume::new(&noise(dims, 8, 1), dims).expect("fits"));
    let mut around: BTreeMap<[u32; 2], BTreeMap<u32, usize>> = BTreeMap::new();
    for (triangle, sides) in found.mesh.triangles.iter().zip(&found.sides) {
        for i in 0..3 {
            let mut edge = [triangle[i], triangle[(i + 1) % 3]];
            edge.sort_unstable();
            sides.iter().for_each(|&side| *around.entry(edge).or_default().entry(side).or_default() += 1);
        }
    }
    assert!(around.values().flat_map(BTreeMap::values).all(|&count| count == 2));
    assert!(around.values().any(|labels| labels.len() == 4), "edges where four labels meet");
}

#[test]
fn two_labels_are_marching_cubes_at_the_middle() {
    let dims = [30, 70, 20];
    let samples = noise(dims, 2, 1);
    let volume = Volume::new(&samples, dims).expect("fits").with_spacing([0.5, 1.0, 2.0]).expect("good");
    let one = LabelParams { labels: Some(vec![1]), ..LabelParams::default() };
    let found = contour_labels(&volume, &one, &Control::default()).expect("good");
    let want = contour(&volume, 0.5, &ContourParams::default()).expect("good");
    assert_eq!((&found.labels, &found.mesh.triangles), (&vec![1], &want.triangles));
    let last = [14.5f32, 69.0, 38.0];
    let mut inner = 0;
    for (a, b) in found.mesh.vertices.iter().zip(&want.vertices) {
        // At the border the one is half a sample further out.
        if (0..3).all(|i| b[i] > 0.0 && b[i] < last[i]) {
            assert_eq!(a, b);
            inner += 1;
        }
    }
    assert!(inner > want.vertices.len() / 2);
}

#[test]
fn threads_types_layouts_and_handedness_change_nothing() {
    let dims = [35, 20, 18];
    let samples = noise(dims, 7, 2);
    let volume = Volume::new(&samples, dims).expect("fits");
    let want = between(&volume);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        assert_eq!(pool.install(|| between(&volume)), want, "{threads} threads");
    }
    let check = |samples: Samples<'_>, shift: i128| {
        let found = between(&Volume::new(samples, dims).expect("fits"));
        assert!(found.mesh == want.mesh && found.sides == want.sides);
        assert_eq!(found.labels, (0..7).map(|label| label + shift).collect::<Vec<_>>());
    };
    let far = u64::MAX - 10;
    check((&samples.iter().map(|&v| i16::from(v) - 3).collect::<Vec<_>>()).into(), -3);
    check((&samples.iter().map(|&v| u64::from(v) + far).collect::<Vec<_>>()).into(), i128::from(far));
    check((&samples.iter().map(|&v| i64::from(v) + i64::MIN).collect::<Vec<_>>()).into(), i128::from(i64::MIN));
    check((&samples.iter().map(|&v| f32::from(v) - 2.0).collect::<Vec<_>>()).into(), -2);
    check((&samples.iter().map(|&v| f64::from(v)).collect::<Vec<_>>()).into(), 0);
    // Every second element, mirrored along x in memory and in the world.
    let mut spread = vec![99u8; 2 * samples.len()];
    samples.iter().enumerate().for_each(|(n, &v)| spread[2 * n] = v);
    let strides = [-2, 2 * dims[0] as isize, 2 * (dims[0] * dims[1]) as isize];
    let mirrored = Volume::strided(&spread, dims, 2 * (dims[0] - 1), strides).expect("fits");
    let mirrored = mirrored.with_spacing([-1.0, 1.0, 1.0]).expect("good");
    let found = between(&mirrored.with_origin([34.0, 0.0, 0.0]).expect("finite"));
    for ((label, mesh), (_, other)) in found.surfaces().zip(want.surfaces()) {
        let [got, expected] = [Report::of(&mesh), Report::of(&other)];
        assert!(got.closed_manifold() && got.triangles == expected.triangles, "{label}: {got:?} {expected:?}");
        // Polygons that are not plane are cut otherwise.
        assert!((got.signed_volume / expected.signed_volume - 1.0).abs() < 0.02, "{label}: {got:?} {expected:?}");
    }
}

#[test]
fn labels_are_chosen_and_absent_samples_are_outside() {
    let dims = [20, 21, 22];
    let mut samples: Vec<f32> = noise(dims, 6, 3).into_iter().map(f32::from).collect();
    samples.iter_mut().step_by(31).for_each(|v| *v = f32::NAN);
    let volume = Volume::new(&samples, dims).expect("fits");
    check(&between(&volume));
    let some = LabelParams { labels: Some(vec![4, 2, 77]), ..LabelParams::default() };
    let found = contour_labels(&volume, &some, &Control::default()).expect("good");
    assert_eq!(found.labels, [2, 4]);
    check(&found);
    assert!(found.surface(77).triangles.is_empty() && found.surface(3).triangles.is_empty());
    let background = LabelParams { background: Some(0), ..LabelParams::default() };
    let found = contour_labels(&volume, &background, &Control::default()).expect("good");
    assert_eq!(found.labels, [1, 2, 3, 4, 5]);
    check(&found);
    let none = LabelParams { labels: Some(Vec::new()), ..LabelParams::default() };
    assert!(contour_labels(&volume, &none, &Control::default()).expect("good").mesh.vertices.is_empty());
}

#[test]
fn an_open_border_ends_there_and_a_closed_one_half_a_sample_further() {
    let samples = vec![5u8; 4 * 5 * 6];
    let volume = Volume::new(&samples, [4, 5, 6]).expect("fits");
    assert!(between(&volume.with_border(Border::Open)).mesh.triangles.is_empty());
    let found = between(&volume);
    let report = Report::of(&found.surface(5));
    assert!(report.closed_manifold() && report.euler_characteristic == 2);
    let reach = |a: usize| found.mesh.vertices.iter().map(|v| v[a]).fold(f32::MIN, f32::max);
    assert_eq!([0, 1, 2].map(reach), [3.5, 4.5, 5.5]);
    // But for its rounded edges it has the volume of its samples.
    assert!((report.signed_volume - 120.0).abs() < 10.0, "{report:?}");
}

#[test]
fn what_cannot_be_done_is_refused() {
    let control = Control::default();
    let halves = vec![0.5f64; 8];
    let volume = Volume::new(&halves, [2; 3]).expect("fits");
    let error = contour_labels(&volume, &LabelParams::default(), &control).expect_err("not whole");
    assert!(matches!(error, Error::Parameter { name: "a sample", value: 0.5, .. }), "{error}");
    let infinite = vec![f32::INFINITY; 8];
    let volume = Volume::new(&infinite, [2; 3]).expect("fits");
    assert!(contour_labels(&volume, &LabelParams::default(), &control).is_err());
    let samples = noise([30, 31, 32], 5, 2);
    let volume = Volume::new(&samples, [30, 31, 32]).expect("fits");
    let mut limit = 100;
    loop {
        let params = LabelParams { max_memory: Some(limit), ..LabelParams::default() };
        match contour_labels(&volume, &params, &control) {
            Err(Error::Memory { needed, available, .. }) if needed > limit && available == limit => limit = needed,
            other => break assert_eq!(other.expect("enough"), between(&volume)),
        }
    }
}
