//! Times one extraction of a raw volume in memory, and one plain reading of it. Reading the file is not timed.
//!
//! Prints one line of JSON: `{"threads", "seconds": [one for each repeat], "read_seconds": […], "vertices", "triangles"}`.
//! Each repeat gives its memory back before the next, as a caller's would. `read_seconds` sums the bytes of the array, in
//! words of 8, once, with the same threads: the floor of anything that looks at every sample.

use std::{hint::black_box, time::Instant};

use pellicle::{ContourParams, Samples, Volume, contour};
use rayon::prelude::*;

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let [file, kind, rest @ ..] = words else { return Err("which file?".into()) };
    let number = |i: usize| rest.get(i).and_then(|word| word.parse::<usize>().ok()).ok_or("numbers, please");
    let dims = [number(0)?, number(1)?, number(2)?];
    let iso: f64 = rest.get(3).and_then(|word| word.parse().ok()).ok_or("an isovalue, please")?;
    let (threads, repeats) = (number(4)?, number(5)?);
    let bytes = std::fs::read(file).map_err(|error| format!("{file}: {error}"))?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())?;
    match kind.as_str() {
        "uint8" => pool.install(|| measure(&bytes[..], dims, iso, repeats)),
        "int16" => pool.install(|| measure(&numbers(&bytes, i16::from_le_bytes)[..], dims, iso, repeats)),
        "int64" => pool.install(|| measure(&numbers(&bytes, i64::from_le_bytes)[..], dims, iso, repeats)),
        "float32" => pool.install(|| measure(&numbers(&bytes, f32::from_le_bytes)[..], dims, iso, repeats)),
        "float64" => pool.install(|| measure(&numbers(&bytes, f64::from_le_bytes)[..], dims, iso, repeats)),
        _ => Err(format!("{kind}: uint8, int16, int64, float32 or float64")),
    }
}

/// Little-endian numbers.
fn numbers<T, const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|&n| number(n)).collect()
}

fn measure<'a, T>(samples: &'a [T], dims: [usize; 3], iso: f64, repeats: usize) -> Result<(), String>
where
    T: bytemuck::Pod + Sync,
    Samples<'a>: From<&'a [T]>,
{
    let volume = Volume::new(samples, dims).map_err(|error| error.to_string())?;
    let (mut seconds, mut read_seconds, mut counts) = (Vec::new(), Vec::new(), (0, 0));
    for _ in 0..repeats {
        let start = Instant::now();
        black_box(read_once(bytemuck::cast_slice(samples)));
        read_seconds.push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let mesh = contour(&volume, iso, &ContourParams::default()).map_err(|error| error.to_string())?;
        seconds.push(start.elapsed().as_secs_f64());
        counts = (mesh.vertices.len(), mesh.triangles.len());
    }
    let threads = rayon::current_num_threads();
    let (vertices, triangles) = counts;
    println!(
        "{{\"threads\": {threads}, \"seconds\": {seconds:?}, \"read_seconds\": {read_seconds:?}, \"vertices\": {vertices}, \"triangles\": {triangles}}}"
    );
    Ok(())
}

/// Sum of all words: eight sums side by side, so that memory is the limit.
fn read_once(bytes: &[u8]) -> u64 {
    let sum = |bytes: &[u8]| {
        let mut sums = [0u64; 8];
        for words in bytes.as_chunks::<64>().0 {
            for (sum, word) in sums.iter_mut().zip(words.as_chunks::<8>().0) {
                *sum = sum.wrapping_add(u64::from_le_bytes(*word));
            }
        }
        sums.iter().fold(0u64, |a, &b| a.wrapping_add(b))
    };
    bytes.par_chunks(1 << 20).map(sum).reduce(|| 0, u64::wrapping_add)
}
