//! Fuzz targets for the readers of `pellicle-io`: one per format, all by [`fuzz_one`].
//!
//! A workspace of its own, since libFuzzer wants a nightly compiler and C++. The seeds in `corpus/` are replayed without
//! either by `crates/pellicle-io/tests/fuzz_corpus.rs`.

mod read;

use std::path::PathBuf;
use std::sync::OnceLock;

pub use read::{BESIDE, TARGETS, read_every_way};

#[doc(hidden)]
pub use libfuzzer_sys;

/// Writes the bytes to a file with this extension, in memory where the system offers that, and reads it in every way.
/// A small folder is left behind for each process.
pub fn fuzz_one(extension: &str, bytes: &[u8]) {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let shared_memory = PathBuf::from("/dev/shm");
        let parent = if shared_memory.is_dir() { shared_memory } else { std::env::temp_dir() };
        let folder = parent.join(format!("pellicle-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for the files");
        for (name, text) in BESIDE {
            std::fs::write(folder.join(name), text).expect("a file beside the one that is read");
        }
        folder
    });
    let path = folder.join(format!("input.{extension}"));
    std::fs::write(&path, bytes).expect("a file to read");
    read_every_way(&path);
}

/// The whole of a target, which is named by the extension of its format.
#[macro_export]
macro_rules! target {
    () => {
        $crate::libfuzzer_sys::fuzz_target!(|bytes: &[u8]| $crate::fuzz_one(env!("CARGO_BIN_NAME"), bytes));
    };
}
