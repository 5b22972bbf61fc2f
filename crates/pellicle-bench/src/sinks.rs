//! The ways out of a counted surface, each into memory that is there already and was touched before: welded slices, a soup
//! counted before it is written, and the linear pool. Signs and counts, which the first two need, have a row of their own; the
//! pool needs the signs only, so what it saves is less than that row.
//!
//! Arguments: FILE TYPE NX NY NZ ISO THREADS REPEATS. Prints a table of medians.

use std::time::Instant;

use pellicle::{Border, Contour, ContourParams, Control, VertexPool, Volume};

use crate::contour::Raw;

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let raw = Raw::read(words)?;
    let number = |i: usize| words.get(i).and_then(|word| word.parse::<usize>().ok()).ok_or("numbers, please");
    let (threads, repeats) = (number(6)?, number(7)?);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())?;
    pool.install(|| measure(&raw, repeats)).map_err(|error| error.to_string())
}

/// Median of the seconds of some runs.
fn median(repeats: usize, mut work: impl FnMut() -> Result<(), pellicle::Error>) -> Result<f64, pellicle::Error> {
    let mut seconds = Vec::new();
    for _ in 0..repeats {
        let start = Instant::now();
        work()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[seconds.len() / 2])
}

fn measure(raw: &Raw, repeats: usize) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let numbers = raw.numbers()?;
    let volume = Volume::new(numbers.samples(), raw.dims)?.with_border(Border::Open);
    let params = ContourParams::default();
    let extract = || Contour::extract(&volume, &[raw.iso], &params, &Control::default());
    let surface = extract()?;
    let (n, t) = (surface.vertices(0), surface.triangles(0));
    println!("{n} vertices, {t} triangles, {} threads; bytes written, then milliseconds", rayon::current_num_threads());
    let print = |what: &str, bytes: usize, seconds: f64| println!("{what:44} {bytes:12} {:9.2}", 1e3 * seconds);
    print("signs and counts", 0, median(repeats, || extract().map(drop))?);
    let (mut vertices, mut triangles) = (vec![[1.0f32; 3]; n], vec![[1u32; 3]; t]);
    let seconds = median(repeats, || surface.write_welded(0, &mut vertices, None, &mut triangles))?;
    print("welded and indexed", 12 * (n + t), seconds);
    let mut normals = vec![[1.0f32; 3]; n];
    let seconds = median(repeats, || surface.write_welded(0, &mut vertices, Some(&mut normals), &mut triangles))?;
    print("welded and indexed, normals of vertices", 12 * (2 * n + t), seconds);
    let (mut positions, mut normals) = (vec![[1.0f32; 3]; 3 * t], vec![[1.0f32; 3]; 3 * t]);
    let seconds = median(repeats, || surface.write_soup(0, &mut positions, None))?;
    print("soup, counted first", 36 * t, seconds);
    let seconds = median(repeats, || surface.write_soup(0, &mut positions, Some(&mut normals)))?;
    print("soup, counted first, normals of faces", 72 * t, seconds);
    let room = 3 * (9 * t + 192 * 64 * rayon::current_num_threads());
    let (mut positions, mut normals) = (vec![1.0f32; room], vec![1.0f32; room]);
    let mut used = 0;
    let seconds = median(repeats, || {
        let pool = VertexPool::new(&mut positions, 3, None)?;
        used = surface.write_pool(0, &pool)?.vertices;
        Ok(())
    })?;
    print("linear pool", 12 * used, seconds);
    let seconds = median(repeats, || {
        let pool = VertexPool::new(&mut positions, 3, Some((&mut normals, 3)))?;
        used = surface.write_pool(0, &pool)?.vertices;
        Ok(())
    })?;
    print("linear pool, normals of faces", 24 * used, seconds);
    println!("the pool holds {} degenerate triangles", used / 3 - t);
    Ok(())
}
