//! Parts that rivals in `pellicle-bench` share with the roads, so that what is compared is the method and not the code
//! around it. No part of the interface: it changes without notice.

pub use crate::{
    field::falloff::{Falloff, Triquet},
    march::tables::{CASES, Case, edge_corner},
    math::simd::{Kernel, LANES, Simd, Unit},
};
