//! Whether two meshes have the same vertices, up to rounding.
//!
//! Source: this project.

use std::collections::HashMap;

use pellicle::Mesh;

/// Vertices by the cell of the lattice that they lie in, in cells.
fn grid(mesh: &Mesh, spacing: f64) -> HashMap<[i64; 3], Vec<[f64; 3]>> {
    let mut cells: HashMap<_, Vec<_>> = HashMap::new();
    for v in 0..mesh.vertices.len() {
        let at = mesh.position(v).map(|x| x / spacing);
        cells.entry(at.map(|x| x.floor() as i64)).or_default().push(at);
    }
    cells
}

/// Vertices of `mesh`, in cells of the lattice, to which `other` has none that is at most `apart` cells away along each
/// axis.
pub fn lonely(mesh: &Mesh, other: &Mesh, spacing: f64, apart: f64) -> Vec<[f64; 3]> {
    let cells = grid(other, spacing);
    let near = |at: [f64; 3]| {
        let range = [0, 1, 2].map(|a| (at[a] - apart).floor() as i64..=(at[a] + apart).floor() as i64);
        range[0].clone().any(|x| {
            range[1].clone().any(|y| {
                range[2].clone().any(|z| {
                    cells
                        .get(&[x, y, z])
                        .is_some_and(|vertices| vertices.iter().any(|v| (0..3).all(|a| (v[a] - at[a]).abs() <= apart)))
                })
            })
        })
    };
    (0..mesh.vertices.len()).map(|v| mesh.position(v).map(|x| x / spacing)).filter(|&at| !near(at)).collect()
}
