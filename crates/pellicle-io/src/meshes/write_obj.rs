//! Wavefront OBJ out: positions, normals, faces. The format has no room for other attributes.
//!
//! Numbers are written in the fewest digits that read back to the same value. Lines are formatted by several threads and
//! written in order.

use std::io::Write;
use std::path::Path;

use pellicle::Mesh;
use rayon::prelude::*;

use super::temporary::Temporary;
use super::{WriteOptions, one_line};
use crate::error::Error;

/// Lines formatted by one task: some 300 kB.
const TASK: usize = 1 << 13;
/// Tasks formatted before their text is written: keeps the text in memory small.
const BATCH: usize = 64;

pub(super) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<(), Error> {
    let file = Temporary::create(path)?;
    let mut head = Vec::new();
    for comment in &options.comments {
        head.extend_from_slice(format!("# {}\n", one_line(comment)).as_bytes());
    }
    put(&file, &head)?;
    if mesh.origin == [0.0; 3] {
        lines(&file, &mesh.vertices, |out, [x, y, z]| writeln!(out, "v {x} {y} {z}"))?;
    } else {
        lines(&file, &mesh.vertices, |out, v| {
            let [x, y, z] = [0, 1, 2].map(|axis| mesh.origin[axis] + f64::from(v[axis]));
            writeln!(out, "v {x} {y} {z}")
        })?;
    }
    lines(&file, &mesh.normals, |out, [x, y, z]| writeln!(out, "vn {x} {y} {z}"))?;
    let has_normals = !mesh.normals.is_empty();
    lines(&file, &mesh.triangles, |out, triangle| {
        let [a, b, c] = triangle.map(|index| u64::from(index) + 1);
        if has_normals { writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}") } else { writeln!(out, "f {a} {b} {c}") }
    })?;
    file.finish()
}

/// Writes a line for each item.
fn lines<T: Copy + Sync>(
    file: &Temporary,
    items: &[T],
    format: impl Fn(&mut Vec<u8>, T) -> std::io::Result<()> + Sync,
) -> Result<(), Error> {
    for batch in items.chunks(TASK * BATCH) {
        let texts: Vec<Vec<u8>> = batch
            .par_chunks(TASK)
            .map(|part| {
                let mut text = Vec::with_capacity(part.len() * 40);
                for &item in part {
                    // Writing to memory cannot fail.
                    let _ = format(&mut text, item);
                }
                text
            })
            .collect();
        for text in &texts {
            put(file, text)?;
        }
    }
    Ok(())
}

fn put(file: &Temporary, bytes: &[u8]) -> Result<(), Error> {
    file.file().write_all(bytes).map_err(|source| file.fail("write", source))
}
