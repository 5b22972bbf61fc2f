//! What the markup of a VTK XML file says: which arrays there are, and where in the file their data lie.

use std::ops::Range;
use std::path::PathBuf;

use crate::scalar::{Endian, Scalar};

/// Where an array's data lie.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Location {
    /// Decimal numbers between the tags.
    Text(Range<usize>),
    /// Base64 between the tags.
    Base64(Range<usize>),
    /// In the appended data, this far from their start.
    Appended(u64),
}

/// An array as its tag describes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DataArray {
    pub(crate) name: String,
    /// `None` for strings and bits.
    pub(crate) scalar: Option<Scalar>,
    pub(crate) components: usize,
    pub(crate) location: Location,
}

/// A part of the data.
#[derive(Debug, Default)]
pub(crate) struct Piece {
    pub(crate) count: u64,
    pub(crate) positions: Option<DataArray>,
    pub(crate) attributes: Vec<DataArray>,
    /// The cells of an unstructured grid, or the polygons of a PolyData.
    pub(crate) cells: CellArrays,
    /// The triangle strips of a PolyData.
    pub(crate) strips: CellArrays,
    /// Arrays of the cells of an image.
    pub(crate) of_cells: Vec<DataArray>,
    /// The part of an image that this piece is: first and last point along each axis.
    pub(crate) extent: Option<[i64; 6]>,
}

/// The points of an image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Image {
    /// First and last point along each axis.
    pub(crate) extent: [i64; 6],
    /// Of the point (0, 0, 0), which need not be in the extent.
    pub(crate) origin: [f64; 3],
    pub(crate) spacing: [f64; 3],
    /// Row by row a matrix whose columns are the directions of the axes.
    pub(crate) direction: [f64; 9],
}

/// The arrays that describe cells.
#[derive(Debug, Default)]
pub(crate) struct CellArrays {
    pub(crate) count: u64,
    pub(crate) connectivity: Option<DataArray>,
    pub(crate) offsets: Option<DataArray>,
    pub(crate) types: Option<DataArray>,
}

/// Another file that this one lists.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Listed {
    pub(crate) file: PathBuf,
    /// Time of the step it belongs to, in a Collection.
    pub(crate) time: f64,
    pub(crate) part: String,
    /// The part of an image that it is.
    pub(crate) extent: Option<[i64; 6]>,
}

/// What a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    UnstructuredGrid,
    PolyData,
    /// A list of files over time.
    Collection,
    /// A list of the files of one step (`PUnstructuredGrid`, `PPolyData`).
    Parallel,
    /// Samples on a regular grid.
    ImageData,
    /// A list of the files of one image (`PImageData`). Its arrays stand in a piece without data.
    ParallelImage,
}

/// The appended data.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Appended {
    /// Place of the first byte after the underscore.
    pub(crate) start: usize,
    pub(crate) is_base64: bool,
}

/// How blocks of data are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compressor {
    Zlib,
    /// Blocks of LZ4 without a frame.
    Lz4,
    /// Streams of XZ.
    Lzma,
}

/// What the markup says.
#[derive(Debug)]
pub(crate) struct Document {
    pub(crate) kind: Kind,
    pub(crate) endian: Endian,
    /// Type of the sizes that stand before binary data.
    pub(crate) header: Scalar,
    pub(crate) compressor: Option<Compressor>,
    pub(crate) pieces: Vec<Piece>,
    pub(crate) listed: Vec<Listed>,
    pub(crate) appended: Option<Appended>,
    pub(crate) image: Option<Image>,
    /// Names of the active scalars of points and of cells.
    pub(crate) active: [Option<String>; 2],
}
