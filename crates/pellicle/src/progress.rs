//! Progress and cancellation, passed in by the caller. The library itself prints nothing and reads no clock.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::Error;

/// A stage of the work, in the order in which they run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// Particles are checked and put in their canonical order.
    Sort,
    /// Densities, hence volumes, of the particles.
    Density,
    /// Which particles lie at the surface; with [`Band::Paper`](crate::Band::Paper) only.
    SurfaceParticles,
    /// Where to look: the field on the coarse lattice, or nodes near surface particles.
    Active,
    /// Field values on the bricks that matter.
    Fill,
    /// Crossings and triangles are counted.
    Count,
    /// Vertices and triangles are written.
    Emit,
}

/// A flag that stops work under way. Clones of one `Arc<CancelToken>` or references to it may live on any thread.
#[derive(Debug, Default)]
pub struct CancelToken(AtomicBool);

impl CancelToken {
    /// A token that is not cancelled.
    pub const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// Asks the work to stop; it returns [`Error::Cancelled`] soon after.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether [`cancel`](Self::cancel) was called.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// What a caller may hand in to watch and stop the work; the default watches nothing.
#[derive(Clone, Copy, Default)]
pub struct Control<'a> {
    /// Checked between and within stages.
    pub cancel: Option<&'a CancelToken>,
    /// Called at the start of each stage, from the calling thread.
    pub on_stage: Option<&'a (dyn Fn(Stage) + Sync)>,
}

impl Control<'_> {
    /// Tells the caller that `stage` begins, unless the work was cancelled.
    pub(crate) fn begin(&self, stage: Stage) -> Result<(), Error> {
        self.check()?;
        if let Some(on_stage) = self.on_stage {
            on_stage(stage);
        }
        Ok(())
    }

    /// An error once the token is cancelled.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.cancel.is_some_and(CancelToken::is_cancelled) { Err(Error::Cancelled) } else { Ok(()) }
    }
}
