//! Writes the vertices and triangles of counted rows to their places.
//!
//! Source: this project; see [`super`].

use std::ops::Range;

use super::{
    cell::{FACES, INSIDE, polygonize},
    codes::Codes,
    count::{Counted, Four, GROUP, KINDS, Word, for_rows, for_words},
};
use crate::{
    march::rows::Shape,
    math::{bits::ones, ranges::for_each_part},
};

/// A counted volume of labels.
pub(crate) struct Emit<'a> {
    pub(crate) codes: &'a dyn Codes,
    pub(crate) counted: &'a Counted,
}

/// Where in the cell at a node each kind of vertex lies, but for those inside.
const MIDDLES: [[f64; 3]; KINDS - 1] =
    [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];

impl Emit<'_> {
    fn shape(&self) -> &Shape {
        self.codes.shape()
    }

    fn groups(&self) -> usize {
        self.shape().rows().div_ceil(GROUP)
    }

    fn group_start(&self, group: usize) -> usize {
        (group * GROUP).min(self.shape().rows())
    }

    fn group(&self, group: usize) -> Range<usize> {
        self.group_start(group)..self.group_start(group + 1)
    }

    /// Writes all vertices, as offsets from the volume's origin.
    pub(crate) fn vertices(&self, to: &mut [[f32; 3]]) {
        let start = |group: usize| self.counted.place(self.group_start(group)).vertices[0] as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [[f32; 3]]| {
            if !to.is_empty() {
                self.group_vertices(group, to);
            }
        });
    }

    fn group_vertices(&self, group: usize, to: &mut [[f32; 3]]) {
        let (rows, shape) = (self.group(group), self.shape());
        let base = self.counted.place(rows.start).vertices[0];
        for_rows(self.codes, rows, |row, four| {
            let start = shape.row_start(row);
            let mut next = self.counted.place(row).vertices.map(|first| (first - base) as usize);
            let mut write = |kind: usize, i: usize, at: [f64; 3]| {
                to[next[kind]] = shape.in_cell(&start, i, at);
                next[kind] += 1;
            };
            for_words(shape, four, |word, w| {
                for (kind, set) in word.own().into_iter().enumerate() {
                    ones(set).for_each(|bit| write(kind, 64 * w + bit, MIDDLES[kind]));
                }
                for bit in ones(word.cells) {
                    let cell = polygonize(&four.labels(64 * w + bit));
                    (0..cell.inner_len).for_each(|n| write(6, 64 * w + bit, cell.inner_place(n)));
                }
            });
        });
    }

    /// Writes all triangles, and the codes behind and before each.
    pub(crate) fn triangles(&self, to: &mut [[u32; 3]], sides: &mut [[u32; 2]]) {
        let start = |group: usize| self.counted.place(self.group_start(group)).triangles as usize;
        let work = |group: usize, (to, sides): (&mut [[u32; 3]], &mut [[u32; 2]])| {
            if !to.is_empty() {
                self.group_triangles(group, to, sides);
            }
        };
        for_each_part(0..self.groups(), (to, sides), &start, &work);
    }

    fn group_triangles(&self, group: usize, to: &mut [[u32; 3]], sides: &mut [[u32; 2]]) {
        let (shape, mut written) = (self.shape(), 0);
        for_rows(self.codes, self.group(group), |row, four| {
            if !four.has_cells {
                return;
            }
            let mut lists = Lists::new(self.counted, shape.nodes[1], row);
            for_words(shape, four, |word, w| {
                written += write_cells(
                    four,
                    &word,
                    w,
                    &mut lists,
                    shape.is_left_handed,
                    &mut to[written..],
                    &mut sides[written..],
                );
                lists.advance(&word);
            });
        });
    }
}

/// Numbers of the next vertex of each list: edges and faces as in [`Word`], and cells.
struct Lists {
    edges: [u32; 8],
    faces: [u32; 5],
    inner: u32,
}

impl Lists {
    /// At the beginning of a row of cells.
    fn new(counted: &Counted, ny: usize, row: usize) -> Self {
        let [own, y, z, yz] = [row, row + 1, row + ny, row + ny + 1].map(|row| counted.place(row).vertices);
        Self {
            edges: [own[0], y[0], z[0], yz[0], own[1], z[1], own[2], y[2]],
            faces: [own[5], own[4], y[4], own[3], z[3]],
            inner: own[6],
        }
    }

    /// Moves on past a word.
    fn advance(&mut self, word: &Word) {
        for (first, set) in self.edges.iter_mut().zip(word.edges) {
            *first = first.wrapping_add(set.count_ones());
        }
        for (first, set) in self.faces.iter_mut().zip(word.faces) {
            *first = first.wrapping_add(set.count_ones());
        }
    }

    /// Number of a vertex of the cell at `bit`.
    fn number(&self, word: &Word, bit: usize, v: u8) -> u32 {
        let before = (1u64 << bit) - 1;
        let rank = |first: u32, set: u64, is_next: bool| {
            // The next node's, one further in the list where this node has one.
            let own = u32::from(is_next) & (set >> bit & 1) as u32;
            first.wrapping_add((set & before).count_ones() + own)
        };
        let v = usize::from(v);
        match v {
            0..4 => rank(self.edges[v], word.edges[v], false),
            4..12 => {
                let list = 4 + (v - 4) / 2;
                rank(self.edges[list], word.edges[list], v & 1 == 1)
            }
            12 | 13 => rank(self.faces[0], word.faces[0], v == 13),
            14..18 => rank(self.faces[v - 13], word.faces[v - 13], false),
            _ => self.inner.wrapping_add((v - usize::from(INSIDE)) as u32),
        }
    }
}

/// Writes the triangles of one word's cells; tells how many those are.
fn write_cells(
    four: &Four<'_>,
    word: &Word,
    w: usize,
    lists: &mut Lists,
    flip: bool,
    to: &mut [[u32; 3]],
    sides: &mut [[u32; 2]],
) -> usize {
    let mut written = 0;
    for bit in ones(word.cells) {
        let cell = polygonize(&four.labels(64 * w + bit));
        for (triangle, of) in cell.triangles[..cell.len].iter().zip(&cell.sides) {
            let [a, b, c] = triangle.map(|v| lists.number(word, bit, v));
            to[written] = if flip { [a, c, b] } else { [a, b, c] };
            sides[written] = *of;
            written += 1;
        }
        lists.inner = lists.inner.wrapping_add(cell.inner_len as u32);
    }
    written
}

const _: () = assert!(FACES == 12 && INSIDE == 18, "as Lists::number has them");
