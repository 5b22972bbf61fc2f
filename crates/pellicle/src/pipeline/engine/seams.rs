//! Vertices that blocks share get one number in the whole surface.

use super::Frame;
use crate::{
    Error,
    march::slices::{FOREIGN, Piece},
};

/// Numbers of vertices that later blocks refer to.
#[derive(Default)]
pub(super) struct Seams {
    /// Keys and numbers, block after block.
    entries: Vec<(u32, u32)>,
    /// Where each block's begin.
    starts: Vec<u32>,
    resolved: Vec<u32>,
    triangles: Vec<[u32; 3]>,
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

    /// Gives a piece's vertices and triangles their numbers in the whole surface, and remembers those that later pieces may
    /// refer to. `around` holds the places in the order of the blocks around, `frame` the counts of what came before.
    pub(super) fn resolve<V>(
        &mut self,
        piece: &Piece<V>,
        around: &[u32; 27],
        frame: &mut Frame,
    ) -> Result<&[[u32; 3]], Error> {
        let base = frame.vertices as u64;
        let end = base + piece.positions.len() as u64;
        if end > u64::from(FOREIGN) {
            return Err(Error::Count { what: "vertices", needed: end, available: u64::from(FOREIGN) });
        }
        let base = base as u32;
        self.entries.extend(piece.shared.iter().map(|&(key, vertex)| (key, vertex + base)));
        self.starts.push(self.entries.len() as u32);
        self.resolved.clear();
        for reference in &piece.foreign {
            let block = around[usize::from(reference.block)] as usize;
            let notes = &self.entries[self.starts[block] as usize..self.starts[block + 1] as usize];
            let found = notes.binary_search_by_key(&reference.key, |&(key, _)| key);
            self.resolved.push(found.map_or(MISSING, |at| notes[at].1));
        }
        let number = |v: u32| if v & FOREIGN == 0 { v + base } else { self.resolved[(v ^ FOREIGN) as usize] };
        self.triangles.clear();
        self.triangles.extend(piece.triangles.iter().map(|triangle| triangle.map(number)));
        if self.resolved.contains(&MISSING) {
            self.triangles.retain(|triangle| !triangle.contains(&MISSING));
            frame.unmatched += piece.triangles.len() - self.triangles.len();
        }
        Ok(&self.triangles)
    }
}
