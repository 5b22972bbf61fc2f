//! Which format a file has: by extension, and by its first bytes where the extension tells nothing.

use std::io::Read;
use std::path::Path;

use crate::error::Error;
use crate::source;

/// A particle format that is read here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ParticleFormat {
    Xyz,
    Npy,
    Ply,
    Bgeo,
    Vtk,
    /// VTU, VTP
    VtkXml,
    Csv,
}

/// A mesh format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MeshFormat {
    Ply,
    Obj,
    Vtk,
}

const PARTICLES: &str = ".xyz .raw .npy .ply .bgeo .vtk .vtu .vtp .csv .txt";
const MESHES: &str = ".ply .obj .vtk";
/// First bytes of gzip, a compression and not a format.
pub(crate) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The format of a particle file.
pub(crate) fn particles(path: &Path) -> Result<ParticleFormat, Error> {
    let name = lower_name(path);
    refuse_known(path, &name)?;
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    Ok(match extension {
        "xyz" | "raw" => ParticleFormat::Xyz,
        "npy" => ParticleFormat::Npy,
        "ply" => ParticleFormat::Ply,
        "bgeo" | "bhclassic" => ParticleFormat::Bgeo,
        "vtk" => ParticleFormat::Vtk,
        "vtu" | "vtp" => ParticleFormat::VtkXml,
        "csv" | "tsv" | "txt" | "dat" => ParticleFormat::Csv,
        _ if name.ends_with(".bgeo.gz") => ParticleFormat::Bgeo,
        _ => return sniff(path)?.ok_or_else(|| unknown(path, "particles are read from", PARTICLES)),
    })
}

/// The format of a mesh file, from its name alone: it may not exist yet.
pub(crate) fn mesh(path: &Path, action: &str) -> Result<MeshFormat, Error> {
    let name = lower_name(path);
    match name.rsplit_once('.').map_or("", |(_, extension)| extension) {
        "ply" => Ok(MeshFormat::Ply),
        "obj" => Ok(MeshFormat::Obj),
        "vtk" => Ok(MeshFormat::Vtk),
        _ => Err(unknown(path, action, MESHES)),
    }
}

fn lower_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn unknown(path: &Path, action: &str, formats: &str) -> Error {
    let what = format!("this file type is not known: {action} {formats}");
    Error::Unsupported { path: path.into(), what }
}

/// Formats that hold particles but are not read: says so, and what to convert to.
fn refuse_known(path: &Path, name: &str) -> Result<(), Error> {
    let (what, convert) = match name.rsplit_once('.').map_or("", |(_, extension)| extension) {
        "sc" if name.ends_with(".bgeo.sc") => (
            "Houdini's Blosc-compressed geometry",
            "in Houdini save it as classic .bgeo, or with the Geometry ROP as .ply",
        ),
        "geo" | "hclassic" => ("Houdini's ASCII geometry", "save it as classic .bgeo, or as .ply"),
        "abc" => ("Alembic", "export the points as .ply, .bgeo or .npy"),
        "usd" | "usda" | "usdc" | "usdz" => ("USD", "export the points as .ply, .bgeo or .npy"),
        "vdb" => ("OpenVDB", "export the points as .ply, .bgeo or .npy"),
        "h5" | "hdf5" | "hdf" => ("HDF5", "write the positions as .npy, for example by numpy and h5py"),
        "pvtu" | "pvtp" | "vtm" | "pvd" | "series" => {
            ("an index of other files", "name the .vtu, .vtp or .vtk files that it lists")
        }
        "npz" => ("a NumPy archive", "save the array by itself as .npy"),
        _ => return Ok(()),
    };
    let what = format!("{what} is not read: {convert}");
    Err(Error::Unsupported { path: path.into(), what })
}

/// The format by the first bytes; `None` if they say nothing.
fn sniff(path: &Path) -> Result<Option<ParticleFormat>, Error> {
    let (file, _) = source::open(path)?;
    let mut head = Vec::with_capacity(64);
    file.take(64).read_to_end(&mut head).map_err(|source| Error::Read { path: path.into(), source })?;
    Ok(by_content(&head))
}

/// The format that begins with `head`.
pub(crate) fn by_content(head: &[u8]) -> Option<ParticleFormat> {
    let begins = |magic: &[u8]| head.starts_with(magic);
    if begins(b"ply\n") || begins(b"ply\r") {
        Some(ParticleFormat::Ply)
    } else if begins(b"\x93NUMPY") {
        Some(ParticleFormat::Npy)
    } else if begins(b"Bgeo") || begins(&GZIP) {
        Some(ParticleFormat::Bgeo)
    } else if begins(b"# vtk DataFile") {
        Some(ParticleFormat::Vtk)
    } else if begins(b"<?xml") || begins(b"<VTKFile") {
        Some(ParticleFormat::VtkXml)
    } else {
        None
    }
}

/// What to say about a file that does not begin as its extension promises.
pub(crate) fn mismatch(expected: &str, head: &[u8]) -> String {
    let found = match by_content(head) {
        Some(ParticleFormat::Ply) => "it begins like a PLY file: rename it to .ply",
        Some(ParticleFormat::Npy) => "it begins like a NumPy array: rename it to .npy",
        Some(ParticleFormat::Bgeo) => "it begins like a BGEO or gzip file",
        Some(ParticleFormat::Vtk) => "it begins like a legacy VTK file: rename it to .vtk",
        Some(ParticleFormat::VtkXml) => "it begins like an XML file: rename it to .vtu or .vtp if it is VTK's",
        _ if head.is_empty() => "it is empty",
        _ => "it begins otherwise",
    };
    format!("this is not {expected}: {found}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_count_in_any_case_and_known_foreign_ones_tell_what_to_convert_to() {
        assert_eq!(particles(Path::new("a/B.XYZ")).ok(), Some(ParticleFormat::Xyz));
        assert_eq!(particles(Path::new("a.bgeo.gz")).ok(), Some(ParticleFormat::Bgeo));
        for name in ["a.bgeo.sc", "a.geo", "a.abc", "a.usdc", "a.vdb", "a.h5"] {
            let message = particles(Path::new(name)).expect_err(name).to_string();
            assert!(
                message.contains("is not read") && message.contains(".npy") | message.contains(".ply"),
                "{message}"
            );
        }
        assert!(mesh(Path::new("a.stl"), "meshes are written to").is_err());
    }
}
