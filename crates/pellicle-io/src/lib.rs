//! Files in and out.
//!
//! [`read_particles`] reads a particle file, [`read_mesh`] a mesh; [`write_mesh`] writes a mesh, and [`PlyFile`] lets
//! several threads write one while it is being made. A file appears whole or not at all.
//!
//! Nothing that a file contains makes a reader panic, hang, or reserve memory out of proportion to the file's size.

mod error;
mod formats;
mod meshes;
mod particles;
mod positional;
mod scalar;
mod source;
mod table;

pub use error::{Error, Place};
pub use meshes::{
    PlyFile, PlyLayout, WriteOptions, check_mesh_format, check_writable, read_mesh, remove_temporaries, write_mesh,
};
pub use particles::{
    AttributeChoice, AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions, read_particles,
};
