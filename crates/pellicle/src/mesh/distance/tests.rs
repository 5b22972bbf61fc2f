//! Distances whose answers are known.

use super::*;

/// A square of the plane z = `height`, `n` × `n` cells of two triangles.
fn square(n: u32, height: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=n {
        for i in 0..=n {
            mesh.vertices.push([i as f32 / n as f32, j as f32 / n as f32, height]);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let at = |i, j| j * (n + 1) + i;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

#[test]
fn planes_are_their_distance_apart_however_they_are_cut() {
    let comparison = Comparison::of(&square(3, 0.0), &square(7, 0.25), 5000);
    for deviation in [comparison.to_reference, comparison.from_reference] {
        assert!((deviation.mean - 0.25).abs() < 1e-12 && (deviation.rms - 0.25).abs() < 1e-12);
        assert!(deviation.samples > 4000 && deviation.skipped_samples == 0);
    }
    assert!((comparison.hausdorff() - 0.25).abs() < 1e-12);
}

#[test]
fn the_two_directions_differ_where_something_is_missing() {
    let (whole, mut part) = (square(8, 0.0), square(8, 0.0));
    part.triangles.truncate(64); // the lower half
    part.vertices.truncate(45);
    let comparison = Comparison::of(&part, &whole, 1000);
    assert!(comparison.to_reference.max < 1e-12, "{comparison:?}");
    assert!((comparison.from_reference.max - 0.5).abs() < 1e-12, "{comparison:?}");
    // The mean of the distance over the whole: half of it lies on the part, the rest is 1/4 away on average.
    assert!((comparison.from_reference.mean - 0.125).abs() < 2e-3, "{comparison:?}");
}

#[test]
fn origins_count() {
    let moved = Mesh { origin: [1e6, 0.0, 3.0], ..square(2, 0.0) };
    let deviation = Deviation::by(&moved, 10, |p| p[2] - 3.0 + (p[0] - 1e6).min(0.0).abs());
    assert_eq!(deviation.max, 0.0);
}

#[test]
fn a_field_gives_first_order_distances() {
    // Half of the squared height: at 1, value 0.5 and slope 1.
    let deviation = Deviation::from_field(&square(2, 1.0), 100, 0.0, |p| (0.5 * p[2] * p[2], [0.0, 0.0, p[2]]));
    assert!((deviation.mean - 0.5).abs() < 1e-12 && (deviation.max - 0.5).abs() < 1e-12);
    let flat = Deviation::from_field(&square(2, 1.0), 100, 0.0, |_| (0.0, [0.0; 3]));
    assert_eq!((flat.skipped_samples, flat.max), (flat.samples, 0.0));
    let lost = Deviation::from_mesh(&square(2, 1.0), 100, &Mesh::default());
    assert_eq!(lost.skipped_samples, lost.samples);
}
