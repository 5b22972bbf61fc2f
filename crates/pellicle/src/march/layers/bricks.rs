//! What is known of one layer of bricks: sides and values of nodes and, where vertices are, outward vectors and user data.
//!
//! ```text
//! inside    one u64 a brick: bit x + 4 y + 16 z is a node
//! needed    the nodes at ends of crossed edges, likewise
//! values    64 a brick: taken only by bricks that are evaluated, found through `place`
//! shades    outward vectors and user data: taken only by bricks with vertices, found through `shade`
//! ```
//!
//! Source: this project; bits in place of arrays of numbers as in [`slices`](crate::march::slices).

use super::{
    fill::NODES,
    sides::{MOST_ROWS, Wanted},
};
use crate::{bricks::lists::Lists, lookup::columns::provide};

/// No values, no shade.
const NONE: u16 = u16::MAX;

/// Outward vectors and user data of one brick's nodes.
#[derive(Clone)]
pub(super) struct Shade<C> {
    pub(super) outward: [[f32; NODES]; 3],
    pub(super) corners: Vec<C>,
    /// Planes whose outward vectors are known; nodes whose user data is.
    pub(super) planes: u8,
    pub(super) nodes: u64,
}

/// One layer of bricks. Reusable.
pub(super) struct Bricks<C> {
    pub(super) lists: Lists,
    pub(super) inside: Vec<u64>,
    /// Nodes at the ends of crossed edges.
    pub(super) needed: Vec<u64>,
    /// Bricks that have nodes inside, and rows of bricks that have any, one bit each.
    pub(super) solid: Wanted,
    pub(super) rows: u16,
    place: Vec<u16>,
    values: Vec<[f32; NODES]>,
    filled: usize,
    shade: Vec<u16>,
    shades: Vec<Shade<C>>,
    taken: usize,
}

impl<C> Default for Bricks<C> {
    fn default() -> Self {
        Self {
            lists: Lists::default(),
            inside: Vec::new(),
            needed: Vec::new(),
            solid: [0; MOST_ROWS],
            rows: 0,
            place: Vec::new(),
            values: Vec::new(),
            filled: 0,
            shade: Vec::new(),
            shades: Vec::new(),
            taken: 0,
        }
    }
}

impl<C: Copy + Default> Bricks<C> {
    /// Starts a layer of so many bricks of which nothing is known.
    pub(super) fn begin(&mut self, bricks: usize) {
        for bits in [&mut self.inside, &mut self.needed] {
            bits.clear();
            bits.resize(bricks, 0);
        }
        for places in [&mut self.place, &mut self.shade] {
            places.clear();
            places.resize(bricks, NONE);
        }
        self.solid = [0; MOST_ROWS];
        (self.rows, self.filled, self.taken) = (0, 0, 0);
    }

    /// Whether a brick has values.
    #[inline(always)]
    pub(super) fn is_filled(&self, brick: usize) -> bool {
        self.place[brick] != NONE
    }

    /// Gives a brick that has none a place for its values, with the lists.
    #[inline(always)]
    pub(super) fn place(&mut self, brick: usize) -> (&Lists, &mut [f32; NODES]) {
        self.place[brick] = self.filled as u16;
        self.filled += 1;
        if self.values.len() < self.filled {
            self.values.push([0.0; NODES]);
        }
        (&self.lists, &mut self.values[self.filled - 1])
    }

    /// The values of a brick that has them.
    #[inline(always)]
    pub(super) fn values_of(&self, brick: usize) -> &[f32; NODES] {
        &self.values[usize::from(self.place[brick])]
    }

    /// Lists, and the shade of a brick, which gets one if it has none, with room for so many nodes' user data.
    #[inline(always)]
    pub(super) fn shade(&mut self, brick: usize, corners: usize) -> (&Lists, &mut Shade<C>) {
        if self.shade[brick] == NONE {
            self.shade[brick] = self.taken as u16;
            self.taken += 1;
            if self.shades.len() < self.taken || self.shades[self.taken - 1].corners.len() < corners {
                self.grow(self.taken, corners);
            }
            let shade = &mut self.shades[self.taken - 1];
            (shade.planes, shade.nodes) = (0, 0);
        }
        (&self.lists, &mut self.shades[usize::from(self.shade[brick])])
    }

    #[cold]
    fn grow(&mut self, shades: usize, corners: usize) {
        self.shades.resize_with(shades.max(self.shades.len()), || Shade {
            outward: [[0.0; NODES]; 3],
            corners: Vec::new(),
            planes: 0,
            nodes: 0,
        });
        self.shades.iter_mut().for_each(|shade| shade.corners.resize(corners.max(shade.corners.len()), C::default()));
    }

    /// The shade of a brick that has one.
    #[inline(always)]
    pub(super) fn shade_of(&self, brick: usize) -> &Shade<C> {
        &self.shades[usize::from(self.shade[brick])]
    }

    /// Bricks with values, and with shades.
    pub(super) fn used(&self) -> [usize; 2] {
        [self.filled, self.taken]
    }

    /// Makes room for so many bricks, of which so many have values and shades, these with so many nodes' user data.
    pub(super) fn provide(&mut self, bricks: usize, [filled, shades]: [usize; 2], corners: usize) {
        provide(&mut self.inside, bricks);
        provide(&mut self.needed, bricks);
        provide(&mut self.place, bricks);
        provide(&mut self.shade, bricks);
        self.values.resize(filled.max(self.values.len()), [0.0; NODES]);
        self.grow(shades, corners);
    }

    /// Bytes in use, with shades of so many nodes' user data.
    pub(super) fn bytes(&self, corners: usize) -> usize {
        self.inside.len() * (8 + 8 + 2 + 2)
            + self.filled * size_of::<[f32; NODES]>()
            + self.taken * (size_of::<Shade<C>>() + corners * size_of::<C>())
    }
}
