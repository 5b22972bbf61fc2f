//! What is known of a volume before its samples are read, and how the caller chooses where a file has several.

use std::path::Path;

use super::grid::Grid;
use super::samples::SampleType;
use crate::error::Error;
use crate::source::Source;

/// Which axis runs fastest in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// x, then y, then z: as VTK, MetaImage, NRRD and NIfTI have it, and NumPy's C order of `[z][y][x]`.
    #[default]
    XFastest,
    /// z, then y, then x: NumPy's Fortran order of `[z][y][x]`.
    ZFastest,
}

/// What a sample is the value of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// A point of the grid.
    #[default]
    Points,
    /// A cell; the [grid](VolumeHeader::grid) tells the centres.
    Cells,
}

/// Whose directions x, y and z are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Space {
    /// Nobody says.
    #[default]
    Unknown,
    /// Of a patient: to the right, to the front, up; as NIfTI has them.
    Ras,
    /// Of a patient: to the left, to the back, up; as MetaImage and ITK have them.
    Lps,
}

/// What samples mean: value = slope · sample + intercept. The slope is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Greater than 0.
    pub slope: f64,
    /// In the unit of the values.
    pub intercept: f64,
}

impl Default for Scaling {
    fn default() -> Scaling {
        Scaling { slope: 1.0, intercept: 0.0 }
    }
}

impl Scaling {
    /// The value that a sample stands for.
    pub fn value(self, sample: f64) -> f64 {
        self.slope * sample + self.intercept
    }

    /// The sample that stands for a value, which may lie between two of them.
    pub fn sample(self, value: f64) -> f64 {
        (value - self.intercept) / self.slope
    }
}

/// An array of a file that may have several.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeArray {
    /// Its name; empty where the format has none.
    pub name: String,
    /// The type in the file.
    pub kind: SampleType,
    /// Numbers per sample.
    pub components: usize,
    /// Of points or of cells.
    pub placement: Placement,
}

/// All but the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeHeader {
    /// Samples along x, y and z, at least 2 each.
    pub dims: [usize; 3],
    /// Type of the samples in the file.
    pub kind: SampleType,
    /// Where they lie.
    pub grid: Grid,
    /// How they follow each other.
    pub order: Order,
    /// Points or cells.
    pub placement: Placement,
    /// The array's name; empty where the format has none.
    pub name: String,
    /// Numbers per sample in the file, of which one is read.
    pub components: usize,
    /// Which one.
    pub component: usize,
    /// Time steps in the file.
    pub frames: usize,
    /// What the samples mean.
    pub scaling: Scaling,
    /// Unit of lengths, such as `mm`; empty where the file does not tell.
    pub unit: String,
    /// Whose directions x, y and z are.
    pub space: Space,
    /// Every array of the file that could be read, this one among them.
    pub arrays: Vec<VolumeArray>,
}

impl VolumeHeader {
    /// Samples of one number, in the usual order, at the points of a grid with spacing 1.
    pub(super) fn new(dims: [usize; 3], kind: SampleType) -> VolumeHeader {
        VolumeHeader {
            dims,
            kind,
            grid: Grid::default(),
            order: Order::default(),
            placement: Placement::Points,
            name: String::new(),
            components: 1,
            component: 0,
            frames: 1,
            scaling: Scaling::default(),
            unit: String::new(),
            space: Space::default(),
            arrays: Vec::new(),
        }
    }

    /// Number of samples.
    pub fn count(&self) -> usize {
        self.dims.iter().product()
    }

    /// Number of cells between samples.
    pub fn cells(&self) -> usize {
        self.dims.iter().map(|n| n - 1).product()
    }

    /// Bytes of the samples in memory.
    pub fn bytes(&self) -> u64 {
        self.count() as u64 * self.kind.bytes() as u64
    }

    /// Samples from one to the next along x, y and z.
    pub fn strides(&self) -> [usize; 3] {
        let [x, y, z] = self.dims;
        match self.order {
            Order::XFastest => [1, x, x * y],
            Order::ZFastest => [z * y, z, 1],
        }
    }
}

/// How to read a volume, and which where a file holds several.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VolumeOptions {
    /// Which array, where a file has several: by its name, or by `cell/` or `point/` and its name. By default the active
    /// scalars, else the first array of one component.
    pub array: Option<String>,
    /// Which number of each sample, counted from 0, where there are several.
    pub component: Option<usize>,
    /// Which time step, counted from 0.
    pub frame: usize,
    /// Index order of NumPy arrays.
    pub axes: Axes,
    /// What a file without header holds; the file is read as one, whatever its name.
    pub raw: Option<RawVolume>,
    /// Bytes that compressed data may grow to. By default 100 times the file's size and 64 MiB: more looks like damage.
    pub inflated_limit: Option<u64>,
}

/// Which index of a NumPy array is which axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axes {
    /// `array[z][y][x]`, as images are stacked.
    #[default]
    Zyx,
    /// `array[x][y][z]`, as nibabel hands them out.
    Xyz,
}

/// What a file without header holds.
#[derive(Debug, Clone, PartialEq)]
pub struct RawVolume {
    /// Samples along x, y and z.
    pub dims: [u64; 3],
    /// Their type.
    pub kind: SampleType,
    /// Numbers per sample.
    pub components: usize,
    /// Whether their bytes are in order of decreasing weight.
    pub big_endian: bool,
    /// Bytes before the first sample.
    pub skip: u64,
}

impl VolumeOptions {
    /// For a format without names of arrays.
    pub(super) fn refuse_array(&self, path: &Path, format_name: &str) -> Result<(), Error> {
        let Some(array) = &self.array else { return Ok(()) };
        let what = format!("there are no named arrays in {format_name}, so '{array}' cannot be chosen: leave it out");
        Err(Error::Unsupported { path: path.into(), what })
    }

    /// Checks that the time step is there.
    pub(super) fn check_frame(&self, path: &Path, frames: usize) -> Result<(), Error> {
        if self.frame < frames {
            return Ok(());
        }
        let what = format!("there is no time step {}: the file holds {frames}, counted from 0", self.frame);
        Err(Error::Unsupported { path: path.into(), what })
    }

    /// The component to read.
    pub(super) fn component(&self, path: &Path, components: usize) -> Result<usize, Error> {
        let what = match self.component {
            Some(component) if component < components => return Ok(component),
            Some(component) => {
                format!("there is no component {component}: a sample has {components}, counted from 0")
            }
            None if components == 1 => return Ok(0),
            None => format!(
                "a sample has {components} components, and a surface is of one: choose one, 0 to {}",
                components.saturating_sub(1)
            ),
        };
        Err(Error::Unsupported { path: path.into(), what })
    }

    /// Bytes that compressed data of a file of `len` bytes may grow to.
    pub(super) fn inflated_limit(&self, len: u64) -> u64 {
        let possible = len.saturating_mul(crate::source::MAX_INFLATION);
        self.inflated_limit.map_or_else(|| crate::source::inflated_limit(len), |limit| limit.min(possible))
    }
}

/// The dimensions of a volume, which must span cells.
pub(super) fn check_dims(source: &Source<'_>, dims: [u64; 3]) -> Result<[usize; 3], Error> {
    dims_of(dims).map_err(|what| source.fail(what))
}

/// The same, or what is wrong.
pub(super) fn dims_of(dims: [u64; 3]) -> Result<[usize; 3], String> {
    /// Places in a lattice are counted in 32 bits.
    const MOST: u64 = i32::MAX as u64 - 1;
    let [x, y, z] = dims;
    if let Some(axis) = dims.iter().position(|&n| n < 2) {
        let name = ["x", "y", "z"][axis];
        return Err(format!(
            "the volume has {x} × {y} × {z} samples, {} along {name}: there must be at least 2 along each axis",
            dims[axis]
        ));
    }
    let count = dims.iter().try_fold(1u64, |product, &n| product.checked_mul(n));
    // 8 bytes each.
    let fits = count.is_some_and(|count| count <= isize::MAX as u64 / 8);
    if dims.iter().any(|&n| n > MOST) || !fits {
        return Err(format!("the volume has {x} × {y} × {z} samples, which is more than can be counted here"));
    }
    Ok(dims.map(|n| n as usize))
}
