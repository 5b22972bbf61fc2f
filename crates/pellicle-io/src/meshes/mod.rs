//! Mesh files in and out: one file per format and direction.
//!
//! Every output is written under a temporary name in its folder and renamed when it is complete, so that a file of
//! the final name is always whole. The bytes depend on nothing but the mesh and the options.

mod assemble;
mod read_obj;
mod read_ply;
mod read_vtk;
mod temporary;
mod write_obj;
mod write_ply;
mod write_vtk;

use std::path::Path;

use pellicle::Mesh;

use crate::error::Error;
use crate::formats::detect::{self, MeshFormat};

pub use temporary::{check_writable, remove_temporaries};
pub use write_ply::{PlyFile, PlyLayout};

/// How to write a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct WriteOptions {
    /// Lines for the header, such as what the mesh was made with. Line ends within a comment become spaces; VTK has
    /// room for 255 bytes in all and gets as much as fits.
    pub comments: Vec<String>,
}

/// Writes a mesh in the format that the extension of `path` names: PLY (binary, little-endian), OBJ, or legacy VTK
/// (binary). OBJ has no room for attributes other than normals: they are left out. World positions are written: in single precision if the mesh's origin is zero, else in double precision.
///
/// # Errors
/// [`Error::Unsupported`] for another extension, [`Error::Length`] if normals or attributes do not match the number
/// of vertices, [`Error::TooLarge`], [`Error::Sink`]. After an error nothing is left in the folder, and a file that
/// existed under the name is unchanged.
pub fn write_mesh(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<(), Error> {
    let format = detect::mesh(path, "meshes are written to")?;
    check_lengths(path, mesh)?;
    match format {
        MeshFormat::Ply => write_ply::write(path, mesh, options),
        MeshFormat::Obj => write_obj::write(path, mesh, options),
        MeshFormat::Vtk => write_vtk::write(path, mesh, options),
    }
}

/// Reads a mesh from PLY, OBJ or legacy VTK, by the file's extension.
///
/// Faces of more than three corners become fans of triangles, which is right for convex ones. Positions in double
/// precision become an origin and offsets such that no more than the last bit of an offset is lost. Normals and other
/// values of the vertices are read where the format has them.
///
/// # Errors
/// As [`read_particles`](crate::read_particles).
pub fn read_mesh(path: &Path) -> Result<Mesh, Error> {
    match detect::mesh(path, "meshes are read from")? {
        MeshFormat::Ply => read_ply::read(path),
        MeshFormat::Obj => read_obj::read(path),
        MeshFormat::Vtk => read_vtk::read(path),
    }
}

/// Whether [`write_mesh`] knows the format that the extension of `path` names.
///
/// # Errors
/// [`Error::Unsupported`] if not; its message lists the extensions that are known.
pub fn check_mesh_format(path: &Path) -> Result<(), Error> {
    detect::mesh(path, "meshes are written to").map(|_| ())
}

fn check_lengths(path: &Path, mesh: &Mesh) -> Result<(), Error> {
    let vertices = mesh.vertices.len();
    let check = |what: String, found: usize, expected: usize| {
        if found == expected {
            return Ok(());
        }
        Err(Error::Length { path: path.into(), what, found: found as u64, expected: expected as u64 })
    };
    if !mesh.normals.is_empty() {
        check("the list of normals".into(), mesh.normals.len(), vertices)?;
    }
    for attribute in &mesh.attributes {
        let expected = vertices.saturating_mul(attribute.components);
        check(format!("the attribute '{}'", attribute.name), attribute.values.len(), expected)?;
    }
    Ok(())
}

/// A comment without line ends, which would end it.
fn one_line(comment: &str) -> String {
    comment.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
