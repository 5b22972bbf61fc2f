//! Where to look: which bricks may hold a crossing, and how the world is cut into blocks.

pub(crate) mod band;
pub(crate) mod blocks;
pub(crate) mod boxes;
pub(crate) mod store;
