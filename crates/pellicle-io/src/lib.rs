//! Files in and out.
//!
//! [`read_particles`] reads a particle file, [`read_mesh`] a mesh, [`read_volume`] a volume; [`write_mesh`] writes a mesh, and [`PlyFile`] lets
//! several threads write one while it is being made. A file appears whole or not at all.
//!
//! ```
//! use std::path::Path;
//!
//! use pellicle::Mesh;
//! use pellicle_io::{ReadOptions, WriteOptions, read_mesh, read_particles, write_mesh};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = std::env::temp_dir();
//! let particles = folder.join("pellicle-doc-particles.csv");
//! std::fs::write(&particles, "x,y,z,vx,vy,vz\n0,0,0,1,0,0\n0,0,1,1,0,0\n")?;
//! let frame = read_particles(&particles, &ReadOptions::default())?;
//! assert_eq!(frame.positions.view().len(), 2);
//! assert_eq!(*frame.attribute("velocity").unwrap().to_f32(), [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
//!
//! let surface = folder.join("pellicle-doc-surface.ply");
//! let triangle = Mesh {
//!     vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
//!     triangles: vec![[0, 1, 2]],
//!     ..Mesh::default()
//! };
//! write_mesh(&surface, &triangle, &WriteOptions::default())?;
//! assert_eq!(read_mesh(&surface)?, triangle);
//! # std::fs::remove_file(particles)?;
//! # std::fs::remove_file(surface)?;
//! # Ok(())
//! # }
//! ```
//!
//! Nothing that a file contains makes a reader panic, hang, or reserve memory out of proportion to the file's size.

mod columns;
mod content;
mod error;
mod formats;
mod meshes;
mod output;
mod particles;
mod positional;
mod rows;
mod scalar;
mod source;
mod table;
mod volumes;

pub use content::{Content, read_content};
pub use error::{Error, Place, printable};
pub use formats::catalog::{Format, FormatInfo, formats};
pub use formats::names::canonical as canonical_name;
pub use meshes::{
    PlyFile, PlyLayout, Up, WriteOptions, check_mesh_format, check_particle_format, check_quad_format, check_writable,
    read_mesh, remove_temporaries, write_file, write_mesh, write_pvd, write_quad_mesh,
};
pub use output::Written;
pub use particles::{
    AttributeChoice, AttributeValues, ParticleAttribute, Particles, PositionData, PvdEntry, RawType, ReadOptions,
    read_particles, read_pvd, write_particles,
};
pub use volumes::{
    Axes, Grid, Order, Placement, RawVolume, SampleType, Samples, Scaling, Space, VolumeArray, VolumeData, VolumeFile,
    VolumeHeader, VolumeOptions, check_volume_format, holds_volume, open_volume, read_volume, write_volume,
};
