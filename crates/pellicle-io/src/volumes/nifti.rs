//! NIfTI-1 and NIfTI-2: `.nii`, `.nii.gz`, and pairs of `.hdr` and `.img`, either byte order.
//!
//! The place of samples is that of the *sform* if there is one, else of the *qform*, else they lie at multiples of the spacing. The
//! coordinates are the file's: x to the right of the patient, y to the front, z up. The fourth dimension counts time steps, the
//! fifth components.
//!
//! Source: "NIfTI-1 Data Format", <https://nifti.nimh.nih.gov/nifti-1>, `nifti1.h` and `nifti2.h`.

use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use super::data::{self, Packing};
use super::file::{Numbers, Stream, VolumeFile};
use super::grid::Grid;
use super::header::{Scaling, Space, VolumeOptions, check_dims};
use crate::error::Error;
use crate::formats::detect::{self, GZIP};
use crate::scalar::{Encoding, Endian, Sample, Scalar};
use crate::source::{self, Source};

/// What the header says.
struct Header {
    /// From the first on; those that are not used are 1.
    dims: [u64; 7],
    datatype: i64,
    endian: Endian,
    /// `qfac`, then the spacing of x, y, z.
    pixdim: [f64; 4],
    offset: f64,
    slope: f64,
    intercept: f64,
    qform: i64,
    sform: i64,
    /// b, c, d, then the place of the first sample.
    quaternion: [f64; 6],
    /// Three rows of four.
    affine: [f64; 12],
    unit: i64,
    /// Whether the samples are in a file of their own.
    is_pair: bool,
}

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.refuse_array(path, "NIfTI")?;
    let (head, samples_in) = files(path)?;
    let mut source = open_header(&head).map_err(|error| data::missing(path, error))?;
    let header = Header::read(&mut source)?;
    let [x, y, z, frames, components, ..] = header.dims;
    let samples = check_dims(&source, [x, y, z])?.iter().product::<usize>() as u64;
    let (Ok(frames), Ok(planes)) = (usize::try_from(frames), usize::try_from(components)) else {
        return Err(source.fail("there are more time steps and components than can be counted"));
    };
    options.check_frame(path, frames)?;
    let (scalar, together) = data_type(&source, header.datatype)?;
    if together > 1 && planes > 1 {
        return Err(source.unsupported("colours with a fifth dimension are not read"));
    }
    let components = together * planes;
    let component = options.component(path, components)?;
    let grid = header.grid(&source)?;
    let data_file = if header.is_pair { samples_in } else { head };
    let least = if header.is_pair { 0.0 } else { source.offset() as f64 };
    if !(header.offset >= least && header.offset < 2f64.powi(53)) {
        let what = format!("the samples are said to begin at byte {}, within the header or nowhere", header.offset);
        return Err(source.fail(what));
    }
    let is_packed = is_gzip(&data_file).map_err(|error| data::missing(path, error))?;
    let packing = if is_packed { Packing::Gzip } else { Packing::Plain };
    let mut data = data::open(&data_file, 0, packing, options)?;
    data.skip(header.offset as u64, "what stands before the samples")?;
    // Time steps lie within components.
    let plane = if planes > 1 { component } else { 0 };
    let before = (plane as u64).saturating_mul(frames as u64).saturating_add(options.frame as u64);
    let bytes = before.saturating_mul(samples).saturating_mul((scalar.size() * together) as u64);
    data.skip(bytes, "earlier time steps and components")?;
    let component_of = if together > 1 { component } else { 0 };
    let numbers = Numbers {
        components: together,
        component: component_of,
        ..Numbers::new(Encoding::Binary(header.endian), scalar)
    };
    VolumeFile::of_stream([x, y, z], Stream { source: data, numbers }, |h| {
        (h.grid, h.frames) = (grid, frames);
        (h.components, h.component) = (components, component);
        h.scaling = header.scaling();
        h.unit = header.unit();
        h.space = Space::Ras;
    })
}

/// Header and data of what is named, which may be the same file.
fn files(path: &Path) -> Result<(PathBuf, PathBuf), Error> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let swap = |from: &str, to: &str| {
        let lower = name.to_ascii_lowercase();
        let stem = lower.strip_suffix(from).or_else(|| lower.strip_suffix(&format!("{from}.gz")))?;
        // Extensions keep their case.
        let found = &name[stem.len()..];
        let to = if found.chars().nth(1).is_some_and(char::is_uppercase) { to.to_uppercase() } else { to.into() };
        let candidates = [format!("{}{to}", &name[..stem.len()]), format!("{}{to}.gz", &name[..stem.len()])];
        let candidates = candidates.map(|name| path.with_file_name(name));
        Some(candidates.iter().find(|path| path.is_file()).unwrap_or(&candidates[0]).clone())
    };
    if let Some(header) = swap(".img", ".hdr") {
        return Ok((header, path.into()));
    }
    let data = swap(".hdr", ".img").unwrap_or_else(|| path.into());
    Ok((path.into(), data))
}

fn is_gzip(path: &Path) -> Result<bool, Error> {
    Ok(Source::open(path)?.peek(2)?.starts_with(&GZIP))
}

fn open_header(path: &Path) -> Result<Source<'static>, Error> {
    if !is_gzip(path)? {
        return Source::open(path);
    }
    let (file, len) = source::open(path)?;
    Ok(Source::inflating(path, MultiGzDecoder::new(file), source::inflated_limit(len)))
}

/// The numbers of a header, by their place.
struct Bytes<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl Bytes<'_> {
    fn at<T: Sample>(&self, offset: usize) -> T {
        T::read(&self.bytes[offset..], self.endian)
    }

    fn reals<const N: usize>(&self, offset: usize, is_second: bool) -> [f64; N] {
        std::array::from_fn(|i| match is_second {
            false => self.at::<f32>(offset + 4 * i).to_f64(),
            true => self.at::<f64>(offset + 8 * i),
        })
    }
}

impl Header {
    fn read(source: &mut Source<'_>) -> Result<Header, Error> {
        const SIZES: [i32; 2] = [348, 540];
        let head = source.peek(4)?;
        let first = head.first_chunk::<4>().copied().unwrap_or_default();
        let endian = if SIZES.contains(&i32::from_be_bytes(first)) { Endian::Big } else { Endian::Little };
        let size = i32::read(&first, endian);
        if !SIZES.contains(&size) {
            let head = source.peek(64)?;
            let what = detect::mismatch("a NIfTI file", &head[..head.len().min(64)]);
            return Err(source.fail(what));
        }
        let is_second = size == SIZES[1];
        let bytes = source.exact(size as usize, "the header")?.to_vec();
        let magic = if is_second { &bytes[4..12] } else { &bytes[344..348] };
        let is_pair = magic.starts_with(b"ni");
        let version = if is_second { b'2' } else { b'1' };
        if !(is_pair || magic.starts_with(b"n+")) || magic[2] != version {
            let what = "the header has the size of a NIfTI header, but not its mark: it may be one of ANALYZE 7.5, which is not \
                        read (convert it to NIfTI)";
            return Err(source.unsupported(what));
        }
        let bytes = Bytes { bytes: &bytes, endian };
        let dim = |i: usize| if is_second { bytes.at::<i64>(16 + 8 * i) } else { bytes.at::<i16>(40 + 2 * i).into() };
        let rank = dim(0);
        let dims: [i64; 7] = std::array::from_fn(|i| if (i as i64) < rank { dim(i + 1) } else { 1 });
        let used = dims.map(|n| u64::try_from(n).ok().filter(|&n| n > 0));
        let (3..=7, [Some(x), Some(y), Some(z), Some(t), Some(c), Some(1), Some(1)]) = (rank, used) else {
            let what = format!(
                "the image has {rank} dimensions, {dims:?}: a volume has 3, then perhaps time steps and components, none of \
                 them empty"
            );
            return Err(source.unsupported(what));
        };
        let pixdim = bytes.reals(if is_second { 104 } else { 76 }, is_second);
        let (offset, [slope, intercept]) = match is_second {
            false => (f64::from(bytes.at::<f32>(108)), bytes.reals(112, false)),
            true => (bytes.at::<i64>(168) as f64, bytes.reals(176, true)),
        };
        let code = |first: usize, second: usize| match is_second {
            false => i64::from(bytes.at::<i16>(first)),
            true => i64::from(bytes.at::<i32>(second)),
        };
        let datatype = i64::from(bytes.at::<i16>(if is_second { 12 } else { 70 }));
        let (qform, sform) = (code(252, 344), code(254, 348));
        let unit = if is_second { i64::from(bytes.at::<i32>(500)) } else { i64::from(bytes.at::<u8>(123)) };
        Ok(Header {
            dims: [x, y, z, t, c, 1, 1],
            datatype,
            endian,
            pixdim,
            offset,
            slope,
            intercept,
            qform,
            sform,
            quaternion: bytes.reals(if is_second { 352 } else { 256 }, is_second),
            affine: bytes.reals(if is_second { 400 } else { 280 }, is_second),
            unit,
            is_pair,
        })
    }

    /// A slope of 0, or one that is no number, means that the samples are the values.
    fn scaling(&self) -> Scaling {
        if self.slope == 0.0 || !self.slope.is_finite() || !self.intercept.is_finite() {
            return Scaling::default();
        }
        Scaling { slope: self.slope, intercept: self.intercept }
    }

    fn unit(&self) -> String {
        match self.unit & 7 {
            1 => "m",
            2 => "mm",
            3 => "µm",
            _ => "",
        }
        .to_owned()
    }

    fn grid(&self, source: &Source<'_>) -> Result<Grid, Error> {
        let [qfac, x, y, z] = self.pixdim;
        let grid = if self.sform > 0 {
            let column = |i: usize| [self.affine[i], self.affine[4 + i], self.affine[8 + i]];
            Grid { origin: column(3), steps: [column(0), column(1), column(2)] }
        } else if self.qform > 0 {
            let [b, c, d, origin @ ..] = self.quaternion;
            let [i, j, k] = rotation([b, c, d]);
            let flip = if qfac < 0.0 { -1.0 } else { 1.0 };
            Grid { origin, steps: [i.map(|v| v * x), j.map(|v| v * y), k.map(|v| v * z * flip)] }
        } else {
            // Files whose spacing was never set have 0 there.
            Grid::new([0.0; 3], [x, y, z].map(|spacing| if spacing == 0.0 { 1.0 } else { spacing }))
        };
        grid.check(source)?;
        Ok(grid)
    }
}

/// The directions of the axes by the quaternion (a, b, c, d) of length 1, whose a is not negative.
fn rotation([b, c, d]: [f64; 3]) -> [[f64; 3]; 3] {
    let rest = 1.0 - (b * b + c * c + d * d);
    // Half a turn, up to rounding: the standard's own limit.
    let (a, [b, c, d]) = if rest < 1e-7 {
        let length = (b * b + c * c + d * d).sqrt();
        (0.0, [b / length, c / length, d / length])
    } else {
        (rest.sqrt(), [b, c, d])
    };
    [
        [a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)],
        [2.0 * (b * c - a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d + a * b)],
        [2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a + d * d - c * c - b * b],
    ]
}

/// The type of the numbers, and how many of them make a sample.
fn data_type(source: &Source<'_>, code: i64) -> Result<(Scalar, usize), Error> {
    Ok(match code {
        2 => (Scalar::U8, 1),
        4 => (Scalar::I16, 1),
        8 => (Scalar::I32, 1),
        16 => (Scalar::F32, 1),
        64 => (Scalar::F64, 1),
        128 => (Scalar::U8, 3),
        256 => (Scalar::I8, 1),
        512 => (Scalar::U16, 1),
        768 => (Scalar::U32, 1),
        1024 => (Scalar::I64, 1),
        1280 => (Scalar::U64, 1),
        2304 => (Scalar::U8, 4),
        _ => {
            let name = match code {
                1 => " (single bits)",
                32 | 1792 | 2048 => " (complex numbers)",
                1536 => " (floats of 128 bits)",
                _ => "",
            };
            let what =
                format!("the data type {code}{name} is not read: integers of 8 to 64 bits and floats of 32 and 64 are");
            return Err(source.unsupported(what));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_turn_as_the_standard_says() {
        let close = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| {
            a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        assert!(close(rotation([0.0; 3]), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]));
        // A quarter about z: x goes to y.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!(close(rotation([0.0, 0.0, half]), [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]));
        // Half a turn about x, of a length that rounding has made more than 1.
        assert!(close(rotation([1.000_001, 0.0, 0.0]), [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]));
    }
}
