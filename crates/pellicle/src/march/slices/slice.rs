//! Slice caches: what is known of the nodes of one lattice plane, and a pool of them.
//!
//! ```text
//! rows     known, inside, shaded, done above, done below, made along x, y, z: one u64 a row, bit x is node (x, y)
//! arrays   values, vertex numbers, outward vectors, user data: x fastest, meaningful where the row's bit is set
//! ```
//!
//! A bit says whether the number behind it means anything, so the arrays are never cleared, and clearing a slice is to
//! clear the rows that it touched. Vertices are found through the bits of the edge's lower node, without a search.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 4; bits and dense arrays take the
//! place of its index array and growing corner cache.

use crate::{lookup::columns::provide, math::bits::ones};

/// Most nodes of a slice along an axis: the bits of a row.
pub(crate) const WIDEST: usize = 64;

/// One bit a node.
pub(crate) type Rows = [u64; WIDEST];

/// What is known of one lattice plane. `C` is the user's data of a corner.
pub(crate) struct Slice<C> {
    /// Nodes whose value is known; those of them that are inside.
    pub(crate) known: Rows,
    pub(crate) inside: Rows,
    /// Corners whose outward vector and user data are known.
    pub(crate) shaded: Rows,
    /// Cubes of the slab above, and of the slab below, that were visited.
    pub(crate) done: [Rows; 2],
    /// Edges, owned by their lower node, along x, y, z, whose vertex has a number.
    pub(crate) made: [Rows; 3],
    pub(crate) values: Vec<f32>,
    pub(crate) vertices: [Vec<u32>; 3],
    pub(crate) outward: Vec<[f32; 3]>,
    pub(crate) corners: Vec<C>,
    /// Rows with a bit set.
    touched: u64,
}

/// Index of the cubes above a slice in [`Slice::done`].
pub(crate) const ABOVE: usize = 0;
/// Index of the cubes below a slice.
pub(crate) const BELOW: usize = 1;

impl<C: Copy + Default> Slice<C> {
    fn new() -> Self {
        let none = [0; WIDEST];
        Self {
            known: none,
            inside: none,
            shaded: none,
            done: [none; 2],
            made: [none; 3],
            values: Vec::new(),
            vertices: [const { Vec::new() }; 3],
            outward: Vec::new(),
            corners: Vec::new(),
            touched: 0,
        }
    }

    /// Makes room for `nodes` nodes, of which `shaded` will have outward vectors and user data.
    fn reserve(&mut self, nodes: usize, shaded: usize) {
        if self.values.len() < nodes {
            self.values.resize(nodes, 0.0);
            self.vertices.iter_mut().for_each(|v| v.resize(nodes, 0));
        }
        if self.outward.len() < shaded {
            self.outward.resize(shaded, [0.0; 3]);
            self.corners.resize(shaded, C::default());
        }
    }

    /// Notes that row `y` will be written to.
    #[inline(always)]
    pub(crate) fn touch(&mut self, y: usize) {
        self.touched |= 1 << y;
    }

    fn clear(&mut self) {
        for y in ones(self.touched) {
            self.known[y] = 0;
            self.inside[y] = 0;
            self.shaded[y] = 0;
            self.done.iter_mut().chain(&mut self.made).for_each(|rows| rows[y] = 0);
        }
        self.touched = 0;
    }
}

/// Slices in use, by their height, and those to be used again.
pub(crate) struct Pool<C> {
    slices: Vec<Slice<C>>,
    free: Vec<u8>,
    /// Which slice stands at each height.
    at: [u8; WIDEST],
    /// Nodes of a slice, and those of them that are shaded.
    nodes: usize,
    shaded: usize,
    live: usize,
    /// Most slices in use at once.
    pub(crate) most: usize,
}

const NONE: u8 = u8::MAX;

impl<C: Copy + Default> Default for Pool<C> {
    fn default() -> Self {
        Self { slices: Vec::new(), free: Vec::new(), at: [NONE; WIDEST], nodes: 0, shaded: 0, live: 0, most: 0 }
    }
}

impl<C: Copy + Default> Pool<C> {
    /// Starts a block.
    pub(crate) fn begin(&mut self, nodes: usize, shaded: usize) {
        (self.nodes, self.shaded, self.live, self.most) = (nodes, shaded, 0, 0);
    }

    /// Makes so many slices as large as the last block's.
    pub(crate) fn provide(&mut self, slices: usize, nodes: usize, shaded: usize) {
        provide(&mut self.free, slices.max(WIDEST));
        while self.slices.len() < slices {
            self.free.push(self.slices.len() as u8);
            self.slices.push(Slice::new());
        }
        self.slices.iter_mut().for_each(|slice| slice.reserve(nodes, shaded));
    }

    /// Sees to it that there is a slice at height `z`.
    pub(crate) fn ensure(&mut self, z: usize) {
        if self.at[z] != NONE {
            return;
        }
        let slice = self.free.pop().unwrap_or_else(|| {
            self.slices.push(Slice::new());
            self.slices.len() as u8 - 1
        });
        self.slices[usize::from(slice)].reserve(self.nodes, self.shaded);
        self.at[z] = slice;
        self.live += 1;
        self.most = self.most.max(self.live);
    }

    /// Gives the slice at height `z` back, cleared.
    pub(crate) fn release(&mut self, z: usize) {
        let slice = std::mem::replace(&mut self.at[z], NONE);
        if slice != NONE {
            self.slices[usize::from(slice)].clear();
            self.free.push(slice);
            self.live -= 1;
        }
    }

    /// The slices at heights `z` and `z + 1`, which must be there.
    #[inline(always)]
    pub(crate) fn pair(&mut self, z: usize) -> [&mut Slice<C>; 2] {
        let [a, b] = [self.at[z], self.at[z + 1]].map(usize::from);
        let (low, high) = (a.min(b), a.max(b));
        let (left, right) = self.slices.split_at_mut(high);
        let (first, second) = (&mut left[low], &mut right[0]);
        if a < b { [first, second] } else { [second, first] }
    }

    /// Bytes that the most slices of this block took.
    pub(crate) fn bytes(&self) -> usize {
        let rows = 8 * size_of::<Rows>();
        self.most * (rows + self.nodes * 16 + self.shaded * (12 + size_of::<C>()))
    }
}

/// Cubes of one slab that are still to be visited, each once.
#[derive(Clone)]
pub(crate) struct Todo {
    pub(crate) rows: Rows,
    pub(crate) filled: u64,
}

impl Default for Todo {
    fn default() -> Self {
        Self { rows: [0; WIDEST], filled: 0 }
    }
}

impl Todo {
    #[inline(always)]
    pub(crate) fn push(&mut self, x: usize, y: usize) {
        self.push_row(y, 1 << x);
    }

    #[inline(always)]
    pub(crate) fn push_row(&mut self, y: usize, cubes: u64) {
        self.rows[y] |= cubes;
        self.filled |= u64::from(cubes != 0) << y;
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<(usize, usize)> {
        if self.filled == 0 {
            return None;
        }
        let y = self.filled.trailing_zeros() as usize;
        let x = self.rows[y].trailing_zeros() as usize;
        self.take(x, y);
        Some((x, y))
    }

    /// Removes a cube.
    #[inline(always)]
    pub(crate) fn take(&mut self, x: usize, y: usize) {
        self.rows[y] &= !(1 << x);
        self.filled &= !(u64::from(self.rows[y] == 0) << y);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.filled == 0
    }
}
