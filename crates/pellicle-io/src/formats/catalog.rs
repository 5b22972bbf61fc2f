//! All formats in one table: names, extensions, and who reads and writes what. Dispatch, error messages, help texts and
//! the documentation's table of formats all come from it.

use std::path::Path;

use pellicle::Mesh;

use crate::error::Error;
use crate::meshes::{self, Faces, WriteOptions};
use crate::output::Written;
use crate::particles::{self, Particles, ReadOptions};
use crate::volumes::{self, VolumeData, VolumeFile, VolumeOptions};

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Format {
    /// Positions without header, `f32` or `f64`, little-endian.
    RawXyz,
    /// Lines of numbers; plain or extended XYZ.
    TextXyz,
    /// Dumps of LAMMPS.
    LammpsDump,
    /// Comma-separated values, with any separator.
    Csv,
    /// A NumPy array.
    Npy,
    /// A NumPy archive.
    Npz,
    /// JSON arrays.
    Json,
    /// Stanford's polygon format.
    Ply,
    /// Houdini's classic binary geometry.
    Bgeo,
    /// Legacy VTK.
    Vtk,
    /// VTK XML, unstructured grid.
    Vtu,
    /// VTK XML, polygons.
    Vtp,
    /// ParaView's list of files over time.
    Pvd,
    /// DualSPHysics' binary particles.
    Bi4,
    /// Hierarchical data: SWIFT, Gadget, PySPH, VTKHDF.
    Hdf5,
    /// Wavefront's object format.
    Obj,
    /// Stereolithography triangles.
    Stl,
    /// Binary glTF.
    Glb,
    /// VTK XML, image.
    Vti,
    /// MetaImage.
    MetaImage,
    /// Nearly raw raster data.
    Nrrd,
    /// Scans of the neuroimaging initiative.
    Nifti,
}

pub(crate) type ReadParticles = fn(&Path, &ReadOptions) -> Result<Particles, Error>;
pub(crate) type WriteParticles = fn(&Path, &Particles, &WriteOptions) -> Result<Written, Error>;
pub(crate) type OpenVolume = fn(&Path, &VolumeOptions) -> Result<VolumeFile, Error>;
pub(crate) type WriteVolume = fn(&Path, &VolumeData) -> Result<Written, Error>;
pub(crate) type ReadMesh = fn(&Path) -> Result<Mesh, Error>;
pub(crate) type WriteMesh = fn(&Path, &Mesh, &WriteOptions) -> Result<Written, Error>;
pub(crate) type WriteQuads = fn(&Path, Faces<'_>, &WriteOptions) -> Result<Written, Error>;

/// A line of the table.
#[derive(Debug)]
pub(crate) struct Row {
    pub(crate) format: Format,
    pub(crate) name: &'static str,
    /// In lower case, without the dot. The first is the usual one.
    pub(crate) extensions: &'static [&'static str],
    pub(crate) read_particles: Option<ReadParticles>,
    pub(crate) write_particles: Option<WriteParticles>,
    pub(crate) read_mesh: Option<ReadMesh>,
    pub(crate) write_mesh: Option<WriteMesh>,
    /// For quads beside triangles.
    pub(crate) write_quads: Option<WriteQuads>,
    pub(crate) open_volume: Option<OpenVolume>,
    pub(crate) write_volume: Option<WriteVolume>,
}

pub(crate) static CATALOG: &[Row] = &[
    Row {
        format: Format::Ply,
        name: "PLY",
        extensions: &["ply"],
        read_particles: Some(particles::ply::read),
        write_particles: Some(particles::write_ply::write),
        read_mesh: Some(meshes::read_ply::read),
        write_mesh: Some(meshes::write_ply::write),
        write_quads: Some(meshes::write_ply::write_faces),
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Bgeo,
        name: "Houdini BGEO classic",
        extensions: &["bgeo", "bgeo.gz", "bhclassic"],
        read_particles: Some(particles::bgeo::read),
        write_particles: Some(particles::write_bgeo::write),
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Vtk,
        name: "VTK legacy",
        extensions: &["vtk"],
        read_particles: Some(particles::vtk::read),
        write_particles: Some(meshes::write_vtk::write_particles),
        read_mesh: Some(meshes::read_vtk::read),
        write_mesh: Some(meshes::write_vtk::write),
        write_quads: Some(meshes::write_vtk::write_faces),
        open_volume: Some(volumes::vtk::open),
        write_volume: Some(volumes::write::vtk),
    },
    Row {
        format: Format::Vtu,
        name: "VTK XML unstructured grid",
        extensions: &["vtu"],
        read_particles: Some(particles::vtu::read),
        write_particles: Some(meshes::write_vtkxml::write_vtu_particles),
        read_mesh: Some(meshes::read_vtkxml::read),
        write_mesh: Some(meshes::write_vtkxml::write_vtu),
        write_quads: Some(meshes::write_vtkxml::write_vtu_faces),
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Vtp,
        name: "VTK XML polygons",
        extensions: &["vtp"],
        read_particles: Some(particles::vtu::read),
        write_particles: Some(meshes::write_vtkxml::write_vtp_particles),
        read_mesh: Some(meshes::read_vtkxml::read),
        write_mesh: Some(meshes::write_vtkxml::write_vtp),
        write_quads: Some(meshes::write_vtkxml::write_vtp_faces),
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Pvd,
        name: "ParaView list of files",
        extensions: &["pvd", "pvtu", "pvtp"],
        read_particles: Some(particles::pvd::read),
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::RawXyz,
        name: "raw XYZ",
        extensions: &["xyz", "raw", "f32", "f64"],
        read_particles: Some(particles::xyz::read),
        write_particles: Some(particles::write_xyz::write),
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: Some(volumes::raw::open_untold),
        write_volume: Some(volumes::write::raw),
    },
    Row {
        format: Format::TextXyz,
        name: "text and extended XYZ",
        extensions: &["extxyz"],
        read_particles: Some(particles::text_xyz::read),
        write_particles: Some(particles::write_text_xyz::write),
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::LammpsDump,
        name: "LAMMPS dump",
        extensions: &["dump", "lammpstrj"],
        read_particles: Some(particles::lammps::read),
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Csv,
        name: "CSV",
        extensions: &["csv", "tsv", "txt", "dat"],
        read_particles: Some(particles::csv::read),
        write_particles: Some(particles::write_csv::write),
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Npy,
        name: "NumPy array",
        extensions: &["npy"],
        read_particles: Some(particles::npy::read),
        write_particles: Some(particles::write_npy::write),
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: Some(volumes::npy::open),
        write_volume: Some(volumes::write::npy),
    },
    Row {
        format: Format::Npz,
        name: "NumPy archive",
        extensions: &["npz"],
        read_particles: Some(particles::npz::read),
        write_particles: Some(meshes::write_npz::write_particles),
        read_mesh: None,
        write_mesh: Some(meshes::write_npz::write),
        write_quads: None,
        open_volume: Some(volumes::npz::open),
        write_volume: None,
    },
    Row {
        format: Format::Json,
        name: "JSON",
        extensions: &["json"],
        read_particles: Some(particles::json::read),
        write_particles: Some(particles::write_json::write),
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Bi4,
        name: "DualSPHysics BI4",
        extensions: &["bi4"],
        read_particles: Some(particles::bi4::read),
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Hdf5,
        name: "HDF5",
        extensions: &["h5", "hdf5", "hdf", "vtkhdf"],
        read_particles: Some(particles::hdf5::read),
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Obj,
        name: "Wavefront OBJ",
        extensions: &["obj"],
        read_particles: None,
        write_particles: None,
        read_mesh: Some(meshes::read_obj::read),
        write_mesh: Some(meshes::write_obj::write),
        write_quads: Some(meshes::write_obj::write_faces),
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Stl,
        name: "STL",
        extensions: &["stl"],
        read_particles: None,
        write_particles: None,
        read_mesh: Some(meshes::read_stl::read),
        write_mesh: Some(meshes::write_stl::write),
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Glb,
        name: "binary glTF",
        extensions: &["glb"],
        read_particles: None,
        write_particles: None,
        read_mesh: Some(meshes::read_glb::read),
        write_mesh: Some(meshes::write_glb::write),
        write_quads: None,
        open_volume: None,
        write_volume: None,
    },
    Row {
        format: Format::Vti,
        name: "VTK XML image",
        extensions: &["vti", "pvti"],
        read_particles: None,
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: Some(volumes::vti::open),
        write_volume: Some(volumes::write::vti),
    },
    Row {
        format: Format::MetaImage,
        name: "MetaImage",
        extensions: &["mhd", "mha"],
        read_particles: None,
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: Some(volumes::mha::open),
        write_volume: Some(volumes::write::mha),
    },
    Row {
        format: Format::Nrrd,
        name: "NRRD",
        extensions: &["nrrd", "nhdr"],
        read_particles: None,
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: Some(volumes::nrrd::open),
        write_volume: Some(volumes::write::nrrd),
    },
    Row {
        format: Format::Nifti,
        name: "NIfTI",
        extensions: &["nii", "nii.gz", "hdr", "hdr.gz", "img", "img.gz"],
        read_particles: None,
        write_particles: None,
        read_mesh: None,
        write_mesh: None,
        write_quads: None,
        open_volume: Some(volumes::nifti::open),
        write_volume: Some(volumes::write::nifti),
    },
];

/// What can be done with a format, as [`formats`] tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FormatInfo {
    /// Which.
    pub format: Format,
    /// Its name in plain words.
    pub name: &'static str,
    /// Extensions in lower case, without the dot; the first is the usual one.
    pub extensions: &'static [&'static str],
    /// Whether [`read_particles`](crate::read_particles) reads it.
    pub reads_particles: bool,
    /// Whether [`write_particles`](crate::write_particles) writes it.
    pub writes_particles: bool,
    /// Whether [`read_mesh`](crate::read_mesh) reads it.
    pub reads_meshes: bool,
    /// Whether [`write_mesh`](crate::write_mesh) writes it.
    pub writes_meshes: bool,
    /// Whether [`write_quad_mesh`](crate::write_quad_mesh) does.
    pub writes_quads: bool,
    /// Whether [`open_volume`](crate::open_volume) reads it.
    pub reads_volumes: bool,
    /// Whether [`write_volume`](crate::write_volume) writes it.
    pub writes_volumes: bool,
}

/// All formats, with what this build does with them.
pub fn formats() -> impl Iterator<Item = FormatInfo> {
    CATALOG.iter().map(|row| FormatInfo {
        format: row.format,
        name: row.name,
        extensions: row.extensions,
        reads_particles: row.read_particles.is_some(),
        writes_particles: row.write_particles.is_some(),
        reads_meshes: row.read_mesh.is_some(),
        writes_meshes: row.write_mesh.is_some(),
        writes_quads: row.write_quads.is_some(),
        reads_volumes: row.open_volume.is_some(),
        writes_volumes: row.write_volume.is_some(),
    })
}

/// The line of a format.
pub(crate) fn row(format: Format) -> Option<&'static Row> {
    CATALOG.iter().find(|row| row.format == format)
}

/// The line whose extension the lower-case file name has; the longest extension wins.
pub(crate) fn by_name(name: &str) -> Option<&'static Row> {
    let has = |extension: &str| name.strip_suffix(extension).is_some_and(|stem| stem.ends_with('.'));
    let longest = |row: &Row| row.extensions.iter().filter(|e| has(e)).map(|e| e.len()).max();
    CATALOG.iter().filter_map(|row| Some((longest(row)?, row))).max_by_key(|found| found.0).map(|found| found.1)
}

/// The extensions of the formats that `can`, for messages: `.ply .vtk …`.
pub(crate) fn extensions(can: impl Fn(&Row) -> bool) -> String {
    let all = CATALOG.iter().filter(|row| can(row)).flat_map(|row| row.extensions);
    all.map(|extension| format!(".{extension}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_extension_leads_to_its_own_format() {
        for row in CATALOG {
            for extension in row.extensions {
                assert_eq!(by_name(&format!("a.b.{extension}")).map(|r| r.format), Some(row.format), "{extension}");
            }
            assert!(by_name(row.extensions[0]).is_none(), "a name without a dot has no extension");
        }
    }
}
