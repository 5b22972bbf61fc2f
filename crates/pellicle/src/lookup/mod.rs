//! Who is near: particles sorted into cells or entered in columns, octets found by their coordinates.

pub(crate) mod cells;
pub(crate) mod columns;
pub(crate) mod directory;
pub(crate) mod gather;
pub(crate) mod isolated;
