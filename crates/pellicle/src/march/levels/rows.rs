//! Signs and vertex numbers of blocks, a word of bits for each row of nodes.
//!
//! ```text
//! row (j, k) of a block of n cells    signs: bit i is node (i, j, k), i in 0..=n
//! crossed along x                     signs xor signs shifted by one node
//! crossed along y, z                  signs xor those of row (j + 1, k), (j, k + 1)
//! owned                               a mask by the row's and the bits' sides (see `around`)
//! number of a vertex                  first of its block + base of its row and axis + rank among the owned bits before
//! ```
//!
//! A block's nodes include those of its high border, so that its cells need no other block's signs. Vertices come block
//! after block; within one by row, x fastest, then axis, then node.
//!
//! Source: this project; see [`super`].

use super::around::{Around, OTHER, side};
use crate::{
    Error,
    bricks::levels::{AROUND, Levels, SELF, offset},
    lattice::Coord,
};

/// One row of nodes along x.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub(crate) signs: u64,
    /// Owned vertices of the block before those on this row's edges along x, y, z.
    base: [u32; 3],
}

/// Rows of all blocks, and what is needed to find a vertex. Reusable.
#[derive(Default)]
pub(crate) struct Rows {
    /// Finest cells of a block along an axis: at most 62, and a multiple of the widest cell.
    pub(crate) side: usize,
    pub(crate) levels: Levels,
    pub(crate) around: Vec<Around>,
    /// Where each block's rows begin, and the end.
    pub(crate) first: Vec<usize>,
    pub(crate) rows: Vec<Row>,
    /// Number of the first vertex of each block, and the end.
    pub(crate) first_vertex: Vec<u32>,
}

/// One block's rows.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    /// Cells along an axis.
    pub(crate) n: usize,
    pub(crate) rows: &'a [Row],
    pub(crate) around: &'a Around,
}

impl View<'_> {
    #[inline(always)]
    fn row(&self, j: usize, k: usize) -> &Row {
        &self.rows[j + (self.n + 1) * k]
    }

    /// Whether a node is inside.
    #[inline(always)]
    pub(crate) fn inside(&self, at: [usize; 3]) -> bool {
        self.row(at[1], at[2]).signs >> at[0] & 1 == 1
    }

    /// Crossed edges along `axis` whose lower nodes are on row (j, k).
    #[inline(always)]
    pub(crate) fn crossed(&self, axis: usize, j: usize, k: usize) -> u64 {
        let here = self.row(j, k).signs;
        match axis {
            0 => (here ^ here >> 1) & ((1 << self.n) - 1),
            1 if j < self.n => here ^ self.row(j + 1, k).signs,
            2 if k < self.n => here ^ self.row(j, k + 1).signs,
            _ => 0,
        }
    }

    /// Those of them whose vertices this block owns.
    #[inline(always)]
    pub(crate) fn owned(&self, axis: usize, j: usize, k: usize) -> u64 {
        let n = self.n;
        let crossed = self.crossed(axis, j, k);
        if crossed == 0 {
            return 0;
        }
        let mine = |sides| self.around.owner(axis, sides) == SELF;
        if axis == 0 {
            return if mine([side(j, n), side(k, n)]) { crossed } else { 0 };
        }
        let across = if axis == 1 { side(k, n) } else { side(j, n) };
        let within = ((1u64 << n) - 1) & !1;
        let low = u64::from(mine([0, across]));
        let middle = if mine([1, across]) { within } else { 0 };
        let high = u64::from(mine([2, across])) << n;
        crossed & (low | middle | high)
    }

    /// Signs of the rows (j, k), (j + 1, k), (j, k + 1), (j + 1, k + 1), and the cells between them that are crossed.
    #[inline(always)]
    pub(crate) fn cells(&self, j: usize, k: usize) -> ([u64; 4], u64) {
        let rows = [(j, k), (j + 1, k), (j, k + 1), (j + 1, k + 1)].map(|(j, k)| self.row(j, k).signs);
        let any = rows.iter().fold(0, |a, b| a | b);
        let all = rows.iter().fold(u64::MAX, |a, b| a & b);
        let crossed = (any | any >> 1) & !(all & all >> 1) & ((1 << self.n) - 1);
        (rows, crossed)
    }
}

/// The case of cell i between four rows.
#[inline(always)]
pub(crate) fn case(rows: &[u64; 4], i: usize) -> usize {
    let pair = |row: u64| (row >> i & 3) as usize;
    pair(rows[0]) | pair(rows[1]) << 2 | pair(rows[2]) << 4 | pair(rows[3]) << 6
}

impl Rows {
    /// Cells along an axis of a block.
    #[inline(always)]
    pub(crate) fn cells(&self, block: usize) -> usize {
        self.side >> self.levels.level[block]
    }

    /// Finest cells that a cell of a block is wide.
    #[inline(always)]
    pub(crate) fn stride(&self, block: usize) -> i32 {
        1 << self.levels.level[block]
    }

    /// First node of a block on the finest lattice.
    #[inline(always)]
    pub(crate) fn first_node(&self, block: usize) -> Coord {
        self.levels.at[block].map(|v| v * self.side as i32)
    }

    /// One block's rows.
    #[inline(always)]
    pub(crate) fn view(&self, block: usize) -> View<'_> {
        View {
            n: self.cells(block),
            rows: &self.rows[self.first[block]..self.first[block + 1]],
            around: &self.around[block],
        }
    }

    /// Makes room for the rows of all blocks that are shown.
    pub(crate) fn lay_out(&mut self) {
        self.around.clear();
        self.around.extend((0..self.levels.len()).map(|block| Around::new(&self.levels, block)));
        self.first.clear();
        let mut end = 0;
        self.first.push(end);
        for block in 0..self.levels.len() {
            end += if self.levels.hidden[block] { 0 } else { (self.cells(block) + 1).pow(2) };
            self.first.push(end);
        }
        self.rows.clear();
        self.rows.resize(end, Row::default());
    }

    /// Gives every block its first vertex number.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn place_vertices(&mut self, counts: &[u32]) -> Result<(), Error> {
        let needed: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        if needed > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed, available: u32::MAX.into() });
        }
        self.first_vertex.clear();
        let mut end = 0;
        self.first_vertex.push(end);
        self.first_vertex.extend(counts.iter().map(|&count| {
            end += count;
            end
        }));
        Ok(())
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        let block = size_of::<Coord>() + size_of::<u8>() + size_of::<[u32; AROUND]>() + size_of::<Around>() + 12;
        self.rows.len() * size_of::<Row>() + self.levels.len() * block
    }

    /// Number of the vertex on a crossed lattice edge of a block, given by its axis and its lower node in the block.
    #[inline(always)]
    pub(crate) fn vertex(&self, block: usize, axis: usize, at: [usize; 3]) -> u32 {
        let n = self.cells(block);
        let owner = self.around[block].owner(axis, OTHER[axis].map(|a| side(at[a], n)));
        if owner == SELF {
            return self.owned_vertex(block, axis, at);
        }
        let d = offset(owner);
        let there = std::array::from_fn(|a| (at[a] as i32 - d[a] * n as i32) as usize);
        self.owned_vertex(self.levels.near[block][owner] as usize, axis, there)
    }

    #[inline(always)]
    fn owned_vertex(&self, block: usize, axis: usize, [i, j, k]: [usize; 3]) -> u32 {
        let view = self.view(block);
        let before = view.owned(axis, j, k) & ((1 << i) - 1);
        self.first_vertex[block] + view.row(j, k).base[axis] + before.count_ones()
    }
}

/// Numbers the vertices that a block owns: fills in the bases, and returns how many they are.
pub(crate) fn number(rows: &mut [Row], n: usize, around: &Around) -> u32 {
    let mut count = 0;
    for k in 0..=n {
        for j in 0..=n {
            let view = View { n, rows, around };
            let base = std::array::from_fn(|axis| {
                let before = count;
                count += view.owned(axis, j, k).count_ones();
                before
            });
            rows[j + (n + 1) * k].base = base;
        }
    }
    count
}
