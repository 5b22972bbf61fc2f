//! Triangles of one slab: of each crossed cell, by the numbers of the vertices on its edges.
//!
//! Source: Lorensen & Cline 1987 with the generated tables of [`tables`](crate::march::tables); order as in Rosenberg &
//! Birdwell 2008, section 5.

use super::{NUMBERED, RING, Work, vertices::section};
use crate::{
    lookup::columns::Extent,
    march::{
        slices::{Blend, March, Rows, Sight, Skin, WIDEST, next},
        tables::{CASES, MOST, edge_corner},
    },
    math::bits::ones,
};

/// Most triangles of a row.
pub(super) const ROW: usize = MOST * WIDEST;

/// What a slab's cells are made of.
struct Slab<'a> {
    lower: &'a Rows,
    upper: &'a Rows,
    numbers: &'a [u32],
    /// From a cell's lowest node to the number of each of its edges.
    offsets: [usize; 16],
    width: usize,
}

impl Slab<'_> {
    #[inline(always)]
    fn case(&self, x: usize, y: usize) -> usize {
        let rows = [self.lower[y], self.lower[y + 1], self.upper[y], self.upper[y + 1]];
        let mut case = 0;
        for (i, row) in rows.iter().enumerate() {
            case |= ((row >> x & 0b11) as usize) << (2 * i);
        }
        case
    }

    /// The numbers of a cell's vertices.
    #[inline(always)]
    fn numbered(&self, x: usize, y: usize, edges: [u8; 3]) -> [u32; 3] {
        let numbers = &self.numbers[x + self.width * y..];
        // Spelled out: a closure would not have the lanes' instructions.
        let [a, b, c] = edges;
        [
            numbers[self.offsets[usize::from(a & 15)]],
            numbers[self.offsets[usize::from(b & 15)]],
            numbers[self.offsets[usize::from(c & 15)]],
        ]
    }

    #[inline(always)]
    fn write(&self, x: usize, y: usize, to: &mut [[u32; 3]]) -> usize {
        let entry = &CASES[self.case(x, y)];
        let len = usize::from(entry.len);
        let to = &mut to[..MOST];
        // Most cells have two: written without asking, and what is too much is written over.
        to[0] = self.numbered(x, y, entry.triangles[0]);
        to[1] = self.numbered(x, y, entry.triangles[1]);
        for i in 2..len {
            to[i] = self.numbered(x, y, entry.triangles[i]);
        }
        len
    }

    #[inline(always)]
    fn write_in_order(&self, sight: &Sight, [x, y, z]: [usize; 3], to: &mut Vec<[u32; 3]>) {
        let triangles = sight.triangles([x, y, z], self.case(x, y));
        to.extend(triangles.map(|edges| self.numbered(x, y, edges)));
    }
}

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Makes the triangles of a slab whose vertices all have numbers, of the cells in `rows`.
    #[inline(always)]
    pub(super) fn march_slab(&mut self, extent: Extent, z: usize, rows: u64) {
        let width = extent.nodes[0];
        let nodes = width * extent.nodes[1];
        let mut offsets = [0; 16];
        for (edge, offset) in offsets.iter_mut().enumerate().take(12) {
            let corner = edge_corner(edge);
            *offset = section(edge / 4, z + (corner >> 2)) * nodes + (corner & 1) + width * (corner >> 1 & 1);
        }
        let work = &mut *self.work;
        let slab = Slab {
            lower: &work.inside[z % RING],
            upper: &work.inside[(z + 1) % RING],
            numbers: &work.numbers[..NUMBERED * nodes],
            offsets,
            width,
        };
        let (mut count, mut made, triangles) = (0, 0, &mut work.triangles[..]);
        for y in ones(rows & ((1 << (extent.nodes[1] - 1)) - 1)) {
            let crossed = crossed(&slab, y, width);
            count += crossed.count_ones();
            match self.sight {
                None => {
                    for x in ones(crossed) {
                        made += slab.write(x, y, &mut triangles[made..]);
                    }
                    if made >= ROW {
                        self.piece.triangles.extend_from_slice(&triangles[..made]);
                        made = 0;
                    }
                }
                Some(_) => work.todo.push_row(y, crossed),
            }
        }
        self.piece.triangles.extend_from_slice(&triangles[..made]);
        if let Some(sight) = &self.sight {
            while let Some((x, y)) = next(&mut work.todo, Some(sight)) {
                slab.write_in_order(sight, [x, y, z], &mut self.piece.triangles);
            }
        }
        self.piece.counts.cubes += u64::from(count);
        self.piece.counts.visited += u64::from(count);
    }
}

/// The cells of a row whose corners are not all on one side.
#[inline(always)]
fn crossed(slab: &Slab<'_>, y: usize, width: usize) -> u64 {
    let rows = [slab.lower[y], slab.lower[y + 1], slab.upper[y], slab.upper[y + 1]];
    let any = rows[0] | rows[1] | rows[2] | rows[3];
    let all = rows[0] & rows[1] & rows[2] & rows[3];
    (any | any >> 1) & !(all & all >> 1) & (u64::MAX >> (65 - width))
}
