//! Who is near: particles sorted into cells, entered in columns or in the bricks of a layer, octets found by coordinates.

pub(crate) mod cells;
pub(crate) mod columns;
pub(crate) mod directory;
pub(crate) mod gather;
pub(crate) mod isolated;
pub(crate) mod layer;
