//! How fast files are written: a mesh of two million triangles and a million particles in every format, beside a plain
//! write of the same number of bytes. `cargo run --release -p pellicle-io --example write_speed -- FOLDER`
//!
//! The folder decides what is measured: a folder in memory, the code; one on a disk, mostly the disk. The best of five.

use std::path::{Path, PathBuf};
use std::time::Instant;

use pellicle::{Mesh, VertexAttribute};
use pellicle_io::{
    AttributeValues, Error, ParticleAttribute, Particles, PositionData, WriteOptions, formats, write_mesh,
    write_particles,
};

/// Vertices along an edge of the sheet.
const EDGE: u32 = 1000;
const ROUNDS: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(std::env::temp_dir, PathBuf::from);
    let (mesh, particles, options) = (sheet(), cloud(), WriteOptions::default());
    println!("{:28} {:>9} {:>10} {:>14}", "", "MB", "MB/s", "plain MB/s");
    for format in formats() {
        let path = folder.join(format!("pellicle-speed.{}", format.extensions[0]));
        if format.writes_meshes {
            measure(&format!("mesh .{}", format.extensions[0]), &path, || {
                write_mesh(&path, &mesh, &options).map(drop)
            })?;
        }
        if format.writes_particles {
            let name = format!("particles .{}", format.extensions[0]);
            measure(&name, &path, || write_particles(&path, &particles, &options).map(drop))?;
        }
    }
    Ok(())
}

/// A wavy sheet with velocities.
fn sheet() -> Mesh {
    let node = |i: u32| [(i % EDGE) as f32 * 0.01, (i / EDGE) as f32 * 0.01, (i as f32 * 0.001).sin()];
    let quad = |i: u32| [[i, i + 1, i + EDGE], [i + 1, i + EDGE + 1, i + EDGE]];
    let corners = (0..EDGE * (EDGE - 1)).filter(|i| i % EDGE + 1 < EDGE);
    let values = (0..3 * EDGE * EDGE).map(|i| (i as f32 * 0.37).cos()).collect();
    Mesh {
        vertices: (0..EDGE * EDGE).map(node).collect(),
        triangles: corners.flat_map(quad).collect(),
        attributes: vec![VertexAttribute::new("velocity", 3, values)],
        ..Mesh::default()
    }
}

fn cloud() -> Particles {
    let Mesh { vertices, mut attributes, .. } = sheet();
    let count = vertices.len();
    let velocity = AttributeValues::F32(attributes.swap_remove(0).values);
    let id = AttributeValues::I32((0..count as i32).collect());
    Particles {
        positions: PositionData::F32(vertices),
        attributes: vec![
            ParticleAttribute { name: "velocity".into(), components: 3, values: velocity },
            ParticleAttribute { name: "id".into(), components: 1, values: id },
        ],
    }
}

fn measure(name: &str, path: &Path, write: impl Fn() -> Result<(), Error>) -> Result<(), Box<dyn std::error::Error>> {
    let mut best = [f64::INFINITY; 2];
    let mut bytes = Vec::new();
    for _ in 0..ROUNDS {
        let start = Instant::now();
        write()?;
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        bytes = std::fs::read(path)?;
        std::fs::remove_file(path)?;
        let start = Instant::now();
        std::fs::write(path, &bytes)?;
        best[1] = best[1].min(start.elapsed().as_secs_f64());
        std::fs::remove_file(path)?;
    }
    let megabytes = bytes.len() as f64 / 1e6;
    println!("{name:28} {megabytes:9.1} {:10.0} {:14.0}", megabytes / best[0], megabytes / best[1]);
    Ok(())
}
