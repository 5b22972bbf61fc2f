//! MetaImage: `.mha`, header and data in one file, and `.mhd` with the data beside it, in one file or in several.
//!
//! Of 4 dimensions the last counts time steps. Compressed data are one zlib stream (or gzip). Rows of `TransformMatrix` are the
//! directions of the axes, as ITK has them. `MET_LONG` is of 4 or 8 bytes, whichever fits the file.
//!
//! Source: "MetaIO: Reference: Tag Definitions", <https://itk.org/Wiki/MetaIO/Documentation>.

use std::path::Path;

use super::data::{self, Packing, beside};
use super::file::{Numbers, Stream, VolumeFile};
use super::grid::Grid;
use super::header::{Space, VolumeOptions, check_dims};
use super::text::{self, MAX_LINES};
use crate::error::Error;
use crate::scalar::{Encoding, Endian, Scalar};
use crate::source::Source;

/// What the header says.
struct Header {
    sizes: Vec<u64>,
    scalar: Scalar,
    /// Whether the type is one of 4 or 8 bytes.
    is_long: bool,
    components: usize,
    encoding: Encoding,
    is_compressed: bool,
    /// Bytes before the data in their file; `None`: as many as there are too many.
    skip: Option<u64>,
    grid: Grid,
    data: String,
}

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.refuse_array(path, "MetaImage")?;
    let mut source = Source::open(path)?;
    source.set_text(true);
    let mut header = Header::read(&mut source)?;
    source.set_text(false);
    let frames = frames(&source, &header.sizes)?;
    options.check_frame(path, frames)?;
    let component = options.component(path, header.components)?;
    let dims = [header.sizes[0], header.sizes[1], header.sizes[2]];
    let samples = check_dims(&source, dims)?.iter().product::<usize>() as u64;
    let mut data = header.open_data(&mut source, options)?;
    if header.is_long && holds(&data, samples, &header, frames, 8) {
        header.scalar = if header.scalar == Scalar::I32 { Scalar::I64 } else { Scalar::U64 };
    }
    let frame = samples.saturating_mul((header.scalar.size() * header.components) as u64);
    if header.skip.is_none() {
        let all = frame.saturating_mul(frames as u64);
        let before = data.remaining().saturating_sub(all);
        data.skip(before, "what stands before the samples")?;
    }
    let numbers = Numbers { components: header.components, component, ..Numbers::new(header.encoding, header.scalar) };
    skip_frames(&mut data, numbers, samples, options.frame)?;
    VolumeFile::of_stream(dims, Stream { source: data, numbers }, |h| {
        (h.grid, h.frames, h.space) = (header.grid, frames, Space::Lps);
        (h.components, h.component) = (header.components, component);
    })
}

/// How many time steps there are.
fn frames(source: &Source<'_>, sizes: &[u64]) -> Result<usize, Error> {
    match *sizes {
        [_, _, _] => Ok(1),
        [_, _, _, frames] if frames > 0 => Ok(usize::try_from(frames).unwrap_or(usize::MAX)),
        _ => Err(source.unsupported(format!(
            "the image has the size {sizes:?}: a volume has three dimensions, or a fourth of time steps"
        ))),
    }
}

/// Passes over the time steps before the one that is wanted.
pub(super) fn skip_frames(source: &mut Source<'_>, numbers: Numbers, samples: u64, frame: usize) -> Result<(), Error> {
    let values = samples.saturating_mul(numbers.components as u64).saturating_mul(frame as u64);
    match numbers.encoding {
        Encoding::Binary(_) => source.skip(values.saturating_mul(numbers.scalar.size() as u64), "earlier time steps"),
        Encoding::Ascii => {
            source.room(values, 2, "numbers of earlier time steps")?;
            for _ in 0..values {
                source.token()?;
            }
            Ok(())
        }
    }
}

/// Whether plain data have just the size of numbers of `size` bytes.
fn holds(data: &Source<'_>, samples: u64, header: &Header, frames: usize, size: u64) -> bool {
    let all = samples.saturating_mul(header.components as u64).saturating_mul(frames as u64);
    matches!(header.encoding, Encoding::Binary(_))
        && !data.is_inflating()
        && data.remaining() == all.saturating_mul(size)
}

impl Header {
    fn read(source: &mut Source<'_>) -> Result<Header, Error> {
        let mut header = Header {
            sizes: Vec::new(),
            scalar: Scalar::U8,
            is_long: false,
            components: 1,
            encoding: Encoding::Binary(Endian::Little),
            is_compressed: false,
            skip: Some(0),
            grid: Grid::default(),
            data: String::new(),
        };
        let (mut spacing, mut size, mut kind, mut is_binary, mut is_big) = (None, None, None, true, false);
        for _ in 0..MAX_LINES {
            let Some(line) = source.line()? else {
                return Err(source.fail("there is no ElementDataFile: this is no MetaImage, or it is cut short"));
            };
            let line = String::from_utf8_lossy(line).into_owned();
            let Some((key, value)) = line.split_once('=').map(|(key, value)| (key.trim(), value.trim())) else {
                if line.trim().is_empty() {
                    continue;
                }
                return Err(source.fail("this line is not 'key = value', as those of a MetaImage's header are"));
            };
            let wrong = || source.fail(format!("{key} = {value} is not understood"));
            match key {
                "NDims" if !matches!(value, "3" | "4") => {
                    let what =
                        format!("an image of {value} dimensions: those of 3, and of 4 with time steps, are read");
                    return Err(source.unsupported(what));
                }
                "DimSize" => header.sizes = text::sizes(value).ok_or_else(wrong)?,
                "ElementSpacing" => spacing = Some(first_three(value).ok_or_else(wrong)?),
                "ElementSize" => size = Some(first_three(value).ok_or_else(wrong)?),
                "Offset" | "Origin" | "Position" => header.grid.origin = first_three(value).ok_or_else(wrong)?,
                "TransformMatrix" | "Rotation" | "Orientation" => {
                    header.grid.steps = matrix(value).ok_or_else(wrong)?
                }
                "ElementType" => kind = Some(value.to_owned()),
                "ElementNumberOfChannels" => {
                    header.components =
                        value.parse().ok().filter(|components| (1..=4096).contains(components)).ok_or_else(wrong)?;
                }
                "BinaryData" => is_binary = is_true(value),
                "BinaryDataByteOrderMSB" | "ElementByteOrderMSB" => is_big = is_true(value),
                "CompressedData" => header.is_compressed = is_true(value),
                "HeaderSize" => {
                    header.skip = if value == "-1" { None } else { Some(value.parse().map_err(|_| wrong())?) }
                }
                "ElementDataFile" => {
                    value.clone_into(&mut header.data);
                    break;
                }
                _ => {}
            }
        }
        if header.sizes.is_empty() || header.data.is_empty() {
            return Err(source.fail("the header tells no DimSize or no ElementDataFile"));
        }
        let Some(kind) = kind else { return Err(source.fail("the header tells no ElementType")) };
        (header.scalar, header.is_long) = element_type(source, &kind)?;
        let endian = if is_big { Endian::Big } else { Endian::Little };
        header.encoding = if is_binary { Encoding::Binary(endian) } else { Encoding::Ascii };
        let spacing = spacing.or(size).unwrap_or([1.0; 3]);
        for (step, length) in header.grid.steps.iter_mut().zip(spacing) {
            step.iter_mut().for_each(|x| *x *= length);
        }
        Ok(header)
    }

    /// The data from their first byte on; `source` is behind the header.
    fn open_data(&self, source: &mut Source<'static>, options: &VolumeOptions) -> Result<Source<'static>, Error> {
        let path = source.path().to_owned();
        let skip = self.skip.unwrap_or(0);
        let mut words = self.data.split_ascii_whitespace();
        let first = words.next().unwrap_or_default();
        let range: Vec<i64> = words.clone().filter_map(|word| word.parse().ok()).collect();
        if first == "LIST" {
            let names = list(source)?;
            return self.join(source, &names, skip);
        }
        if first.contains('%') && matches!(range.len(), 2 | 3) {
            let range = [range[0], range[1], range.get(2).copied().unwrap_or(1)];
            return self.join(source, &text::pattern(source, first, range)?, skip);
        }
        let is_local = self.data.eq_ignore_ascii_case("local");
        let (file, skip) =
            if is_local { (path, source.offset().saturating_add(skip)) } else { (beside(&path, &self.data), skip) };
        let open = self.packing(&file, skip).and_then(|packing| data::open(&file, skip, packing, options));
        open.map_err(|error| data::missing(source.path(), error))
    }

    fn join(&self, source: &Source<'_>, names: &[String], skip: u64) -> Result<Source<'static>, Error> {
        if self.is_compressed {
            return Err(source.unsupported("compressed data in several files are not read: decompress them first"));
        }
        data::joined(source.path(), names, skip)
    }

    /// ITK writes zlib; others have been seen to write gzip.
    fn packing(&self, file: &Path, skip: u64) -> Result<Packing, Error> {
        if !self.is_compressed {
            return Ok(Packing::Plain);
        }
        let mut data = Source::open(file)?;
        data.skip(skip, "what stands before the samples")?;
        let is_gzip = data.peek(2)?.starts_with(&crate::formats::detect::GZIP);
        Ok(if is_gzip { Packing::Gzip } else { Packing::Zlib })
    }
}

/// The names that follow `LIST`, a line each.
pub(super) fn list(source: &mut Source<'_>) -> Result<Vec<String>, Error> {
    let mut names = Vec::new();
    while let Some(line) = source.line()? {
        let name = String::from_utf8_lossy(line).trim().to_owned();
        if !name.is_empty() {
            names.push(name);
        }
        if names.len() > data::MAX_FILES {
            return Err(source.fail(format!("more than {} files of data", data::MAX_FILES)));
        }
    }
    Ok(names)
}

/// Of 4 numbers the last is about time.
fn first_three(text: &str) -> Option<[f64; 3]> {
    text::numbers::<3>(text).or_else(|| text::numbers::<4>(text).map(|[x, y, z, _]| [x, y, z]))
}

fn matrix(text: &str) -> Option<[[f64; 3]; 3]> {
    if let Some([a, b, c, d, e, f, g, h, i]) = text::numbers::<9>(text) {
        return Some([[a, b, c], [d, e, f], [g, h, i]]);
    }
    let of_four = text::numbers::<16>(text)?;
    Some([0, 4, 8].map(|row| [of_four[row], of_four[row + 1], of_four[row + 2]]))
}

fn is_true(text: &str) -> bool {
    matches!(text.bytes().next(), Some(b'T' | b't' | b'Y' | b'y' | b'1'))
}

fn element_type(source: &Source<'_>, name: &str) -> Result<(Scalar, bool), Error> {
    let scalar = match name.strip_suffix("_ARRAY").unwrap_or(name) {
        "MET_CHAR" | "MET_ASCII_CHAR" => Scalar::I8,
        "MET_UCHAR" => Scalar::U8,
        "MET_SHORT" => Scalar::I16,
        "MET_USHORT" => Scalar::U16,
        "MET_INT" => Scalar::I32,
        "MET_UINT" => Scalar::U32,
        "MET_LONG" => return Ok((Scalar::I32, true)),
        "MET_ULONG" => return Ok((Scalar::U32, true)),
        "MET_LONG_LONG" => Scalar::I64,
        "MET_ULONG_LONG" => Scalar::U64,
        "MET_FLOAT" => Scalar::F32,
        "MET_DOUBLE" => Scalar::F64,
        _ => {
            let what = format!("the element type '{name}' is not known: MET_UCHAR to MET_DOUBLE are read");
            return Err(source.unsupported(what));
        }
    };
    Ok((scalar, false))
}
