//! Where to look: which bricks may hold a crossing.

pub(crate) mod band;
pub(crate) mod store;
