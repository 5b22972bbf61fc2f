//! Wavefront OBJ out: positions, normals, faces. The format has no room for attributes but one: the attribute `color` becomes
//! three more numbers behind each position, as many programs have it (an opacity is left out).
//!
//! Numbers are written in the fewest digits that read back to the same value. Lines are formatted by several threads and
//! written in order.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use pellicle::Mesh;
use rayon::prelude::*;

use super::temporary::Temporary;
use super::{Faces, WriteOptions, one_line};
use crate::error::Error;
use crate::output::Written;

/// Lines formatted by one task: some 300 kB.
const TASK: usize = 1 << 13;
/// Tasks formatted before their text is written: keeps the text in memory small.
const BATCH: usize = 64;

pub(crate) fn write(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<Written, Error> {
    write_faces(path, mesh.into(), options)
}

/// The same with quads, which come before the triangles.
pub(crate) fn write_faces(path: &Path, faces: Faces<'_>, options: &WriteOptions) -> Result<Written, Error> {
    let Faces { mesh, quads } = faces;
    let color = mesh.attributes.iter().find(|a| a.name == "color" && matches!(a.components, 3 | 4));
    let file = Temporary::create(path)?;
    for comment in &options.comments {
        put(&file, format!("# {}\n", one_line(comment)).as_bytes())?;
    }
    let is_single = mesh.origin == [0.0; 3];
    lines(&file, &mesh.vertices, |out, i, v| {
        if is_single {
            write!(out, "v {} {} {}", v[0], v[1], v[2])?;
        } else {
            let [x, y, z] = [0, 1, 2].map(|axis| mesh.origin[axis] + f64::from(v[axis]));
            write!(out, "v {x} {y} {z}")?;
        }
        if let Some(color) = color {
            let c = &color.values[i * color.components..];
            write!(out, " {} {} {}", c[0], c[1], c[2])?;
        }
        out.push('\n');
        Ok(())
    })?;
    lines(&file, &mesh.normals, |out, _, [x, y, z]| writeln!(out, "vn {x} {y} {z}"))?;
    let has_normals = !mesh.normals.is_empty();
    lines(&file, quads, |out, _, quad| face(out, &quad, has_normals))?;
    lines(&file, &mesh.triangles, |out, _, triangle| face(out, &triangle, has_normals))?;
    file.finish()?;
    let mut written = Written::default();
    for attribute in &mesh.attributes {
        match color {
            Some(color) if std::ptr::eq(color, attribute) => {
                if color.components == 4 {
                    written.narrowed.push(color.name.clone());
                }
            }
            _ => written.left_out.push(attribute.name.clone()),
        }
    }
    Ok(written)
}

/// The line of a face.
fn face(out: &mut String, corners: &[u32], has_normals: bool) -> std::fmt::Result {
    out.push('f');
    for &index in corners {
        let digits = Digits::of(u64::from(index) + 1);
        out.push(' ');
        out.push_str(digits.text());
        if has_normals {
            out.push_str("//");
            out.push_str(digits.text());
        }
    }
    out.push('\n');
    Ok(())
}

/// An index in decimals: several times as fast as the formatting of the standard library, and most of a file.
struct Digits {
    bytes: [u8; 10],
    start: usize,
}

impl Digits {
    /// Numbers up to 2^32, which have ten digits.
    fn of(mut number: u64) -> Digits {
        let (mut bytes, mut start) = ([b'0'; 10], 10);
        while start > 0 && (number > 0 || start == 10) {
            start -= 1;
            bytes[start] = b'0' + (number % 10) as u8;
            number /= 10;
        }
        Digits { bytes, start }
    }

    fn text(&self) -> &str {
        std::str::from_utf8(&self.bytes[self.start..]).unwrap_or_default()
    }
}

/// Writes a line for each item, which `format` gets with its number.
fn lines<T: Copy + Sync>(
    file: &Temporary,
    items: &[T],
    format: impl Fn(&mut String, usize, T) -> std::fmt::Result + Sync,
) -> Result<(), Error> {
    for (b, batch) in items.chunks(TASK * BATCH).enumerate() {
        let texts: Vec<String> = batch
            .par_chunks(TASK)
            .enumerate()
            .map(|(p, part)| {
                let mut text = String::with_capacity(part.len() * 40);
                for (i, &item) in part.iter().enumerate() {
                    // Writing to memory cannot fail.
                    let _ = format(&mut text, (b * BATCH + p) * TASK + i, item);
                }
                text
            })
            .collect();
        for text in &texts {
            put(file, text.as_bytes())?;
        }
    }
    Ok(())
}

fn put(file: &Temporary, bytes: &[u8]) -> Result<(), Error> {
    file.file().write_all(bytes).map_err(|source| file.fail("write", source))
}

#[cfg(test)]
mod tests {
    use super::Digits;

    #[test]
    fn indices_are_written_in_full() {
        for number in [0, 1, 9, 10, 12_345, u64::from(u32::MAX) + 1] {
            assert_eq!(Digits::of(number).text(), number.to_string());
        }
    }
}
