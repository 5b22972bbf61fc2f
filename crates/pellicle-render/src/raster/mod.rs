//! Who is seen where: from triangles and spheres to one number for every sample of every pixel.
//!
//! ```text
//! vertices ─ corners ─► fixed-point corners ─ bins ─► a list for each tile ─ tile ─► key and id of each sample
//! ```
//!
//! Nothing is shaded here. A sample keeps the id of what is nearest, so work that is hidden is never done twice, and the
//! result does not depend on the order of work: of two at the same depth the lower id is seen.
//!
//! Corners are snapped to 1/256 pixel, and edges are tested in integers (held exactly in `f64`) with the top-left rule: two
//! triangles that share an edge leave no gap between them and cover no sample twice.

mod ball;
mod bins;
mod corners;
mod tile;

pub(crate) use ball::Ball;
pub(crate) use bins::{Bins, Grid};
pub(crate) use corners::{Corner, pieces};
pub(crate) use tile::{NOTHING, Pattern, Tile};

/// Edge of a tile in pixels: with four samples its keys and ids fit a first-level cache.
pub(crate) const TILE: u32 = 32;

/// Steps of a pixel's edge that corners are snapped to.
pub(crate) const SUBPIXELS: i32 = 256;
