//! Volumes out: what is read can be written, in the type that it has, little-endian and not compressed but for `.nii.gz`.
//!
//! Samples go out x fastest. Scaled values (`scl_slope`) stay scaled in NIfTI, if slope and intercept are exact there, which are in single
//! precision in NIfTI-1; elsewhere they are computed, in single precision where the samples have 16 bits at most, else in double.
//!
//! Places are copied, but for one thing. NIfTI counts to the right and to the front of a patient (RAS), MetaImage to the left
//! and to the back (LPS), and NRRD says which. Where a file tells, x and y change their sign on the way from one to the other, as
//! they do in ITK; the place in the patient is the same.
//!
//! Source: those of the readers, format by format.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::file::VolumeData;
use super::grid::Grid;
use super::header::{Order, Scaling, Space};
use super::samples::SampleType;
use crate::each_sample_type;
use crate::error::Error;
use crate::meshes::temporary::Temporary;
use crate::output::{Output, Written};

/// A sample as the bytes of a file.
macro_rules! bytes_of {
    ($samples:expr, $order:expr, $range:expr, $to:expr, $method:ident) => {
        each_sample_type!($samples, values => $range.for_each(|n| $to.extend_from_slice(&values[$order(n)].$method())))
    };
}

/// What goes to a file: samples, in the order of the file, and where they lie.
struct Out<'a> {
    data: &'a VolumeData,
    /// What the file's numbers mean. Where that is not what the samples mean, the numbers are the values.
    scaling: Scaling,
    grid: Grid,
}

impl<'a> Out<'a> {
    /// With `space` as the file's, if it has one of its own.
    fn new(data: &'a VolumeData, keeps_scaling: bool, space: Option<Space>) -> Out<'a> {
        let header = &data.header;
        let scaling = if keeps_scaling { header.scaling } else { Scaling::default() };
        let mut grid = header.grid;
        if space.is_some_and(|space| space != header.space && header.space != Space::Unknown) {
            [&mut grid.origin].into_iter().chain(&mut grid.steps).for_each(|v| (v[0], v[1]) = (-v[0], -v[1]));
        }
        Out { data, scaling, grid }
    }

    fn len(&self) -> usize {
        self.data.samples.len()
    }

    /// Whether the values are computed.
    fn is_computed(&self) -> bool {
        self.scaling != self.data.header.scaling
    }

    fn kind(&self) -> SampleType {
        match self.data.samples.kind() {
            kind if !self.is_computed() => kind,
            SampleType::I8 | SampleType::U8 | SampleType::I16 | SampleType::U16 => SampleType::F32,
            _ => SampleType::F64,
        }
    }

    /// Appends all samples to what begins with `head`.
    fn write(&self, path: &Path, head: &[u8], tail: &[u8], is_big: bool) -> Result<(), Error> {
        let (count, size) = (self.len(), self.kind().bytes());
        let mut output = Output::create(path, Some((head.len() + count * size + tail.len()) as u64))?;
        output.bytes(head)?;
        output.tasks(count, size, |range, to| {
            to.clear();
            self.put(range, to, is_big);
        })?;
        output.bytes(tail)?;
        output.finish()
    }

    /// The bytes of a range of samples, x fastest.
    fn put(&self, range: std::ops::Range<usize>, to: &mut Vec<u8>, is_big: bool) {
        let ([x, y, _], [sx, sy, sz]) = (self.data.header.dims, self.data.header.strides());
        let is_plain = self.data.header.order == Order::XFastest;
        let order = |n: usize| if is_plain { n } else { n % x * sx + n / x % y * sy + n / (x * y) * sz };
        let samples = &self.data.samples;
        match (self.is_computed(), self.kind()) {
            (false, _) if is_big => bytes_of!(samples, order, range, to, to_be_bytes),
            (false, _) => bytes_of!(samples, order, range, to, to_le_bytes),
            (true, kind) => {
                let values = range.map(|n| self.data.header.scaling.value(samples.get_f64(order(n))));
                match kind {
                    SampleType::F32 if is_big => values.for_each(|v| to.extend_from_slice(&(v as f32).to_be_bytes())),
                    SampleType::F32 => values.for_each(|v| to.extend_from_slice(&(v as f32).to_le_bytes())),
                    _ if is_big => values.for_each(|v| to.extend_from_slice(&v.to_be_bytes())),
                    _ => values.for_each(|v| to.extend_from_slice(&v.to_le_bytes())),
                }
            }
        }
    }

    /// Lengths of the steps, and their directions.
    fn parted(&self) -> ([f64; 3], [[f64; 3]; 3]) {
        let spacing = self.grid.spacing();
        (spacing, std::array::from_fn(|axis| self.grid.steps[axis].map(|v| v / spacing[axis])))
    }

    /// Refuses what a format without directions cannot tell.
    fn check_straight(&self, path: &Path, name: &str) -> Result<(), Error> {
        let straight = Grid::new(self.grid.origin, std::array::from_fn(|axis| self.grid.steps[axis][axis]));
        if self.grid.steps == straight.steps && straight.spacing() == [0, 1, 2].map(|axis| self.grid.steps[axis][axis])
        {
            return Ok(());
        }
        let what = format!(
            "{name} has no room for the directions of this volume's axes: write it as .vti, .nrrd, .mha or .nii"
        );
        Err(Error::Unsupported { path: path.into(), what })
    }

    /// What a format without places leaves out.
    fn without_place(&self, more: &[&str]) -> Written {
        let place = (self.grid != Grid::default()).then_some("spacing and origin");
        Written { left_out: place.iter().chain(more).map(|&what| what.to_owned()).collect(), ..Written::default() }
    }
}

/// Numbers with blanks between them.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

pub(crate) fn npy(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    let out = Out::new(data, false, None);
    let [x, y, z] = data.header.dims;
    let kind = match out.kind() {
        SampleType::I8 => "|i1",
        SampleType::U8 => "|u1",
        SampleType::I16 => "<i2",
        SampleType::U16 => "<u2",
        SampleType::I32 => "<i4",
        SampleType::U32 => "<u4",
        SampleType::I64 => "<i8",
        SampleType::U64 => "<u8",
        SampleType::F64 => "<f8",
        SampleType::F32 | SampleType::F16 => "<f4",
    };
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({z}, {y}, {x}), }}");
    let len = (10 + text.len() + 1).next_multiple_of(64) - 10;
    text.extend(std::iter::repeat_n(' ', len - text.len() - 1));
    text.push('\n');
    let head = [b"\x93NUMPY\x01\x00".as_slice(), &(len as u16).to_le_bytes(), text.as_bytes()].concat();
    out.write(path, &head, b"", false)?;
    Ok(out.without_place(&[]))
}

pub(crate) fn raw(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("raw")) {
        let what = "raw samples, of whatever type, are written to .raw".into();
        return Err(Error::Unsupported { path: path.into(), what });
    }
    let out = Out::new(data, false, None);
    out.write(path, b"", b"", false)?;
    Ok(out.without_place(&["dimensions", "type"]))
}

/// The name of an array; VTK wants one.
fn array_name(data: &VolumeData) -> &str {
    if data.header.name.is_empty() { "values" } else { &data.header.name }
}

pub(crate) fn vti(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pvti")) {
        let what = "a .pvti lists pieces in other files: write .vti".into();
        return Err(Error::Unsupported { path: path.into(), what });
    }
    let out = Out::new(data, false, None);
    let [x, y, z] = data.header.dims.map(|n| n - 1);
    let kind = match out.kind() {
        SampleType::I8 => "Int8",
        SampleType::U8 => "UInt8",
        SampleType::I16 => "Int16",
        SampleType::U16 => "UInt16",
        SampleType::I32 => "Int32",
        SampleType::U32 => "UInt32",
        SampleType::I64 => "Int64",
        SampleType::U64 => "UInt64",
        SampleType::F64 => "Float64",
        SampleType::F32 | SampleType::F16 => "Float32",
    };
    let (spacing, directions) = out.parted();
    let rows: [[f64; 3]; 3] = std::array::from_fn(|row| std::array::from_fn(|axis| directions[axis][row]));
    let name = quick_xml::escape::escape(array_name(data));
    let (origin, spacing, direction) = (list(&out.grid.origin), list(&spacing), list(rows.as_flattened()));
    let head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <ImageData WholeExtent=\"0 {x} 0 {y} 0 {z}\" Origin=\"{origin}\" Spacing=\"{spacing}\" Direction=\"{direction}\">\n\
         <Piece Extent=\"0 {x} 0 {y} 0 {z}\">\n<PointData Scalars=\"{name}\">\n\
         <DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"0\"/>\n\
         </PointData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_"
    );
    let bytes = (out.len() * out.kind().bytes()) as u64;
    out.write(path, &[head.as_bytes(), &bytes.to_le_bytes()].concat(), b"\n</AppendedData>\n</VTKFile>\n", false)?;
    Ok(Written::default())
}

pub(crate) fn vtk(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    let out = Out::new(data, false, None);
    out.check_straight(path, "legacy VTK")?;
    let kind = match out.kind() {
        SampleType::I8 => "char",
        SampleType::U8 => "unsigned_char",
        SampleType::I16 => "short",
        SampleType::U16 => "unsigned_short",
        SampleType::I32 => "int",
        SampleType::U32 => "unsigned_int",
        SampleType::I64 => "vtktypeint64",
        SampleType::U64 => "vtktypeuint64",
        SampleType::F64 => "double",
        SampleType::F32 | SampleType::F16 => "float",
    };
    let [x, y, z] = data.header.dims;
    // Names end at a blank.
    let name: String = array_name(data).chars().map(|c| if c.is_whitespace() { '_' } else { c }).collect();
    let (origin, spacing, count) = (list(&out.grid.origin), list(&out.grid.spacing()), out.len());
    let head = format!(
        "# vtk DataFile Version 3.0\npellicle\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS {x} {y} {z}\nORIGIN {origin}\n\
         SPACING {spacing}\nPOINT_DATA {count}\nSCALARS {name} {kind} 1\nLOOKUP_TABLE default\n"
    );
    out.write(path, head.as_bytes(), b"\n", true)?;
    Ok(Written::default())
}

pub(crate) fn mha(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    refuse_header_alone(path, "mhd", "mha")?;
    let out = Out::new(data, false, Some(Space::Lps));
    let kind = match out.kind() {
        SampleType::I8 => "MET_CHAR",
        SampleType::U8 => "MET_UCHAR",
        SampleType::I16 => "MET_SHORT",
        SampleType::U16 => "MET_USHORT",
        SampleType::I32 => "MET_INT",
        SampleType::U32 => "MET_UINT",
        SampleType::I64 => "MET_LONG_LONG",
        SampleType::U64 => "MET_ULONG_LONG",
        SampleType::F64 => "MET_DOUBLE",
        SampleType::F32 | SampleType::F16 => "MET_FLOAT",
    };
    let [x, y, z] = data.header.dims;
    let (spacing, directions) = out.parted();
    let (matrix, origin, spacing) = (list(directions.as_flattened()), list(&out.grid.origin), list(&spacing));
    let head = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n\
         TransformMatrix = {matrix}\nOffset = {origin}\nElementSpacing = {spacing}\nDimSize = {x} {y} {z}\n\
         ElementType = {kind}\nElementDataFile = LOCAL\n"
    );
    out.write(path, head.as_bytes(), b"", false)?;
    Ok(Written::default())
}

pub(crate) fn nrrd(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    refuse_header_alone(path, "nhdr", "nrrd")?;
    let out = Out::new(data, false, None);
    let kind = match out.kind() {
        SampleType::I8 => "int8",
        SampleType::U8 => "uint8",
        SampleType::I16 => "int16",
        SampleType::U16 => "uint16",
        SampleType::I32 => "int32",
        SampleType::U32 => "uint32",
        SampleType::I64 => "int64",
        SampleType::U64 => "uint64",
        SampleType::F64 => "double",
        SampleType::F32 | SampleType::F16 => "float",
    };
    let [x, y, z] = data.header.dims;
    let vector = |v: [f64; 3]| format!("({},{},{})", v[0], v[1], v[2]);
    let space = match data.header.space {
        Space::Unknown => "space dimension: 3",
        Space::Ras => "space: right-anterior-superior",
        Space::Lps => "space: left-posterior-superior",
    };
    let mut head = format!("NRRD0005\ntype: {kind}\ndimension: 3\n{space}\nsizes: {x} {y} {z}\n");
    let directions = out.grid.steps.map(vector).join(" ");
    // Writing to a string cannot fail.
    let _ =
        write!(head, "space directions: {directions}\nkinds: domain domain domain\nendian: little\nencoding: raw\n");
    if !data.header.unit.is_empty() && !data.header.unit.contains(['"', '\n', '\\']) {
        let unit = &data.header.unit;
        let _ = writeln!(head, "space units: \"{unit}\" \"{unit}\" \"{unit}\"");
    }
    let _ = write!(head, "space origin: {}\n\n", vector(out.grid.origin));
    out.write(path, head.as_bytes(), b"", false)?;
    Ok(Written::default())
}

/// NIfTI-1, or NIfTI-2 where dimensions exceed 16 bits. Its affine map is in single precision in the first.
pub(crate) fn nifti(path: &Path, data: &VolumeData) -> Result<Written, Error> {
    let name = path.to_string_lossy().to_ascii_lowercase();
    if ![".nii", ".nii.gz"].iter().any(|extension| name.ends_with(extension)) {
        let what = "a NIfTI header alone has no samples: write .nii or .nii.gz, which have both".into();
        return Err(Error::Unsupported { path: path.into(), what });
    }
    let is_second = data.header.dims.iter().any(|&n| n > i16::MAX as usize);
    let Scaling { slope, intercept } = data.header.scaling;
    let is_exact = |v: f64| f64::from(v as f32) == v;
    let out = Out::new(data, is_second || [slope, intercept].into_iter().all(is_exact), Some(Space::Ras));
    let head = if is_second { second_header(&out) } else { first_header(&out) };
    if name.ends_with(".gz") {
        write_gzipped(path, &out, &head)?;
    } else {
        out.write(path, &head, b"", false)?;
    }
    let numbers = out.grid.steps.as_flattened().iter().chain(&out.grid.origin);
    let is_rounded = !is_second && !numbers.copied().all(is_exact);
    Ok(Written { narrowed: is_rounded.then(|| "position".to_owned()).into_iter().collect(), ..Written::default() })
}

fn write_gzipped(path: &Path, out: &Out<'_>, head: &[u8]) -> Result<(), Error> {
    const CHUNK: usize = 1 << 18;
    let file = Temporary::create(path)?;
    let mut encoder = GzEncoder::new(file.file(), Compression::fast());
    let (count, mut buffer) = (out.len(), Vec::new());
    let mut write = || {
        encoder.write_all(head)?;
        for from in (0..count).step_by(CHUNK) {
            buffer.clear();
            out.put(from..count.min(from + CHUNK), &mut buffer, false);
            encoder.write_all(&buffer)?;
        }
        encoder.try_finish()
    };
    write().map_err(|source| file.fail("write", source))?;
    drop(encoder);
    file.finish()
}

/// The code of a type, and its bits.
fn nifti_type(kind: SampleType) -> [i16; 2] {
    let code = match kind {
        SampleType::U8 => 2,
        SampleType::I16 => 4,
        SampleType::I32 => 8,
        SampleType::F32 | SampleType::F16 => 16,
        SampleType::F64 => 64,
        SampleType::I8 => 256,
        SampleType::U16 => 512,
        SampleType::U32 => 768,
        SampleType::I64 => 1024,
        SampleType::U64 => 1280,
    };
    [code, 8 * kind.bytes() as i16]
}

fn nifti_unit(unit: &str) -> u8 {
    match unit {
        "m" => 1,
        "mm" => 2,
        "µm" | "um" => 3,
        _ => 0,
    }
}

/// Row `row` of the affine map.
fn affine_row(grid: &Grid, row: usize) -> [f64; 4] {
    [grid.steps[0][row], grid.steps[1][row], grid.steps[2][row], grid.origin[row]]
}

fn first_header(out: &Out<'_>) -> Vec<u8> {
    let (mut head, header) = (vec![0u8; 352], &out.data.header);
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    let float = |v: f64| (v as f32).to_le_bytes();
    put(0, &348i32.to_le_bytes());
    put(40, &3i16.to_le_bytes());
    for (i, n) in header.dims.into_iter().chain([1; 4]).enumerate() {
        put(42 + 2 * i, &(n as i16).to_le_bytes());
    }
    let [code, bits] = nifti_type(out.kind());
    put(70, &code.to_le_bytes());
    put(72, &bits.to_le_bytes());
    let spacing = out.grid.spacing();
    for (i, v) in [1.0].into_iter().chain(spacing).enumerate() {
        put(76 + 4 * i, &float(v));
    }
    put(108, &float(352.0));
    put(112, &float(out.scaling.slope));
    put(116, &float(out.scaling.intercept));
    put(123, &[nifti_unit(&header.unit)]);
    put(254, &2i16.to_le_bytes());
    for row in 0..3 {
        for (i, v) in affine_row(&out.grid, row).into_iter().enumerate() {
            put(280 + 16 * row + 4 * i, &float(v));
        }
    }
    put(344, b"n+1\0");
    head
}

fn second_header(out: &Out<'_>) -> Vec<u8> {
    let (mut head, header) = (vec![0u8; 544], &out.data.header);
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &540i32.to_le_bytes());
    put(4, b"n+2\0\r\n\x1a\n");
    let [code, bits] = nifti_type(out.kind());
    put(12, &code.to_le_bytes());
    put(14, &bits.to_le_bytes());
    put(16, &3i64.to_le_bytes());
    for (i, n) in header.dims.into_iter().chain([1; 4]).enumerate() {
        put(24 + 8 * i, &(n as i64).to_le_bytes());
    }
    for (i, v) in [1.0].into_iter().chain(out.grid.spacing()).enumerate() {
        put(104 + 8 * i, &v.to_le_bytes());
    }
    put(168, &544i64.to_le_bytes());
    put(176, &out.scaling.slope.to_le_bytes());
    put(184, &out.scaling.intercept.to_le_bytes());
    put(348, &2i32.to_le_bytes());
    for row in 0..3 {
        for (i, v) in affine_row(&out.grid, row).into_iter().enumerate() {
            put(400 + 32 * row + 8 * i, &v.to_le_bytes());
        }
    }
    put(500, &i32::from(nifti_unit(&header.unit)).to_le_bytes());
    head
}

/// A header whose samples are in another file cannot appear at once with it.
fn refuse_header_alone(path: &Path, header: &str, whole: &str) -> Result<(), Error> {
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(header)) {
        return Ok(());
    }
    let what = format!("a .{header} has its samples in another file: write .{whole}, which has both");
    Err(Error::Unsupported { path: path.into(), what })
}
