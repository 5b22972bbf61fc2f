//! Shared by the tests: the folder of real data, a folder of one's own, and particles that any format can hold.
#![allow(dead_code, reason = "no test uses all of it")]

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use pellicle_io::{AttributeChoice, Error, ParticleAttribute, Particles, ReadOptions, read_particles};

/// The folder of real data, or `None` with a line that says so.
pub fn data() -> Option<PathBuf> {
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("PELLICLE_DATA").map_or(default, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    // Not by eprintln, whose output the test harness swallows.
    let _ =
        writeln!(std::io::stderr(), "SKIPPED: no real data at {}; set PELLICLE_DATA to their folder", folder.display());
    None
}

/// A folder that is removed with all its content.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Folder {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("pellicle-io-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for the test");
        Folder(path)
    }

    pub fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.join(name);
        std::fs::write(&path, bytes).expect("a file for the test");
        path
    }

    pub fn entries(&self) -> usize {
        std::fs::read_dir(&self.0).expect("the folder is there").count()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn all() -> ReadOptions {
    ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() }
}

pub fn read(path: &Path) -> Result<Particles, Error> {
    read_particles(path, &all())
}

pub fn positions(particles: &Particles) -> Vec<[f64; 3]> {
    let view = particles.positions.view();
    (0..view.len()).map(|i| view.get(i)).collect()
}

pub fn attribute<'a>(particles: &'a Particles, name: &str) -> &'a ParticleAttribute {
    particles.attribute(name).unwrap_or_else(|| panic!("no attribute {name}"))
}

/// The largest address space that this process has had, in bytes: counts what was reserved, used or not. Only Linux
/// tells.
pub fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmPeak:"))?;
    Some(line.split_ascii_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}
