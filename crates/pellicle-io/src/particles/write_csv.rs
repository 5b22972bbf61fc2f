//! CSV out: a line of names, then a line per particle. Numbers have the fewest digits that read back to the same value.
//! The extensions `.tsv`, `.txt` and `.dat` get tabs. Comments are left out: few programs know them in CSV.

use std::path::Path;

use super::Particles;
use crate::columns::Points;
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::meshes::WriteOptions;
use crate::meshes::write_ply::property_names;
use crate::output::{Output, Written};

pub(crate) fn write(path: &Path, particles: &Particles, _options: &WriteOptions) -> Result<Written, Error> {
    let points = Points::of_particles(particles);
    let has_commas = path.extension().is_none_or(|extension| extension.eq_ignore_ascii_case("csv"));
    let separator = if has_commas { ',' } else { '\t' };
    let mut names: Vec<String> = ["x", "y", "z"].map(String::from).into();
    for (column, name) in points.columns.iter().zip(points.names(Format::Csv, &[])) {
        names.extend(property_names(&name, column.components, false));
    }
    // A quote within quotes is doubled by some programs and escaped by others.
    let quoted = names.iter().map(|name| match name.replace('"', "'") {
        name if name.contains([',', ';', '\t', '\'', '#']) => format!("\"{name}\""),
        name => name,
    });
    let mut out = Output::create(path, None)?;
    out.bytes(quoted.collect::<Vec<_>>().join(separator.to_string().as_str()).as_bytes())?;
    out.bytes(b"\n")?;
    let mut all = vec![(3, points.positions)];
    all.extend(points.columns.iter().map(|column| (column.components, column.values)));
    out.lines(points.count, |i, line| {
        for (at, &(components, values)) in all.iter().enumerate() {
            for component in 0..components {
                if at + component > 0 {
                    line.push(separator);
                }
                values.show(i * components + component, line);
            }
        }
        line.push('\n');
    })?;
    out.finish()?;
    Ok(Written::default())
}
