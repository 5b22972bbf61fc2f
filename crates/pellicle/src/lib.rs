//! Particles and volumes to surface meshes: fast, exact, in bounded memory, the same bytes every time.
//!
//! ```text
//!  positions, attributes ──► Reconstructor::extract ──► Surface (exact counts) ──┬─► Mesh
//!                                                                                └─► chunks, written anywhere
//!  stage by stage:  sort ─► Sorted ─► weigh ─► Weighed ─► sample ─► Sampled ─► count ─► Surface
//! ```
//!
//! A volume, any regular grid of samples in memory, goes through [`contour`] instead.
//!
//! One call does it all:
//!
//! ```
//! let positions = [[0.0f32, 0.0, 0.0], [0.05, 0.0, 0.0]];
//! let mesh = pellicle::reconstruct(&positions, &pellicle::Params::new(0.025))?;
//! assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
//! # Ok::<(), pellicle::Error>(())
//! ```
//!
//! # Conventions
//! A sample is *inside* when it is greater than the isovalue; equal is outside. Triangles wind counter-clockwise seen from
//! outside, normals point outward. The lattice is anchored at the world's origin, so that a still fluid gives the same
//! triangles in every frame. A mesh is an `f64` origin plus `f32` offsets.
//!
//! # What a mesh guarantees
//! Closed, oriented, 2-manifold, by index and without welding; the same bytes for any number of threads, any memory limit
//! and any vector unit. And what not: no two vertices need be at different places (a sample may equal the isovalue), thin
//! triangles occur, and where a cell's signs are ambiguous inside corners are kept apart, which need not be the topology of
//! the trilinear interpolant.
//!
//! The library prints nothing, reads no clock and starts no threads of its own: it runs in the current rayon pool.

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals;
pub mod mesh;
pub mod particles;
pub mod post;
pub mod sink;

/// Surfaces over moving particles, every frame: road B. See [`Engine`](realtime::Engine).
pub mod realtime {
    pub use crate::{
        march::slices::{
            Clock, Counts, CustomField, DrawOrder, Neighbour, Neighbours, Plain, Seeds, Skin, Sorting, Times,
        },
        pipeline::engine::{Engine, Frame, MOST_LEVELS, Metaball, Params, Particles, Region, Reuse, Sweep, View},
    };
}

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
pub use field::balls::Metaballs;
pub use field::crowding::crowding;
pub use field::function::{Domain, Function, Warp};
pub use field::noise::{Noise, Turbulent};
pub use field::surface_particles::surface_particles;
pub use field::volume::{Border, Interpolant, Samples, Volume};
pub use field::warp::{Depth, Projection, View};
pub use lookup::isolated::{IsolationParams, isolated};
pub use march::resolve::Level;
pub use mesh::{Mesh, QuadMesh, VertexAttribute};
pub use params::{
    AnisotropicParams, Band, FieldParameter, Lanes, MetaballKernel, MetaballParams, OnderikParams, Params, ScalarField,
    SolenthalerParams, ZhuBridsonParams,
};
pub use particles::{Attribute, Carry, Ghosts, Positions, Solid, Walls, infer_radius};
pub use pipeline::{
    Chunk, Contour, ContourParams, ContourPiece, ContourStream, LabelParams, PoolUse, Reconstructor, Sampled, Sorted,
    StreamSample, StreamShape, Surface, Tetrahedra, TetrahedraParams, VertexNormals, Weighed, contour,
    contour_function, contour_function_tetrahedra, contour_labels, contour_tetrahedra, reconstruct,
};
pub use progress::{CancelToken, Control, Stage};
pub use sink::pool::VertexPool;
pub use stats::Stats;
