//! Binary STL out: triangles with their normals, each with its own three corners, in single precision.
//!
//! ```text
//! 80 bytes of title | number of triangles, u32 | normal, 3 corners, u16 of zero: 50 bytes | …      little-endian
//! ```
//!
//! Normals are those of the faces, by the right-hand rule; a triangle without area has (0, 0, 0). The format has no place
//! for normals of vertices, attributes and vertices without a triangle.

use std::path::Path;

use pellicle::Mesh;

use super::{WriteOptions, check_indices, one_line};
use crate::error::Error;
use crate::output::{Output, Written};

/// Bytes of the title.
const TITLE: usize = 80;
/// Bytes of a triangle.
const TRIANGLE: usize = 50;

pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    let triangles = mesh.triangles.len();
    let Ok(count) = u32::try_from(triangles) else {
        let (needed, available) = (triangles as u64, u64::from(u32::MAX));
        return Err(Error::TooLarge { path: path.into(), what: "triangles in an STL file", needed, available });
    };
    check_indices(path, mesh)?;
    let mut out = Output::create(path, Some((TITLE + 4 + triangles * TRIANGLE) as u64))?;
    out.bytes(&title(options))?;
    out.bytes(&count.to_le_bytes())?;
    out.tasks(triangles, TRIANGLE, |range, to| {
        to.clear();
        for &triangle in &mesh.triangles[range] {
            to.extend_from_slice(&record(mesh, triangle));
        }
    })?;
    out.finish()?;
    let mut written = Written::default();
    if !mesh.normals.is_empty() {
        written.left_out.push("normal".into());
    }
    written.left_out.extend(mesh.attributes.iter().map(|a| a.name.clone()));
    if mesh.origin != [0.0; 3] {
        written.narrowed.push("position".into());
    }
    Ok(written)
}

/// A triangle as the file has it; two bytes of zero stand at its end.
fn record(mesh: &Mesh, triangle: [u32; 3]) -> [u8; TRIANGLE] {
    let corners = triangle.map(|i| mesh.vertices[i as usize]);
    let world = corners.map(|v| [0, 1, 2].map(|axis| (mesh.origin[axis] + f64::from(v[axis])) as f32));
    let mut bytes = [0; TRIANGLE];
    let numbers = [face_normal(corners), world[0], world[1], world[2]];
    for (to, value) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(numbers.as_flattened()) {
        *to = value.to_le_bytes();
    }
    bytes
}

/// The unit normal from the offsets, which are exact where world positions in single precision are not.
fn face_normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let edge = |i: usize| [0, 1, 2].map(|axis| f64::from(corners[i][axis]) - f64::from(corners[0][axis]));
    let (a, b) = (edge(1), edge(2));
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let length = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
    if length > 0.0 && length.is_finite() { cross.map(|v| (v / length) as f32) } else { [0.0; 3] }
}

/// What the mesh was made with. It must not begin with `solid`, by which programs tell STL in text.
fn title(options: &WriteOptions) -> [u8; TITLE] {
    let mut text = one_line(&options.comments.join("; "));
    if text.trim_start().to_ascii_lowercase().starts_with("solid") || text.is_empty() {
        text.insert_str(0, "pellicle: ");
    }
    text.truncate(text.floor_char_boundary(TITLE));
    let mut title = [b' '; TITLE];
    title[..text.len()].copy_from_slice(text.as_bytes());
    title
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_unit_or_zero_and_titles_never_begin_like_text() {
        assert_eq!(face_normal([[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]), [0.0, 0.0, 1.0]);
        assert_eq!(face_normal([[1.0; 3], [1.0; 3], [0.0, 3.0, 0.0]]), [0.0; 3]);
        assert_eq!(face_normal([[f32::NAN; 3], [1.0; 3], [0.0, 3.0, 0.0]]), [0.0; 3]);
        let options = WriteOptions { comments: vec![" Solid thing".into()], ..WriteOptions::default() };
        assert!(title(&options).starts_with(b"pellicle:  Solid thing "));
    }
}
