//! What each scalar field does to a jittered block of particles, and what an evaluation of its kernel costs.
//!
//! ```sh
//! cargo run --release -p pellicle-bench -- fields flatness
//! cargo run --release -p pellicle-bench -- fields cost
//! ```
//!
//! `flatness`: 40 × 40 × 20 particles, each moved by up to a tenth of the spacing r along each axis, seed 1. *RMS* is the distance of
//! the top's vertices, ten spacings away from the rim, to the plane that fits them best, in r; *volume* that of the mesh over
//! N r³. *sheet* is the same lattice, one layer thick: its pieces and its holes. No smoothing.
//!
//! `cost`: one thread, every node in reach of a particle (`Band::Full`), so that the number of kernel evaluations is known:
//! each particle has 4/3 π (R/spacing)³ nodes in its support R. Time is that of the stage `Fill`, the least of five. The floor is
//! the vector operations of one evaluation (listed below, a square root taken for one), 16 lanes wide, two a cycle. The clock
//! is measured by a chain of multiplications of three cycles each.
//!
//! One JSON line a field, and a table in the end.

use std::{
    f64::consts::PI,
    hint::black_box,
    sync::Mutex,
    time::{Duration, Instant},
};

use pellicle::{Band, Control, Mesh, Params, Reconstructor, ScalarField, Stage, mesh::Report};
use pellicle_scenes::Random;

const RADIUS: f64 = 0.05;
const SPACING: f64 = 2.0 * RADIUS;

/// Operations on vectors that one evaluation takes at least: distance, kernel, sums.
const OPERATIONS: [(&str, f64); 9] = [
    ("sph", 13.25),
    ("zhu-bridson", 13.25),
    ("solenthaler", 31.25),
    ("adams", 15.25),
    ("onderik", 14.25),
    ("anisotropic", 26.0),
    ("metaball", 7.25),
    ("metaball-wyvill", 9.25),
    ("metaball-inverse-square", 10.25),
];

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    match words.first().map(String::as_str) {
        Some("flatness") => flatness(),
        Some("cost") => cost(),
        _ => Err("flatness or cost?".into()),
    }
}

fn fields() -> impl Iterator<Item = ScalarField> {
    ScalarField::NAMES.into_iter().filter_map(ScalarField::from_name)
}

/// A jittered lattice of particles.
fn block(dims: [i32; 3]) -> Vec<[f64; 3]> {
    let mut random = Random::new(1);
    let places =
        (0..dims[0] * dims[1] * dims[2]).map(|i| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])]);
    places
        .map(|place| {
            let jitter = random.in_cube(0.1 * SPACING);
            std::array::from_fn(|a| f64::from(place[a]) * SPACING + jitter[a])
        })
        .collect()
}

fn flatness() -> Result<(), String> {
    let dims = [40, 40, 20];
    let (particles, sheet) = (block(dims), block([40, 40, 1]));
    println!("| field | RMS of the top, r | volume / N r³ | sheet |");
    let mut rows = Vec::new();
    for field in fields() {
        let params = Params::with_field(RADIUS, field);
        let mesh = |particles: &[[f64; 3]]| pellicle::reconstruct(particles, &params).map_err(|e| e.to_string());
        let surface = mesh(&particles)?;
        let rms = rms_of_top(&surface, dims) / SPACING;
        let volume = Report::of(&surface).signed_volume / (particles.len() as f64 * SPACING.powi(3));
        let report = Report::of(&mesh(&sheet)?);
        let (pieces, euler) = (report.components, report.euler_characteristic);
        let holes = pieces as i64 - euler / 2;
        let name = field.name();
        println!(
            "{{\"field\": \"{name}\", \"rms\": {rms:.5}, \"volume\": {volume:.4}, \"sheet_pieces\": {pieces}, \"sheet_holes\": {holes}}}"
        );
        rows.push(format!("| {name} | {rms:.4} | {volume:.3} | {pieces} pieces, {holes} holes |"));
    }
    println!("\n{}", rows.join("\n"));
    Ok(())
}

/// Root mean square distance of the top's vertices to the plane that fits them best.
fn rms_of_top(mesh: &Mesh, dims: [i32; 3]) -> f64 {
    let inner = |a: usize, v: f64| v > 10.0 * SPACING && v < (f64::from(dims[a]) - 11.0) * SPACING;
    let top: Vec<[f64; 3]> = (0..mesh.vertices.len())
        .map(|v| mesh.position(v))
        .filter(|p| inner(0, p[0]) && inner(1, p[1]) && p[2] > 10.0 * SPACING)
        .collect();
    let n = top.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|a| top.iter().map(|p| p[a]).sum::<f64>() / n);
    let moment = |a: usize, b: usize| top.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>();
    let (xx, xy, yy, xz, yz) = (moment(0, 0), moment(0, 1), moment(1, 1), moment(0, 2), moment(1, 2));
    let det = xx * yy - xy * xy;
    let (slope_x, slope_y) = ((xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det);
    let off = |p: &[f64; 3]| p[2] - mean[2] - slope_x * (p[0] - mean[0]) - slope_y * (p[1] - mean[1]);
    let tilt = (1.0 + slope_x * slope_x + slope_y * slope_y).sqrt();
    (top.iter().map(|p| (off(p) / tilt).powi(2)).sum::<f64>() / n).sqrt()
}

fn cost() -> Result<(), String> {
    let particles = block([24, 24, 24]);
    let clock = clock();
    println!("clock: {:.2} GHz", clock / 1e9);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| error.to_string())?;
    println!("| field | support, r | evaluations, M | ns | floor, ns | times the floor |");
    let mut rows = Vec::new();
    for field in fields() {
        let name = field.name();
        let operations = OPERATIONS.iter().find(|entry| entry.0 == name).map_or(f64::NAN, |entry| entry.1);
        let params = Params { band: Band::Full, ..Params::with_field(RADIUS, field) };
        let nodes = 4.0 / 3.0 * PI * (params.support() / params.spacing()).powi(3);
        let evaluations = particles.len() as f64 * nodes;
        let mut reconstructor = Reconstructor::new();
        let mut best = f64::MAX;
        for _ in 0..5 {
            let time = pool.install(|| time_of_fill(&mut reconstructor, &particles, &params))?;
            best = best.min(time.as_secs_f64());
        }
        let (each, floor) = (1e9 * best / evaluations, 1e9 * operations / (32.0 * clock));
        let (support, times) = (field.smoothing_length(), each / floor);
        println!(
            "{{\"field\": \"{name}\", \"evaluations\": {evaluations:.0}, \"fill_s\": {best:.4}, \"ns\": {each:.4}, \"floor_ns\": {floor:.4}}}"
        );
        let millions = evaluations / 1e6;
        rows.push(format!("| {name} | {support} | {millions:.0} | {each:.3} | {floor:.3} | {times:.1} |"));
    }
    println!("\n{}", rows.join("\n"));
    Ok(())
}

/// Time that the stage `Fill` takes.
fn time_of_fill(
    reconstructor: &mut Reconstructor,
    particles: &[[f64; 3]],
    params: &Params,
) -> Result<Duration, String> {
    let times = Mutex::new((Instant::now(), Duration::ZERO));
    let on_stage = |stage: Stage| {
        if let Ok(mut times) = times.lock() {
            match stage {
                Stage::Fill => times.0 = Instant::now(),
                Stage::Count => times.1 = times.0.elapsed(),
                _ => {}
            }
        }
    };
    let control = Control { on_stage: Some(&on_stage), ..Control::default() };
    reconstructor.extract(particles.into(), &[], params, &control).map_err(|error| error.to_string())?;
    Ok(times.into_inner().map_err(|error| error.to_string())?.1)
}

/// Cycles a second: a multiplication waits three for the one before it.
fn clock() -> f64 {
    let mut best = f64::MAX;
    for _ in 0..5 {
        let start = Instant::now();
        let mut x = black_box(3u64);
        for _ in 0..20_000_000 {
            x = x.wrapping_mul(x);
        }
        black_box(x);
        best = best.min(start.elapsed().as_secs_f64());
    }
    3.0 * 20e6 / best
}
