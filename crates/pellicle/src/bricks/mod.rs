//! Where to look: which bricks may hold a crossing and what reaches them, how the world is cut into blocks, and how fine each
//! block is.

pub(crate) mod band;
pub(crate) mod blocks;
pub(crate) mod boxes;
pub(crate) mod budget;
mod close;
mod halves;
pub(crate) mod levels;
pub(crate) mod lists;
pub(crate) mod marks;
pub(crate) mod store;
mod values;
