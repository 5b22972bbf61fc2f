//! Who is near: particles sorted into cells, octets found by their coordinates.

pub(crate) mod cells;
pub(crate) mod directory;
pub(crate) mod gather;
pub(crate) mod isolated;
