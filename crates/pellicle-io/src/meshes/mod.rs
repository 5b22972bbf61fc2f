//! Mesh files in and out: one file per format and direction.
//!
//! Every output gets its name when it is complete (`temporary`), so that a file of the final name is always whole. The bytes depend on nothing but the mesh and the options.

mod assemble;
mod cells;
mod glb;
pub(crate) mod read_glb;
pub(crate) mod read_obj;
pub(crate) mod read_ply;
pub(crate) mod read_stl;
pub(crate) mod read_vtk;
pub(crate) mod read_vtkxml;
pub(crate) mod temporary;
mod weld;
pub(crate) mod write_glb;
pub(crate) mod write_npz;
pub(crate) mod write_obj;
pub(crate) mod write_ply;
mod write_pvd;
pub(crate) mod write_stl;
pub(crate) mod write_vtk;
pub(crate) mod write_vtkxml;

use std::path::Path;

use pellicle::{Mesh, QuadMesh};

use crate::columns;
use crate::error::Error;
use crate::formats::detect;
use crate::output::Written;

pub use temporary::{check_writable, remove_temporaries, write_file};
pub use write_ply::{PlyFile, PlyLayout};
pub use write_pvd::write_pvd;

/// How to write a mesh or particles.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// Lines for the header, such as what the mesh was made with. Line ends within a comment become spaces; VTK has
    /// room for 255 bytes in all and gets as much as fits.
    pub comments: Vec<String>,
    /// Which axis points up. Binary glTF, where up is y, turns a scene whose z points up; other formats keep the
    /// coordinates.
    pub up: Up,
    /// Metres per unit of length, for formats that are in metres (binary glTF); 1 unless told.
    pub metres_per_unit: f64,
}

impl Default for WriteOptions {
    fn default() -> Self {
        WriteOptions { comments: Vec::new(), up: Up::default(), metres_per_unit: 1.0 }
    }
}

/// The axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// As in Houdini, SPlisHSPlasH and glTF.
    #[default]
    Y,
    /// As in Blender, DualSPHysics and most of engineering.
    Z,
}

/// Writes a mesh in the format that the extension of `path` names: PLY, OBJ, STL, legacy VTK, VTP, VTU, binary glTF or an
/// NPZ archive; binary and little-endian but for OBJ, which is text, and legacy VTK, which is big-endian. World positions
/// are written: in single precision if the mesh's origin is zero, else in double precision. (STL has single precision
/// only; glTF has the origin in its node.)
///
/// What the format has no room for is left out, and told by the result: OBJ holds normals and colours but no other
/// attributes, STL neither.
///
/// # Errors
/// [`Error::Unsupported`] for another extension, [`Error::Length`] if normals or attributes do not match the number
/// of vertices, [`Error::TooLarge`], [`Error::Sink`]. After an error nothing is left in the folder, and a file that
/// existed under the name is unchanged.
pub fn write_mesh(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    let write = detect::mesh_out(path)?;
    check_lengths(path, mesh)?;
    write(path, mesh, options)
}

/// Writes a mesh of quads and triangles, in the formats of [`write_mesh`] that hold polygons: PLY, OBJ, legacy VTK, VTP and VTU.
/// Quads come first, then triangles.
///
/// # Errors
/// As [`write_mesh`]; [`Error::Unsupported`] for formats of triangles alone.
pub fn write_quad_mesh(path: &Path, mesh: &QuadMesh, options: &WriteOptions) -> Result<Written, Error> {
    let write = detect::quads_out(path)?;
    check_lengths(path, &mesh.mesh)?;
    write(path, Faces { mesh: &mesh.mesh, quads: &mesh.quads }, options)
}

/// A mesh and its quads, as writers take it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Faces<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) quads: &'a [[u32; 4]],
}

impl<'a> From<&'a Mesh> for Faces<'a> {
    fn from(mesh: &'a Mesh) -> Self {
        Self { mesh, quads: &[] }
    }
}

/// Reads a mesh from PLY, OBJ, STL, legacy VTK, VTP, VTU or binary glTF, by the file's extension. The pieces of a VTK XML
/// file become one mesh; its cells may be triangles, quads, pixels, polygons and triangle strips, and points and lines are
/// passed over.
///
/// Faces of more than three corners become fans of triangles, which is right for convex ones. Positions in double
/// precision become an origin and offsets such that no more than the last bit of an offset is lost. Normals and other
/// values of the vertices are read where the format has them.
///
/// # Errors
/// As [`read_particles`](crate::read_particles).
pub fn read_mesh(path: &Path) -> Result<Mesh, Error> {
    detect::mesh(path)?(path)
}

/// Whether [`write_mesh`] knows the format that the extension of `path` names.
///
/// # Errors
/// [`Error::Unsupported`] if not; its message lists the extensions that are known.
pub fn check_mesh_format(path: &Path) -> Result<(), Error> {
    detect::mesh_out(path).map(|_| ())
}

/// Whether [`write_quad_mesh`] can write to the format that the extension of `path` names.
///
/// # Errors
/// [`Error::Unsupported`] if not; its message lists the extensions that can.
pub fn check_quad_format(path: &Path) -> Result<(), Error> {
    detect::quads_out(path).map(|_| ())
}

/// Whether [`write_particles`](crate::write_particles) knows the format that the extension of `path` names.
///
/// # Errors
/// As [`check_mesh_format`].
pub fn check_particle_format(path: &Path) -> Result<(), Error> {
    detect::particles_out(path).map(|_| ())
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

/// Checks that every triangle has its vertices.
fn check_indices(path: &Path, mesh: &Mesh) -> Result<(), Error> {
    let count = mesh.vertices.len();
    let wrong = columns::first(&mesh.triangles, |t| t.iter().fold(false, |wrong, &i| wrong | (i as usize >= count)));
    match wrong {
        None => Ok(()),
        Some(at) => {
            let corners = mesh.triangles[at];
            let what = format!("triangle {at} refers to the vertices {corners:?}, but there are {count}");
            Err(Error::Unsupported { path: path.into(), what })
        }
    }
}

/// A comment without line ends, which would end it.
pub(crate) fn one_line(comment: &str) -> String {
    comment.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
