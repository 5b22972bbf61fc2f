//! Blocks whose surface can be used again, because nothing that it depends on has changed.
//!
//! What is compared is content: the block's particles, bit for bit, which of its neighbours exist and in which order they
//! come, and where the viewer is if there is one. Time plays no part.
//!
//! Source: the idea is Rosenberg & Birdwell's, 2008, section 3: blocks without moving particles are output again.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use crate::{
    bricks::blocks::{Block, Blocks, NOBODY},
    lattice::Coord,
    lookup::{
        columns::Placed,
        directory::{Cursor, Directory},
    },
    march::slices::{Piece, Sight},
};

/// Whether surfaces of blocks are kept from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reuse {
    /// Every block is marched in every frame; nothing is kept.
    #[default]
    Off,
    /// A block whose particles did not change gives the same triangles without being marched. All blocks' surfaces stay in
    /// memory: see [`Frame::kept_bytes`](super::Frame::kept_bytes).
    Unchanged,
}

/// One block's surface, and what it depends on.
pub(super) struct Kept<V> {
    pub(super) piece: Piece<V>,
    /// Place in the order of blocks of each block around.
    pub(super) around: [u32; 27],
    at: Coord,
    members: Vec<Placed>,
    /// How many of the blocks around come before each of them.
    before: [u8; 27],
    sight: Option<Sight>,
    valid: bool,
    /// Whether the surface was used again in this frame.
    pub(super) reused: bool,
    /// Whether the surface is this frame's and waits to be written.
    pub(super) done: bool,
}

/// A block's surface, which one thread makes and another may write.
pub(super) struct Slot<V>(Mutex<Kept<V>>);

impl<V> Default for Slot<V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<V> Slot<V> {
    /// For who has it alone.
    pub(super) fn get(&mut self) -> &mut Kept<V> {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// For who makes the surface.
    pub(super) fn lock(&self) -> MutexGuard<'_, Kept<V>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// For who writes it: nothing unless it is done.
    pub(super) fn done(&self) -> Option<MutexGuard<'_, Kept<V>>> {
        let kept = match self.0.try_lock() {
            Ok(kept) => kept,
            // Of an earlier frame, whose thread panicked.
            Err(TryLockError::Poisoned(kept)) => kept.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        kept.done.then_some(kept)
    }
}

impl<V> Default for Kept<V> {
    fn default() -> Self {
        Self {
            piece: Piece::default(),
            around: [NOBODY; 27],
            at: [i32::MIN; 3],
            members: Vec::new(),
            before: [0; 27],
            sight: None,
            valid: false,
            reused: false,
            done: false,
        }
    }
}

impl<V> Kept<V> {
    /// Compares what the block depends on with what it was, and takes the new. Whether the surface still holds.
    pub(super) fn holds(&mut self, block: &Block, members: &[u32], particles: &[Placed], sight: Option<Sight>) -> bool {
        let before = self.around.map(|rank| match rank {
            NOBODY => u8::MAX,
            rank => self.around.iter().filter(|&&other| other < rank).count() as u8,
        });
        let mut now = members.iter().map(|&i| &particles[i as usize]);
        let same = self.valid
            && (self.at, self.before, self.sight) == (block.at, before, sight)
            && self.members.len() == members.len()
            && self.members.iter().zip(now.clone()).all(|(a, b)| a.same_bits(b));
        if !same {
            (self.at, self.before, self.sight, self.valid) = (block.at, before, sight, false);
            self.members.clear();
            self.members.extend(now.by_ref());
        }
        same
    }

    /// The surface is that of what was last compared.
    pub(super) fn settle(&mut self) {
        self.valid = true;
    }

    fn bytes(&self) -> usize {
        self.members.len() * size_of::<Placed>() + self.piece.bytes()
    }
}

/// What all surfaces depend on: the origin, and the bits of the pose.
type Stamp = ([i32; 3], Option<[[u64; 3]; 3]>);

/// All blocks' surfaces, in the order of blocks.
pub(super) struct Keep<V> {
    pub(super) kept: Vec<Slot<V>>,
    previous: Vec<Slot<V>>,
    places: Directory,
    stamp: Option<Stamp>,
}

impl<V> Default for Keep<V> {
    fn default() -> Self {
        Self { kept: Vec::new(), previous: Vec::new(), places: Directory::default(), stamp: None }
    }
}

impl<V> Keep<V> {
    /// Nothing kept holds any more.
    pub(super) fn forget(&mut self) {
        self.stamp = None;
    }

    /// Brings what was kept of each block to the block's place in the new order.
    pub(super) fn arrange(&mut self, blocks: &Blocks, origin: [i32; 3], axes: Option<[[f64; 3]; 3]>) {
        let stamp = Some((origin, axes.map(|axes| axes.map(|axis| axis.map(f64::to_bits)))));
        if self.stamp != stamp {
            self.stamp = stamp;
            self.kept.iter_mut().for_each(|kept| kept.get().valid = false);
        }
        std::mem::swap(&mut self.kept, &mut self.previous);
        self.places.clear();
        let mut cursor = Cursor::default();
        for (i, kept) in self.previous.iter_mut().map(Slot::get).enumerate().filter(|(_, kept)| kept.valid) {
            *self.places.entry(&mut cursor, kept.at) = i as u32;
        }
        let n = blocks.blocks.len();
        self.kept.resize_with(n.max(self.kept.len()), Slot::default);
        for (block, kept) in blocks.blocks.iter().zip(&mut self.kept) {
            match self.places.get(&mut cursor, block.at) {
                Some(i) => std::mem::swap(kept, &mut self.previous[i as usize]),
                None => kept.get().valid = false,
            }
        }
        for kept in &mut self.kept[n..] {
            kept.get().valid = false;
        }
    }

    /// Bytes that are kept of the first `n` blocks.
    pub(super) fn bytes(&mut self, n: usize) -> usize {
        self.kept[..n].iter_mut().map(|kept| kept.get().bytes()).sum()
    }
}
