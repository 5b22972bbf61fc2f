//! What threads keep between blocks and frames, and how much room the largest block so far needed.
//!
//! Source: this project.

use crate::march::{layers, slices};

/// What one thread needs to march, in either way.
#[derive(Default)]
pub(super) struct Work<C: Copy + Default> {
    pub(super) slices: slices::Work<C>,
    pub(super) layers: layers::Work<C>,
}

/// How much room the largest block so far needed.
#[derive(Clone, Copy, Default)]
pub(super) struct Needs {
    slices: slices::Needs,
    layers: layers::Needs,
}

impl Needs {
    /// Room for both.
    pub(super) fn join(&self, other: &Self) -> Self {
        Self { slices: self.slices.join(&other.slices), layers: self.layers.join(&other.layers) }
    }
}

impl<C: Copy + Default> Work<C> {
    pub(super) fn needs(&self) -> Needs {
        Needs { slices: self.slices.needs(), layers: self.layers.needs() }
    }

    pub(super) fn provide(&mut self, needs: &Needs) {
        self.slices.provide(&needs.slices);
        self.layers.provide(&needs.layers);
    }
}
