//! Memory that lying headers cost: in a process of its own, whose peak it measures. Only Linux tells the peak.
#![cfg(target_os = "linux")]

mod common;

use std::io::Write;

use common::{Folder, read};

/// The largest address space that the process has had, in bytes: counts what was reserved, used or not.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find(|line| line.starts_with("VmPeak:")).expect("Linux has it");
    line.split_ascii_whitespace().nth(1).and_then(|kib| kib.parse::<u64>().ok()).expect("a number") * 1024
}

#[test]
fn lying_headers_and_bombs_cost_no_memory() {
    let folder = Folder::new();
    let count = 1u64 << 32;
    let gzip = |parts: &[&[u8]]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        parts.iter().for_each(|part| encoder.write_all(part).expect("in memory"));
        encoder.finish().expect("in memory")
    };
    let mut bgeo = b"BgeoV\0\0\0\x05\x7f\xff\xff\xff".to_vec();
    bgeo.extend_from_slice(&[0; 28]);
    // 400 MB of zeros, which are as many particles as announced.
    let mut bomb = b"BgeoV\0\0\0\x05".to_vec();
    bomb.extend_from_slice(&25_000_000u32.to_be_bytes());
    bomb.extend_from_slice(&[0; 28]);
    let zeros = vec![0u8; 1 << 20];
    let bomb = gzip(&[&[bomb.as_slice()], vec![zeros.as_slice(); 400].as_slice()].concat());
    drop(zeros);
    let head = "element vertex";
    let xyz = "property float x\nproperty float y\nproperty float z\nend_header\n";
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("a.ply", format!("ply\nformat binary_little_endian 1.0\n{head} {count}\n{xyz}").into_bytes()),
        ("b.ply", format!("ply\nformat ascii 1.0\n{head} {count}\n{xyz}").into_bytes()),
        ("c.ply", format!("ply\nformat binary_little_endian 1.0\nelement e 9\nproperty list uint double l\n{head} 1\n{xyz}\u{7f}\u{7f}\u{7f}\u{7f}").into_bytes()),
        ("a.vtk", format!("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS {count} float\n").into_bytes()),
        ("a.vtu", format!("<VTKFile type=\"PolyData\"><Piece NumberOfPoints=\"{count}\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">1 2 3</DataArray></Points></Piece></VTKFile>").into_bytes()),
        ("a.bgeo", bgeo.clone()),
        ("b.bgeo", gzip(&[&bgeo])),
        ("c.bgeo", bomb),
        ("a.csv", [b"x,y,z\n1,2,3\n".as_slice(), &[b'1'; 100_000]].concat()),
        ("a.obj", vec![b'f'; 300_000]),
    ];
    let files = files.into_iter().chain(xml_bombs());
    // The first reading settles what the process needs anyway.
    let _ = read(&folder.write("first.ply", b"ply\n"));
    let before = peak();
    for (name, bytes) in files {
        assert!(read(&folder.write(name, &bytes)).is_err() || name.ends_with("obj"), "{name}");
        let grown = peak() - before;
        assert!(grown < 100 << 20, "{name}: {} MiB", grown >> 20);
    }
}

/// VTK XML files that announce much, in blocks that hold nothing or much more than they should.
fn xml_bombs() -> Vec<(&'static str, Vec<u8>)> {
    let file = |compressor: &str, points: u64, data: &[u8]| {
        let head = format!(
            "<VTKFile type=\"PolyData\" header_type=\"UInt64\" compressor=\"{compressor}\"><PolyData>\
             <Piece NumberOfPoints=\"{points}\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" \
             format=\"appended\" offset=\"0\"/></Points></Piece></PolyData><AppendedData encoding=\"raw\">_"
        );
        [head.as_bytes(), data].concat()
    };
    let sizes = |sizes: &[u64]| sizes.iter().flat_map(|size| size.to_le_bytes()).collect::<Vec<u8>>();
    let zeros = vec![0u8; 400 << 20];
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    zlib.write_all(&zeros).expect("in memory");
    let zlib = zlib.finish().expect("in memory");
    let options = lzma_rust2::XzOptions::with_preset(1);
    let mut xz = lzma_rust2::XzWriter::new(Vec::new(), options).expect("in memory");
    xz.write_all(&zeros[..100 << 20]).expect("in memory");
    let xz = xz.finish().expect("in memory");
    drop(zeros);
    let (long, xz_long) = (zlib.len() as u64, xz.len() as u64);
    vec![
        // Honest about what is out of proportion.
        (
            "zlib.vtp",
            file("vtkZLibDataCompressor", (400 << 20) / 12, &[sizes(&[1, 400 << 20, 0, long]), zlib.clone()].concat()),
        ),
        (
            "lzma.vtp",
            file("vtkLZMADataCompressor", (100 << 20) / 12, &[sizes(&[1, 100 << 20, 100 << 20, xz_long]), xz].concat()),
        ),
        // Holds more than it says.
        ("more.vtp", file("vtkZLibDataCompressor", 100, &[sizes(&[1, 1200, 0, long]), zlib].concat())),
        ("blocks.vtp", file("vtkLZ4DataCompressor", 1 << 40, &sizes(&[1 << 60, 1, 0, 1]))),
        ("sum.vtp", file("vtkLZ4DataCompressor", 1 << 20, &sizes(&[2, 6 << 20, 0, 1 << 63, 1 << 63]))),
    ]
}
