//! A volume file that has been opened: its header, and its samples to come, all at once or layer by layer.

use std::path::{Path, PathBuf};

use super::header::{Order, VolumeHeader, check_dims};
use super::samples::{SampleType, Samples};
use crate::error::Error;
use crate::scalar::{Encoding, Field, Records, Scalar};
use crate::source::Source;

/// A volume in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeData {
    /// What they are and where.
    pub header: VolumeHeader,
    /// As many as the header tells, in its order.
    pub samples: Samples,
}

impl VolumeData {
    /// What the sample at `(i, j, k)` stands for.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [x, y, z] = self.header.strides();
        self.header.scaling.value(self.samples.get_f64(i * x + j * y + k * z))
    }
}

/// A volume whose header has been read.
pub struct VolumeFile {
    path: PathBuf,
    header: VolumeHeader,
    data: Data,
    /// Whether the order of the samples is turned around, since their slope is negative.
    is_reversed: bool,
}

enum Data {
    Stream(Box<Stream>),
    /// Reads all of them.
    Whole(Whole),
}

/// Reads all samples of a file.
pub(super) type Whole = Box<dyn FnOnce() -> Result<Samples, Error> + Send>;

/// How the numbers of a stream of samples are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers {
    pub(super) encoding: Encoding,
    pub(super) scalar: Scalar,
    /// Numbers per sample that lie together, and which of them is wanted.
    pub(super) components: usize,
    pub(super) component: usize,
}

impl Numbers {
    /// One per sample.
    pub(super) fn new(encoding: Encoding, scalar: Scalar) -> Numbers {
        Numbers { encoding, scalar, components: 1, component: 0 }
    }

    /// Checks that so many samples can follow; returns how many to reserve memory for.
    pub(super) fn room(self, source: &Source<'_>, count: usize) -> Result<usize, Error> {
        let least = Source::least_bytes(self.encoding, &vec![self.scalar; self.components]);
        source.room(count as u64, least, "samples")
    }

    /// Appends the next samples.
    pub(super) fn append(self, source: &mut Source<'_>, count: usize, samples: &mut Samples) -> Result<(), Error> {
        let (scalar, size) = (self.scalar, self.scalar.size());
        let layout = vec![scalar; self.components];
        let (stride, field) = (size * self.components, Field { offset: size * self.component, scalar });
        source.records(self.encoding, &layout, count as u64, "samples", |bytes, endian| {
            samples.append(Records { bytes, stride, endian }, field);
            Ok(())
        })
    }

    /// Reads all of them.
    pub(super) fn read(self, source: &mut Source<'_>, count: usize) -> Result<Samples, Error> {
        let mut samples = Samples::with_capacity(self.scalar.into(), self.room(source, count)?);
        self.append(source, count, &mut samples)?;
        samples.shrink();
        Ok(samples)
    }
}

/// Samples that follow each other in a file.
pub(super) struct Stream {
    /// At the first of them.
    pub(super) source: Source<'static>,
    pub(super) numbers: Numbers,
}

impl VolumeFile {
    /// A volume that follows in a stream. Checks dimensions, grid and size.
    pub(super) fn of_stream(
        dims: [u64; 3],
        stream: Stream,
        complete: impl FnOnce(&mut VolumeHeader),
    ) -> Result<VolumeFile, Error> {
        let dims = check_dims(&stream.source, dims)?;
        let mut header = VolumeHeader::new(dims, SampleType::from(stream.numbers.scalar));
        complete(&mut header);
        header.grid.check(&stream.source)?;
        stream.numbers.room(&stream.source, header.count())?;
        Ok(VolumeFile::new(stream.source.path().into(), header, Data::Stream(Box::new(stream))))
    }

    /// A volume that is read as a whole; its header has been checked.
    pub(super) fn of_whole(path: &Path, header: VolumeHeader, whole: Whole) -> VolumeFile {
        VolumeFile::new(path.into(), header, Data::Whole(whole))
    }

    fn new(path: PathBuf, mut header: VolumeHeader, data: Data) -> VolumeFile {
        let is_reversed = header.scaling.slope < 0.0;
        if is_reversed {
            // Slope and intercept of the samples as they will be.
            let [_, most] = Samples::with_capacity(header.kind, 0).reverse_order(0);
            let scaling = &mut header.scaling;
            scaling.intercept += scaling.slope * most;
            scaling.slope = -scaling.slope;
        }
        VolumeFile { path, header, data, is_reversed }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What is known of it.
    pub fn header(&self) -> &VolumeHeader {
        &self.header
    }

    /// Puts the samples elsewhere.
    ///
    /// # Errors
    /// What is wrong with that place.
    pub fn set_grid(&mut self, grid: super::Grid) -> Result<(), Error> {
        if let Some(what) = grid.problem() {
            return Err(Error::Unsupported { path: self.path.clone(), what });
        }
        self.header.grid = grid;
        Ok(())
    }

    /// Why [`read_layers`](Self::read_layers) cannot read it; `None` if it can.
    pub fn why_no_layers(&self) -> Option<&'static str> {
        match self.data {
            Data::Whole(_) => Some("files of this format are read as a whole (save it as MHD, NRRD, NIfTI or NPY)"),
            Data::Stream(_) if self.header.order == Order::ZFastest => {
                Some("its samples lie in Fortran order (save it in C order)")
            }
            Data::Stream(_) => None,
        }
    }

    /// Reads all samples. More memory than for them is not taken, and none ahead of what the file is seen to hold.
    ///
    /// # Errors
    /// As [`read_volume`](super::read_volume).
    pub fn read(self) -> Result<VolumeData, Error> {
        let mut samples = match self.data {
            Data::Whole(whole) => whole()?,
            Data::Stream(mut stream) => stream.numbers.read(&mut stream.source, self.header.count())?,
        };
        if self.is_reversed {
            samples.reverse_order(0);
        }
        Ok(VolumeData { header: self.header, samples })
    }

    /// Appends the samples of the next layers, each of all x and y for one z.
    ///
    /// # Errors
    /// As [`read_volume`](super::read_volume); and if [`why_no_layers`](Self::why_no_layers) tells a reason, or more
    /// layers are asked for than there are.
    pub fn read_layers(&mut self, layers: usize, samples: &mut Samples) -> Result<(), Error> {
        if let Some(reason) = self.why_no_layers() {
            let what = format!("it cannot be read layer by layer: {reason}");
            return Err(Error::Unsupported { path: self.path.clone(), what });
        }
        let Data::Stream(stream) = &mut self.data else { return Ok(()) };
        let [x, y, _] = self.header.dims;
        let from = samples.len();
        stream.numbers.append(&mut stream.source, layers * x * y, samples)?;
        if self.is_reversed {
            samples.reverse_order(from);
        }
        Ok(())
    }
}
