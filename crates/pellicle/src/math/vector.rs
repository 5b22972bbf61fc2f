//! The few operations on vectors of three `f64` that judges of meshes and lattices need.

/// Three directions at right angles, of length 1: a rotation, row by row.
pub(crate) type Axes = [[f64; 3]; 3];

/// The vector whose coordinates along `axes` are `v`; without axes `v` itself.
#[inline(always)]
pub(crate) fn from_axes(axes: Option<&Axes>, v: [f64; 3]) -> [f64; 3] {
    match axes {
        None => v,
        Some(axes) => [0, 1, 2].map(|i| axes[0][i] * v[0] + axes[1][i] * v[1] + axes[2][i] * v[2]),
    }
}

/// `a − b`.
#[inline(always)]
pub(crate) fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + s·b`.
#[inline(always)]
pub(crate) fn add_scaled(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// `a · b`.
#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[inline(always)]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `|a|`.
#[inline(always)]
pub(crate) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
