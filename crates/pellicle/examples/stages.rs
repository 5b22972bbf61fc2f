//! Times the stages of road A on a raw little-endian f32 xyz file: `stages FILE RADIUS CELL [THREADS] [RUNS]`.
use std::{sync::Mutex, time::Instant};

use pellicle::{Band, Control, Params, Reconstructor, Stage};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&args[1]).expect("the file can be read");
    let values: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let positions: Vec<[f32; 3]> = values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let mut params = Params::new(args[2].parse().expect("a radius"));
    params.cell_size = args[3].parse().expect("a cell size");
    if std::env::var_os("FULL").is_some() {
        params.band = Band::Full;
    }
    params.max_memory = std::env::var("MAX_MEMORY").ok().and_then(|v| v.parse().ok());
    params.normals = std::env::var_os("NORMALS").is_some();
    match std::env::var("PELLICLE_LANES").as_deref() {
        Ok("avx2") => params.lanes = pellicle::Lanes::Avx2,
        Ok("portable") => params.lanes = pellicle::Lanes::Portable,
        _ => {}
    }
    let threads = args.get(4).map_or(1, |v| v.parse().expect("a number of threads"));
    let runs = args.get(5).map_or(3, |v| v.parse().expect("a number of runs"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| {
        let mut reconstructor = Reconstructor::new();
        let mut mesh = pellicle::Mesh::default();
        for _ in 0..runs {
            let times: Mutex<Vec<(Stage, Instant)>> = Mutex::default();
            let note = |stage| times.lock().expect("no panic").push((stage, Instant::now()));
            let control = Control { on_stage: Some(&note), ..Control::default() };
            let start = Instant::now();
            let stats = {
                let surface = reconstructor.extract((&positions).into(), &[], &params, &control).expect("a surface");
                surface.write_mesh(&mut mesh).expect("a mesh");
                surface.stats()
            };
            let end = Instant::now();
            let times = times.into_inner().expect("no panic");
            for (i, (stage, at)) in times.iter().enumerate() {
                let next = times.get(i + 1).map_or(end, |t| t.1);
                print!("{stage:?} {:.2}  ", (next - *at).as_secs_f64() * 1e3);
            }
            println!("total {:.2} ms", (end - start).as_secs_f64() * 1e3);
            println!("{stats:?}");
        }
        let sum = mesh.vertices.iter().flatten().fold(0u64, |h, v| h.wrapping_mul(31).wrapping_add(v.to_bits().into()));
        let sum = mesh.triangles.iter().flatten().fold(sum, |h, v| h.wrapping_mul(31).wrapping_add((*v).into()));
        println!("hash {sum:016x}");
    });
}
