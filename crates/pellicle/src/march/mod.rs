//! Samples to triangles.

pub(crate) mod cubes;
pub(crate) mod levels;
pub(crate) mod tables;
