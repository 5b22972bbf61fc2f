//! Codes to exact counts: where every row's vertices and triangles will go.
//!
//! Source: this project; see [`super`].

use rayon::prelude::*;

use super::{
    cell::{meets, polygonize},
    codes::Codes,
};
use crate::{
    Control, Error,
    march::rows::{
        Shape,
        places::{self, Places},
    },
    math::bits::ones,
};

/// Kinds of vertices: of edges along x, y, z, of xy, xz, yz faces, of cells.
pub(crate) const KINDS: usize = 7;

/// Of each row: vertices of all kinds.
pub(crate) type Place = places::Place<KINDS>;

/// The counted rows of a lattice, and the end.
pub(crate) type Counted = Places<KINDS>;

/// Rows that one task handles.
pub(crate) const GROUP: usize = 32;

impl Counted {
    /// Counts all rows.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`, [`Error::Cancelled`].
    pub(crate) fn new(codes: &dyn Codes, control: &Control<'_>) -> Result<Self, Error> {
        let rows = codes.shape().rows();
        let mut places = vec![Place::default(); rows + 1];
        places[..rows].par_chunks_mut(GROUP).enumerate().try_for_each(|(group, to)| {
            control.check()?;
            for_rows(codes, group * GROUP..group * GROUP + to.len(), |row, four| {
                let place = &mut to[row - group * GROUP];
                for_words(codes.shape(), four, |word, w| count(four, &word, w, place));
            });
            Ok(())
        })?;
        Self::of(places, 0)
    }
}

/// Adds what one word of a row has.
fn count(four: &Four<'_>, word: &Word, w: usize, to: &mut Place) {
    for (kind, set) in word.own().into_iter().enumerate() {
        to.vertices[kind] += set.count_ones();
    }
    for bit in ones(word.cells) {
        let cell = polygonize(&four.labels(64 * w + bit));
        to.vertices[6] += cell.inner_len as u32;
        to.triangles += cell.len as u64;
    }
}

/// Codes of the four rows around a row of cells: (j, k), (j + 1, k), (j, k + 1), (j + 1, k + 1). Where the lattice ends a row
/// stands in for the one that is missing: nothing is crossed there.
pub(crate) struct Four<'a> {
    pub(crate) rows: [&'a [u32]; 4],
    /// Whether all four are there.
    pub(crate) has_cells: bool,
}

impl Four<'_> {
    /// Labels of the corners of cell `i`.
    pub(crate) fn labels(&self, i: usize) -> [u32; 8] {
        std::array::from_fn(|c| self.rows[c >> 1][i + (c & 1)])
    }
}

/// Calls `work` with each of some rows and the four around it. Rows are read once, for as long as a task needs them.
pub(crate) fn for_rows(codes: &dyn Codes, rows: std::ops::Range<usize>, mut work: impl FnMut(usize, &Four<'_>)) {
    let [nx, ny, nz] = codes.shape().nodes;
    if nx == 0 || rows.is_empty() {
        return;
    }
    // Two runs of rows: those asked for and the next, and the same a slab further.
    let width = rows.len() + 1;
    let mut read = vec![0u32; 2 * width * nx];
    for (n, to) in read.chunks_exact_mut(nx).enumerate() {
        let row = rows.start + n % width + (n / width) * ny;
        if row < ny * nz {
            codes.row(row % ny, row / ny, to);
        }
    }
    let at = |n: usize, slab: usize| &read[(slab * width + n) * nx..][..nx];
    for row in rows.clone() {
        let n = row - rows.start;
        let (has_y, has_z) = (row % ny + 1 < ny, row / ny + 1 < nz);
        let (y, z) = (usize::from(has_y), usize::from(has_z));
        let rows = [at(n, 0), at(n + y, 0), at(n, z), at(n + y, z)];
        work(row, &Four { rows, has_cells: has_y && has_z });
    }
}

/// What is crossed at 64 nodes of a row.
#[derive(Clone, Copy)]
pub(crate) struct Word {
    /// Edges that differ: along x of the four rows, along y at k and k + 1, along z at j and j + 1.
    pub(crate) edges: [u64; 8],
    /// Faces with a vertex: yz; xz at j and j + 1; xy at k and k + 1.
    pub(crate) faces: [u64; 5],
    /// Cells with corners of different labels.
    pub(crate) cells: u64,
}

impl Word {
    /// Sets of the row's own vertices, by kind, cells left out.
    pub(crate) fn own(&self) -> [u64; KINDS - 1] {
        let ([x, _, _, _, y, _, z, _], [yz, xz, _, xy, _]) = (self.edges, self.faces);
        [x, y, z, xy, xz, yz]
    }
}

/// Calls `work` with each word of a row that has something crossed, and its number.
pub(crate) fn for_words(shape: &Shape, four: &Four<'_>, mut work: impl FnMut(Word, usize)) {
    for w in 0..shape.words() {
        if !is_uniform(four, 64 * w, shape.nodes[0]) {
            work(word(shape, four, w), w);
        }
    }
}

/// Whether the cells of a word have one label.
fn is_uniform(four: &Four<'_>, from: usize, nodes: usize) -> bool {
    let (end, label) = ((from + 65).min(nodes), four.rows[0][from]);
    four.rows.iter().all(|row| row[from..end].iter().fold(0, |differ, &code| differ | (code ^ label)) == 0)
}

/// The nodes from `from` on at which two rows differ, of up to 64.
fn differ(a: &[u32], b: &[u32]) -> u64 {
    let mut set = 0;
    for (i, (a, b)) in a.iter().zip(b).take(64).enumerate() {
        set |= u64::from(a != b) << i;
    }
    set
}

fn word(shape: &Shape, four: &Four<'_>, w: usize) -> Word {
    let (from, with_next) = (64 * w, shape.with_next(w));
    let row = |r: usize| &four.rows[r][from..];
    let x: [u64; 4] = std::array::from_fn(|r| differ(row(r), &row(r)[1..]));
    // Between two rows at these nodes, and at each one's next.
    let between = |a: usize, b: usize| {
        let (here, beyond) = (differ(row(a), row(b)), from + 64);
        let last = beyond < shape.nodes[0] && four.rows[a][beyond] != four.rows[b][beyond];
        [here, here >> 1 | u64::from(last) << 63]
    };
    let [y, y_up, z, z_right] = [between(0, 1), between(2, 3), between(0, 2), between(1, 3)];
    let l = |r: usize, i: usize| four.rows[r][from + i];
    // Of faces with three crossed sides or four.
    let meeting = |sides: [u64; 4], around: &dyn Fn(usize) -> [u32; 4]| {
        let [a, b, c, d] = sides;
        let three = (a & b & (c | d)) | (c & d & (a | b));
        ones(three).filter(|&i| meets(around(i))).fold(0u64, |set, i| set | 1 << i)
    };
    let xy = |r: usize, y: [u64; 2]| {
        let around = move |i: usize| [l(r, i), l(r, i + 1), l(r + 1, i + 1), l(r + 1, i)];
        meeting([x[r], x[r + 1], y[0], y[1]].map(|side| side & with_next), &around)
    };
    let xz = |r: usize, z: [u64; 2]| {
        let around = move |i: usize| [l(r, i), l(r, i + 1), l(r + 2, i + 1), l(r + 2, i)];
        meeting([x[r], x[r + 2], z[0], z[1]].map(|side| side & with_next), &around)
    };
    let yz = meeting([y[0], y_up[0], z[0], z_right[0]], &|i| [l(0, i), l(1, i), l(3, i), l(2, i)]);
    let all = [x[0], x[1], x[2], x[3], y[0], y_up[0], z[0], z_right[0]];
    let of_cells = all.iter().fold(0, |set, side| set | side) | y[1] | y_up[1] | z[1] | z_right[1];
    Word {
        edges: all,
        faces: [yz, xz(0, z), xz(1, z_right), xy(0, y), xy(2, y_up)],
        cells: if four.has_cells { of_cells & with_next } else { 0 },
    }
}
