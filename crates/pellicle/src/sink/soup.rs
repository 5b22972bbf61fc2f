//! Triangles without shared vertices.
//!
//! Source: Gourlay 2014, Fluid Simulation for Video Games 18 (normals by the cross product of a triangle's edges).

/// Unit normal of a triangle, outward where it winds counter-clockwise seen from outside; zero without an area.
pub(crate) fn face_normal(triangle: &[[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = triangle.map(|v| v.map(f64::from));
    let (u, v): ([f64; 3], [f64; 3]) = (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    if length > 0.0 { normal.map(|n| (n / length) as f32) } else { [0.0; 3] }
}
