//! Which format a file has: by extension, and by its first bytes where the extension tells nothing.

use std::io::Read;
use std::path::Path;

use super::catalog::{self, Format, OpenVolume, ReadMesh, Row, WriteMesh, WriteParticles, WriteQuads, WriteVolume};
use super::foreign::{self, Foreign};
use crate::error::Error;
use crate::formats::vtk;
use crate::particles::npy_header;
use crate::source::{self, Source};
use crate::volumes;

/// First bytes of gzip, a compression and not a format.
pub(crate) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The format of a particle file that is there.
pub(crate) fn particles(path: &Path) -> Result<&'static Row, Error> {
    let name = lower_name(path);
    refuse(path, foreign::by_name(&name))?;
    // Text may be compressed; the readers of other formats say that they cannot be.
    let found = match catalog::by_name(&name).or_else(|| catalog::by_name(name.strip_suffix(".gz")?)) {
        Some(row) => Some(row),
        None => sniff(path)?.and_then(catalog::row),
    };
    match found {
        Some(row) if row.read_particles.is_some() => Ok(row),
        Some(row) if row.read_mesh.is_none() && row.open_volume.is_some() => {
            let what = format!(
                "a {} holds a volume, not particles or a mesh: surfaces of volumes are made by contouring",
                row.name
            );
            Err(Error::Unsupported { path: path.into(), what })
        }
        _ => Err(unknown(path, "particles are read from", |row| row.read_particles.is_some())),
    }
}

/// The format of a file that is there, whether of particles or of a mesh.
pub(crate) fn content(path: &Path) -> Result<&'static Row, Error> {
    match catalog::by_name(&lower_name(path)) {
        Some(row) if row.read_mesh.is_some() => Ok(row),
        _ => particles(path),
    }
}

/// The format of a volume file that is there.
pub(crate) fn volume(path: &Path) -> Result<OpenVolume, Error> {
    let found = match catalog::by_name(&lower_name(path)) {
        Some(row) => Some(row),
        None => sniff(path)?.and_then(catalog::row),
    };
    let open = found.and_then(|row| row.open_volume);
    open.ok_or_else(|| unknown(path, "volumes are read from", |row| row.open_volume.is_some()))
}

/// Whether a file that is there holds a volume.
pub(crate) fn holds_volume(path: &Path) -> Result<bool, Error> {
    let row = match catalog::by_name(&lower_name(path)) {
        Some(row) => row,
        None => match sniff(path).ok().flatten().and_then(catalog::row) {
            Some(row) => row,
            None => return Ok(false),
        },
    };
    match row.format {
        Format::Npy => {
            let array = npy_header::read_array(&mut Source::open(path)?);
            Ok(array.is_ok_and(|array| matches!(array.shape.len(), 3 | 4)))
        }
        Format::Npz => volumes::npz::is_volume_archive(path),
        Format::Vtk => Ok(vtk::Reader::open(path)?.dataset() == volumes::vtk::DATASET),
        _ => Ok(row.open_volume.is_some() && row.read_particles.is_none()),
    }
}

/// The format of a particle file to be written, from its name alone.
pub(crate) fn particles_out(path: &Path) -> Result<WriteParticles, Error> {
    let write = catalog::by_name(&lower_name(path)).and_then(|row| row.write_particles);
    write.ok_or_else(|| unknown(path, "particles are written to", |row| row.write_particles.is_some()))
}

/// The format of a volume file to be written, from its name alone.
pub(crate) fn volume_out(path: &Path) -> Result<WriteVolume, Error> {
    let write = catalog::by_name(&lower_name(path)).and_then(|row| row.write_volume);
    write.ok_or_else(|| unknown(path, "volumes are written to", |row| row.write_volume.is_some()))
}

/// The format of a mesh file that is there, from its name alone.
pub(crate) fn mesh(path: &Path) -> Result<ReadMesh, Error> {
    let read = catalog::by_name(&lower_name(path)).and_then(|row| row.read_mesh);
    read.ok_or_else(|| unknown(path, "meshes are read from", |row| row.read_mesh.is_some()))
}

/// The format of a mesh file to be written, from its name alone.
pub(crate) fn mesh_out(path: &Path) -> Result<WriteMesh, Error> {
    let write = catalog::by_name(&lower_name(path)).and_then(|row| row.write_mesh);
    write.ok_or_else(|| unknown(path, "meshes are written to", |row| row.write_mesh.is_some()))
}

/// The format of a file of quads to be written, from its name alone.
pub(crate) fn quads_out(path: &Path) -> Result<WriteQuads, Error> {
    let write = catalog::by_name(&lower_name(path)).and_then(|row| row.write_quads);
    write.ok_or_else(|| unknown(path, "quads are written to", |row| row.write_quads.is_some()))
}

fn lower_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn unknown(path: &Path, action: &str, can: impl Fn(&Row) -> bool) -> Error {
    let why = match catalog::by_name(&lower_name(path)) {
        Some(row) => format!("with {} this is not possible", row.name),
        None => "this file type is not known".into(),
    };
    let what = format!("{why}: {action} {}", catalog::extensions(can));
    Error::Unsupported { path: path.into(), what }
}

/// An error for a format that is known and not read.
fn refuse(path: &Path, foreign: Option<&Foreign>) -> Result<(), Error> {
    match foreign {
        Some(foreign) => Err(Error::Unsupported { path: path.into(), what: foreign.refusal() }),
        None => Ok(()),
    }
}

/// The format by the first bytes; `None` if they say nothing.
fn sniff(path: &Path) -> Result<Option<Format>, Error> {
    let (file, _) = source::open(path)?;
    let mut head = Vec::with_capacity(64);
    file.take(64).read_to_end(&mut head).map_err(|source| Error::Read { path: path.into(), source })?;
    refuse(path, foreign::by_content(&head))?;
    Ok(by_content(&head).or_else(|| weakly(&head)))
}

/// Formats whose beginning is too common to doubt an extension because of it.
fn weakly(head: &[u8]) -> Option<Format> {
    let text = head.trim_ascii_start();
    let of_table = |b: &u8| b.is_ascii_digit() || b" \t\r\n,;+-.eE".contains(b);
    match text.first()? {
        b'[' | b'{' if is_text(head) => Some(Format::Json),
        _ if is_text(head) && head.iter().all(of_table) => Some(Format::TextXyz),
        _ => None,
    }
}

/// Whether the first bytes are lines of text with a number in them. A dozen random bytes look like this once in 10^6.
pub(crate) fn is_text(head: &[u8]) -> bool {
    let is_printable = |b: &u8| matches!(b, b' '..=b'~' | b'\t' | b'\r' | b'\n');
    let separates = |b: &u8| matches!(b, b' ' | b'\t' | b'\n' | b',' | b';');
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    head.iter().all(is_printable) && head.iter().any(u8::is_ascii_digit) && head.iter().any(separates)
}

/// The format that begins with `head`.
pub(crate) fn by_content(head: &[u8]) -> Option<Format> {
    let begins = |magic: &[u8]| head.starts_with(magic);
    if begins(b"ply\n") || begins(b"ply\r") {
        Some(Format::Ply)
    } else if begins(b"\x93NUMPY") {
        Some(Format::Npy)
    } else if begins(b"Bgeo") || begins(&GZIP) {
        Some(Format::Bgeo)
    } else if begins(b"\x89HDF\r\n\x1a\n") {
        Some(Format::Hdf5)
    } else if begins(b"# vtk DataFile") {
        Some(Format::Vtk)
    } else if begins(b"<?xml") || begins(b"<VTKFile") {
        let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
        let is_list = has(b"\"Collection") || has(b"\"PUnstructuredGrid") || has(b"\"PPolyData");
        match (is_list, has(b"\"ImageData") || has(b"\"PImageData")) {
            (true, _) => Some(Format::Pvd),
            (_, true) => Some(Format::Vti),
            _ => Some(Format::Vtu),
        }
    } else if begins(b"ITEM:") {
        Some(Format::LammpsDump)
    } else if begins(b"PK\x03\x04") || begins(b"PK\x05\x06") {
        Some(Format::Npz)
    } else if begins(b"NRRD00") {
        Some(Format::Nrrd)
    } else if begins(b"ObjectType") || begins(b"NDims") {
        Some(Format::MetaImage)
    } else if begins(&348u32.to_le_bytes()) || begins(&348u32.to_be_bytes()) {
        Some(Format::Nifti)
    } else if begins(b"#FileJBD ") {
        Some(Format::Bi4)
    } else {
        None
    }
}

/// What to say about a file that does not begin as its extension promises.
pub(crate) fn mismatch(expected: &str, head: &[u8]) -> String {
    if let Some(foreign) = foreign::by_content(head) {
        return format!("this is not {expected}: {}", foreign.refusal());
    }
    let found = match by_content(head) {
        Some(Format::Ply) => "it begins like a PLY file: rename it to .ply",
        Some(Format::Npy) => "it begins like a NumPy array: rename it to .npy",
        Some(Format::Hdf5) => "it begins like an HDF5 file: rename it to .h5",
        Some(Format::Bgeo) => "it begins like a BGEO or gzip file",
        Some(Format::Vtk) => "it begins like a legacy VTK file: rename it to .vtk",
        Some(Format::Vtu | Format::Pvd) => "it begins like an XML file: rename it to .vtu or .vtp if it is VTK's",
        Some(Format::LammpsDump) => "it begins like a LAMMPS dump: rename it to .dump",
        Some(Format::Npz) => "it begins like a ZIP archive: rename it to .npz if it is NumPy's",
        Some(Format::Bi4) => "it begins like DualSPHysics' data: rename it to .bi4",
        Some(Format::Nrrd) => "it begins like a NRRD volume: rename it to .nrrd",
        Some(Format::MetaImage) => "it begins like a MetaImage: rename it to .mha or .mhd",
        Some(Format::Nifti) => "it begins like a NIfTI volume: rename it to .nii",
        Some(Format::Vti) => "it begins like a VTK XML image: rename it to .vti",
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
        let format = |name| particles(Path::new(name)).ok().map(|row| row.format);
        assert_eq!(format("a/B.XYZ"), Some(Format::RawXyz));
        assert_eq!(format("a.bgeo.gz"), Some(Format::Bgeo));
        for name in ["a.bgeo.sc", "a.geo", "a.abc", "a.usdc", "a.vdb", "a.hclassic", "a.vtm"] {
            let message = particles(Path::new(name)).expect_err(name).to_string();
            let way_out = [".bhclassic", ".npy", ".vtu"].iter().any(|out| message.contains(out));
            assert!(message.contains("is not read") && way_out, "{message}");
        }
        for head in [&b"\x7fNSJb"[..], b"Ogawa\xff", b"PXR-USDC", b"#usda 1.0", b" BDV\0", b"PGEOMETRY V5"] {
            assert!(mismatch("a PLY file", head).contains("is not read: "), "{head:?}");
        }
        let message = mesh_out(Path::new("a.csv")).expect_err("no mesh").to_string();
        assert!(message.contains("with CSV this is not possible: meshes are written to .ply"), "{message}");
        assert!(mesh_out(Path::new("a.foo")).expect_err("unknown").to_string().contains("is not known"));
    }
}
