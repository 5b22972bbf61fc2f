//! Marching blocks.

use std::sync::Mutex;

use super::{Params, keep::Kept, work::Work};
use crate::{
    bricks::blocks::{Block, Blocks},
    march::slices::{Blend, Drain, March, Scene, Seam, Seeds, Sight, Skin},
    math::{
        ranges::{PerItem, for_each_part},
        simd::Unit,
    },
};

/// Marching some blocks, on as many threads as there are.
pub(super) struct Job<'a, B, K: Skin> {
    pub(super) unit: Unit,
    pub(super) scene: &'a Scene<'a, B, K>,
    /// The viewer's cube in the lattice.
    pub(super) sight: Option<Sight>,
    pub(super) blocks: &'a Blocks,
    pub(super) params: &'a Params,
    pub(super) works: &'a [Mutex<Work<K::Corner>>],
    /// Whether what was kept of a block is compared with what there is now.
    pub(super) reuse: bool,
}

impl<B: Blend, K: Skin> Job<'_, B, K> {
    /// Marches all of them.
    pub(super) fn run(&self, blocks: &[Block], kept: &mut [Kept<K::Vertex>]) {
        for_each_part(0..blocks.len(), PerItem(kept, 1), &|i| i, &|i, kept: PerItem<'_, _>| {
            self.march(&blocks[i], &mut kept.0[0], None);
        });
    }

    /// Marches one block, unless what was kept of it still holds.
    pub(super) fn march(&self, block: &Block, kept: &mut Kept<K::Vertex>, drain: Option<&mut Drain<'_, K::Vertex>>) {
        kept.around = self.blocks.around(block);
        let seam = Seam { around: kept.around, margin: self.params.margin(), cells: self.params.block };
        let first: [i32; 3] = std::array::from_fn(|a| block.at[a] * self.params.block[a] as i32);
        let sight = self.sight.map(|sight| sight.in_block(first.map(|n| n - seam.margin as i32), 1));
        let members = self.blocks.members(block);
        kept.reused = self.reuse && kept.holds(block, members, self.scene.particles, sight);
        if kept.reused {
            return;
        }
        let thread = rayon::current_thread_index().unwrap_or(0) % self.works.len();
        let mut work = self.works[thread].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (scene, piece) = (self.scene, &mut kept.piece);
        let drain = drain.map(|drain| drain as &mut Drain<'_, _>);
        let Work { slices: by_slices, layers: by_layers } = &mut *work;
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
