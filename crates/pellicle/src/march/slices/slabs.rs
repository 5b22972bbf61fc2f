//! Triangles of a block that are kept back until its march is over, and then put in the viewer's order.
//!
//! The march sometimes steps back to a lower slab, and within a slab it follows the surface. So what it makes is kept with its
//! cube, and at the end written slab by slab, row by row, cube by cube, in the product order of [`order`](super::order). In
//! place of an index buffer a slab there is one for all of them, and a key a cube that sorts them: it is no larger, whatever
//! slab the triangles are in.
//!
//! ```text
//! cubes       one u64 a cube: place of slab, row and cube in the order, how many triangles, where they begin
//! triangles   as they were made
//! ```
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 5: index buffers for each slab.

use crate::lookup::columns::provide;

/// Where a key has the number of triangles, at most 5, and the place in the order.
const COUNT: u32 = 32;
const PLACE: u32 = 40;

/// Cubes with triangles, and these. Reusable.
#[derive(Default)]
pub(super) struct Slabs {
    cubes: Vec<u64>,
    triangles: Vec<[u32; 3]>,
}

/// How many cubes and triangles there were at most.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Room {
    cubes: usize,
    triangles: usize,
}

impl Room {
    /// Room for both.
    pub(super) fn join(&self, other: &Self) -> Self {
        Self { cubes: self.cubes.max(other.cubes), triangles: self.triangles.max(other.triangles) }
    }
}

impl Slabs {
    /// Starts a block.
    pub(super) fn clear(&mut self) {
        self.cubes.clear();
        self.triangles.clear();
    }

    /// Takes the triangles of the cube that has this place in the order.
    #[inline(always)]
    pub(super) fn push(&mut self, place: u32, triangles: impl Iterator<Item = [u32; 3]>) {
        let first = self.triangles.len();
        self.triangles.extend(triangles);
        let count = (self.triangles.len() - first) as u64;
        self.cubes.push(u64::from(place) << PLACE | count << COUNT | first as u64);
    }

    /// Writes all triangles, cubes in order.
    pub(super) fn write(&mut self, to: &mut Vec<[u32; 3]>) {
        self.cubes.sort_unstable();
        to.reserve(self.triangles.len());
        for &cube in &self.cubes {
            let (first, count) = (cube as u32 as usize, (cube >> COUNT & 0xff) as usize);
            to.extend_from_slice(&self.triangles[first..first + count]);
        }
    }

    /// What the last block took.
    pub(super) fn room(&self) -> Room {
        Room { cubes: self.cubes.len(), triangles: self.triangles.len() }
    }

    /// Makes room for a block that takes this much.
    pub(super) fn provide(&mut self, room: &Room) {
        provide(&mut self.cubes, room.cubes);
        provide(&mut self.triangles, room.triangles);
    }

    /// Bytes in use.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.cubes[..]) + size_of_val(&self.triangles[..])
    }
}
