//! Marching blocks, on all threads, and writing them one by one in their order.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use super::{
    Params,
    keep::{Kept, Slot},
    work::Work,
};
use crate::{
    Error,
    bricks::blocks::{Block, Blocks},
    march::slices::{Blend, Drain, March, Scene, Seam, Seeds, Sight, Skin},
    math::{
        ranges::{PerItem, for_each_part},
        simd::Unit,
    },
};

/// Marching some blocks.
pub(super) struct Job<'a, B, K: Skin> {
    pub(super) unit: Unit,
    pub(super) scene: &'a Scene<'a, B, K>,
    /// The viewer's cube in the lattice.
    pub(super) sight: Option<Sight>,
    pub(super) blocks: &'a Blocks,
    pub(super) params: &'a Params,
    /// Whether what was kept of a block is compared with what there is now.
    pub(super) reuse: bool,
}

/// Blocks that are marched by all threads. Whoever is done with one writes what can be written, while the others go on.
struct Line<'a, B, K: Skin, W> {
    job: &'a Job<'a, B, K>,
    /// A slot for block `i` and, once that is written, for block `i` + their number.
    slots: &'a [Slot<K::Vertex>],
    /// Blocks that have been begun, and that have been written.
    begun: AtomicUsize,
    written: AtomicUsize,
    /// Something failed: what was begun need not be finished.
    stopped: AtomicBool,
    writer: Mutex<Writer<W>>,
}

struct Writer<W> {
    write: W,
    result: Result<(), Error>,
}

/// Sees to it that nobody waits for a thread that panicked.
struct StopOnPanic<'a>(&'a AtomicBool);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

impl<B: Blend, K: Skin, W: FnMut(&Kept<K::Vertex>) -> Result<(), Error> + Send> Line<'_, B, K, W> {
    /// What one thread does.
    fn work(&self, work: &mut Work<K::Corner>) {
        let _stop = StopOnPanic(&self.stopped);
        let blocks = &self.job.blocks.blocks[..];
        loop {
            let i = self.begun.fetch_add(1, Ordering::Relaxed);
            let Some(block) = blocks.get(i) else { break };
            while i >= self.written.load(Ordering::Acquire) + self.slots.len() {
                if self.stopped.load(Ordering::Relaxed) {
                    return;
                }
                std::thread::yield_now();
            }
            let mut kept = self.slots[i % self.slots.len()].lock();
            self.job.march(block, &mut kept, work, None);
            kept.done = true;
            drop(kept);
            self.write();
            if self.stopped.load(Ordering::Relaxed) {
                return;
            }
        }
    }

    /// Writes what is done, up to the first block that is not, unless somebody else does.
    fn write(&self) {
        let next = |written: usize| self.slots[written % self.slots.len()].done();
        loop {
            let Ok(mut writer) = self.writer.try_lock() else { return };
            let mut written = self.written.load(Ordering::Relaxed);
            while let Some(mut kept) = next(written) {
                if writer.result.is_ok() {
                    writer.result = (writer.write)(&kept);
                }
                if writer.result.is_err() {
                    self.stopped.store(true, Ordering::Relaxed);
                    return;
                }
                kept.done = false;
                written += 1;
                self.written.store(written, Ordering::Release);
            }
            drop(writer);
            // A thread that was done meanwhile found the writer taken, and went on.
            if next(written).is_none() {
                return;
            }
        }
    }
}

impl<B: Blend, K: Skin> Job<'_, B, K> {
    /// Marches all blocks and has them written in their order, at most as many as there are slots on their way at a time.
    ///
    /// # Errors
    /// The first one of `write`, after which nothing more is written.
    pub(super) fn run(
        &self,
        slots: &mut [Slot<K::Vertex>],
        works: &mut [Work<K::Corner>],
        write: impl FnMut(&Kept<K::Vertex>) -> Result<(), Error> + Send,
    ) -> Result<(), Error> {
        slots.iter_mut().for_each(|slot| slot.get().done = false);
        let line = Line {
            job: self,
            slots,
            begun: AtomicUsize::new(0),
            written: AtomicUsize::new(0),
            stopped: AtomicBool::new(false),
            writer: Mutex::new(Writer { write, result: Ok(()) }),
        };
        for_each_part(0..works.len(), PerItem(works, 1), &|i| i, &|_, work: PerItem<'_, _>| line.work(&mut work.0[0]));
        line.writer.into_inner().unwrap_or_else(PoisonError::into_inner).result
    }

    /// Marches one block, unless what was kept of it still holds.
    pub(super) fn march(
        &self,
        block: &Block,
        kept: &mut Kept<K::Vertex>,
        work: &mut Work<K::Corner>,
        drain: Option<&mut Drain<'_, K::Vertex>>,
    ) {
        kept.around = self.blocks.around(block);
        let seam = Seam { around: kept.around, margin: self.params.margin(), cells: self.params.block };
        let first: [i32; 3] = std::array::from_fn(|a| block.at[a] * self.params.block[a] as i32);
        let sight = self.sight.map(|sight| sight.in_block(first.map(|n| n - seam.margin as i32), 1));
        let members = self.blocks.members(block);
        kept.reused = self.reuse && kept.holds(block, members, self.scene.particles, sight);
        if kept.reused {
            return;
        }
        let (scene, piece) = (self.scene, &mut kept.piece);
        let drain = drain.map(|drain| drain as &mut Drain<'_, _>);
        let Work { slices: by_slices, layers: by_layers } = work;
        match scene.seeds {
            Seeds::Complete => {
                self.unit.run(March { scene, first, seam, sight, members, work: by_layers, piece, drain })
            }
            Seeds::Particles => {
                self.unit.run(March { scene, first, seam, sight, members, work: by_slices, piece, drain })
            }
        }
        if self.reuse {
            kept.settle();
        }
    }
}
