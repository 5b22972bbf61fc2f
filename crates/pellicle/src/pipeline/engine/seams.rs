//! Vertices that blocks share get one number in the whole surface.

use super::Frame;
use crate::{
    Error,
    march::slices::{FOREIGN, Piece},
    sink::{Part, Sink},
};

/// Triangles that are numbered and handed to the sink at once.
const AT_ONCE: usize = 256;
/// Of those, triangles that are asked together whether they have vertices of other blocks.
const TOGETHER: usize = 16;

/// Numbers of vertices that later blocks refer to.
#[derive(Default)]
pub(super) struct Seams {
    /// Keys and numbers, block after block.
    entries: Vec<(u32, u32)>,
    /// Where each block's begin.
    starts: Vec<u32>,
    /// Of the present block: its first vertex, and the numbers of others' that it refers to.
    base: u32,
    resolved: Vec<u32>,
    lacks: bool,
}

/// Stands for a vertex that the owner did not make.
const MISSING: u32 = u32::MAX;

impl Seams {
    /// Bytes in use.
    pub(super) fn bytes(&self) -> usize {
        self.entries.len() * 8 + self.starts.len() * 4
    }

    /// Starts a frame.
    pub(super) fn begin(&mut self) {
        self.entries.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    /// Starts the next block.
    pub(super) fn begin_block(&mut self, frame: &Frame) {
        // What does not fit is refused before it is numbered.
        self.base = frame.vertices as u32;
        self.resolved.clear();
        self.lacks = false;
    }

    /// Gives what a block's piece has of vertices and triangles their numbers in the whole surface, and writes them.
    /// `around` holds the places in the order of the blocks around, `frame` the counts of what came before.
    ///
    /// # Errors
    /// [`Error::Count`] when there are more vertices than numbers.
    pub(super) fn write<V>(
        &mut self,
        piece: &Piece<V>,
        around: &[u32; 27],
        frame: &mut Frame,
        sink: &mut impl Sink<V>,
    ) -> Result<(), Error> {
        let end = (frame.vertices + piece.positions.len()) as u64;
        if end > u64::from(FOREIGN) {
            return Err(Error::Count { what: "vertices", needed: end, available: u64::from(FOREIGN) });
        }
        for reference in &piece.foreign[self.resolved.len()..] {
            let block = around[usize::from(reference.block)] as usize;
            let notes = &self.entries[self.starts[block] as usize..self.starts[block + 1] as usize];
            let found = notes.binary_search_by_key(&reference.key, |&(key, _)| key);
            self.lacks |= found.is_err();
            self.resolved.push(found.map_or(MISSING, |at| notes[at].1));
        }
        let (positions, normals, data) = (&piece.positions[..], &piece.normals[..], &piece.data[..]);
        let (first_vertex, first_triangle) = (frame.vertices, frame.triangles);
        sink.append(Part { first_vertex, first_triangle, positions, normals, data, triangles: &[] });
        frame.vertices += positions.len();
        let mut numbered = [[0; 3]; AT_ONCE];
        for triangles in piece.triangles.chunks(AT_ONCE) {
            let count = self.number(triangles, &mut numbered);
            sink.append(Part {
                first_vertex: frame.vertices,
                first_triangle: frame.triangles,
                positions: &[],
                normals: &[],
                data: &[],
                triangles: &numbered[..count],
            });
            frame.triangles += count;
            frame.unmatched += triangles.len() - count;
        }
        Ok(())
    }

    /// Gives triangles their vertices' numbers in the whole surface; those without some vertex are left out. Gives how many
    /// there are then.
    fn number(&self, triangles: &[[u32; 3]], to: &mut [[u32; 3]; AT_ONCE]) -> usize {
        let mut count = 0;
        for some in triangles.chunks(TOGETHER) {
            let numbers = &mut to[count..count + some.len()];
            let mut any = 0;
            for (&v, number) in some.as_flattened().iter().zip(numbers.as_flattened_mut()) {
                any |= v;
                *number = v.wrapping_add(self.base);
            }
            if any & FOREIGN == 0 {
                count += some.len();
                continue;
            }
            for triangle in some {
                to[count] = triangle.map(|v| match v & FOREIGN {
                    0 => v + self.base,
                    _ => self.resolved[(v ^ FOREIGN) as usize],
                });
                count += usize::from(!(self.lacks && to[count].contains(&MISSING)));
            }
        }
        count
    }

    /// Remembers the vertices that later blocks may refer to of a block that has been written.
    pub(super) fn end_block<V>(&mut self, piece: &Piece<V>) {
        self.entries.extend(piece.shared.iter().map(|&(key, vertex)| (key, vertex + self.base)));
        self.starts.push(self.entries.len() as u32);
    }
}
