//! What is benchmarked: a splash that we make ourselves, always, and a frame of a real simulator where it is there.

use std::path::{Path, PathBuf};

use pellicle::Params;
use pellicle_io::{PositionData, ReadOptions, read_particles};

/// Particles and how to make their surface.
pub struct Input {
    /// `SCENE-cCELL`.
    pub name: String,
    /// In world units.
    pub positions: Vec<[f32; 3]>,
    /// Defaults but for the radius and the cell size.
    pub params: Params,
}

/// All inputs. The frame comes from the folder `PELLICLE_DATA`, by default `shared/data` beside the repository; where
/// it is missing that is said, and the splash remains.
pub fn all() -> Vec<Input> {
    let scene = pellicle_scenes::splash(30_000, 1);
    let mut inputs = vec![input("splash_30k", scene.positions, scene.radius.into(), 0.5)];
    let frame = data().join("particles/cbd_t1.10.xyz");
    if frame.is_file() {
        let positions = read(&frame);
        inputs.push(input("dam_break_140k", positions.clone(), 0.025, 0.5));
        inputs.push(input("dam_break_140k", positions, 0.025, 1.0));
    } else {
        let frame = frame.display();
        println!("SKIPPED: dam_break_140k: {frame} is missing: set PELLICLE_DATA to the folder of test data");
    }
    inputs
}

fn input(scene: &str, positions: Vec<[f32; 3]>, radius: f64, cell_size: f64) -> Input {
    let params = Params { cell_size, ..Params::new(radius) };
    Input { name: format!("{scene}-c{cell_size:.1}"), positions, params }
}

fn data() -> PathBuf {
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("PELLICLE_DATA").map_or(default, PathBuf::from)
}

fn read(path: &Path) -> Vec<[f32; 3]> {
    let particles = read_particles(path, &ReadOptions::default()).expect("the frame can be read");
    match particles.positions {
        PositionData::F32(positions) => positions,
        PositionData::F64(positions) => positions.iter().map(|p| p.map(|v| v as f32)).collect(),
    }
}
