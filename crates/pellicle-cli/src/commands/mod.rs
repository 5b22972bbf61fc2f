//! One file per verb.

pub mod check;
pub mod demo;
pub mod info;
pub mod manual;
pub mod mesh;
pub mod render;
