//! Extended XYZ out: the number of particles, a line that names the columns, a line per particle.
//!
//! Every particle is of the species `X`, which programs take for an atom of no element. Integers of the format have no
//! stated size; all are written. Names become single words.
//!
//! Source: the format as ASE and OVITO document it.

use std::path::Path;

use super::Particles;
use crate::columns::Points;
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::meshes::{WriteOptions, one_line};
use crate::output::{Output, Written};
use crate::scalar::Scalar;

pub(crate) fn write(path: &Path, particles: &Particles, options: &WriteOptions) -> Result<Written, Error> {
    let points = Points::of_particles(particles);
    let mut properties = String::from("species:S:1:pos:R:3");
    for (column, name) in points.columns.iter().zip(points.names(Format::TextXyz, &["species", "pos"])) {
        let kind = match column.values.scalar() {
            Scalar::I32 | Scalar::I64 => 'I',
            _ => 'R',
        };
        let word = |c: char| if c.is_whitespace() || c.is_control() || ":=\"'".contains(c) { '_' } else { c };
        let name: String = name.chars().map(word).collect();
        properties.push_str(&format!(":{name}:{kind}:{}", column.components));
    }
    let comment = one_line(&options.comments.join("; ")).replace(['"', '\\'], "'");
    let comment = if comment.is_empty() { String::new() } else { format!(" comment=\"{comment}\"") };
    let mut out = Output::create(path, None)?;
    out.bytes(format!("{}\nProperties={properties}{comment} pbc=\"F F F\"\n", points.count).as_bytes())?;
    let mut all = vec![(3, points.positions)];
    all.extend(points.columns.iter().map(|column| (column.components, column.values)));
    out.lines(points.count, |i, line| {
        line.push('X');
        for &(components, values) in &all {
            for component in 0..components {
                line.push(' ');
                values.show(i * components + component, line);
            }
        }
        line.push('\n');
    })?;
    out.finish()?;
    Ok(Written::default())
}
