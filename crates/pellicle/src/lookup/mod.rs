//! Who is near: particles sorted into cells, found again by integer coordinates.

pub(crate) mod cells;

use crate::lattice::Coord;

/// From coordinates to a dense index. Only looked up, never iterated, so that its order cannot reach a result.
pub(crate) type Directory = rustc_hash::FxHashMap<Coord, u32>;
