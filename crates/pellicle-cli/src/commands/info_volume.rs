//! `info` on a volume: dimensions, type, place, how its values are spread, and an isovalue to try.

use std::path::Path;

use pellicle_io::{Placement, VolumeHeader};
use serde_json::{Value, json};

use super::info::show_point;
use crate::args::InfoArgs;
use crate::console::Console;
use crate::failure::Failure;
use crate::machine;
use crate::values::{show_argument, show_bytes, show_count, show_many, show_number};
use crate::volume::Selection;
use crate::volume::statistics::{SHARES, Statistics};

/// Runs the verb.
pub fn run(args: &InfoArgs, console: &Console) -> Result<(), Failure> {
    let path = &args.input;
    refuse(args)?;
    let selection =
        Selection { scale: args.from.scale, ..Selection::new(&args.volume, args.from.array.as_ref(), args.from.step) };
    let (header, found) = machine::thread_pool(machine::default_threads())?.install(|| -> Result<_, Failure> {
        let header = selection.open(path)?.header().clone();
        Ok((header, Statistics::of_file(&|| selection.open(path))?))
    })?;
    tell(&header, &found, path, console);
    console.report(|| as_json(&header, &found, path));
    Ok(())
}

/// Options that are about particles.
fn refuse(args: &InfoArgs) -> Result<(), Failure> {
    let from = &args.from;
    let given = [
        ("--where", from.condition.is_some()),
        ("--crop", from.crop.is_some()),
        ("--raw", from.raw.is_some()),
        ("--drop-invalid", from.drop_invalid),
    ];
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => {
            Err(Failure::Usage(format!("{name} is about particles, and {} holds a volume", args.input.display())))
        }
        None => Ok(()),
    }
}

fn tell(header: &VolumeHeader, found: &Statistics, path: &Path, console: &Console) {
    let [x, y, z] = header.dims;
    console.say(format_args!(
        "{}: volume of {x} × {y} × {z} samples, {}, {}, {}",
        path.display(),
        header.kind.name(),
        show_bytes(header.bytes()),
        show_many(header.cells(), "cell"),
    ));
    let grid = &header.grid;
    let unit = if header.unit.is_empty() { String::new() } else { format!(" {}", header.unit) };
    console.say(format_args!(
        "  spacing {}{unit}, first sample at {}",
        show_point(grid.spacing()),
        show_point(grid.origin)
    ));
    let is_straight = (0..3).all(|a| (0..3).all(|b| (a == b && grid.steps[a][b] > 0.0) || grid.steps[a][b] == 0.0));
    if !is_straight {
        let [a, b, c] = grid.steps.map(show_point);
        let hand = if grid.determinant() < 0.0 { ", left-handed" } else { "" };
        console.say(format_args!("  axes {a}, {b}, {c}{hand}"));
    }
    if header.components > 1 || header.frames > 1 {
        console.say(format_args!(
            "  component {} of {} (--component), {} (--step)",
            header.component,
            header.components,
            show_many(header.frames, "time step"),
        ));
    }
    for array in header.arrays.iter().filter(|_| header.arrays.len() > 1) {
        let of = if array.placement == Placement::Cells { "cells" } else { "points" };
        let mark = if array.name == header.name && array.placement == header.placement { " (this one)" } else { "" };
        let components = if array.components > 1 { format!(" × {}", array.components) } else { String::new() };
        console.say(format_args!("  array {}: {}{components} of {of}{mark}", array.name, array.kind.name()));
    }
    if header.placement == Placement::Cells {
        console.say("  values of cells: they stand for the cells' centres");
    }
    if let Some([low, high]) = found.range {
        console.say(format_args!("  values {} to {}", show_number(low), show_number(high)));
        let share = |(share, value): (&f64, &f64)| format!("{}%: {}", 100.0 * share, show_number(*value));
        let shares: Vec<String> = SHARES.iter().zip(&found.percentiles).map(share).collect();
        console.say(format_args!("  percentiles {}", shares.join(", ")));
    }
    if found.invalid > 0 {
        let invalid = show_count(found.invalid as usize);
        console.warn(format!("{}: {invalid} samples are NaN: they count as outside", path.display()));
    }
    match found.suggestion {
        Some(value) => {
            let file = show_argument(path);
            console.say(format_args!("Next: pellicle contour {file} --iso {}", show_number(value)));
        }
        None => console.say("  all values are equal: there is no surface"),
    }
}

fn as_json(header: &VolumeHeader, found: &Statistics, path: &Path) -> Value {
    let arrays = header.arrays.iter().map(|array| {
        json!({
            "name": array.name,
            "type": array.kind.name(),
            "components": array.components,
            "of": if array.placement == Placement::Cells { "cells" } else { "points" },
        })
    });
    json!({
        "kind": "volume",
        "input": path.to_string_lossy(),
        "dims": header.dims,
        "cells": header.cells(),
        "type": header.kind.name(),
        "bytes": header.bytes(),
        "spacing": header.grid.spacing(),
        "origin": header.grid.origin,
        "steps": header.grid.steps,
        "unit": header.unit,
        "array": header.name,
        "of": if header.placement == Placement::Cells { "cells" } else { "points" },
        "component": header.component,
        "components": header.components,
        "time_steps": header.frames,
        "arrays": arrays.collect::<Vec<_>>(),
        "slope": header.scaling.slope,
        "intercept": header.scaling.intercept,
        "min": found.range.map(|range| range[0]),
        "max": found.range.map(|range| range[1]),
        "percentiles": SHARES.iter().zip(&found.percentiles).map(|(s, v)| json!([100.0 * s, v])).collect::<Vec<_>>(),
        "invalid": found.invalid,
        "iso_suggested": found.suggestion,
    })
}
