//! Where to look: which bricks may hold a crossing, and which particles matter there.

pub(crate) mod band;
pub(crate) mod gather;
pub(crate) mod store;
