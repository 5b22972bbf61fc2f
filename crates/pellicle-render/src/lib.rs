//! A mesh or particles to a PNG, without a GPU or a window.
//!
//! ```text
//!  meshes, spheres ─ Scene ─┐
//!  bounds ─ Framing ─ Camera ─┼─► draw ─► Image ─► encode_png
//!  size, background ─ Settings┘
//!  mesh ─────────────────────────► page ─► one HTML file that shows it in a browser
//! ```
//!
//! ```
//! use pellicle_render::{Framing, Scene, Settings, draw};
//!
//! let mesh = pellicle::reconstruct(&[[0.0f32, 0.0, 0.0], [0.06, 0.0, 0.0]], &pellicle::Params::new(0.05))?;
//! let scene = Scene::of_mesh(&mesh);
//! let settings = Settings::new(320, 200);
//! let camera = Framing::default().fit(&scene.bounds(), settings.aspect())?;
//! let png = draw(&scene, &camera, &settings)?.encode_png()?;
//! assert!(png.starts_with(b"\x89PNG"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How
//! The picture is cut into tiles. Triangles are projected, snapped to 1/256 pixel and listed for the tiles that they meet;
//! each tile finds for every sample what is nearest, then shades what is seen once per pixel, in linear light. Spheres are
//! spheres: each sample's ray meets them at its own depth, so they cut each other and meshes as they should.
//!
//! # What is guaranteed
//! Same input, same bytes, for every number of threads, and by construction on every platform: only operations that IEEE
//! 754 rounds in one way are used. Two triangles that share an edge leave no gap. Any mesh can be drawn: the camera may
//! stand inside, triangles may be degenerate, vertices that are not finite take their triangles with them. And what not:
//! there are no shadows and no transparency, and spheres much smaller than a pixel fall between samples.
//!
//! Colors are sRGB, lengths world units, pixels count from the upper left corner. The library prints nothing, opens no
//! files, and runs in the current rayon pool.

mod bar;
mod bounds;
mod camera;
mod color;
mod draw;
mod error;
mod image;
mod lighting;
mod page;
mod ramp;
mod raster;
mod scene;
mod settings;
mod stage;
mod surface;
mod text;
mod texture;
mod vector;
mod view;

pub use bounds::Bounds;
pub use camera::{Camera, Framing, Lens};
pub use color::Color;
pub use draw::draw;
pub use error::Error;
pub use image::Image;
pub use page::{Page, page};
pub use scene::{Layer, Paint, Radius, Scalars, Scene, Shading, Spheres, Surface, Wireframe};
pub use settings::{Background, Bars, Samples, Settings};
pub use texture::Texture;
