//! Samples to triangles.

pub(crate) mod cubes;
pub(crate) mod labels;
pub(crate) mod layers;
pub(crate) mod levels;
pub(crate) mod resolve;
pub(crate) mod rows;
pub mod slices;
pub(crate) mod tables;
pub(crate) mod tetrahedra;
