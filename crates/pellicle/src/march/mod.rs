//! Samples to triangles.

pub(crate) mod cubes;
pub mod slices;
pub(crate) mod tables;
