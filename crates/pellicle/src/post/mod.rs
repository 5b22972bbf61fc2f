//! What is done to a finished mesh: one verb per file.

pub mod largest;
