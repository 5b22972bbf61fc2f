//! NRRD: `.nrrd` with the data behind the header, and `.nhdr` with the data beside it; raw, gzip and text.
//!
//! A fourth axis that is not of space (its direction is `none`, or its kind says so) is one of components, if it is the first, or
//! of time steps, if it is the last. `axis mins` of cells are moved to their centres.
//!
//! Source: "Definition of NRRD File Format", <https://teem.sourceforge.net/nrrd/format.html>.

use std::collections::HashMap;
use std::path::Path;

use super::data::{self, Packing};
use super::file::{Numbers, Stream, VolumeFile};
use super::grid::Grid;
use super::header::{Space, VolumeOptions, check_dims};
use super::mha::{list, skip_frames};
use super::text::{self, MAX_LINES};
use crate::error::Error;
use crate::formats::detect;
use crate::scalar::{Encoding, Endian, Scalar};
use crate::source::Source;

/// The fields of a header, by their names without blanks.
struct Fields(HashMap<String, String>);

/// Which of the axes are those of space, and what a fourth one counts.
struct Axes {
    count: usize,
    /// The first axis of space.
    first: usize,
    components: usize,
    frames: usize,
    dims: [u64; 3],
}

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.refuse_array(path, "NRRD")?;
    let mut source = Source::open(path)?;
    source.set_text(true);
    let fields = Fields::read(&mut source)?;
    let axes = Axes::of(&source, &fields)?;
    options.check_frame(path, axes.frames)?;
    let component = options.component(path, axes.components)?;
    let samples = check_dims(&source, axes.dims)?.iter().product::<usize>() as u64;
    let scalar = fields.scalar(&source)?;
    let grid = fields.grid(&source, &axes)?;
    let (encoding, packing) = fields.encoding(&source, scalar)?;
    let bytes = samples.saturating_mul((scalar.size() * axes.components) as u64).saturating_mul(axes.frames as u64);
    let mut data = fields.open_data(&mut source, packing, bytes, options)?;
    data.set_text(encoding == Encoding::Ascii);
    let numbers = Numbers { components: axes.components, component, ..Numbers::new(encoding, scalar) };
    skip_frames(&mut data, numbers, samples, options.frame)?;
    VolumeFile::of_stream(axes.dims, Stream { source: data, numbers }, |header| {
        (header.grid, header.frames) = (grid, axes.frames);
        (header.components, header.component) = (axes.components, component);
        header.unit = fields.unit(&axes);
        header.space = fields.space();
    })
}

impl Axes {
    fn of(source: &Source<'_>, fields: &Fields) -> Result<Axes, Error> {
        let wrong = |what: String| source.unsupported(what);
        let sizes = fields.required(source, "sizes")?;
        let Some(sizes) = text::sizes(sizes) else {
            return Err(wrong(format!(
                "the array has the sizes {sizes}: 3, or 4 with components or time steps, are read"
            )));
        };
        if fields.get("dimension").and_then(|n| n.parse().ok()) != Some(sizes.len()) {
            return Err(source.fail("the 'dimension' is not the number of 'sizes'"));
        }
        match *sizes.as_slice() {
            [x, y, z] => Ok(Axes { count: 3, first: 0, components: 1, frames: 1, dims: [x, y, z] }),
            [a, b, c, d] if fields.is_of_space(0, 4) == Some(false) => {
                let components = usize::try_from(a).ok().filter(|n| (1..=4096).contains(n));
                let Some(components) = components else {
                    return Err(wrong(format!("{a} components: 1 to 4096 are read")));
                };
                Ok(Axes { count: 4, first: 1, components, frames: 1, dims: [b, c, d] })
            }
            [a, b, c, d] if fields.is_of_space(3, 4) != Some(true) => {
                let frames = usize::try_from(d).ok().filter(|&n| n > 0);
                let Some(frames) = frames else { return Err(source.fail("there are no time steps")) };
                Ok(Axes { count: 4, first: 0, components: 1, frames, dims: [a, b, c] })
            }
            ref other => Err(wrong(format!(
                "the array has the sizes {other:?}: a volume has 3 axes of space, and perhaps one of components before them or \
                 one of time steps behind them"
            ))),
        }
    }
}

impl Fields {
    fn read(source: &mut Source<'_>) -> Result<Fields, Error> {
        let head = source.peek(64)?;
        if !head.starts_with(b"NRRD00") {
            let what = detect::mismatch("a NRRD file", &head[..head.len().min(64)]);
            return Err(source.fail(what));
        }
        source.line()?;
        let mut fields = HashMap::new();
        for _ in 0..MAX_LINES {
            // A header by itself ends with its file.
            let Some(line) = source.line()? else { break };
            if line.is_empty() {
                break;
            }
            let line = String::from_utf8_lossy(line).into_owned();
            if line.starts_with('#') || line.contains(":=") {
                continue;
            }
            let Some((key, value)) = line.split_once(':') else {
                return Err(source.fail("this line is not 'field: description', as those of a NRRD header are"));
            };
            let key: String = key.chars().filter(|c| *c != ' ').flat_map(char::to_lowercase).collect();
            let is_list = key == "datafile" && value.trim().starts_with("LIST");
            fields.insert(key, value.trim().to_owned());
            if is_list {
                break;
            }
        }
        Ok(Fields(fields))
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    fn required(&self, source: &Source<'_>, key: &str) -> Result<&str, Error> {
        self.get(key).ok_or_else(|| source.fail(format!("the header has no '{key}'")))
    }

    /// Whether an axis is one of space; `None` if the header does not tell.
    fn is_of_space(&self, axis: usize, axes: usize) -> Option<bool> {
        if let Some(directions) = self.get("spacedirections").and_then(|text| vectors(text, axes)) {
            return Some(directions[axis].is_some());
        }
        let kinds: Vec<&str> = self.get("kinds")?.split_ascii_whitespace().collect();
        match *kinds.get(axis)? {
            "domain" | "space" => Some(true),
            "???" | "none" => None,
            _ => Some(false),
        }
    }

    fn scalar(&self, source: &Source<'_>) -> Result<Scalar, Error> {
        let name = self.required(source, "type")?;
        Ok(match name.to_ascii_lowercase().as_str() {
            "signed char" | "int8" | "int8_t" => Scalar::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
            "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => Scalar::I64,
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Scalar::U64,
            "float" => Scalar::F32,
            "double" => Scalar::F64,
            _ => {
                let what =
                    format!("the type '{name}' is not known: integers of 8 to 64 bits, float and double are read");
                return Err(source.unsupported(what));
            }
        })
    }

    fn encoding(&self, source: &Source<'_>, scalar: Scalar) -> Result<(Encoding, Packing), Error> {
        let endian = match self.get("endian").map(str::to_ascii_lowercase).as_deref() {
            Some("big") => Endian::Big,
            Some("little") => Endian::Little,
            Some(other) => return Err(source.fail(format!("endian '{other}' is neither little nor big"))),
            None => Endian::Little,
        };
        let name = self.required(source, "encoding")?.to_ascii_lowercase();
        let is_text = matches!(name.as_str(), "txt" | "text" | "ascii");
        if self.get("endian").is_none() && scalar.size() > 1 && !is_text {
            return Err(source.fail("the header tells no 'endian', which numbers of several bytes need"));
        }
        match name.as_str() {
            "raw" => Ok((Encoding::Binary(endian), Packing::Plain)),
            "gz" | "gzip" => Ok((Encoding::Binary(endian), Packing::Gzip)),
            "txt" | "text" | "ascii" => Ok((Encoding::Ascii, Packing::Plain)),
            _ => {
                let what = format!("the encoding '{name}' is not read: write the file as raw, gzip or text");
                Err(source.unsupported(what))
            }
        }
    }

    /// The data from their first byte on; `source` is behind the header.
    fn open_data(
        &self,
        source: &mut Source<'static>,
        packing: Packing,
        bytes: u64,
        options: &VolumeOptions,
    ) -> Result<Source<'static>, Error> {
        let path = source.path().to_owned();
        let lines: u64 = self.number(source, "lineskip")?;
        let skip: i64 = self.number(source, "byteskip")?;
        let is_plain = packing == Packing::Plain;
        let mut data = match self.get("datafile") {
            None => data::open(&path, source.offset(), packing, options)?,
            Some(name) => {
                let words: Vec<&str> = name.split_ascii_whitespace().collect();
                let range: Vec<i64> = words.iter().skip(1).filter_map(|word| word.parse().ok()).collect();
                let several = match (words.as_slice(), range.as_slice()) {
                    (["LIST", ..], _) => Some(list(source)?),
                    ([pattern, ..], &[first, last, step, ..]) => {
                        Some(text::pattern(source, pattern, [first, last, step])?)
                    }
                    _ => None,
                };
                match several {
                    None => data::open_beside(&path, name, 0, packing, options)?,
                    Some(names) if is_plain && lines == 0 => {
                        let skip =
                            u64::try_from(skip).map_err(|_| source.unsupported("'byte skip' -1 with several files"))?;
                        return data::joined(&path, &names, skip);
                    }
                    Some(_) => return Err(source.unsupported("several files of data that are not raw are not read")),
                }
            }
        };
        for _ in 0..lines {
            data.line()?;
        }
        match u64::try_from(skip) {
            Ok(skip) => data.skip(skip, "the bytes to skip")?,
            Err(_) if skip == -1 && is_plain => {
                data.skip(data.remaining().saturating_sub(bytes), "the bytes to skip")?;
            }
            Err(_) => return Err(source.fail("'byte skip' is negative")),
        }
        Ok(data)
    }

    /// A whole number; 0 where the field is not there.
    fn number<T: std::str::FromStr + Default>(&self, source: &Source<'_>, key: &str) -> Result<T, Error> {
        let Some(text) = self.get(key) else { return Ok(T::default()) };
        text.parse().map_err(|_| source.fail(format!("'{text}' is not a number, in '{key}'")))
    }

    fn grid(&self, source: &Source<'_>, axes: &Axes) -> Result<Grid, Error> {
        let wrong = |key: &str| source.fail(format!("the header's '{key}' are not what they should be"));
        let count = axes.count;
        let mut grid = Grid::default();
        let directions = self.get("spacedirections");
        if let Some(text) = directions {
            let directions = vectors(text, count).ok_or_else(|| wrong("space directions"))?;
            for axis in 0..3 {
                grid.steps[axis] = directions[axes.first + axis].ok_or_else(|| wrong("space directions"))?;
            }
        } else if let Some(text) = self.get("spacings") {
            let spacings = list_of(text, count, axes.first).ok_or_else(|| wrong("spacings"))?;
            grid = Grid::new([0.0; 3], spacings.map(|spacing| if spacing.is_nan() { 1.0 } else { spacing }));
        }
        if let Some(text) = self.get("spaceorigin") {
            grid.origin = vectors(text, 1).and_then(|found| found[0]).ok_or_else(|| wrong("space origin"))?;
        } else if let Some(text) = self.get("axismins") {
            let mins = list_of(text, count, axes.first).ok_or_else(|| wrong("axis mins"))?;
            let centers = self.get("centerings").or(self.get("centers")).unwrap_or_default();
            let is_cell = |axis: usize| centers.split_whitespace().nth(axes.first + axis) == Some("cell");
            for axis in (0..3).filter(|&axis| !mins[axis].is_nan()) {
                let half = if is_cell(axis) { 0.5 * grid.steps[axis][axis] } else { 0.0 };
                grid.origin[axis] = mins[axis] + half;
            }
        }
        Ok(grid)
    }

    /// Whose directions the axes of space are.
    fn space(&self) -> Space {
        match self.get("space").unwrap_or_default().to_ascii_lowercase().as_str() {
            "ras" | "right-anterior-superior" => Space::Ras,
            "lps" | "left-posterior-superior" => Space::Lps,
            _ => Space::Unknown,
        }
    }

    /// The unit of space, such as `mm`, if all axes have one.
    fn unit(&self, axes: &Axes) -> String {
        let (text, first) = match (self.get("spaceunits"), self.get("units")) {
            (Some(text), _) => (text, 0),
            (None, Some(text)) => (text, axes.first),
            _ => return String::new(),
        };
        let units: Vec<&str> = text.split('"').skip(1).step_by(2).skip(first).take(3).collect();
        match units.as_slice() {
            [a, b, c] if a == b && b == c => (*a).to_owned(),
            _ => String::new(),
        }
    }
}

/// Vectors such as `(1,0,0)` and `none`, so many.
fn vectors(text: &str, count: usize) -> Option<Vec<Option<[f64; 3]>>> {
    let (mut rest, mut vectors) = (text.trim(), Vec::new());
    while !rest.is_empty() && vectors.len() < count {
        if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            rest = after.trim_start();
            continue;
        }
        let (inner, after) = rest.strip_prefix('(')?.split_once(')')?;
        vectors.push(Some(text::numbers(inner)?));
        rest = after.trim_start();
    }
    (vectors.len() == count && rest.is_empty()).then_some(vectors)
}

/// Three numbers of a list of `count`, from the `first` on; `nan` where an axis has none.
fn list_of(text: &str, count: usize, first: usize) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    numbers.filter(|numbers| numbers.len() == count)?.get(first..first + 3)?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_may_be_none_and_must_be_as_many_as_axes() {
        let found = vectors("none (1,0,0) (0, -2.5,0)  (0,0,3e1)", 4).unwrap();
        assert_eq!(found, [None, Some([1.0, 0.0, 0.0]), Some([0.0, -2.5, 0.0]), Some([0.0, 0.0, 30.0])]);
        assert!(vectors("(1,0,0) (0,1,0)", 3).is_none());
        assert!(vectors("(1,0) (0,1,0) (0,0,1)", 3).is_none());
        assert!(vectors("(1,0,0) (0,1,0) (0,0,1) x", 3).is_none());
        assert_eq!(list_of("nan 1 2 3", 4, 1), Some([1.0, 2.0, 3.0]));
    }
}
