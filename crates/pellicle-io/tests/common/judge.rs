//! Reads files that may be anything on a thread of its own, and judges how: no panic, no long wait, little memory.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use super::common::{Folder, peak};
use super::fuzz::{BESIDE, read_every_way};

/// The longest that reading a file may take, in all ways together.
const LONGEST: Duration = Duration::from_secs(10);
/// The address space that small files may cost, beyond what the process has from the start.
const MOST: u64 = 100 << 20;

pub struct Judge {
    folder: Folder,
    files: Sender<PathBuf>,
    words: Receiver<Result<String, String>>,
    before: u64,
}

impl Judge {
    pub fn new() -> Judge {
        let folder = Folder::new();
        BESIDE.iter().for_each(|(name, text)| drop(folder.write(name, text)));
        let (files, to_read) = channel::<PathBuf>();
        let (told, words) = channel();
        std::thread::spawn(move || {
            for path in to_read {
                let result = catch_unwind(AssertUnwindSafe(|| read_every_way(&path)));
                let text = |panic: Box<dyn std::any::Any + Send>| match panic.downcast::<String>() {
                    Ok(text) => *text,
                    Err(other) => other.downcast::<&str>().map_or("a panic".into(), |text| (*text).to_owned()),
                };
                if told.send(result.map_err(text)).is_err() {
                    break;
                }
            }
        });
        let mut judge = Judge { folder, files, words, before: u64::MAX };
        // Every thread has its first memory before the counting starts.
        rayon::broadcast(|_| vec![0u8; 4 << 20].len());
        judge.read("csv", b"x,y,z\n1,2,3\n").expect("a sound file");
        judge.before = peak().unwrap_or(u64::MAX);
        judge
    }

    /// What came of a file with this extension, in words, or what is wrong with how it was read.
    pub fn read(&self, extension: &str, bytes: &[u8]) -> Result<String, String> {
        let path = self.folder.write(&format!("input.{extension}"), bytes);
        self.files.send(path).map_err(|_| "the reading thread has ended".to_owned())?;
        let words = match self.words.recv_timeout(LONGEST) {
            Ok(words) => words?,
            Err(RecvTimeoutError::Timeout) => return Err(format!("it takes more than {LONGEST:?}")),
            Err(RecvTimeoutError::Disconnected) => return Err("the reading thread has ended".into()),
        };
        let grown = peak().unwrap_or(0).saturating_sub(self.before);
        let allowed = MOST + 2 * bytes.len() as u64;
        if grown > allowed { Err(format!("it takes {} MiB of memory", grown >> 20)) } else { Ok(words) }
    }

    /// Reads a file that must not break a promise.
    ///
    /// # Panics
    /// If it does; the message tells where the file is, and what to do with it.
    pub fn expect_sound(&self, extension: &str, bytes: &[u8], origin: &str) -> String {
        self.read(extension, bytes).unwrap_or_else(|problem| {
            let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("finding.{extension}"));
            let kept = std::fs::write(&path, bytes).map_or_else(|e| e.to_string(), |()| path.display().to_string());
            panic!(
                "{origin} as .{extension}: {problem}\nThe file is {kept}. Once it is read as it should be, keep it as \
                 fuzz/corpus/{extension}/<what broke>"
            )
        })
    }
}
