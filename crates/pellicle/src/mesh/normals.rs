//! Normals of vertices from the triangles around them.

/// Sums the triangles' normals, each as long as twice its area, at their corners, in the triangles' order, and makes the
/// sums one long: outward, zero where there is no area. `to` has one for each vertex.
pub(crate) fn face_normals(vertices: &[[f32; 3]], triangles: &[[u32; 3]], to: &mut [[f32; 3]]) {
    to.fill([0.0; 3]);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| vertices[v as usize]);
        let (u, v): ([f32; 3], [f32; 3]) = (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for v in triangle {
            let sum = &mut to[*v as usize];
            (0..3).for_each(|a| sum[a] += normal[a]);
        }
    }
    for normal in to {
        let length = normal.iter().map(|n| f64::from(*n).powi(2)).sum::<f64>().sqrt();
        *normal = if length > 0.0 { normal.map(|n| (f64::from(n) / length) as f32) } else { [0.0; 3] };
    }
}
