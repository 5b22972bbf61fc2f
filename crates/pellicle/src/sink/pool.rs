//! A linear pool: one vertex buffer of the caller's that many threads fill at once.
//!
//! The buffer is cut into blocks of 64 triangles. A thread claims the next block by one atomic addition, fills it by itself,
//! and claims another. Blocks are never given back. A block is a whole number of cache lines and, where the buffer allows
//! it, begins on one: no two threads write to one line. What a thread leaves of its last block is filled with degenerate
//! triangles, so that the buffer can be drawn from its beginning to its end as it is.
//!
//! It guarantees the set of triangles, not their order, which depends on who came first: bytes may differ from run to run.
//! Nothing is ever written beyond the buffer; how much would have been needed is known at the end. Counting first, as
//! [`Contour::write_soup`](crate::Contour::write_soup) does, gives every triangle its place without any of this: see the book.
//!
//! Source: Gourlay 2014, Fluid Simulation for Video Games 18, `VertexLinearPoolAllocator`. Deviations: strides of positions and
//! normals apart, one of the article's wishes; tails repeat the last corner written instead of `FLT_MAX`, so that boxes
//! around the buffer stay right; a block is handed over as a slice behind a lock that nobody contends for, instead of a
//! pointer.

use std::sync::{
    Mutex,
    atomic::{AtomicUsize, Ordering},
};

use super::soup::face_normal;
use crate::Error;

/// Triangles of a block: with any stride its bytes are whole cache lines.
const BLOCK: usize = 64;

/// Vertices of a block.
const VERTICES: usize = 3 * BLOCK;

/// Bytes of a cache line.
const LINE: usize = 64;

/// A part of the caller's buffers.
struct Block<'a> {
    positions: &'a mut [f32],
    normals: Option<&'a mut [f32]>,
}

/// A vertex buffer of the caller's, shared by threads.
///
/// ```
/// use pellicle::{Contour, ContourParams, Control, VertexPool, Volume};
/// let samples: Vec<u8> = (0..1000).map(|n| u8::from(n % 10 > 3)).collect();
/// let volume = Volume::new(&samples, [10, 10, 10])?;
/// let surface = Contour::extract(&volume, &[0.5], &ContourParams::default(), &Control::default())?;
/// let mut positions = vec![0.0f32; 4 * 100_000];
/// let pool = VertexPool::new(&mut positions, 4, None)?;
/// let used = surface.write_pool(0, &pool)?;
/// assert!(used.vertices >= 3 * used.triangles);
/// # Ok::<(), pellicle::Error>(())
/// ```
pub struct VertexPool<'a> {
    blocks: Vec<Mutex<Option<Block<'a>>>>,
    strides: [usize; 2],
    /// Vertices before the first block, which stand there to align it.
    lead: usize,
    claimed: AtomicUsize,
}

impl<'a> VertexPool<'a> {
    /// A pool over `positions`, whose vertex i begins at number `i * stride`, and normals likewise.
    ///
    /// # Errors
    /// [`Error::Parameter`] when a stride is below 3.
    pub fn new(
        positions: &'a mut [f32],
        stride: usize,
        normals: Option<(&'a mut [f32], usize)>,
    ) -> Result<Self, Error> {
        let (normals, normal_stride) = normals.map_or((None, 3), |(normals, stride)| (Some(normals), stride));
        if let Some(stride) = [stride, normal_stride].into_iter().find(|&stride| stride < 3) {
            return Err(Error::Parameter { name: "stride", value: stride as f64, must: "at least 3" });
        }
        // The fewest triangles after which a block of positions begins on a cache line; none if that never happens.
        let address = positions.as_ptr().addr();
        let aligned = |triangles: &usize| (address + triangles * 3 * stride * 4).is_multiple_of(LINE);
        let lead = 3 * (0..LINE).find(aligned).unwrap_or(0);
        let room = |len: usize, stride: usize| (len / stride).saturating_sub(lead) / VERTICES;
        let normals_room = normals.as_ref().map_or(usize::MAX, |n| room(n.len(), normal_stride));
        let count = room(positions.len(), stride).min(normals_room);
        let (before, positions) = positions.split_at_mut((lead * stride).min(positions.len()));
        before.fill(0.0);
        let mut normals = normals.map(|normals| {
            let at = (lead * normal_stride).min(normals.len());
            let (before, normals) = normals.split_at_mut(at);
            before.fill(0.0);
            normals.chunks_exact_mut(VERTICES * normal_stride)
        });
        let blocks = positions.chunks_exact_mut(VERTICES * stride).take(count).map(|positions| {
            let normals = normals.as_mut().and_then(Iterator::next);
            Mutex::new(Some(Block { positions, normals }))
        });
        Ok(Self { blocks: blocks.collect(), strides: [stride, normal_stride], lead, claimed: AtomicUsize::new(0) })
    }

    /// The next block: `None` when there are no more.
    fn claim(&self) -> Option<Block<'a>> {
        let number = self.claimed.fetch_add(1, Ordering::Relaxed);
        let block = self.blocks.get(number)?;
        block.lock().ok().and_then(|mut block| block.take())
    }

    /// Vertices to draw so far.
    pub fn vertices(&self) -> usize {
        self.lead + VERTICES * self.claimed.load(Ordering::Relaxed).min(self.blocks.len())
    }

    /// Most vertices that the pool can hold.
    pub fn capacity(&self) -> usize {
        self.lead + VERTICES * self.blocks.len()
    }

    /// Whether all fitted.
    ///
    /// # Errors
    /// [`Error::Capacity`] in vertices: how many the same work would have needed.
    pub(crate) fn finish(&self) -> Result<(), Error> {
        let claimed = self.claimed.load(Ordering::Relaxed);
        if claimed > self.blocks.len() {
            let (needed, available) = (self.lead + VERTICES * claimed, self.capacity());
            return Err(Error::Capacity { what: "vertices", needed: needed as u64, available: available as u64 });
        }
        Ok(())
    }
}

/// One thread's hold on a pool.
pub(crate) struct Writer<'p, 'a> {
    pool: &'p VertexPool<'a>,
    block: Option<Block<'a>>,
    /// Triangles in the block, whether it is there or would have been.
    used: usize,
}

impl<'p, 'a> Writer<'p, 'a> {
    pub(crate) fn new(pool: &'p VertexPool<'a>) -> Self {
        Self { pool, block: None, used: BLOCK }
    }

    /// Writes a triangle, with its face's normal; drops it, counted, where the pool is full.
    pub(crate) fn push(&mut self, triangle: &[[f32; 3]; 3]) {
        if self.used == BLOCK {
            self.block = self.pool.claim();
            self.used = 0;
        }
        self.put(self.used, triangle);
        self.used += 1;
    }

    fn put(&mut self, at: usize, triangle: &[[f32; 3]; 3]) {
        let [stride, normal_stride] = self.pool.strides;
        let Some(block) = &mut self.block else { return };
        let to = block.positions[3 * at * stride..].chunks_mut(stride);
        to.zip(triangle).for_each(|(to, corner)| to[..3].copy_from_slice(corner));
        if let Some(normals) = &mut block.normals {
            let normal = face_normal(triangle);
            normals[3 * at * normal_stride..]
                .chunks_mut(normal_stride)
                .take(3)
                .for_each(|to| to[..3].copy_from_slice(&normal));
        }
    }
}

impl Drop for Writer<'_, '_> {
    /// Fills the rest of the block with triangles without an area.
    fn drop(&mut self) {
        let stride = self.pool.strides[0];
        let last = match &self.block {
            Some(block) if self.used > 0 => {
                let from = (3 * self.used - 1) * stride;
                std::array::from_fn(|a| block.positions[from + a])
            }
            _ => return,
        };
        (self.used..BLOCK).for_each(|at| self.put(at, &[last; 3]));
    }
}
