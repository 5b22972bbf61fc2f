//! Memory that lying headers cost: in a process of its own, whose peak it measures. Only Linux tells the peak.
#![cfg(target_os = "linux")]

mod common;

use std::io::Write;

use common::{Folder, peak, read};
use pellicle_io::{VolumeOptions, read_mesh, read_volume};

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
    let npy = |shape: &str| {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat()
    };
    // 400 MB of zeros again, as an array of an archive.
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    archive.start_file("pos.npy", zip::write::SimpleFileOptions::default()).expect("in memory");
    archive.write_all(&npy("(34952533, 3)")).expect("in memory");
    (0..400).for_each(|_| archive.write_all(&zeros).expect("in memory"));
    let archive = archive.finish().expect("in memory").into_inner();
    drop(zeros);
    let mut bi4 = b"#FileJBD".to_vec();
    bi4.resize(64, b' ');
    bi4[60..].copy_from_slice(&[0; 4]);
    bi4.extend_from_slice(
        b"\x7f\0\0\0\x06\0\0\0\nITEM\n\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0",
    );
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
        ("a.npy", npy(&format!("({count}, 3)"))),
        ("b.npy", npy("(1152921504606846977, 4096)")),
        ("a.npz", archive),
        ("a.bi4", bi4),
        ("a.xyz", format!("{count}\nProperties=pos:R:3\n0 0 0\n").into_bytes()),
        ("b.xyz", b"2\nProperties=pos:R:3:a:R:4000:b:R:18446744073709551615\n0 0 0\n".to_vec()),
        ("a.dump", format!("ITEM: NUMBER OF ATOMS\n{count}\nITEM: ATOMS x y z\n0 0 0\n").into_bytes()),
        ("b.csv.gz", gzip(&[b"x,y,z\n", vec![b'1'; 300 << 20].as_slice()])),
        ("a.json", vec![b'['; 1 << 20]),
        ("b.json", [b"[{".as_slice(), &b"\"a\":[1,2,3],".repeat(100_000)].concat()),
        ("c.json", [b"[{\"a\":[1,2,3,4,5,6,7,8,9]}".as_slice(), &b",{}".repeat(1 << 20), b"]"].concat()),
    ];
    // A mesh that is shown again and again, and as much JSON as there may be, which unfolds when it is parsed.
    let glb = |json: String, binary: &[u8]| {
        let padding = json.len().next_multiple_of(4) - json.len();
        let json = json + &" ".repeat(padding);
        let len = 28 + json.len() + binary.len();
        let chunk = |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes(), kind, data].concat();
        let head = [b"glTF".as_slice(), &2u32.to_le_bytes(), &(len as u32).to_le_bytes()].concat();
        [head, chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", binary)].concat()
    };
    let shown: Vec<String> = (0..20_000).map(|_| "{\"mesh\":0}".into()).collect();
    let numbers: Vec<String> = (0..20_000).map(|i| i.to_string()).collect();
    let many = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":1000,"type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":12000}}],"buffers":[{{"byteLength":12000}}]}}"#,
        numbers.join(","),
        shown.join(",")
    );
    let files: Vec<(&str, Vec<u8>)> = files
        .into_iter()
        .chain([
            ("a.stl", [&[0; 80][..], &u32::MAX.to_le_bytes(), &[0; 1000]].concat()),
            ("a.glb", glb(many, &[0; 12000])),
            ("b.glb", glb(format!("[{}0]", "0,".repeat((2 << 20) - 4)), &[])),
            ("c.glb", [b"glTF".as_slice(), &2u32.to_le_bytes(), &[255; 12], b"BIN\0", &[0; 40]].concat()),
        ])
        .chain(xml_bombs())
        .collect();
    // The first reading settles what the process needs anyway.
    let _ = read(&folder.write("first.ply", b"ply\n"));
    let peak = || peak().expect("Linux tells it");
    let before = peak();
    for (name, bytes) in &files {
        let path = folder.write(name, bytes);
        assert!(read(&path).is_err() || name.ends_with("obj"), "{name}");
        let mesh = read_mesh(&path);
        // An array instead of an object has no scene, and so no mesh.
        assert!(mesh.is_err() || *name == "b.glb", "{name}");
        let grown = peak() - before;
        assert!(grown < 100 << 20, "{name}: {} MiB", grown >> 20);
    }
    for (name, bytes) in volume_bombs() {
        let path = folder.write(name, bytes);
        assert!(read_volume(&path, &VolumeOptions::default()).is_err(), "{name}");
        let grown = peak() - before;
        assert!(grown < 100 << 20, "{name}: {} MiB", grown >> 20);
    }
}

/// Volumes of which nothing or next to nothing is there, and of zeros that were compressed a thousandfold.
fn volume_bombs() -> Vec<(&'static str, Vec<u8>)> {
    let zeros = vec![0u8; 1 << 20];
    let packed = |head: &[u8], is_gzip: bool| {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        let out: &mut dyn Write = if is_gzip { &mut gzip } else { &mut zlib };
        out.write_all(head).expect("in memory");
        (0..400).for_each(|_| out.write_all(&zeros).expect("in memory"));
        if is_gzip { gzip.finish().expect("in memory") } else { zlib.finish().expect("in memory") }
    };
    let nii = |dims: [i16; 3], kind: i16| {
        let mut head = vec![0; 352];
        head[..4].copy_from_slice(&348i32.to_le_bytes());
        for (i, n) in [3, dims[0], dims[1], dims[2]].into_iter().enumerate() {
            head[40 + 2 * i..42 + 2 * i].copy_from_slice(&n.to_le_bytes());
        }
        head[70..72].copy_from_slice(&kind.to_le_bytes());
        head[108..112].copy_from_slice(&352f32.to_le_bytes());
        head[344..348].copy_from_slice(b"n+1\0");
        head
    };
    let mha = |more: &str| {
        format!("NDims = 3\nDimSize = 1000 1000 400\nElementType = MET_UCHAR\n{more}ElementDataFile = LOCAL\n")
    };
    let nrrd = |encoding: &str| {
        format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1000 1000 400\nencoding: {encoding}\n\n").into_bytes()
    };
    let extent = "0 999 0 999 0 399";
    let vti = |pieces: &str| {
        let head = "<VTKFile type=\"ImageData\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">";
        format!("{head}<ImageData WholeExtent=\"{extent}\">{pieces}</ImageData></VTKFile>").into_bytes()
    };
    let array = "<PointData><DataArray type=\"UInt8\" Name=\"a\" format=\"ascii\">1 2 3</DataArray></PointData>";
    let npy = "{'descr': '<f8', 'fortran_order': False, 'shape': (2000, 2000, 2000), }\n";
    let zipped = |first: &[u8], rest: Vec<u8>| [first.to_vec(), rest].concat();
    vec![
        ("a.nii", nii([32767; 3], 64)),
        ("b.nii.gz", packed(&nii([1000, 1000, 400], 2), true)),
        ("a.mha", mha("").into_bytes()),
        ("b.mha", zipped(mha("CompressedData = True\n").as_bytes(), packed(&[], false))),
        ("c.mha", mha("BinaryData = False\n").into_bytes()),
        ("a.nrrd", nrrd("raw")),
        ("b.nrrd", zipped(&nrrd("gzip"), packed(&[], true))),
        ("a.vti", vti(&format!("<Piece Extent=\"{extent}\">{array}</Piece>"))),
        ("b.vti", vti(&format!("<Piece Extent=\"0 1 0 1 0 1\">{array}</Piece>"))),
        ("a.npy", [b"\x93NUMPY\x01\0".as_slice(), &(npy.len() as u16).to_le_bytes(), npy.as_bytes()].concat()),
        (
            "a.vtk",
            b"# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2000 2000 2000\nPOINT_DATA 8000000000\n\
              SCALARS a double\nLOOKUP_TABLE default\n"
                .to_vec(),
        ),
    ]
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
