//! Real frames in every format, from file to file. They lie in the folder that `PELLICLE_DATA` names, or in
//! `../shared/data` beside the workspace; without them the tests say that they are skipped.

mod common;

use std::path::PathBuf;

use common::Folder;

/// Name, particles, radius of the simulation, whether velocities are in the file.
const FRAMES: [(&str, u64, f64, bool); 7] = [
    ("cbd_t0.50.bgeo", 140_608, 0.025, true),
    ("cbd_t1.10.xyz", 140_608, 0.025, false),
    ("cbd_t4.00.vtu", 140_608, 0.025, true),
    ("hemi_t0.35.vtk", 28_899, 0.025, true),
    ("hemi_t0.60.ply", 28_899, 0.025, true),
    ("hemi_t1.50.csv", 28_899, 0.025, true),
    ("drop_t0.10.npy", 149_260, 0.02, false),
];

/// The folder of frames; without it the test that asks is skipped, which the tally of `cargo xtask test` counts.
fn frames() -> Option<PathBuf> {
    let root = match std::env::var_os("PELLICLE_DATA") {
        Some(folder) => PathBuf::from(folder),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
    };
    let folder = root.join("particles");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("SKIPPED: {} is missing: set PELLICLE_DATA to the folder of test data", folder.display());
    None
}

#[test]
fn info_finds_every_particle_and_about_the_radius_of_the_simulation() {
    let Some(frames) = frames() else { return };
    let folder = Folder::new();
    for (name, count, radius, has_velocity) in FRAMES {
        let path = frames.join(name);
        let report = folder.run(&["info", &path.to_string_lossy(), "--json"]).expect(0).json();
        assert_eq!(report["particles"], count, "{name}");
        let inferred = report["particle_radius_inferred"].as_f64().unwrap();
        assert!((inferred / radius - 1.0).abs() < 0.2, "{name}: {inferred}, not {radius}");
        let attributes = report["attributes"].as_array().unwrap();
        assert_eq!(attributes.iter().any(|a| a["name"] == "velocity"), has_velocity, "{name}: {attributes:?}");
    }
}

#[test]
fn every_format_becomes_a_closed_mesh() {
    let Some(frames) = frames() else { return };
    let folder = Folder::new();
    for (name, _, radius, has_velocity) in FRAMES {
        let path = frames.join(name);
        let radius = radius.to_string();
        let args = ["mesh", &path.to_string_lossy(), "-r", &radius, "-c", "1", "-o", "out.ply", "--json"];
        let report = folder.run(&args).expect(0).json();
        let carried = report["parameters"]["attributes"].as_array().unwrap().len();
        assert_eq!(carried, usize::from(has_velocity), "{name}");
        folder.run(&["check", "out.ply", "-q"]).expect(0);
    }
}
