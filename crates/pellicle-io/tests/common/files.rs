//! Sound files of every format that is read, for the tests that damage them.
#![allow(dead_code, reason = "no test uses all of it")]

#[path = "samples.rs"]
pub mod samples;

use pellicle::Mesh;
use pellicle_io::{FormatInfo, WriteOptions, formats, write_mesh};

use crate::common::Folder;

/// A mesh of 30 vertices and 28 triangles in every format of meshes.
pub fn mesh_files(folder: &Folder) -> Vec<(&'static str, Vec<u8>)> {
    let mesh = Mesh {
        vertices: (0..30).map(|i| [i as f32, 0.5, -1.0]).collect(),
        triangles: (0..28).map(|i| [i, i + 1, i + 2]).collect(),
        ..Mesh::default()
    };
    let written = ["mesh.ply", "mesh.obj", "mesh.vtk", "mesh.stl", "mesh.glb"].into_iter().map(|name| {
        let path = folder.join(name);
        write_mesh(&path, &mesh, &WriteOptions::default()).expect(name);
        (name, std::fs::read(&path).expect(name))
    });
    let xml = [("mesh.vtp", samples::mesh_xml(false)), ("mesh.vtu", samples::mesh_xml(true))];
    written.chain(xml).collect()
}

/// Lists of files, which all name `part.vtp` and `rest.vtp` beside them.
pub fn lists() -> Vec<(&'static str, Vec<u8>)> {
    let series = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\"><Collection>\
                  <DataSet timestep=\"0\" group=\"\" part=\"0\" file=\"part.vtp\"/>\
                  <DataSet timestep=\"0\" group=\"\" part=\"1\" file=\"rest.vtp\"/>\
                  <DataSet timestep=\"0.5\" group=\"\" part=\"0\" file=\"part.vtp\"/></Collection></VTKFile>\n";
    let pieces = "<VTKFile type=\"PPolyData\"><PPolyData GhostLevel=\"0\"><Piece Source=\"part.vtp\"/>\
                  <Piece Source=\"rest.vtp\"/></PPolyData></VTKFile>\n";
    vec![("series.pvd", series.into()), ("pieces.pvtp", pieces.into())]
}

/// Whether this build reads anything of the format.
pub fn is_read(format: &FormatInfo) -> bool {
    format.reads_particles || format.reads_meshes || format.reads_volumes
}

/// The usual extension of the format that the name of a file tells.
pub fn usual_extension(name: &str) -> Option<&'static str> {
    let ends = |name: &str, extension: &str| name.strip_suffix(extension).is_some_and(|stem| stem.ends_with('.'));
    let by_name = |name: &str| formats().find(|format| format.extensions.iter().any(|e| ends(name, e)));
    let format = by_name(name).or_else(|| by_name(name.strip_suffix(".gz")?))?;
    format.extensions.first().copied()
}

/// Every sound file there is, by name.
pub fn all(folder: &Folder) -> Vec<(String, Vec<u8>)> {
    let particles = samples::all().into_iter().map(|sample| (sample.name, sample.bytes));
    let volumes = samples::volume_samples::volumes().into_iter().map(|volume| (volume.name, volume.bytes));
    let files = particles.chain(mesh_files(folder)).chain(lists()).chain(volumes);
    files.map(|(name, bytes)| (name.to_owned(), bytes)).collect()
}
