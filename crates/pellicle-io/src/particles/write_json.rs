//! JSON out: an object of arrays, `{"positions": [[x, y, z], …], "density": [d, …], …}`. JSON has no NaN and no infinite
//! numbers: they are refused.

use std::path::Path;

use super::Particles;
use crate::columns::{Points, Values};
use crate::error::Error;
use crate::formats::catalog::Format;
use crate::meshes::WriteOptions;
use crate::output::{Output, Written};

pub(crate) fn write(path: &Path, particles: &Particles, options: &WriteOptions) -> Result<Written, Error> {
    let points = Points::of_particles(particles);
    check_finite(path, &points)?;
    let mut out = Output::create(path, None)?;
    out.bytes(b"{")?;
    if !options.comments.is_empty() {
        out.bytes(format!("\"comments\": {},\n", serde_json::json!(options.comments)).as_bytes())?;
    }
    write_array(&mut out, "positions", 3, points.positions, points.count)?;
    let names = points.names(Format::Json, &["comments", "positions"]);
    for (column, name) in points.columns.iter().zip(&names) {
        out.bytes(b",\n")?;
        write_array(&mut out, name, column.components, column.values, points.count)?;
    }
    out.bytes(b"}\n")?;
    out.finish()?;
    Ok(Written::default())
}

fn write_array(out: &mut Output, name: &str, components: usize, values: Values<'_>, count: usize) -> Result<(), Error> {
    out.bytes(format!("{}: [", serde_json::json!(name)).as_bytes())?;
    out.lines(count, |i, line| {
        line.push_str(if i > 0 { ",\n" } else { "\n" });
        if components == 1 {
            return values.show(i, line);
        }
        for component in 0..components {
            line.push_str(if component > 0 { ", " } else { "[" });
            values.show(i * components + component, line);
        }
        line.push(']');
    })?;
    out.bytes(b"]")
}

fn check_finite(path: &Path, points: &Points<'_>) -> Result<(), Error> {
    let columns = points.columns.iter().map(|column| (column.name, column.components, column.values));
    for (name, components, values) in [("position", 3, points.positions)].into_iter().chain(columns) {
        if let Some(at) = values.first_not_finite() {
            let what = format!(
                "the {name} of particle {} is NaN or infinite, which JSON cannot hold: leave such particles out, or write \
                 .ply or .csv",
                at / components
            );
            return Err(Error::Unsupported { path: path.into(), what });
        }
    }
    Ok(())
}
