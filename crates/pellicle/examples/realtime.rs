//! Times the real-time engine on particle files of raw `f32` x y z.
//!
//! `cargo run --release -p pellicle-bench --example realtime -- REACH SPACING FRAMES FILE… [--block X,Y,Z] [--particles]
//! [--copies N] [--threads N] [--no-normals]` prints the median time of a frame, and what a frame amounted to.

use std::time::Instant;

use pellicle::{
    Mesh,
    realtime::{Engine, Params, Seeds},
};

fn main() {
    let mut words = std::env::args().skip(1);
    let mut number = || words.next().and_then(|w| w.parse::<f64>().ok()).expect("REACH SPACING FRAMES");
    let (reach, spacing, frames) = (number(), number(), number() as usize);
    let mut params = Params::new(reach, spacing);
    let (mut files, mut copies, mut threads) = (Vec::new(), 1, 1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--particles" => params.seeds = Seeds::Particles,
            "--no-normals" => params.normals = false,
            "--block" => {
                let sizes: Vec<usize> = words.next().unwrap().split(',').map(|n| n.parse().unwrap()).collect();
                params.block = [sizes[0], sizes[1], sizes[2]];
            }
            "--copies" => copies = words.next().unwrap().parse().unwrap(),
            "--threads" => threads = words.next().unwrap().parse().unwrap(),
            _ => files.push(word),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    for file in files {
        let bytes = std::fs::read(&file).expect("a file");
        let numbers: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        let one: Vec<[f32; 3]> = numbers.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        let width = one.iter().fold([f32::MAX, f32::MIN], |w, p| [w[0].min(p[0]), w[1].max(p[0])]);
        let step = width[1] - width[0] + 3.0 * reach as f32;
        let positions: Vec<[f32; 3]> =
            (0..copies).flat_map(|c| one.iter().map(move |p| [p[0] + c as f32 * step, p[1], p[2]])).collect();
        pool.install(|| {
            let mut engine = Engine::new(params.clone()).expect("parameters");
            let mut mesh = Mesh::default();
            let mut times = Vec::new();
            let mut frame = engine.update(&positions, &mut mesh).expect("a surface");
            for _ in 0..frames {
                let start = Instant::now();
                frame = engine.update(&positions, &mut mesh).expect("a surface");
                times.push(start.elapsed().as_secs_f64());
            }
            times.sort_by(f64::total_cmp);
            let median = times[times.len() / 2];
            let (fps, c) = (1.0 / median, frame.counts);
            println!(
                "{file} spacing {spacing} {:?} threads {threads}: {:.3} ms, {fps:.0} frames/s, {:.2} Mcubes/s, {:.2} Mtriangles/s\n  {frame:?}\n  render {} cache {}",
                params.seeds,
                median * 1e3,
                c.cubes as f64 * fps / 1e6,
                frame.triangles as f64 * fps / 1e6,
                c.render_bytes,
                c.cache_bytes,
            );
        });
    }
}
