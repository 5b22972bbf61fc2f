//! Times one extraction of a raw volume in memory, and one plain reading of it. Reading the file is not timed.
//!
//! Prints one line of JSON: `{"version", "threads", "seconds": [one for each repeat], "read_seconds": […], "vertices",
//! "triangles"}`. Each repeat gives its memory back before the next, as a caller's would. `read_seconds` sums the bytes of
//! the array, in words of 8, once, with the same threads: the floor of anything that looks at every sample. The border is
//! open, as other programs have it.

use std::{hint::black_box, time::Instant};

use pellicle::{Border, ContourParams, Level, Samples, Volume, contour};
use rayon::prelude::*;

/// A volume as read from a raw file.
pub struct Raw {
    bytes: Vec<u8>,
    kind: String,
    /// Nodes along each axis, the first fastest.
    pub dims: [usize; 3],
    /// Isovalue.
    pub iso: f64,
}

/// Numbers that bytes were read as.
pub enum Numbers {
    U8(Vec<u8>),
    I16(Vec<i16>),
    I64(Vec<i64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Raw {
    /// From FILE TYPE NX NY NZ ISO.
    pub fn read(words: &[String]) -> Result<Self, String> {
        let [file, kind, rest @ ..] = words else { return Err("which file?".into()) };
        let number = |i: usize| rest.get(i).and_then(|word| word.parse::<usize>().ok()).ok_or("numbers, please");
        let dims = [number(0)?, number(1)?, number(2)?];
        let iso = rest.get(3).and_then(|word| word.parse().ok()).ok_or("an isovalue, please")?;
        let bytes = std::fs::read(file).map_err(|error| format!("{file}: {error}"))?;
        Ok(Self { bytes, kind: kind.clone(), dims, iso })
    }

    /// Its samples.
    pub fn numbers(&self) -> Result<Numbers, String> {
        let bytes = &self.bytes;
        Ok(match self.kind.as_str() {
            "uint8" => Numbers::U8(bytes.clone()),
            "int16" => Numbers::I16(numbers(bytes, i16::from_le_bytes)),
            "int64" => Numbers::I64(numbers(bytes, i64::from_le_bytes)),
            "float32" => Numbers::F32(numbers(bytes, f32::from_le_bytes)),
            "float64" => Numbers::F64(numbers(bytes, f64::from_le_bytes)),
            kind => return Err(format!("{kind}: uint8, int16, int64, float32 or float64")),
        })
    }

    /// Its samples as doubles.
    pub fn samples_f64(&self) -> Result<Vec<f64>, String> {
        let numbers = self.numbers()?;
        let samples = numbers.samples();
        Ok((0..samples.len()).map(|i| samples.value(i)).collect())
    }
}

impl Numbers {
    /// As the library takes them.
    pub fn samples(&self) -> Samples<'_> {
        match self {
            Self::U8(v) => v.into(),
            Self::I16(v) => v.into(),
            Self::I64(v) => v.into(),
            Self::F32(v) => v.into(),
            Self::F64(v) => v.into(),
        }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Self::U8(v) => v,
            Self::I16(v) => bytemuck::cast_slice(v),
            Self::I64(v) => bytemuck::cast_slice(v),
            Self::F32(v) => bytemuck::cast_slice(v),
            Self::F64(v) => bytemuck::cast_slice(v),
        }
    }
}

/// Little-endian numbers.
fn numbers<T, const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|&n| number(n)).collect()
}

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let raw = Raw::read(words)?;
    let number = |i: usize| words.get(i).and_then(|word| word.parse::<usize>().ok()).ok_or("numbers, please");
    let (threads, repeats) = (number(6)?, number(7)?);
    let level = match words.get(8).map(String::as_str) {
        None | Some("classic") => Level::Classic,
        Some("consistent") => Level::Consistent,
        Some("topological") => Level::Topological,
        Some(other) => return Err(format!("{other}: classic, consistent or topological")),
    };
    let numbers = raw.numbers()?;
    let volume = Volume::new(numbers.samples(), raw.dims).map_err(|error| error.to_string())?.with_border(Border::Open);
    let params = ContourParams { level, ..ContourParams::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())?;
    pool.install(|| measure(&volume, numbers.bytes(), raw.iso, &params, repeats))
}

fn measure(volume: &Volume<'_>, bytes: &[u8], iso: f64, params: &ContourParams, repeats: usize) -> Result<(), String> {
    let (mut seconds, mut read_seconds, mut counts) = (Vec::new(), Vec::new(), (0, 0));
    for _ in 0..repeats {
        let start = Instant::now();
        black_box(read_once(bytes));
        read_seconds.push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let mesh = contour(volume, iso, params).map_err(|error| error.to_string())?;
        seconds.push(start.elapsed().as_secs_f64());
        counts = (mesh.vertices.len(), mesh.triangles.len());
    }
    let (threads, version) = (rayon::current_num_threads(), env!("CARGO_PKG_VERSION"));
    let (vertices, triangles) = counts;
    println!(
        "{{\"version\": \"{version}\", \"threads\": {threads}, \"seconds\": {seconds:?}, \"read_seconds\": {read_seconds:?}, \
         \"vertices\": {vertices}, \"triangles\": {triangles}}}"
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
