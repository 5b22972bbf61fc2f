//! Memory that a lattice near the surface may take: refused before it is taken, or done with less.
//!
//! Source: this project.

use super::store::Store;
use crate::Error;

/// Bytes that may be used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// In all.
    pub(crate) bytes: u64,
    /// Of them, those that are taken already: by the particles, later by the coarse lattice, too.
    pub(crate) taken: u64,
}

impl Budget {
    /// Whether the values of all bricks filled and waiting fit; an error when not even their signs do.
    pub(super) fn check<const SETS: usize>(self, store: &Store<SETS>) -> Result<bool, Error> {
        let bricks = store.len() + store.waiting_bricks();
        let signs = Store::<SETS>::bytes(store.octet_count(), bricks);
        self.fits(signs)?;
        // A quarter more for the bricks that closing adds.
        let values = store.value_bytes();
        Ok(self.taken + signs + values + values / 4 <= self.bytes)
    }

    /// An error unless so many bytes fit beside what is taken.
    pub(crate) fn fits(self, lattice: u64) -> Result<(), Error> {
        let needed = self.taken.saturating_add(lattice);
        if needed <= self.bytes {
            Ok(())
        } else {
            Err(Error::Memory { what: "the lattice near the surface", needed, available: self.bytes })
        }
    }
}
