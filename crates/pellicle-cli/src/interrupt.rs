//! Ctrl-C (and the request to terminate, and a closed terminal) leaves whole files or none, and ends the run soon.
//!
//! Reading cannot be cancelled, but leaves nothing behind: there Ctrl-C ends the run at once. Once the surface is being
//! made, the first Ctrl-C asks the work to stop in order, the second ends it at once. When the file has its name the
//! run is over but for its last words, and those may be heard.

use std::io::{IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicU8, Ordering};

use pellicle::CancelToken;

use crate::failure::Failure;

/// Cancelled by Ctrl-C while the work can stop in order. One for the process, as the signal is.
pub static TOKEN: CancelToken = CancelToken::new();

static PHASE: AtomicU8 = AtomicU8::new(Phase::Reading as u8);

/// What Ctrl-C would interrupt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Before the work that watches the token.
    Reading,
    /// Work that watches the token.
    Working,
    /// The output is complete.
    Written,
}

/// Says what would be interrupted from now on.
pub fn enter(phase: Phase) {
    PHASE.store(phase as u8, Ordering::SeqCst);
}

/// Listens from now on. Where the system offers no signals, Ctrl-C keeps its usual meaning.
pub fn listen() {
    let _ = ctrlc::set_handler(|| {
        let phase = PHASE.load(Ordering::SeqCst);
        if phase == Phase::Written as u8 {
            return;
        }
        if phase == Phase::Working as u8 && !TOKEN.is_cancelled() {
            TOKEN.cancel();
            if stderr().is_terminal() {
                let _ = writeln!(stderr(), "stopping; Ctrl-C again ends at once");
            }
            return;
        }
        // A file that is no longer in the library's list of unfinished ones does not get its name any more.
        pellicle_io::remove_temporaries();
        let _ = writeln!(stderr(), "error: {}", Failure::Interrupted);
        std::process::exit(i32::from(Failure::Interrupted.exit_code()));
    });
}

/// Whether Ctrl-C was pressed.
pub fn is_asked() -> bool {
    TOKEN.is_cancelled()
}

/// An error once Ctrl-C was pressed: for the places between stages that the library cannot see.
pub fn check() -> Result<(), Failure> {
    if is_asked() { Err(Failure::Interrupted) } else { Ok(()) }
}
