//! Frames of a real simulator: the band loses nothing, threads change nothing, every mesh is closed.
//!
//! They lie in the folder that `PELLICLE_DATA` names, or in `../shared/data` beside the workspace; without them the tests
//! say that they are skipped. The frame of a million particles takes part in `cargo xtask test --all`.

use pellicle::{Band, Lanes, Mesh, Params};
use pellicle_conformance::{Subject, closed, must, particle_file, same_bytes};
use pellicle_io::{ReadOptions, read_particles};

/// Compares the ways to mesh one frame at one cell size.
fn judge(name: &str, radius: f64, cell_size: f64) {
    let Some(file) = particle_file(name) else { return };
    let particles = read_particles(&file, &ReadOptions::default()).expect("the frame can be read");
    let params = Params { cell_size, ..Params::new(radius) };
    let mesh = |threads: usize, band: Band, lanes: Lanes| -> Mesh {
        let subject = Subject { threads, ..Subject::default() };
        let params = Params { band, lanes, ..params.clone() };
        subject.mesh_of(particles.positions.view(), &[], &params).expect("a mesh").0
    };
    let auto = mesh(2, Band::Auto, Lanes::Auto);
    let report = must(closed(&auto));
    assert!(report.triangles > 1000, "{report:?}");
    must(same_bytes(&mesh(1, Band::Auto, Lanes::Auto), &auto).map_err(|e| format!("one thread: {e}")));
    must(same_bytes(&auto, &mesh(2, Band::Full, Lanes::Auto)).map_err(|e| format!("band: {e}")));
}

/// One test for each frame, at both cell sizes.
macro_rules! frames {
    ($($test:ident: $name:literal, $radius:literal;)*) => { $(
        #[test]
        fn $test() {
            judge($name, $radius, 1.0);
            judge($name, $radius, 0.5);
        }
    )* };
}

frames! {
    cbd_at_rest: "cbd_t0.00.npy", 0.025;
    cbd_collapse: "cbd_t0.50.bgeo", 0.025;
    cbd_splash: "cbd_t1.10.xyz", 0.025;
    cbd_spray: "cbd_t1.75.vtk", 0.025;
    cbd_return: "cbd_t4.00.vtu", 0.025;
    cbd_calm: "cbd_t6.00.ply", 0.025;
    hemi_fall: "hemi_t0.35.vtk", 0.025;
    hemi_impact: "hemi_t0.60.ply", 0.025;
    hemi_sheets: "hemi_t1.50.csv", 0.025;
    drop_fall: "drop_t0.10.npy", 0.02;
    drop_impact: "drop_t0.20.bgeo", 0.02;
    drop_crown: "drop_t0.30.xyz", 0.02;
    drop_waves: "drop_t0.80.xyz", 0.02;
}

/// A minute or two: only when asked for.
#[test]
#[ignore = "minutes: cargo xtask test --all"]
fn a_million_particles() {
    judge("cbd1m_t1.56.xyz", 0.0125, 1.0);
    judge("cbd1m_t1.56.xyz", 0.0125, 0.5);
}
