//! The frames that stand for the paper's scenes.

use std::path::{Path, PathBuf};

use pellicle_io::{PositionData, ReadOptions, read_particles};

/// A scene of the paper, and a frame like it.
#[derive(Debug, Clone)]
pub struct Scene {
    /// As the paper calls it.
    pub name: &'static str,
    /// Within the folder of test data.
    pub file: PathBuf,
    /// Particle radius: half of the spacing r.
    pub radius: f64,
}

/// The corner breaking dam of about 150,000 particles.
pub const DAM: &str = "CBD-150k";

/// All but the Hebe statue, of which there is nothing alike.
pub fn all() -> Vec<Scene> {
    let scene = |name, file: &str, radius| Scene { name, file: Path::new("particles").join(file), radius };
    vec![
        scene("Drop", "drop_t0.30.xyz", 0.02),
        scene(DAM, "cbd_t1.10.xyz", 0.025),
        scene("CBD", "cbd1m_t1.56.xyz", 0.0125),
        scene("Hemispheres", "hemi_t0.60.ply", 0.025),
    ]
}

impl Scene {
    /// The particles.
    ///
    /// # Errors
    /// What is wrong with the file, and where it was looked for.
    pub fn read(&self) -> Result<Vec<[f32; 3]>, String> {
        let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
        let folder = std::env::var_os("PELLICLE_DATA").map_or(default, PathBuf::from);
        let path = folder.join(&self.file);
        let particles = read_particles(&path, &ReadOptions::default())
            .map_err(|error| format!("{error} (PELLICLE_DATA names the folder of test data)"))?;
        Ok(match particles.positions {
            PositionData::F32(positions) => positions,
            PositionData::F64(positions) => positions.iter().map(|p| p.map(|v| v as f32)).collect(),
        })
    }
}
