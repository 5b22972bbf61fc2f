//! One file per verb.

pub mod check;
pub mod contour;
pub mod convert;
pub mod demo;
mod demo_metaballs;
pub mod fields;
pub mod formats;
pub mod info;
mod info_volume;
pub mod manual;
pub mod mesh;
pub mod render;
