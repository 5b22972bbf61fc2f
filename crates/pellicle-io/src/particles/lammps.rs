//! Dumps of LAMMPS in text, plain or compressed by gzip: any number of time steps, columns in any order.
//!
//! The position is `x y z`, else unwrapped `xu yu zu`, else scaled `xs ys zs` or `xsu ysu zsu`, which become lengths by
//! the box: orthogonal, triclinic (whose bounds in the file enclose the tilted box), or general triclinic. What is not
//! the position is an attribute: integers for ids, types and image flags, else double precision. Columns of text, such as
//! `element`, are passed over.
//!
//! Source: LAMMPS manual, commands "dump" and "dump_modify", and the howto "Triclinic (non-orthogonal) simulation boxes",
//! <https://docs.lammps.org/dump.html>, <https://docs.lammps.org/Howto_triclinic.html>.

use std::path::Path;

use rayon::prelude::*;

use super::{Particles, PositionData, ReadOptions};
use crate::error::Error;
use crate::formats::names;
use crate::rows::{Extent, MAX_COLUMNS, Rows, Separator, fields, number, skip_lines};
use crate::scalar::Scalar;
use crate::source::Source;

/// Columns that hold integers.
const INTEGERS: [&str; 9] = ["id", "type", "mol", "proc", "procp1", "ix", "iy", "iz", "typelabel"];
/// Names of the position's columns, and whether they are in units of the box.
const POSITIONS: [([&str; 3], bool); 4] =
    [(["x", "y", "z"], false), (["xu", "yu", "zu"], false), (["xs", "ys", "zs"], true), (["xsu", "ysu", "zsu"], true)];

/// A box: a corner and the three edges from there.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    origin: [f64; 3],
    edges: [[f64; 3]; 3],
}

/// What is known of a time step before its particles.
#[derive(Default)]
struct Step {
    particles: Option<u64>,
    cell: Option<Cell>,
}

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.refuse_array(path, "a LAMMPS dump")?;
    let mut source = Source::open_text(path)?;
    let mut step = Step::default();
    let mut frame = 0;
    let mut is_first = true;
    while let Some(line) = source.line()? {
        let line = String::from_utf8_lossy(line.trim_ascii()).into_owned();
        if line.is_empty() {
            continue;
        }
        let Some(item) = line.strip_prefix("ITEM:").map(str::trim) else {
            let what = "an 'ITEM:' was expected here";
            return Err(source.fail(if is_first { format!("this is no LAMMPS dump: {what}") } else { what.into() }));
        };
        is_first = false;
        if item == "NUMBER OF ATOMS" {
            let particles = text(&mut source)?.trim().parse().map_err(|_| source.fail("this is no number of atoms"))?;
            step.particles = Some(source.room(particles, 2, "atoms").map(|_| particles)?);
        } else if let Some(kind) = item.strip_prefix("BOX BOUNDS") {
            step.cell = Some(read_box(&mut source, kind)?);
        } else if let Some(columns) = item.strip_prefix("ATOMS") {
            let Some(particles) = step.particles else { return Err(source.fail("ATOMS before NUMBER OF ATOMS")) };
            if frame == options.frame {
                return read_atoms(&mut source, particles, step.cell, columns, options);
            }
            skip_lines(&mut source, particles, "the atoms")?;
            frame += 1;
            step = Step::default();
        } else {
            // TIMESTEP, UNITS, TIME: a line each.
            text(&mut source)?;
        }
    }
    if frame == 0 {
        return Err(source.cut("the first time step"));
    }
    Err(source.unsupported(format!("there is no time step {}: they are 0 to {}", options.frame, frame - 1)))
}

/// The next line.
fn text(source: &mut Source<'_>) -> Result<String, Error> {
    match source.line()? {
        Some(line) => Ok(String::from_utf8_lossy(line).into_owned()),
        None => Err(source.cut("the head of a time step")),
    }
}

fn read_box(source: &mut Source<'_>, kind: &str) -> Result<Cell, Error> {
    let is_general = kind.trim_start().starts_with("abc");
    let is_tilted = kind.trim_start().starts_with("xy");
    let columns = if is_general { 4 } else { 2 + usize::from(is_tilted) };
    let mut bounds = [[0.0; 4]; 3];
    for row in &mut bounds {
        let line = text(source)?;
        let values: Option<Vec<f64>> = line.split_whitespace().map(|w| w.parse().ok()).collect();
        match values {
            Some(values) if values.len() >= columns => row[..columns].copy_from_slice(&values[..columns]),
            _ => return Err(source.fail(format!("a line of the box must have {columns} numbers"))),
        }
    }
    Ok(if is_general {
        Cell { origin: bounds.map(|row| row[3]), edges: bounds.map(|row| [row[0], row[1], row[2]]) }
    } else {
        tilted(bounds)
    })
}

/// The box whose bounding box and tilts `xy xz yz` the dump has.
fn tilted(bounds: [[f64; 4]; 3]) -> Cell {
    let [[x0, x1, xy, _], [y0, y1, xz, _], [z0, z1, yz, _]] = bounds;
    let least = |values: &[f64]| values.iter().copied().fold(0.0, f64::min);
    let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let shifts = [xy, xz, xy + xz];
    let (x0, x1) = (x0 - least(&shifts), x1 - most(&shifts));
    let (y0, y1) = (y0 - least(&[yz]), y1 - most(&[yz]));
    Cell { origin: [x0, y0, z0], edges: [[x1 - x0, 0.0, 0.0], [xy, y1 - y0, 0.0], [xz, yz, z1 - z0]] }
}

fn read_atoms(
    source: &mut Source<'_>,
    particles: u64,
    cell: Option<Cell>,
    columns: &str,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let path = source.path().to_owned();
    let names: Vec<String> = columns.split_whitespace().map(String::from).collect();
    if names.len() > MAX_COLUMNS {
        return Err(source.fail(format!("{} columns: the limit is {MAX_COLUMNS}", names.len())));
    }
    let find = |wanted: &str| names.iter().position(|n| n == wanted);
    let found = POSITIONS
        .iter()
        .find_map(|&(wanted, is_scaled)| Some(([find(wanted[0])?, find(wanted[1])?, find(wanted[2])?], is_scaled)));
    let Some((position, is_scaled)) = found else {
        let what = format!("the atoms have no x y z, xu yu zu, xs ys zs or xsu ysu zsu, but: {}", names.join(", "));
        return Err(source.fail(what));
    };
    let rows = rows(source, particles, &names, position, options)?;
    let capacity = source.room(particles, 2 * names.len() as u64, "atoms")?;
    let mut table = rows.table(&path, options, capacity)?;
    rows.read(source, Extent::Lines(particles), &mut table)?;
    let mut particles = table.finish();
    if is_scaled {
        let cell = cell.ok_or_else(|| source.fail("scaled coordinates, but no BOX BOUNDS before them"))?;
        unscale(&mut particles.positions, cell);
    }
    Ok(particles)
}

fn rows(
    source: &mut Source<'_>,
    particles: u64,
    names: &[String],
    position: [usize; 3],
    options: &ReadOptions,
) -> Result<Rows, Error> {
    let bytes = source.peek(64 << 10)?;
    let end = bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len());
    let first: Vec<bool> =
        fields(&bytes[..end], Separator::Blank).map(|field| number(field, Separator::Blank).is_some()).collect();
    let is_number = |i: usize| particles == 0 || first.get(i).copied().unwrap_or(true);
    let usable: Vec<usize> = (0..names.len()).filter(|&i| !position.contains(&i) && is_number(i)).collect();
    let usable_names: Vec<String> = usable.iter().map(|&i| names[i].clone()).collect();
    let mut groups = names::group(&usable_names);
    for column in groups.attributes.iter_mut().flat_map(|g| &mut g.columns) {
        *column = usable[*column];
    }
    let scalar = |name: &String| if INTEGERS.contains(&name.as_str()) { Scalar::I64 } else { Scalar::F64 };
    let mut scalars: Vec<Scalar> = names.iter().map(scalar).collect();
    position.iter().for_each(|&i| scalars[i] = Scalar::F64);
    Rows::new(source.path(), Separator::Blank, &scalars, position, groups, options)
}

/// From units of the box to lengths.
fn unscale(positions: &mut PositionData, cell: Cell) {
    let [a, b, c] = cell.edges;
    let place =
        |s: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| cell.origin[i] + s[0] * a[i] + s[1] * b[i] + s[2] * c[i]) };
    match positions {
        PositionData::F64(positions) => positions.par_iter_mut().for_each(|p| *p = place(*p)),
        PositionData::F32(positions) => {
            positions.par_iter_mut().for_each(|p| *p = place(p.map(f64::from)).map(|x| x as f32));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_of_a_tilted_box_enclose_it() {
        // Box from (1, 2, 3) with sides 4, 5, 6 and tilts -1, 2, 0.5.
        let cell = tilted([[1.0 - 1.0, 1.0 + 4.0 + 2.0, -1.0, 0.0], [2.0, 7.5, 2.0, 0.0], [3.0, 9.0, 0.5, 0.0]]);
        let expected = Cell { origin: [1.0, 2.0, 3.0], edges: [[4.0, 0.0, 0.0], [-1.0, 5.0, 0.0], [2.0, 0.5, 6.0]] };
        assert_eq!(cell, expected);
        let mut positions = PositionData::F64(vec![[0.5, 0.5, 0.5], [0.0; 3]]);
        unscale(&mut positions, cell);
        assert_eq!(positions, PositionData::F64(vec![[3.5, 4.75, 6.0], [1.0, 2.0, 3.0]]));
    }
}
