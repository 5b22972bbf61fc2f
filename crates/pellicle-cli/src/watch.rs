//! `--watch`: frames as a running simulation writes them.
//!
//! The folder is looked at again and again, since network file systems tell nobody what other machines write. A file counts
//! when it has been the same, in size and time, from one look to the next but one, or for a while; and again when it
//! changes later. Ctrl-C ends the watch and is no failure.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::console::Console;
use crate::interrupt;
use crate::plan::{Absent, Frame, Plan};
use crate::resolve::MeshJob;

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(250);
/// Time between two looks at Ctrl-C.
const BLINK: Duration = Duration::from_millis(50);
/// A file that has not changed for so long is taken to be complete.
const SETTLED: Duration = Duration::from_millis(1000);

/// What a file was like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Signature {
    len: u64,
    modified: SystemTime,
}

/// A file that has come or changed.
#[derive(Debug)]
struct Pending {
    signature: Signature,
    since: Instant,
}

/// A watched sequence.
#[derive(Debug)]
pub struct Watch {
    /// Seconds without a new frame after which it ends.
    patience: f64,
    /// What was handed out, as it was then.
    known: HashMap<PathBuf, Signature>,
    pending: HashMap<PathBuf, Pending>,
    last: Instant,
}

impl Watch {
    /// Nothing is known yet: of the frames that are there the last may be half-written.
    pub fn new(patience: f64) -> Self {
        Self { patience, known: HashMap::new(), pending: HashMap::new(), last: Instant::now() }
    }

    /// Waits for the next frames. `None` when patience is over or Ctrl-C was pressed.
    pub fn wait(&mut self, job: &MeshJob, console: &Console) -> Option<Vec<Frame>> {
        // The time that the last frames took does not count as waiting.
        self.last = Instant::now();
        loop {
            let pause = Instant::now();
            while pause.elapsed() < PAUSE {
                if interrupt::is_asked() {
                    return None;
                }
                std::thread::sleep(BLINK);
            }
            let there = match Plan::find(&job.files, Absent::Await) {
                Ok((plan, _)) => plan.frames,
                Err(failure) => {
                    console.warn(failure.to_string());
                    return None;
                }
            };
            let ready: Vec<Frame> = there.into_iter().filter(|frame| self.is_ready(&frame.input)).collect();
            if !ready.is_empty() {
                return Some(ready);
            }
            if self.last.elapsed().as_secs_f64() > self.patience && self.pending.is_empty() {
                return None;
            }
        }
    }

    /// Whether the file is new or changed, and complete as far as one can tell.
    fn is_ready(&mut self, path: &Path) -> bool {
        let Some(now) = signature(path) else { return false };
        if self.known.get(path) == Some(&now) {
            return false;
        }
        let pending = self.pending.entry(path.to_owned()).or_insert(Pending { signature: now, since: Instant::now() });
        if pending.signature != now {
            *pending = Pending { signature: now, since: Instant::now() };
        }
        if pending.since.elapsed() < SETTLED && !now.is_old() {
            return false;
        }
        self.pending.remove(path);
        self.known.insert(path.to_owned(), now);
        true
    }
}

impl Signature {
    /// Whether nobody has written for so long that one look is enough.
    fn is_old(&self) -> bool {
        self.modified.elapsed().unwrap_or_default() >= 2 * SETTLED
    }
}

/// Whether the file is complete as far as one look can tell.
pub fn is_settled(path: &Path) -> bool {
    signature(path).is_some_and(|signature| signature.is_old())
}

fn signature(path: &Path) -> Option<Signature> {
    let metadata = std::fs::metadata(path).ok()?;
    Some(Signature { len: metadata.len(), modified: metadata.modified().ok()? })
}
