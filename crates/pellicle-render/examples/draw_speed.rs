//! How long a picture takes: a mesh of a raw file of little-endian `f32` triples, or of a splash, median of several runs.
//!
//! `cargo run --release -p pellicle-render --example draw_speed -- [FILE.xyz RADIUS | PARTICLES] [CELL]`

use std::time::Instant;

use pellicle::Params;
use pellicle_render::{Framing, Samples, Scene, Settings, draw};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let first = arguments.first().map_or("140000", String::as_str);
    let (positions, radius, cell) = if let Ok(count) = first.parse() {
        let splash = pellicle_scenes::splash(count, 1);
        (splash.positions, f64::from(splash.radius), arguments.get(1))
    } else {
        let radius = arguments.get(1).ok_or("FILE needs a RADIUS")?.parse()?;
        let number = |at: &[u8]| f32::from_le_bytes([at[0], at[1], at[2], at[3]]);
        let bytes = std::fs::read(first)?;
        let positions = bytes.chunks_exact(12).map(|at| [number(&at[0..4]), number(&at[4..8]), number(&at[8..12])]);
        (positions.collect(), radius, arguments.get(2))
    };
    let cell_size = cell.map_or(Ok(0.75), |text| text.parse())?;
    let mesh = pellicle::reconstruct(&positions, &Params { cell_size, ..Params::new(radius) })?;
    let with_normals = pellicle::reconstruct(&positions, &Params { cell_size, normals: true, ..Params::new(radius) })?;
    println!("{} triangles, {} threads", mesh.triangles.len(), std::thread::available_parallelism()?);
    let scenes = [
        ("mesh", Scene::of_mesh(&mesh)),
        ("mesh with normals", Scene::of_mesh(&with_normals)),
        ("spheres", Scene::of_spheres(&positions, radius)),
    ];
    for (name, scene) in &scenes {
        for samples in [Samples::One, Samples::Four, Samples::Eight, Samples::Sixteen] {
            let settings = Settings { samples, ..Settings::default() };
            let mut times = Vec::new();
            let before = processor_ticks();
            for _ in 0..7 {
                let started = Instant::now();
                let camera = Framing::default().fit(&scene.bounds(), settings.aspect())?;
                let image = draw(scene, &camera, &settings)?;
                let drawn = started.elapsed();
                let bytes = image.encode_png()?.len();
                times.push((started.elapsed().as_secs_f64() * 1e3, drawn.as_secs_f64() * 1e3, bytes));
            }
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            let ((least, _, _), (all, drawn, bytes)) = (times[0], times[times.len() / 2]);
            println!("{name}, {samples:?}: {all:.0} ms (least {least:.0}), of which drawing {drawn:.0}; {bytes} bytes");
            if let Some((before, after)) = before.zip(processor_ticks()) {
                println!(
                    "    processor time of all threads: {:.0} ms",
                    (after - before) as f64 * 10.0 / times.len() as f64
                );
            }
        }
    }
    Ok(())
}

/// Hundredths of a second that all threads have used, where the system tells: on a busy machine the better measure.
fn processor_ticks() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    Some(fields.next()?.parse::<u64>().ok()? + fields.next()?.parse::<u64>().ok()?)
}
