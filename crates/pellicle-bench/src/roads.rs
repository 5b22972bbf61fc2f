//! `pellicle-bench roads`: the bulk road and the real-time road on the same particles, field and lattice, so that a caller
//! knows which one to take. `--json` prints one object a row.
//!
//! Both make positions, normals and triangles of every frame in memory that they keep; they take turns, and the middle of
//! several rounds counts. `SCENE` and `CELLS` choose one scene and one number of cells per reach. Columns: particles, cells per reach, threads, crossed cells, milliseconds a frame of each road, and
//! the ratio (above 1 the real-time road is faster). `--stages` also tells what the real-time road counted and how long its
//! stages took.
//!
//! Source: this project.

use std::{sync::LazyLock, time::Instant};

use pellicle::{
    Control, Mesh, MetaballParams, Params, Reconstructor, ScalarField,
    realtime::{Engine, Frame},
};
use pellicle_scenes::{FRAMES, ISO, Play, SUPPORT, Show, splash};

/// Rounds over all frames, of which the middle one counts.
const ROUNDS: usize = 5;

static START: LazyLock<Instant> = LazyLock::new(Instant::now);

/// Particles of some frames.
struct Case {
    name: String,
    frames: Vec<Vec<[f32; 3]>>,
    /// World units.
    reach: f64,
    iso: f64,
}

/// Runs the verb.
pub fn run(words: &[String]) -> Result<(), String> {
    let (mut json, mut stages, mut chosen) = (false, false, Vec::new());
    for word in words {
        match word.as_str() {
            "--json" => json = true,
            "--stages" => stages = true,
            other if other.starts_with('-') => return Err(format!("{other}: [SCENE [CELLS]] [--json] [--stages]")),
            other => chosen.push(other),
        }
    }
    let only = match chosen.get(1) {
        None => None,
        Some(word) => Some(word.parse::<f64>().map_err(|_| format!("{word}: cells per reach, a number"))?),
    };
    if !json {
        println!("{:<18} particles  cells/reach  threads     cells  bulk ms  real-time ms  ratio", "scene");
    }
    for case in cases().into_iter().filter(|case| chosen.first().is_none_or(|name| case.name == **name)) {
        for cells in only.map_or(vec![3.0, 6.0, 10.0], |cells| vec![cells]) {
            for threads in [1, 2] {
                let pool =
                    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())?;
                pool.install(|| measure(&case, cells, threads, json, stages))?;
            }
        }
    }
    Ok(())
}

fn cases() -> Vec<Case> {
    let show = |show: Show, name: &str| {
        let mut play = Play::new(show, 1);
        let mut frames = Vec::new();
        while play.frame() < FRAMES {
            if play.frame() >= FRAMES / 2 && play.frame().is_multiple_of(FRAMES / 10) {
                frames.push(play.balls().positions.clone());
            }
            play.step();
        }
        Case { name: name.into(), frames, reach: SUPPORT.into(), iso: ISO.into() }
    };
    let pool = |n: usize| {
        let scene = splash(n, 1);
        let reach = 4.0 * f64::from(scene.radius);
        Case { name: format!("splash {n}"), frames: vec![scene.positions], reach, iso: 0.6 }
    };
    vec![
        show(Show::Blob, "blob"),
        show(Show::Explosion, "explosion"),
        show(Show::Fountain, "fountain"),
        pool(3_000),
        pool(30_000),
        pool(150_000),
    ]
}

fn measure(case: &Case, cells: f64, threads: usize, json: bool, stages: bool) -> Result<(), String> {
    let spacing = case.reach / cells;
    let says = |error: pellicle::Error| error.to_string();
    let field = ScalarField::Metaball(MetaballParams::default());
    let radius = case.reach / 4.0;
    let params = Params {
        smoothing_length: 2.0,
        cell_size: spacing / radius,
        iso: case.iso,
        normals: true,
        ..Params::with_field(radius, field)
    };
    let realtime = pellicle::realtime::Params { iso: case.iso, ..pellicle::realtime::Params::new(case.reach, spacing) };
    let mut engine = Engine::new(realtime).map_err(says)?;
    engine.set_clock(Some(|| START.elapsed().as_nanos() as u64));
    let (mut bulk, control) = (Reconstructor::new(), Control::default());
    let (mut mesh, mut other) = (Mesh::default(), Mesh::default());
    let mut seconds = [Vec::new(), Vec::new()];
    let (mut found, mut last) = ([0, 0], Frame::default());
    for _ in 0..ROUNDS {
        let start = Instant::now();
        found[0] = 0;
        for positions in &case.frames {
            let surface = bulk.extract(positions.into(), &[], &params, &control).map_err(says)?;
            surface.write_mesh(&mut mesh).map_err(says)?;
            found[0] += mesh.triangles.len();
        }
        seconds[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        found[1] = 0;
        for positions in &case.frames {
            last = engine.update(positions, &mut other).map_err(says)?;
            found[1] += last.triangles;
        }
        seconds[1].push(start.elapsed().as_secs_f64());
    }
    drop((mesh, other));
    let [bulk_ms, ms] = seconds.map(|mut seconds| {
        seconds.sort_by(f64::total_cmp);
        1e3 * seconds[ROUNDS / 2] / case.frames.len() as f64
    });
    let (particles, crossed) = (last.particles, last.counts.cubes);
    if json {
        let row = serde_json::json!({
            "scene": case.name, "particles": particles, "cells_per_reach": cells, "threads": threads, "cells": crossed,
            "triangles_bulk": found[0], "triangles_real_time": found[1], "bulk_ms": bulk_ms, "real_time_ms": ms,
        });
        println!("{row}");
    } else {
        println!(
            "{:<18} {particles:>9}  {cells:>11}  {threads:>7}  {crossed:>8}  {bulk_ms:>7.2}  {ms:>12.2}  {:>5.2}",
            case.name,
            bulk_ms / ms
        );
    }
    if stages {
        println!("   {:?}\n   {:?}", last.counts, last.times);
    }
    Ok(())
}
