//! HDF5 particles: SWIFT and Gadget, PySPH, VTKHDF, and any dataset of three columns.
//!
//! Behind the feature `hdf5`: few need it, and it brings a reader of a large format with it. The reader is pure Rust, so
//! no library of the system is involved. Without the feature such a file is recognised, and the error says what to do.
//!
//! Sources: "The SWIFT parallel particle-in-cell code", snapshot format, <https://swift.strw.leidenuniv.nl>; PySPH,
//! `pysph/solver/output.py`; "VTKHDF File Format", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format>.

#[cfg(feature = "hdf5")]
mod channels;
#[cfg(feature = "hdf5")]
mod layouts;
#[cfg(feature = "hdf5")]
mod store;
#[cfg(feature = "hdf5")]
mod vtkhdf;

use std::path::Path;

use super::{Particles, ReadOptions};
use crate::error::Error;

#[cfg(feature = "hdf5")]
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    layouts::read(&store::Store::open(path)?, options)
}

#[cfg(not(feature = "hdf5"))]
pub(crate) fn read(path: &Path, _: &ReadOptions) -> Result<Particles, Error> {
    // So that a file that is not there is told as such.
    crate::source::open(path)?;
    let what = "HDF5 is not read by this build: build it with --features hdf5, or save the positions as .npy, \
                for example by numpy.save(\"positions.npy\", h5py.File(\"file.h5\")[\"PartType0/Coordinates\"])";
    Err(Error::Unsupported { path: path.into(), what: what.into() })
}
