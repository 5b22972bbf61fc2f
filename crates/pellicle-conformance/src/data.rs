//! Frames that are not part of the repository: in the folder that `PELLICLE_DATA` names, or in `../shared/data` beside the
//! workspace. A test that lacks them says that it is skipped.
//!
//! Source: this project.

use std::path::PathBuf;

use crate::skip;

/// The file of particles of this name, if it is there; otherwise the test is told to be skipped.
pub fn particle_file(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("PELLICLE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let path = root.join("particles").join(name);
    if path.is_file() {
        return Some(path);
    }
    skip(&format!("{} is missing: set PELLICLE_DATA to the folder of test data", path.display()));
    None
}

/// Positions from a file of raw little-endian `f32` x y z, if it is there.
pub fn raw_particles(name: &str) -> Option<Vec<[f32; 3]>> {
    let bytes = std::fs::read(particle_file(name)?).expect("a file that is there can be read");
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Some(bytes.chunks_exact(12).map(|p| [number(p), number(&p[4..]), number(&p[8..])]).collect())
}
