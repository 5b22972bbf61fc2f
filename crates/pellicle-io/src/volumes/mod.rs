//! Volume files in: one file per format.
//!
//! A volume is a regular grid of numbers. Its samples keep the type of the file, and are read once, into one array or layer by
//! layer. Where the file says what they lie at — spacing, origin, oblique or left-handed directions — that is the
//! [`Grid`]; coordinates are those of the file.

mod choose;
mod data;
mod file;
mod grid;
mod header;
pub(crate) mod mha;
pub(crate) mod nifti;
pub(crate) mod npy;
pub(crate) mod npz;
pub(crate) mod nrrd;
mod pvti;
pub(crate) mod raw;
mod samples;
mod text;
pub(crate) mod vti;
pub(crate) mod vtk;
pub(crate) mod write;

use std::path::Path;

use crate::error::Error;
use crate::formats::detect;
use crate::output::Written;

pub use file::{VolumeData, VolumeFile};
pub use grid::Grid;
pub use header::{Axes, Order, Placement, RawVolume, Scaling, Space, VolumeArray, VolumeHeader, VolumeOptions};
pub use samples::{SampleType, Samples};

/// Opens a volume file and reads its header. The format follows from the extension, or from the first bytes where the extension
/// tells nothing; [`VolumeOptions::raw`] reads any file as raw numbers.
///
/// Read are:
/// - NumPy arrays (`.npy`) and archives (`.npz`), C and Fortran order, by default as `array[z][y][x]`;
/// - VTK XML images (`.vti`, and `.pvti`, whose pieces are files) and legacy VTK (`.vtk`, `STRUCTURED_POINTS`), in every encoding, data of points and of cells;
/// - MetaImage (`.mha`, `.mhd` with its data), plain and compressed;
/// - NRRD (`.nrrd`, `.nhdr` with its data), raw, gzip and text;
/// - NIfTI-1 and NIfTI-2 (`.nii`, `.nii.gz`, `.hdr` with `.img`), with its affine map and its scaling of values;
/// - raw numbers.
///
/// # Errors
/// Whatever [`Error`] names except for its `Length` and `Sink`. Nothing that a file contains makes this panic, or use memory out of
/// proportion to the file's size.
pub fn open_volume(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    if let Some(raw) = &options.raw {
        return raw::open(path, raw, options);
    }
    detect::volume(path)?(path, options)
}

/// Reads a volume into memory: [`open_volume`], then [`VolumeFile::read`].
///
/// # Errors
/// As [`open_volume`].
pub fn read_volume(path: &Path, options: &VolumeOptions) -> Result<VolumeData, Error> {
    open_volume(path, options)?.read()
}

/// Writes a volume in the format that the extension names: `.npy`, `.vti`, `.vtk`, `.mha`, `.nrrd`, `.nii`, `.nii.gz`, `.raw`. The
/// file appears whole or not at all.
///
/// # Errors
/// [`Error::Unsupported`] for another extension, and where a format has no room for the directions of the axes;
/// [`Error::Sink`].
pub fn write_volume(path: &Path, volume: &VolumeData) -> Result<Written, Error> {
    detect::volume_out(path)?(path, volume)
}

/// Whether [`write_volume`] knows the format that the extension of `path` names.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn check_volume_format(path: &Path) -> Result<(), Error> {
    detect::volume_out(path).map(|_| ())
}

/// Whether a file is one of a volume, by its name, and by its content where the format holds other things, too.
///
/// # Errors
/// The file cannot be read, or is damaged where the answer should be.
pub fn holds_volume(path: &Path) -> Result<bool, Error> {
    detect::holds_volume(path)
}
