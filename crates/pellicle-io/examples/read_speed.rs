//! How fast particle files are read: `read_speed [-n RUNS] FILE…` prints the least and the median time of each, warm.
//! `read_speed --make FOLDER COUNT` writes files of as many random particles in the formats that can be written simply.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use pellicle_io::{AttributeChoice, ReadOptions, read_particles};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [make, folder, count] = arguments.as_slice()
        && make == "--make"
    {
        return make_files(Path::new(folder), count.parse()?);
    }
    let mut runs = 9;
    if let [flag, number, ..] = arguments.as_slice()
        && flag == "-n"
    {
        runs = number.parse()?;
        arguments.drain(..2);
    }
    let options = ReadOptions { attributes: AttributeChoice::All, ..ReadOptions::default() };
    for file in &arguments {
        let size = std::fs::metadata(file)?.len() as f64;
        let mut times = Vec::new();
        let mut count = 0;
        for _ in 0..runs.max(1) {
            let start = Instant::now();
            let particles = read_particles(Path::new(file), &options)?;
            times.push(start.elapsed().as_secs_f64());
            count = particles.positions.len();
        }
        times.sort_by(f64::total_cmp);
        let (least, median) = (times[0], times[times.len() / 2]);
        println!(
            "{file}: {count} particles, min {:.1} ms, median {:.1} ms, {:.0} MB/s",
            least * 1e3,
            median * 1e3,
            size / median / 1e6
        );
    }
    Ok(())
}

fn make_files(folder: &Path, count: usize) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u32 << 24) as f32
    };
    let positions: Vec<[f32; 3]> = (0..count).map(|_| [next(), next(), next()]).collect();
    let raw: Vec<u8> = positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(folder.join("speed.xyz"), &raw)?;
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({count}, 3), }}\n");
    let length = (header.len() as u16).to_le_bytes();
    std::fs::write(folder.join("speed.npy"), [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), &raw].concat())?;
    let mut csv = String::from("x,y,z\n");
    let mut dump = format!("ITEM: NUMBER OF ATOMS\n{count}\nITEM: ATOMS id x y z\n");
    let mut json = String::from("[");
    for (i, [x, y, z]) in positions.iter().enumerate() {
        writeln!(csv, "{x},{y},{z}")?;
        writeln!(dump, "{i} {x} {y} {z}")?;
        write!(json, "{}[{x},{y},{z}]", if i == 0 { "" } else { "," })?;
    }
    json.push(']');
    std::fs::write(folder.join("speed.csv"), csv)?;
    std::fs::write(folder.join("speed.dump"), dump)?;
    std::fs::write(folder.join("speed.json"), json)?;
    Ok(())
}
