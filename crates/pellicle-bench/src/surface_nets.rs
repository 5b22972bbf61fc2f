//! Times the crate fast-surface-nets on a raw volume in memory, for `peers/contour.py`.
//!
//! It takes single precision and the surface at 0: samples are converted first, untimed. Prints one line of JSON.

use std::time::Instant;

use fast_surface_nets::{
    SurfaceNetsBuffer,
    ndshape::{RuntimeShape, Shape},
    surface_nets,
};

use crate::contour::Raw;

/// The version that `Cargo.toml` asks for.
const VERSION: &str = "0.2";

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let raw = Raw::read(words)?;
    let repeats: usize = words.get(6).and_then(|word| word.parse().ok()).ok_or("how many repeats?")?;
    // Inside is negative there.
    let samples: Vec<f32> = raw.samples_f64()?.into_iter().map(|v| (raw.iso - v) as f32).collect();
    let dims = raw.dims.map(|n| n as u32);
    let shape = RuntimeShape::<u32, 3>::new(dims);
    let mut seconds = Vec::new();
    let mut triangles = 0;
    debug_assert_eq!(shape.usize(), samples.len());
    for _ in 0..repeats {
        let mut mesh = SurfaceNetsBuffer::default();
        let start = Instant::now();
        surface_nets(&samples, &shape, [0; 3], dims.map(|n| n - 1), &mut mesh);
        seconds.push(start.elapsed().as_secs_f64());
        triangles = mesh.indices.len() / 3;
    }
    println!("{{\"version\": \"{VERSION}\", \"seconds\": {seconds:?}, \"triangles\": {triangles}}}");
    Ok(())
}
