//! One file per verb.

pub mod check;
pub mod convert;
pub mod demo;
pub mod info;
pub mod mesh;
