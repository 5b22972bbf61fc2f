//! NumPy arrays of three axes, or of four, of which the last counts components.
//!
//! By default they are `array[z][y][x]`, as images are stacked; [`Axes::Xyz`] tells that they are `array[x][y][z]`. Which
//! index runs fastest in memory (C or Fortran order) changes nothing but the order of reading. An array tells no place: its
//! samples lie at whole numbers unless the caller says otherwise.
//!
//! Source: the NPY format, versions 1.0 to 3.0, <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use std::path::Path;

use super::file::{Numbers, Stream, VolumeFile};
use super::header::{Axes, Order, VolumeHeader, VolumeOptions, check_dims};
use crate::error::Error;
use crate::particles::npy_header::{self, Array};
use crate::scalar::Encoding;
use crate::source::Source;

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.refuse_array(path, "a NumPy array")?;
    options.check_frame(path, 1)?;
    let mut source = Source::open(path)?;
    let array = npy_header::read_array(&mut source)?;
    let layout = Layout::of(&source, &array, options)?;
    layout.skip_to_component(&mut source)?;
    let numbers = layout.numbers();
    VolumeFile::of_stream(layout.dims, Stream { source, numbers }, |header| layout.complete(header))
}

/// How the samples of an array follow each other.
pub(super) struct Layout<'a> {
    array: &'a Array,
    pub(super) dims: [u64; 3],
    order: Order,
    components: usize,
    component: usize,
}

impl<'a> Layout<'a> {
    pub(super) fn of(source: &Source<'_>, array: &'a Array, options: &VolumeOptions) -> Result<Layout<'a>, Error> {
        let (axes, components) = match array.shape.as_slice() {
            &[a, b, c] => ([a, b, c], 1),
            &[a, b, c, components] => ([a, b, c], components),
            other => {
                return Err(source.unsupported(format!(
                    "the array has the shape {other:?}: a volume has three axes z, y, x, or a fourth of components behind them"
                )));
            }
        };
        let Some(components) = usize::try_from(components).ok().filter(|n| (1..=4096).contains(n)) else {
            return Err(source.fail(format!("{components} components: 1 to 4096 are read")));
        };
        let [a, b, c] = axes;
        let dims = if options.axes == Axes::Zyx { [c, b, a] } else { axes };
        // The last index runs fastest in C order.
        let is_x_fastest = (options.axes == Axes::Zyx) != array.is_fortran;
        let order = if is_x_fastest { Order::XFastest } else { Order::ZFastest };
        let component = options.component(source.path(), components)?;
        check_dims(source, dims)?;
        Ok(Layout { array, dims, order, components, component })
    }

    /// In Fortran order each component is an array of its own.
    pub(super) fn skip_to_component(&self, source: &mut Source<'_>) -> Result<(), Error> {
        let samples: u64 = self.dims.iter().product();
        let bytes = u128::from(samples) * self.array.scalar.size() as u128 * self.components as u128;
        if bytes > u128::from(source.remaining()) {
            source.room(samples, (self.array.scalar.size() * self.components) as u64, "samples")?;
        }
        if self.array.is_fortran {
            source.skip(samples * self.array.scalar.size() as u64 * self.component as u64, "samples")?;
        }
        Ok(())
    }

    pub(super) fn numbers(&self) -> Numbers {
        let numbers = Numbers::new(Encoding::Binary(self.array.endian), self.array.scalar);
        if self.array.is_fortran {
            return numbers;
        }
        Numbers { components: self.components, component: self.component, ..numbers }
    }

    pub(super) fn complete(&self, header: &mut VolumeHeader) {
        header.order = self.order;
        (header.components, header.component) = (self.components, self.component);
    }
}
