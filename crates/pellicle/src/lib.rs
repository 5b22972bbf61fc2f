//! Particles and volumes to surface meshes.

pub mod mesh;
pub mod particles;

mod bricks;
mod error;
mod field;
mod fill;
mod lattice;
mod lookup;
mod march;
mod math;
mod params;
mod pipeline;
mod progress;
mod stats;

pub use error::Error;
pub use mesh::{Mesh, VertexAttribute};
pub use params::{Band, Lanes, Params};
pub use particles::{Attribute, Positions, infer_radius};
pub use pipeline::{Chunk, Reconstructor, Surface, reconstruct};
pub use progress::{CancelToken, Control, Stage};
pub use stats::Stats;
