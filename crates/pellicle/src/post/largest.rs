//! The connected pieces of a mesh, and the largest of them alone.
//!
//! Two triangles belong to one piece if they share a vertex. Pieces are numbered by their first triangle; the largest is the one of
//! greatest area, and of equal ones the first. Vertices and triangles keep their order, so the same mesh gives the same bytes.
//! Vertices that no triangle has belong to no piece.
//!
//! By area and not by volume, as [`components`](super::components) has it, since surfaces of volumes may be open. Source: this project.

use super::{
    check,
    rebuild::{NONE, merge},
};
use crate::{
    Error, Mesh,
    math::union_find::{join, root},
};

/// The pieces of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Components {
    /// The piece of each triangle.
    pub of_triangle: Vec<u32>,
    /// Area of each piece.
    pub areas: Vec<f64>,
}

impl Components {
    /// Finds them. Time is linear in the size of the mesh, but for a factor that is below 5 in practice.
    ///
    /// # Panics
    /// If a triangle refers to a vertex that is not there.
    pub fn of(mesh: &Mesh) -> Self {
        let mut parents: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        for &[a, b, c] in &mesh.triangles {
            join(&mut parents, a, b);
            join(&mut parents, b, c);
        }
        let mut numbers = vec![NONE; mesh.vertices.len()];
        let mut found = Self { of_triangle: Vec::with_capacity(mesh.triangles.len()), areas: Vec::new() };
        for triangle in &mesh.triangles {
            let root = root(&mut parents, triangle[0]) as usize;
            if numbers[root] == NONE {
                numbers[root] = found.areas.len() as u32;
                found.areas.push(0.0);
            }
            found.of_triangle.push(numbers[root]);
            found.areas[numbers[root] as usize] += area(triangle.map(|v| mesh.vertices[v as usize].map(f64::from)));
        }
        found
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// The one of greatest area; `None` without triangles.
    pub fn largest(&self) -> Option<u32> {
        let mut best: Option<usize> = None;
        for (number, area) in self.areas.iter().enumerate() {
            if best.is_none_or(|best| *area > self.areas[best]) {
                best = Some(number);
            }
        }
        best.map(|number| number as u32)
    }
}

/// Leaves out all but the piece of greatest area; returns how many pieces there were.
///
/// # Errors
/// [`Error::Count`] for an index that names no vertex, [`Error::Length`] for an attribute of the wrong length.
pub fn keep_largest(mesh: &mut Mesh) -> Result<usize, Error> {
    check(mesh)?;
    let components = Components::of(mesh);
    if let Some(largest) = components.largest()
        && components.count() > 1
    {
        let mut target = vec![NONE; mesh.vertices.len()];
        for (triangle, _) in mesh.triangles.iter().zip(&components.of_triangle).filter(|(_, piece)| **piece == largest)
        {
            triangle.iter().for_each(|&v| target[v as usize] = v);
        }
        merge(mesh, &target);
    }
    Ok(components.count())
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (u, v): ([f64; 3], [f64; 3]) = (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    0.5 * cross.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VertexAttribute;

    /// A small and a large tetrahedron whose vertices alternate, and an idle vertex.
    fn mesh() -> Mesh {
        let corner = |i: usize| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][i];
        let vertices: Vec<[f32; 3]> = (0..9)
            .map(|v| if v == 8 { [9.0; 3] } else { corner(v / 2).map(|x: f32| x * if v % 2 == 0 { 1.0 } else { 3.0 }) })
            .collect();
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        Mesh {
            normals: (0..9).map(|v| if v % 2 == 0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }).collect(),
            attributes: vec![VertexAttribute::new("pair", 2, (0..18).map(|v| v as f32).collect())],
            triangles: faces.iter().flat_map(|f| [f.map(|v| 2 * v), f.map(|v| 2 * v + 1)]).collect(),
            vertices,
            ..Mesh::default()
        }
    }

    #[test]
    fn pieces_are_numbered_by_their_first_triangle_and_measured() {
        let found = Components::of(&mesh());
        assert_eq!(found.of_triangle, [0, 1, 0, 1, 0, 1, 0, 1]);
        let area = 1.5 + 0.75f64.sqrt();
        assert!((found.areas[0] - area).abs() < 1e-6 && (found.areas[1] - 9.0 * area).abs() < 1e-5, "{found:?}");
        assert_eq!(found.largest(), Some(1));
    }

    #[test]
    fn the_largest_keeps_its_order_and_all_that_belongs_to_its_vertices() {
        let mut mesh = mesh();
        assert_eq!(keep_largest(&mut mesh), Ok(2));
        assert_eq!(mesh.vertices, [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]]);
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
        assert_eq!(mesh.normals, [[0.0, 1.0, 0.0]; 4]);
        assert_eq!(mesh.attributes[0].values, [2.0, 3.0, 6.0, 7.0, 10.0, 11.0, 14.0, 15.0]);
        let whole = mesh.clone();
        assert_eq!(keep_largest(&mut mesh), Ok(1));
        assert_eq!(mesh, whole, "a single piece stays as it is");
        assert_eq!(keep_largest(&mut Mesh::default()), Ok(0));
    }
}
