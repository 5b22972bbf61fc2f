//! What boxes of samples are made from: the nodes of a volume, or a function evaluated where it is asked for.
//!
//! Source: this project.

use super::{boxed::Cubic, source::ABSENT};
use crate::{Border, Domain, Function, Volume, field::volume::Scalar};

/// The nodes of a volume, whose samples must be those given.
pub(crate) struct Nodes<'a, T> {
    pub(crate) volume: &'a Volume<'a>,
    pub(crate) samples: &'a [T],
    pub(crate) iso: f64,
}

impl<T: Scalar> Cubic for Nodes<'_, T> {
    fn nodes(&self) -> [usize; 3] {
        self.volume.dims()
    }

    fn is_open(&self) -> bool {
        self.volume.border() == Border::Open
    }

    fn row(&self, from: [usize; 3], to: &mut [f64]) {
        let (first, stride) = (self.volume.element(from) as isize, self.volume.strides()[0]);
        for (i, to) in to.iter_mut().enumerate() {
            let element = (first + i as isize * stride) as usize;
            let value = self.samples[element].to_f64() - self.iso;
            *to = if value.is_nan() { ABSENT } else { value };
        }
        if let Some(present) = self.volume.mask() {
            for (i, to) in to.iter_mut().enumerate() {
                if !present[(first + i as isize * stride) as usize] {
                    *to = ABSENT;
                }
            }
        }
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        let d = self.volume.directions();
        std::array::from_fn(|a| at[0] * d[0][a] + at[1] * d[1][a] + at[2] * d[2][a])
    }

    fn is_left_handed(&self) -> bool {
        self.volume.is_left_handed()
    }
}

/// A function on the lattice of a domain.
pub(crate) struct Evaluated<'a> {
    pub(crate) function: &'a dyn Function,
    pub(crate) domain: &'a Domain<'a>,
    pub(crate) iso: f64,
    pub(crate) is_left_handed: bool,
}

impl Evaluated<'_> {
    fn value(&self, at: [f64; 3]) -> f64 {
        let value = self.function.value(self.domain.to_world(at)) - self.iso;
        if value.is_nan() { ABSENT } else { value }
    }
}

impl Cubic for Evaluated<'_> {
    fn nodes(&self) -> [usize; 3] {
        self.domain.cells.map(|n| n + 1)
    }

    fn is_open(&self) -> bool {
        self.domain.border == Border::Open
    }

    fn row(&self, [i, j, k]: [usize; 3], to: &mut [f64]) {
        for (n, to) in to.iter_mut().enumerate() {
            *to = self.value([i + n, j, k].map(|v| v as f64));
        }
    }

    fn value_at(&self, at: [f64; 3]) -> Option<f64> {
        Some(self.value(at))
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        let (world, origin) = (self.domain.to_world(at), self.domain.mesh_origin());
        std::array::from_fn(|a| world[a] - origin[a])
    }

    fn is_left_handed(&self) -> bool {
        self.is_left_handed
    }
}
