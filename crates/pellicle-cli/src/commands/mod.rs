//! One file per verb.

pub mod check;
pub mod convert;
pub mod demo;
mod demo_metaballs;
pub mod fields;
pub mod formats;
pub mod info;
pub mod manual;
pub mod mesh;
pub mod render;
