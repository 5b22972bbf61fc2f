//! What a process allocates, counted: for tests and tables of memory. The process must name [`Counting`] as its allocator:
//!
//! ```
//! #[global_allocator]
//! static ALLOCATOR: pellicle_conformance::allocations::Counting = pellicle_conformance::allocations::Counting;
//! let (_, count) = pellicle_conformance::allocations::count(|| drop(std::hint::black_box(vec![0u8; 1000])));
//! assert_eq!((count.calls, count.peak, count.held), (1, 1000, 0));
//! ```

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed},
};

/// The system's allocator, with counts.
#[derive(Debug)]
pub struct Counting;

static CALLS: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicU64 = AtomicU64::new(0);
static LARGEST: AtomicU64 = AtomicU64::new(0);
static LIVE: AtomicI64 = AtomicI64::new(0);
static PEAK: AtomicI64 = AtomicI64::new(0);

fn note(allocated: usize, freed: usize) {
    if allocated > 0 {
        CALLS.fetch_add(1, Relaxed);
        BYTES.fetch_add(allocated as u64, Relaxed);
        LARGEST.fetch_max(allocated as u64, Relaxed);
    }
    let change = allocated as i64 - freed as i64;
    PEAK.fetch_max(LIVE.fetch_add(change, Relaxed) + change, Relaxed);
}

// SAFETY: every call goes to the system's allocator with the caller's own arguments; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    // SAFETY: as the trait demands.
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size(), 0);
        // SAFETY: the caller keeps the trait's contract.
        unsafe { System.alloc(layout) }
    }

    // SAFETY: as the trait demands.
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size(), 0);
        // SAFETY: the caller keeps the trait's contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    // SAFETY: as the trait demands.
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        note(0, layout.size());
        // SAFETY: the caller keeps the trait's contract.
        unsafe { System.dealloc(at, layout) }
    }

    // SAFETY: as the trait demands.
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size, layout.size());
        // SAFETY: the caller keeps the trait's contract.
        unsafe { System.realloc(at, layout, size) }
    }
}

/// What some work allocated.
#[derive(Debug, Clone, Copy)]
pub struct Count {
    /// Allocations.
    pub calls: u64,
    /// Bytes of all of them.
    pub bytes: u64,
    /// The largest single allocation, in bytes.
    pub largest: u64,
    /// Bytes held at the worst moment, beyond those held before.
    pub peak: i64,
    /// Bytes held at the end, beyond those held before.
    pub held: i64,
}

/// Does some work and tells what the whole process allocated meanwhile.
pub fn count<T>(work: impl FnOnce() -> T) -> (T, Count) {
    let (calls, bytes, live) = (CALLS.load(Relaxed), BYTES.load(Relaxed), LIVE.load(Relaxed));
    PEAK.store(live, Relaxed);
    LARGEST.store(0, Relaxed);
    let result = work();
    let count = Count {
        calls: CALLS.load(Relaxed) - calls,
        bytes: BYTES.load(Relaxed) - bytes,
        largest: LARGEST.load(Relaxed),
        peak: PEAK.load(Relaxed) - live,
        held: LIVE.load(Relaxed) - live,
    };
    (result, count)
}
