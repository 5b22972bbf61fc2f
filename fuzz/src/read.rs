//! What every fuzz target does with its bytes: reads them in every way there is, and checks what comes out.
//!
//! An error that names the file, or particles and meshes that are whole; a panic is a finding. The tests of `pellicle-io`
//! include this file to replay the corpus with a plain compiler.

use std::path::Path;

use pellicle::Mesh;
use pellicle_io::{
    AttributeChoice, Axes, Content, Error, Particles, RawType, RawVolume, ReadOptions, SampleType, Samples, VolumeData,
    VolumeOptions, holds_volume, open_volume, read_content, read_mesh, read_particles, read_pvd, read_volume,
};

/// One target per format that is read, named by the format's usual extension.
pub const TARGETS: [&str; 22] = [
    "ply", "bgeo", "vtk", "vtu", "vtp", "pvd", "xyz", "extxyz", "dump", "csv", "npy", "npz", "json", "bi4", "h5",
    "obj", "stl", "glb", "vti", "mhd", "nrrd", "nii",
];

/// Files that a list of files may name: they lie beside it.
pub const BESIDE: [(&str, &str); 2] = [("part.vtp", POINT), ("rest.vtp", POINT)];
const POINT: &str = "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Float32\" \
     NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray></Points></Piece></PolyData></VTKFile>";

/// Reads a file as particles, with all attributes and with few, as a mesh, as either, as a list of files, and as a volume: at
/// once and layer by layer.
///
/// Returns what came of it, in words: two files with the same words went the same way through the readers.
///
/// # Panics
/// If what came of it breaks a promise of the readers.
pub fn read_every_way(path: &Path) -> String {
    let all = ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() };
    let part = ReadOptions { array: Some("PartType0".into()), attributes: AttributeChoice::None, ..all.clone() };
    let later = ReadOptions { frame: 1, raw: RawType::F64, ..ReadOptions::default() };
    let second = VolumeOptions { component: Some(1), axes: Axes::Xyz, ..VolumeOptions::default() };
    let untold = RawVolume { dims: [3, 2, 2], kind: SampleType::U8, components: 1, big_endian: true, skip: 5 };
    let raw = VolumeOptions { raw: Some(untold), ..VolumeOptions::default() };
    let next = VolumeOptions { frame: 1, array: Some("cell/rho".into()), ..VolumeOptions::default() };
    let outcomes = [
        told(path, read_particles(path, &all), check_particles),
        told(path, read_mesh(path), check_mesh),
        told(path, read_volume(path, &VolumeOptions::default()), check_volume),
        told(path, read_particles(path, &part), check_particles),
        told(path, read_particles(path, &later), check_particles),
        told(path, read_content(path, &ReadOptions::default()), |content| match content {
            Content::Mesh(mesh) => check_mesh(mesh),
            Content::Particles(particles) => check_particles(particles),
        }),
        told(path, read_volume(path, &second), check_volume),
        told(path, read_volume(path, &next), check_volume),
        told(path, read_volume(path, &raw), check_volume),
        told(path, read_in_layers(path), |_| ()),
        told(path, holds_volume(path), |_| ()),
        told(path, read_pvd(path), |entries| assert!(entries.iter().all(|entry| entry.time.is_finite()))),
    ];
    outcomes.join("\n")
}

fn told<T>(path: &Path, result: Result<T, Error>, check: impl Fn(&T)) -> String {
    match result {
        Ok(value) => {
            check(&value);
            "sound".into()
        }
        Err(error) => {
            let message = error.to_string();
            let name = path.display().to_string();
            // What a list of files or a header names may be what is wrong.
            let may_name = |extension: &std::ffi::OsStr| ["pvd", "mhd", "nrrd"].iter().any(|name| extension == *name);
            let names_it = path.extension().is_some_and(may_name) || message.starts_with(&name);
            assert!(names_it, "the message does not name {name}: {message}");
            assert!(message.len() > name.len() + ": ".len(), "the message says nothing: {message}");
            message.replace(&name, "")
        }
    }
}

fn check_particles(particles: &Particles) {
    for attribute in &particles.attributes {
        let expected = particles.positions.len() * attribute.components;
        assert_eq!(attribute.values.len(), expected, "values of '{}'", attribute.name);
        assert!(attribute.components > 0, "'{}' has no components", attribute.name);
    }
}

fn check_volume(volume: &VolumeData) {
    let header = &volume.header;
    assert_eq!(volume.samples.len(), header.count(), "samples");
    assert!(header.dims.iter().all(|&n| n >= 2), "{:?}", header.dims);
    assert!(header.scaling.slope > 0.0 && header.grid.problem().is_none(), "{header:?}");
    let last = header.dims.map(|n| n - 1);
    let _ = volume.value(last);
}

/// Reads the layers of a volume one by one, as far as there are any.
fn read_in_layers(path: &Path) -> Result<usize, Error> {
    let mut file = open_volume(path, &VolumeOptions::default())?;
    let mut samples = Samples::with_capacity(file.header().kind, 0);
    let layers = file.header().dims[2];
    for _ in 0..layers {
        samples.clear();
        file.read_layers(1, &mut samples)?;
    }
    Ok(layers)
}

fn check_mesh(mesh: &Mesh) {
    let count = mesh.vertices.len();
    let is_inside = |&corner: &u32| usize::try_from(corner).is_ok_and(|corner| corner < count);
    assert!(mesh.triangles.as_flattened().iter().all(is_inside), "a triangle has a corner that is no vertex");
    assert!(mesh.normals.is_empty() || mesh.normals.len() == count, "{} normals", mesh.normals.len());
    for attribute in &mesh.attributes {
        assert_eq!(attribute.values.len(), count * attribute.components, "values of '{}'", attribute.name);
    }
}
