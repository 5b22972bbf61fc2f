//! The particles of `samples` in formats of text.

use super::{COUNT, Sample, csv, gzip, row};

fn lines(header: &str, line: impl Fn(usize, [f32; 7]) -> String) -> String {
    (0..COUNT).fold(header.to_owned(), |text, i| text + &line(i, row(i)) + "\n")
}

/// Two frames of XYZ, of which the first has the particles.
fn xyz(comment: &str, line: impl Fn(usize, [f32; 7]) -> String) -> Vec<u8> {
    let frame = lines(&format!("{COUNT}\n{comment}\n"), line);
    format!("{frame}1\n{comment}\n{}\n", frame.lines().last().unwrap_or_default()).into_bytes()
}

fn extended(i: usize, r: [f32; 7]) -> String {
    let species = ["H", "He", "O"][i % 3];
    format!("{species}\t{} {}  {} {} {} {} T {}", r[3], r[4], r[5], r[0], r[1], r[2], r[6])
}

/// A step with another number of atoms, then one with the particles.
fn dump(bounds: &str, columns: &str, line: impl Fn(usize, [f32; 7]) -> String) -> Vec<u8> {
    let step = |count: usize| {
        format!(
            "ITEM: UNITS\nlj\nITEM: TIMESTEP\n100\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS {bounds}\nITEM: ATOMS {columns}\n"
        )
    };
    let steps = lines(&step(COUNT), &line) + &step(1) + &line(0, row(0)) + "\n";
    steps.into_bytes()
}

pub fn text() -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut add = |name, has_attributes, bytes| samples.push(Sample { name, bytes, has_attributes });
    let plain = lines("", |_, r| format!("{} {}\t{}", r[0], r[1], r[2])).into_bytes();
    add("plain.xyz.gz", false, gzip(&plain));
    add("text.xyz", false, plain);
    add("classic.xyz", false, xyz("a comment", |_, r| format!("He {} {} {}", r[0], r[1], r[2])));
    add("numbers.xyz", false, xyz("", |_, r| format!("2 {} {} {}", r[0], r[1], r[2])));
    add("bare.dat", false, xyz("0 0 0", |_, r| format!("{} {} {}", r[0], r[1], r[2])));
    let properties =
        "Lattice=\"1 0 0 0 1 0 0 0 1\" Properties=species:S:1:velo:R:3:pos:R:3:is_wet:L:1:density:R:1 Time=0.5";
    add("extended.extxyz", true, xyz(properties, extended));
    add("extended.xyz.gz", true, gzip(&xyz(properties, extended)));
    let box_ = "pp pp ff\n-1 1\n-1 1\n-1 1";
    let usual =
        |i: usize, r: [f32; 7]| format!("{} 1 {} {} {} {} {} {} {} ", i + 1, r[0], r[1], r[2], r[3], r[4], r[5], r[6]);
    add("usual.dump", true, dump(box_, "id type x y z vx vy vz density", usual));
    add("usual.lammpstrj.gz", true, gzip(&dump(box_, "id type x y z vx vy vz density", usual)));
    let shuffled = |_: usize, r: [f32; 7]| format!("{} {} He {} {} {} {} {}", r[6], r[2], r[5], r[0], r[3], r[1], r[4]);
    add("shuffled.dump", true, dump(box_, "density zu element vz xu vx yu vy", shuffled));
    // Sides and tilts are powers of two, so that nothing is rounded.
    let tilted = "xy xz yz pp pp pp\n-4 16 4\n-8 10 0\n1 9 2";
    let scaled = |_: usize, r: [f32; 7]| {
        let r = r.map(f64::from);
        let z = (r[2] - 1.0) / 8.0;
        let y = (r[1] + 8.0 - 2.0 * z) / 16.0;
        let x = (r[0] + 4.0 - 4.0 * y) / 16.0;
        format!("{x} {y} {z} {} {} {} {}", r[3], r[4], r[5], r[6])
    };
    add("scaled.dump", true, dump(tilted, "xs ys zs vx vy vz density", scaled));
    add("percent.txt", true, csv("% x y z vx vy vz density\n", "  ", true));
    let comma = String::from_utf8(csv("x;y;z;vx;vy;vz;density\n", ";", true)).expect("it is text").replace('.', ",");
    add("comma_decimal.csv", true, comma.into_bytes());
    let quoted =
        |_: usize, r: [f32; 7]| format!("\"a, b\",{},{},{},,\"{}\",{},{},{}", r[0], r[1], r[2], r[3], r[4], r[5], r[6]);
    add("quoted.csv", true, lines("name,x,y,z,gap,vx,vy,vz,density\n", quoted).into_bytes());
    let gaps =
        |i: usize, r: [f32; 7]| format!("{i}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t", r[0], r[1], r[2], r[3], r[4], r[5], r[6]);
    add("gaps.tsv", true, lines("\tx\ty\tz\tvx\tvy\tvz\tdensity\tnote\n", gaps).into_bytes());
    add("packed.csv.gz", true, gzip(&csv("x,y,z,vx,vy,vz,density\n", ",", true)));
    samples
}
