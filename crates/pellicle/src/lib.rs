//! Particles and volumes to surface meshes.

pub mod mesh;
pub mod particles;

mod error;
mod params;
mod pipeline;
mod progress;

pub use error::Error;
pub use mesh::{Mesh, VertexAttribute};
pub use params::{Band, Lanes, Params};
pub use particles::{Attribute, Positions};
pub use pipeline::{Chunk, Reconstructor, Stats, Surface, infer_radius};
pub use progress::{CancelToken, Control, Stage};
