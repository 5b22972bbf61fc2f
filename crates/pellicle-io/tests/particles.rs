//! Every format and variant gives the same particles; what cannot be read is told.

mod common;
#[path = "common/samples.rs"]
mod samples;

use common::{Folder, attribute, positions, read};
use pellicle_io::{AttributeChoice, AttributeValues, Error, PositionData, ReadOptions, read_particles};
use samples::COUNT;

#[test]
fn every_format_and_variant_gives_the_same_particles() {
    let folder = Folder::new();
    for sample in samples::all() {
        let path = folder.write(sample.name, &sample.bytes);
        let particles = read(&path).unwrap_or_else(|error| panic!("{error}"));
        let expected: Vec<[f64; 3]> = (0..COUNT).map(|i| samples::position(i).map(f64::from)).collect();
        assert_eq!(positions(&particles), expected, "{}", sample.name);
        if sample.has_attributes {
            let velocity = attribute(&particles, "velocity");
            assert_eq!(velocity.components, 3);
            let expected: Vec<f32> = (0..COUNT).flat_map(samples::velocity).collect();
            assert_eq!(*velocity.to_f32(), expected, "{}", sample.name);
            let expected: Vec<f32> = (0..COUNT).map(samples::density).collect();
            assert_eq!(*attribute(&particles, "density").to_f32(), expected, "{}", sample.name);
        } else {
            assert!(particles.attributes.is_empty(), "{}", sample.name);
        }
        let default = read_particles(&path, &ReadOptions::default()).expect(sample.name);
        let names: Vec<&str> = default.attributes.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names, if sample.has_attributes { vec!["velocity"] } else { vec![] }, "{}", sample.name);
    }
}

#[test]
fn precision_and_integers_are_kept() {
    let folder = Folder::new();
    let sample = |name: &str| {
        let samples = samples::all();
        let sample = samples.iter().find(|s| s.name == name).expect(name);
        read(&folder.write(name, &sample.bytes)).expect(name)
    };
    assert!(matches!(sample("c3_double.npy").positions, PositionData::F64(_)));
    assert!(matches!(sample("c3_big.npy").positions, PositionData::F32(_)));
    assert!(matches!(sample("big.ply").positions, PositionData::F64(_)));
    let indices = sample("plain.bgeo");
    let expected = AttributeValues::I32((0..COUNT as i32).map(|i| i % 2).collect());
    assert_eq!(attribute(&indices, "material").values, expected);
    let field = sample("new.vtk");
    assert_eq!(attribute(&field, "a name").components, 2);
    assert_eq!(attribute(&field, "a name").values, AttributeValues::I32((0..2 * COUNT as i32).collect()));
}

/// Their first bytes tell nothing.
const TEXTS_AND_RAW: [&str; 9] = [".tsv", ".xyz", ".f64", ".csv", ".txt", ".dat", ".gz", ".extxyz", "members.json"];

#[test]
fn a_format_is_recognised_without_its_extension() {
    let folder = Folder::new();
    for sample in samples::all().iter().filter(|s| !TEXTS_AND_RAW.iter().any(|extension| s.name.ends_with(extension))) {
        let path = folder.write(&sample.name.replace('.', "_"), &sample.bytes);
        assert_eq!(positions(&read(&path).expect(sample.name)).len(), COUNT);
    }
}

#[test]
fn what_is_not_read_is_told_with_a_way_out() {
    let folder = Folder::new();
    let npy = |descr: &str, shape: &str| {
        let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend_from_slice(&(header.len() as u16).to_le_bytes());
        out.extend_from_slice(header.as_bytes());
        out.extend_from_slice(&[0; 96]);
        out
    };
    let cases: [(&str, Vec<u8>, &str); 13] = [
        ("text.raw", b"0.5 1.5 2.5\n3.5 4.5 5.5\n6.5 7.5 8.5\n".to_vec(), "rename it to .xyz"),
        (
            "odd.xyz",
            vec![0; 37],
            "37 bytes are no whole number of positions in f32 (12 bytes a position); nor of f64 (24",
        ),
        ("odd.f64", vec![0; 36], "24 bytes a position); it would be one of f32"),
        ("wrong.ply", b"\x93NUMPY\x01\x00 and so on".to_vec(), "rename it to .npy"),
        ("wrong.xyz", b"ply\nformat ascii 1.0\n".to_vec(), "rename it to .ply"),
        ("structured.npy", npy("[('x', '<f4')]", "(8,)"), "no fields are named x, y, z or pos, but: x"),
        ("complex.npy", npy("'<c8'", "(8, 3)"), "astype"),
        ("flat.npy", npy("'<f4'", "(24,)"), "N rows of at least 3 columns"),
        ("new.bgeo", b"\x7fNSJb and so on".to_vec(), "gconvert"),
        (
            "image.vtk",
            b"# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\n".to_vec(),
            "STRUCTURED_POINTS",
        ),
        ("image.vtu", b"<VTKFile type=\"ImageData\"></VTKFile>".to_vec(), "a volume of samples"),
        ("odd.vtu", b"<VTKFile type=\"PolyData\" compressor=\"vtkZstdDataCompressor\"></VTKFile>".to_vec(), "zlib"),
        ("names.csv", b"a,b,c\n1,2,3\n".to_vec(), "the columns are: a, b, c"),
    ];
    for (name, bytes, expected) in cases {
        let message = read(&folder.write(name, bytes)).expect_err(name).to_string();
        assert!(message.contains(expected) && message.contains(name), "{message}");
    }
    assert!(matches!(read(&folder.join("none.ply")), Err(Error::Open { .. })));
    assert!(matches!(read(&folder.join("")), Err(Error::Unsupported { .. })));
}

#[test]
fn no_particles_are_an_empty_result() {
    let folder = Folder::new();
    let cases: [(&str, &[u8]); 13] = [
        ("a.vtp", b"<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"0\"/></PolyData></VTKFile>"),
        ("a.pvd", b"<VTKFile type=\"Collection\"><Collection><DataSet file=\"a.vtp\"/></Collection></VTKFile>"),
        (
            "a.dump",
            b"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n0\nITEM: BOX BOUNDS\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z\n",
        ),
        ("a.extxyz", b"0\nProperties=species:S:1:pos:R:3\n"),
        ("a.json", b"[]"),
        ("a.xyz", b""),
        ("a.csv", b""),
        ("b.csv", b"x,y,z,vx\n"),
        (
            "lists.ply",
            b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty list uchar int l\n\
              property float y\nproperty float z\nend_header\n",
        ),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
              end_header\n",
        ),
        ("a.vtk", b"# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n"),
        ("a.vtu", b"<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"0\"/></PolyData></VTKFile>"),
        ("a.bgeo", b"BgeoV\0\0\0\x05\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\xff"),
    ];
    for (name, bytes) in cases {
        let particles = read(&folder.write(name, bytes)).unwrap_or_else(|error| panic!("{error}"));
        assert!(particles.positions.is_empty(), "{name}");
    }
}

#[test]
fn errors_name_the_line() {
    let folder = Folder::new();
    let cases: [(&str, &[u8], &str); 5] = [
        ("a.csv", b"x,y,z\n1,2,3\n\n1,oops,3\n", "in line 4: 'oops' in column 2"),
        ("b.csv", b"x,y,z\n1,2,3\n1,2\n", "in line 3: 2 columns, where 3 were expected"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n4 five 6\n", "in line 9: 'five'"),
        ("b.ply", b"ply\nformat ascii 1.0\nelement vertex 2\nproperty flout x\n", "in line 4: 'flout'"),
        ("a.vtk", b"# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3\n4 nope 6\n", "in line 7: 'nope'"),
    ];
    for (name, bytes, expected) in cases {
        let message = read(&folder.write(name, bytes)).expect_err(name).to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn attributes_are_chosen_by_either_name() {
    let folder = Folder::new();
    let bytes = samples::all().into_iter().find(|s| s.name == "plain.bgeo").expect("it is there").bytes;
    let path = folder.write("a.bgeo", bytes);
    for name in ["v", "velocity"] {
        let options = ReadOptions {
            attributes: AttributeChoice::Names(vec![name.into(), "material".into()]),
            ..ReadOptions::default()
        };
        let particles = read_particles(&path, &options).expect("both names are known");
        let names: Vec<&str> = particles.attributes.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names, ["velocity", "material"]);
    }
}
