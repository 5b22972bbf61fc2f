//! Vectors of lanes, bit tricks and parallel ranges: what the stages are made of, and nothing about surfaces.

pub(crate) mod bits;
pub(crate) mod eigen;
pub(crate) mod jacobi;
pub(crate) mod memory;
pub(crate) mod ranges;
pub mod simd;
pub(crate) mod tree;
pub(crate) mod union_find;
pub(crate) mod vector;
