//! Replays the corpus of the fuzz targets, and damages the files of it and of `files` at random; by a plain compiler, in
//! seconds.
//!
//! Promised are: no panic, an error that names the file, 10 seconds at most, and no more memory than the file's size
//! justifies. `PELLICLE_FUZZ_SECONDS` sets how long to go on with seeds that differ each time, `PELLICLE_FUZZ_TARGETS`
//! (`ply,glb`) which formats. A finding is left in a file, which belongs into the corpus.

mod common;
#[path = "common/files.rs"]
mod files;
#[path = "../../../fuzz/src/read.rs"]
mod fuzz;
#[path = "common/judge.rs"]
mod judge;
#[path = "common/mutate.rs"]
mod mutate;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use common::Folder;
use fuzz::TARGETS;
use judge::Judge;
use mutate::{minimized, mutated};
use pellicle_io::formats;
use pellicle_scenes::Random;

/// Damaged files per format without `PELLICLE_FUZZ_SECONDS`.
const FILES: u64 = 1000;
/// Files per format to choose from: the memory that is measured is this process's.
const POOL: usize = 500;
/// Findings of interest that `grow_the_corpus` keeps for each format.
const KEPT: usize = 24;

/// One for all tests of this process, whose memory is measured.
static JUDGE: LazyLock<Mutex<Judge>> = LazyLock::new(|| Mutex::new(Judge::new()));

fn fuzz_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz")
}

/// The files of a target's corpus, by name.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(fuzz_folder().join("corpus").join(target)).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).expect("a seed")))
        .collect();
    files.sort();
    files
}

/// The files that are damaged: the corpus and the sound files.
fn starts(target: &str, sound: &[(String, Vec<u8>)]) -> Vec<Vec<u8>> {
    let own = sound.iter().filter(|(name, _)| files::usual_extension(name) == Some(target));
    own.map(|(_, bytes)| bytes.clone()).chain(corpus(target).into_iter().map(|(_, bytes)| bytes)).collect()
}

/// The targets that are asked for.
fn targets() -> Vec<&'static str> {
    let chosen = std::env::var("PELLICLE_FUZZ_TARGETS").unwrap_or_default();
    let is_chosen = |target: &&str| chosen.is_empty() || chosen.split(',').any(|name| name == *target);
    TARGETS.into_iter().filter(is_chosen).collect()
}

fn seconds() -> Option<Duration> {
    let text = std::env::var("PELLICLE_FUZZ_SECONDS").ok()?;
    Some(Duration::from_secs(text.parse().expect("PELLICLE_FUZZ_SECONDS is a whole number of seconds")))
}

#[test]
fn every_format_that_is_read_has_a_target_with_seeds() {
    let read: BTreeSet<&str> = formats().filter(files::is_read).map(|format| format.extensions[0]).collect();
    assert_eq!(read, TARGETS.into_iter().collect());
    let manifest = std::fs::read_to_string(fuzz_folder().join("Cargo.toml")).expect("the targets' manifest");
    for target in TARGETS {
        let path = format!("fuzz_targets/{target}.rs");
        assert!(manifest.contains(&format!("name = \"{target}\"\npath = \"{path}\"")), "{target} in fuzz/Cargo.toml");
        assert!(fuzz_folder().join(&path).is_file(), "fuzz/{path}");
        assert!(!corpus(target).is_empty(), "fuzz/corpus/{target}: no seeds");
    }
}

#[test]
fn the_corpus_is_read_without_a_panic_a_long_wait_or_much_memory() {
    let judge = JUDGE.lock().unwrap_or_else(PoisonError::into_inner);
    for target in TARGETS {
        for (name, bytes) in corpus(target) {
            judge.expect_sound(target, &bytes, &format!("fuzz/corpus/{target}/{name}"));
        }
    }
}

#[test]
fn damaged_files_are_read_without_a_panic_a_long_wait_or_much_memory() {
    let judge = JUDGE.lock().unwrap_or_else(PoisonError::into_inner);
    let sound = files::all(&Folder::new());
    let start = Instant::now();
    let first = match seconds() {
        Some(_) => SystemTime::UNIX_EPOCH.elapsed().map_or(0, |since| since.as_nanos() as u64),
        None => 0,
    };
    let mut files: Vec<(&str, Vec<Vec<u8>>)> = targets().into_iter().map(|t| (t, starts(t, &sound))).collect();
    let (mut known, mut count) = (BTreeSet::new(), 0u64);
    for seed in first.. {
        match seconds() {
            Some(limit) if start.elapsed() > limit => break,
            None if seed == FILES => break,
            _ => {}
        }
        for (target, files) in &mut files {
            let mut random = Random::new(seed);
            let [file, other] = [(); 2].map(|()| &files[random.below(files.len())]);
            let bytes = mutated(&mut random, file, other);
            count += 1;
            let words = judge.expect_sound(target, &bytes, &format!("seed {seed}"));
            // A file that goes a way of its own is worth further damage.
            if known.insert((*target, outline(&words))) {
                if files.len() < POOL {
                    files.push(bytes);
                } else {
                    let place = random.below(POOL);
                    files[place] = bytes;
                }
            }
        }
    }
    println!("{count} files, {} ways through the readers, {:.1?}", known.len(), start.elapsed());
}

/// What came of the file as particles, as a mesh and as a volume: the beginning of each message, without what differs from file to
/// file, numbers and quotations.
fn outline(words: &str) -> String {
    const LENGTH: usize = 60;
    let mut outline = String::new();
    for line in words.lines().take(3) {
        let (mut is_quoted, mut last, mut length) = (false, ' ', 0);
        for c in line.chars() {
            // An apostrophe stands behind a letter.
            let is_quote = matches!(c, '\'' | '"' | '`') && (is_quoted || !last.is_alphanumeric());
            is_quoted ^= is_quote;
            if !is_quoted && !is_quote && !c.is_ascii_digit() && length < LENGTH {
                outline.push(c);
                length += 1;
            }
            last = c;
        }
        outline.push('\n');
    }
    outline
}

/// Writes seeds: sound files, and of files that go a new way through the readers the least that does.
///
/// `PELLICLE_FUZZ_SECONDS=300 cargo test -p pellicle-io --all-features --test fuzz_corpus -- --ignored`
#[test]
#[ignore = "writes into the repository"]
fn grow_the_corpus() {
    const LARGEST_SOUND: usize = 3 << 10;
    const LARGEST: usize = 600;
    let judge = JUDGE.lock().unwrap_or_else(PoisonError::into_inner);
    let sound = files::all(&Folder::new());
    let targets = targets();
    let share = seconds().unwrap_or(Duration::from_secs(180)) / targets.len() as u32;
    for target in targets {
        let folder = fuzz_folder().join("corpus").join(target);
        std::fs::create_dir_all(&folder).expect("a folder for the seeds");
        let is_own = |(name, _): &&(String, Vec<u8>)| files::usual_extension(name) == Some(target);
        let least = sound.iter().filter(is_own).map(|(_, bytes)| bytes.len()).min().unwrap_or(0);
        for (name, bytes) in sound.iter().filter(is_own) {
            if bytes.len() <= LARGEST_SOUND.max(least) {
                std::fs::write(folder.join(format!("sound-{name}")), bytes).expect("a seed");
            }
        }
        let way = |bytes: &[u8]| outline(&judge.expect_sound(target, bytes, "damaged"));
        let mut files = starts(target, &sound);
        let mut known: BTreeSet<String> = files.iter().map(|bytes| way(bytes)).collect();
        let mut kept = corpus(target).iter().filter(|(name, _)| name.starts_with("damaged-")).count();
        let start = Instant::now();
        for seed in 0.. {
            if start.elapsed() > share || kept == KEPT {
                break;
            }
            let mut random = Random::new(seed);
            let [file, other] = [(); 2].map(|()| &files[random.below(files.len())]);
            let bytes = mutated(&mut random, file, other);
            let found = way(&bytes);
            if !known.insert(found.clone()) {
                continue;
            }
            let least = minimized(&bytes, |shorter| way(shorter) == found);
            if least.len() <= LARGEST {
                std::fs::write(folder.join(format!("damaged-{kept:02}")), &least).expect("a seed");
                kept += 1;
            }
            files.push(bytes);
        }
        println!("{target}: {} ways, {kept} kept", known.len());
    }
}
