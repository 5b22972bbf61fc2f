//! NumPy archives out: one array per entry, stored and not compressed, 64-bit where an entry needs it.
//!
//! A mesh has `vertices` (N×3), `triangles` (M×3, u32), `normals` if there are, and its attributes under their names;
//! particles have `positions` and their attributes. What they were made with is the archive's comment.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use pellicle::Mesh;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::temporary::Temporary;
use super::{WriteOptions, one_line};
use crate::columns::{Points, Values};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::formats::npy_header::header;
use crate::output::Written;
use crate::particles::Particles;
use crate::scalar::Endian;

/// Numbers formatted between two writes.
const CHUNK: usize = 64 << 10;
/// Bytes of an entry from which on sizes need 64 bits; less than 2^32 by more than a header.
const LARGE: u64 = 0xffff_0000;

pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    let points = Points::of_mesh(mesh);
    let triangles = Values::U32(mesh.triangles.as_flattened());
    write_archive(path, &points, "vertices", &[("triangles", 3, triangles)], options)
}

pub(crate) fn write_particles(path: &Path, particles: &Particles, options: &WriteOptions) -> Result<Written, Error> {
    write_archive(path, &Points::of_particles(particles), "positions", &[], options)
}

fn write_archive(
    path: &Path,
    points: &Points<'_>,
    positions: &str,
    others: &[(&str, usize, Values<'_>)],
    options: &WriteOptions,
) -> Result<Written, Error> {
    let taken: Vec<&str> = others.iter().map(|other| other.0).chain([positions]).collect();
    let names = points.names(Format::Npz, &taken);
    let columns = points.columns.iter().zip(&names);
    let columns = columns.map(|(column, name)| (name.as_str(), column.components, column.values));
    let arrays = [(positions, 3, points.positions)].into_iter().chain(others.iter().copied()).chain(columns);
    let file = Temporary::create(path)?;
    let archive = ZipWriter::new(BufWriter::with_capacity(1 << 20, file.file()));
    put(archive, arrays, &one_line(&options.comments.join("; "))).map_err(|source| file.fail("write", source))?;
    file.finish()?;
    Ok(Written::default())
}

fn put<'a>(
    mut archive: ZipWriter<BufWriter<&File>>,
    arrays: impl Iterator<Item = (&'a str, usize, Values<'a>)>,
    comment: &str,
) -> io::Result<()> {
    archive.set_comment(&comment[..comment.floor_char_boundary(usize::from(u16::MAX))])?;
    for (name, components, values) in arrays {
        // No time of day: the same data give the same bytes.
        let options = SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default())
            .large_file(values.bytes() >= LARGE);
        archive.start_file(format!("{name}.npy"), options)?;
        archive.write_all(&header(values, components))?;
        if let Some(plain) = values.plain(Endian::Little) {
            archive.write_all(plain)?;
            continue;
        }
        let size = values.scalar().size();
        let mut bytes = Vec::new();
        for first in (0..values.len()).step_by(CHUNK) {
            let range = first..values.len().min(first + CHUNK);
            bytes.resize(range.len() * size, 0);
            values.put(range, Endian::Little, &mut bytes, size, 1);
            archive.write_all(&bytes)?;
        }
    }
    archive.finish()?.flush()
}
