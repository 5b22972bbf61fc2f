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

/// Points that a function is asked for at once.
const RUN: usize = 64;

/// A function on the lattice of a domain.
pub(crate) struct Evaluated<'a> {
    pub(crate) function: &'a dyn Function,
    pub(crate) domain: &'a Domain<'a>,
    pub(crate) iso: f64,
    pub(crate) is_left_handed: bool,
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
            self.at(&[[i + n, j, k].map(|v| v as f64)], std::slice::from_mut(to));
        }
    }

    const ANYWHERE: bool = true;

    fn at(&self, places: &[[f64; 3]], to: &mut [f64]) {
        let mut world = [[0.0; 3]; RUN];
        for (places, to) in places.chunks(RUN).zip(to.chunks_mut(RUN)) {
            for (world, &at) in world.iter_mut().zip(places) {
                *world = self.domain.to_world(at);
            }
            self.function.values(&world[..places.len()], to);
            for to in to {
                let value = *to - self.iso;
                *to = if value.is_nan() { ABSENT } else { value };
            }
        }
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        let (world, origin) = (self.domain.to_world(at), self.domain.mesh_origin());
        std::array::from_fn(|a| world[a] - origin[a])
    }

    fn is_left_handed(&self) -> bool {
        self.is_left_handed
    }
}
