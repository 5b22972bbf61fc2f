//! Where to look.

pub(crate) mod band;
pub(crate) mod levels;
pub(crate) mod store;
