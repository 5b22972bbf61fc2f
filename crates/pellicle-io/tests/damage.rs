//! Damaged files: cut short, with wrong counts, with random bytes. An error or a result, never a panic, a long wait, or
//! memory out of proportion.

mod common;
#[path = "common/files.rs"]
mod files;

use std::path::Path;
use std::time::{Duration, Instant};

use common::{Folder, read};
use files::mesh_files;
use files::samples::{self, COUNT};
use pellicle_io::{Content, WriteOptions, formats, read_content, read_mesh, write_mesh};
use pellicle_scenes::Random;

/// Reads a damaged file in every way there is; it may fail.
fn try_all(path: &Path) -> Option<usize> {
    let start = Instant::now();
    let particles = read(path);
    // A list may be sound and what it names not.
    let is_list = path.to_string_lossy().contains(".pv");
    if let Err(error) = particles.as_ref()
        && !is_list
    {
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }
    let _ = read_mesh(path);
    assert!(start.elapsed() < Duration::from_secs(5), "{} took too long", path.display());
    particles.ok().map(|p| p.positions.len())
}

#[test]
fn every_format_that_is_read_has_a_sample() {
    let folder = Folder::new();
    let names: Vec<String> = files::all(&folder).into_iter().map(|(name, _)| name).collect();
    for format in formats().filter(files::is_read) {
        let usual = format.extensions[0];
        let is_built = usual != "h5" || cfg!(feature = "hdf5");
        assert!(
            !is_built || names.iter().any(|name| files::usual_extension(name) == Some(usual)),
            "{} is read, but there is no sample of it to damage",
            format.name
        );
    }
}

#[test]
fn files_cut_short_are_told_as_such() {
    let folder = Folder::new();
    let part = samples::all().into_iter().find(|s| s.name.ends_with(".vtp")).expect("a sample").bytes;
    folder.write("part.vtp", &part);
    folder.write("rest.vtp", &part);
    for (name, bytes) in files::all(&folder) {
        for i in 0..50 {
            let path = folder.write(&name, &bytes[..bytes.len() * i / 50]);
            let count = try_all(&path);
            // Formats that tell how many particles there are cannot give fewer; raw and CSV cannot know, and a VTU
            // cut after its first piece is not well-formed.
            let tells_count =
                !["xyz", "csv", "txt", "obj", "f64", "dat", "tsv"].iter().any(|extension| name.ends_with(extension));
            // An empty file of text holds nothing, compressed or not.
            let is_empty_text = i == 0 && name.ends_with(".gz");
            if tells_count
                && !is_empty_text
                && let Some(count) = count
            {
                // Lists name two parts for the first time step.
                let is_list = name.contains(".pv") && count == 2 * COUNT;
                assert!(
                    count == COUNT || is_list || name.starts_with("mesh") && count == 30,
                    "{name} cut at {i}/50 gives {count}"
                );
            }
        }
    }
}

#[test]
fn meshes_cut_short_are_never_meshes() {
    let folder = Folder::new();
    for (name, bytes) in mesh_files(&folder) {
        // A text of whole lines is complete as far as it goes.
        if name.ends_with("obj") {
            continue;
        }
        for i in 0..50 {
            let path = folder.write(name, &bytes[..bytes.len() * i / 50]);
            if let Ok(mesh) = read_mesh(&path) {
                // VTK's point data may be missing as a whole.
                assert_eq!((name, mesh.triangles.len()), ("mesh.vtk", 28), "{name} cut at {i}/50");
            }
        }
    }
}

/// Points, attributes and cells of a surface stand in this order, so much of it is there long before the faces are. Legacy
/// VTK cut right before its faces is a whole file of points, and may pass for one there and nowhere else.
#[test]
fn surfaces_cut_short_do_not_pass_for_particles() {
    let folder = Folder::new();
    let mut files: Vec<(&str, Vec<u8>)> = mesh_files(&folder);
    let mesh = read_mesh(&folder.write("whole.ply", &files[0].1)).expect("a mesh");
    for name in ["ours.vtu", "ours.vtp"] {
        write_mesh(&folder.join(name), &mesh, &WriteOptions::default()).expect(name);
        files.push((name, std::fs::read(folder.join(name)).expect(name)));
    }
    for (name, bytes) in files.into_iter().filter(|(name, _)| !name.ends_with("obj")) {
        for cut in (0..bytes.len()).step_by(23) {
            let content = read_content(&folder.write(name, &bytes[..cut]), &common::all());
            let is_whole = name.ends_with(".vtk") && bytes[cut..].trim_ascii_start().starts_with(b"POLYGONS");
            assert!(
                is_whole || !matches!(content, Ok(Content::Particles(_))),
                "{name} cut at {cut} of {}",
                bytes.len()
            );
        }
    }
}

#[test]
fn stl_and_glb_that_lie_are_refused() {
    let folder = Folder::new();
    let files = mesh_files(&folder);
    let file = |name: &str| files.iter().find(|f| f.0 == name).map(|f| f.1.clone()).expect(name);
    for count in [29u32, 1 << 20, u32::MAX] {
        let mut stl = file("mesh.stl");
        stl[80..84].copy_from_slice(&count.to_le_bytes());
        let message = read_mesh(&folder.write("a.stl", stl)).expect_err("too many").to_string();
        assert!(message.contains("cut short"), "{message}");
    }
    let glb = file("mesh.glb");
    // Of equal length, so that the chunk's length stays right.
    for (from, to, expected) in [
        ("\"count\":30", "\"count\":99", "not in the binary chunk"),
        ("\"count\":84", "\"count\":99", "not in the binary chunk"),
        ("\"count\":30", "\"count\":0 ", "not in the binary chunk"),
        ("\"indices\":1", "\"indices\":7", "number 7 of accessors"),
        ("\"indices\":1", "\"indices\":0", "single unsigned integers"),
        ("\"mesh\":0", "\"mesh\":3", "number 3 of meshes"),
        ("\"nodes\":[0]", "\"nodes\":[4]", "number 4 of nodes"),
        ("\"VEC3\"", "\"VEC2\"", "VEC3"),
        ("\"buffer\":0", "\"buffer\":1", "other files"),
        ("\"version\"", "\"versi\u{1}n\"", "JSON is damaged"),
    ] {
        let damaged = replaced(&glb, from.as_bytes(), to.as_bytes());
        let message = read_mesh(&folder.write("a.glb", damaged)).expect_err(to).to_string();
        assert!(message.contains(expected), "{to}: {message}");
    }
    let mut wrong = glb.clone();
    let end = wrong.len();
    wrong[end - 4..].copy_from_slice(&30u32.to_le_bytes());
    assert!(read_mesh(&folder.write("a.glb", wrong)).expect_err("an index").to_string().contains("vertex 30"));
}

#[test]
fn real_files_cut_short_are_told_as_such() {
    let Some(data) = common::data() else { return };
    let folder = Folder::new();
    for (name, count) in [
        ("cbd_t0.50.bgeo", 140_608),
        ("hemi_t0.35.vtk", 28_899),
        ("cbd_t4.00.vtu", 140_608),
        ("hemi_t0.60.ply", 28_899),
    ] {
        let bytes = std::fs::read(data.join("particles").join(name)).expect(name);
        for i in 0..50 {
            let found = try_all(&folder.write(name, &bytes[..bytes.len() * i / 50]));
            assert!(found.is_none() || found == Some(count), "{name} cut at {i}/50 gives {found:?}");
        }
    }
}

#[test]
fn random_bytes_and_random_changes_never_panic() {
    let folder = Folder::new();
    let mut random = Random::new(1);
    for (name, bytes) in &files::all(&folder) {
        for round in 0..60 {
            let mut damaged = bytes.clone();
            // Mostly in the first part, where headers are.
            let reach = if round % 2 == 0 { bytes.len() } else { bytes.len().min(400) };
            for _ in 0..1 + round % 4 {
                let at = random.below(reach);
                damaged[at] = if round % 3 == 0 { b'0' + random.below(10) as u8 } else { random.bits() as u8 };
            }
            try_all(&folder.write(name, &damaged));
        }
        let noise: Vec<u8> = (0..5000).map(|_| random.bits() as u8).collect();
        for len in [0, 1, 7, 64, 511, 5000] {
            try_all(&folder.write(name, &noise[..len]));
        }
        // The same behind a right beginning.
        for keep in [8, 30, 100, 300] {
            let keep = keep.min(bytes.len());
            try_all(&folder.write(name, [&bytes[..keep], &noise].concat()));
        }
    }
}

/// Replaces the first `from` by `to`.
fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from).expect("the sample has it");
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

#[test]
fn counts_that_lie_are_refused() {
    let folder = Folder::new();
    let samples = samples::all();
    let sample = |name: &str| &samples.iter().find(|s| s.name == name).expect(name).bytes;
    let counts = [
        "41",
        "1000000",
        "4294967336",
        "1152921504606846977",
        "18446744073709551615",
        "99999999999999999999999",
        "-40",
    ];
    for count in counts {
        let text = |name: &str, prefix: &str, suffix: &str| {
            let from = format!("{prefix}{COUNT}{suffix}");
            let bytes = replaced(sample(name), from.as_bytes(), format!("{prefix}{count}{suffix}").as_bytes());
            let path = folder.write(name, bytes);
            assert!(try_all(&path).is_none(), "{name} with {count}");
        };
        for name in ["little.ply", "ascii.ply", "big_lists.ply", "ascii_lists.ply"] {
            text(name, "element vertex ", "\n");
        }
        for name in ["c3.npy", "c3_double.npy", "c7_fortran.npy", "structured.npy", "halves.npy"] {
            text(name, "(", ",");
        }
        text("stored.npz", "(", ", 3)");
        text("classic.xyz", "", "\n");
        text("numbers.xyz", "", "\n");
        text("bare.dat", "", "\n");
        text("extended.extxyz", "", "\n");
        for name in ["usual.dump", "shuffled.dump", "scaled.dump"] {
            text(name, "NUMBER OF ATOMS\n", "\n");
        }
        for name in ["old.vtk", "old_ascii.vtk", "new.vtk", "new_ascii.vtk"] {
            text(name, "POINTS ", " ");
            text(name, "POINT_DATA ", "\n");
            text(name, "a%20name 2 ", " ");
        }
        let vertices = folder.write(
            "cells.vtk",
            replaced(sample("old.vtk"), b"VERTICES 40 80", format!("VERTICES {count} {count}").as_bytes()),
        );
        assert!(try_all(&vertices).is_none());
        for sample in samples.iter().filter(|s| s.name.ends_with(".vtu") || s.name.ends_with(".vtp")) {
            // The last of three pieces has 30 points.
            let from = b"NumberOfPoints=\"30\"";
            let bytes = replaced(&sample.bytes, from, format!("NumberOfPoints=\"{count}\"").as_bytes());
            assert!(try_all(&folder.write(sample.name, bytes)).is_none(), "{} with {count}", sample.name);
        }
    }
    for count in [0u32, 39, 41, 1 << 24, u32::MAX, -40i32 as u32] {
        // The type, the count and the size of the positions.
        let from = [[22, 0, 0, 0], [COUNT as u8, 0, 0, 0]].concat();
        let bytes = replaced(sample("single.bi4"), &from, &[&from[..4], &count.to_le_bytes()].concat());
        assert!(try_all(&folder.write("a.bi4", bytes)).is_none(), "BI4 with {count}");
    }
    // The shape of a dataset in one piece, whose header has no checksum.
    if cfg!(feature = "hdf5") {
        for count in [0u64, 41, 1 << 20, 1 << 32, 1 << 63, u64::MAX] {
            let shape = |count: u64| [count.to_le_bytes(), 3u64.to_le_bytes()].concat();
            let bytes = replaced(sample("snapshot.hdf5"), &shape(COUNT as u64), &shape(count));
            let found = try_all(&folder.write("snapshot.hdf5", bytes));
            assert!(found.is_none() || (count, found) == (0, Some(0)), "snapshot.hdf5 with {count}");
        }
    }
    for count in [41u32, 1 << 24, u32::MAX, -40i32 as u32] {
        let bytes = replaced(
            sample("plain.bgeo"),
            &[0, 0, 0, 5, 0, 0, 0, COUNT as u8],
            &[&[0, 0, 0, 5][..], &count.to_be_bytes()].concat(),
        );
        assert!(try_all(&folder.write("plain.bgeo", &bytes)).is_none());
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut encoder, &bytes).expect("in memory");
        assert!(try_all(&folder.write("packed.bgeo", encoder.finish().expect("in memory"))).is_none());
    }
}

#[test]
fn cells_that_lie_are_refused() {
    let folder = Folder::new();
    for (name, is_grid) in [("a.vtp", false), ("a.vtu", true)] {
        let bytes = samples::mesh_xml(is_grid);
        assert!(read_mesh(&folder.write(name, &bytes)).is_ok());
        let (count, first) =
            if is_grid { ("NumberOfCells=\"13\"", "0 1 2 ") } else { ("NumberOfPolys=\"20\"", "0 1 2 ") };
        let key = count.split('=').next().expect("it has one");
        for (from, to) in [
            (count, format!("{key}=\"14000000000000\"")),
            (count, format!("{key}=\"-1\"")),
            (count, format!("{key}=\"18446744073709551615\"")),
            (first, "0 1 30 ".into()),
            (first, "0 1 -1 ".into()),
            (first, "0 1 4294967296 ".into()),
            (">3 6 ", ">3 9223372036854775807 ".into()),
            (">3 6 ", ">6 3 ".into()),
            (">3 6 ", ">3 -6 ".into()),
        ] {
            let error = read_mesh(&folder.write(name, replaced(&bytes, from.as_bytes(), to.as_bytes())));
            assert!(error.is_err(), "{name}: {to} for {from}");
        }
    }
}

#[test]
fn faces_that_lie_are_refused() {
    let folder = Folder::new();
    let files = mesh_files(&folder);
    let mut cases = Vec::new();
    for count in ["29", "1000000", "4294967296", "18446744073709551615", "99999999999999999999999", "-28"] {
        cases.push(("mesh.ply", "element face 28\n", format!("element face {count}\n")));
        cases.push(("mesh.ply", "element vertex 30\n", format!("element vertex {count}\n")));
        cases.push(("mesh.vtk", "POINTS 30 ", format!("POINTS {count} ")));
        cases.push(("mesh.vtk", "POLYGONS 28 112\n", format!("POLYGONS {count} 112\n")));
        cases.push(("mesh.vtk", "POLYGONS 28 112\n", format!("POLYGONS 28 {count}\n")));
        cases.push(("mesh.obj", "f 1 2 3\n", format!("f 1 2 {count}000\n")));
    }
    for corners in ["1 2 31", "0 1 2", "1 2 -31", "1 2 4294967297", "1 2", "1/x 2/y 3.5"] {
        cases.push(("mesh.obj", "f 1 2 3\n", format!("f {corners}\n")));
    }
    for (name, from, to) in cases {
        let bytes = &files.iter().find(|file| file.0 == name).expect(name).1;
        assert!(read_mesh(&folder.write(name, bytes)).is_ok());
        let path = folder.write(name, replaced(bytes, from.as_bytes(), to.as_bytes()));
        try_all(&path);
        assert!(read_mesh(&path).is_err(), "{name}: {to} for {from}");
    }
}

/// Sizes before the compressed data that lie, one at a time, of the first array and of the last.
#[test]
fn sizes_of_blocks_that_lie_are_refused() {
    let folder = Folder::new();
    for name in ["raw_zlib_big.vtu", "raw_lz4_big.vtu", "raw_lzma.vtu"] {
        let sample = samples::all().into_iter().find(|s| s.name == name).expect(name);
        let size = if name == "raw_lzma.vtu" { 8 } else { 4 };
        let start = sample.bytes.windows(2).rposition(|w| w == b"\n ").expect("appended data") + 3;
        // The first piece has no points, so its arrays have no blocks: three sizes each, all zero.
        let first = start + 3 * 3 * size;
        for field in 0..5 {
            for value in [0u64, 1, 99, 101, 1 << 31, u64::from(u32::MAX), 1 << 62, u64::MAX] {
                let mut bytes = sample.bytes.clone();
                let at = first + field * size;
                let whole =
                    if size == 8 { value.to_le_bytes().to_vec() } else { (value as u32).to_be_bytes().to_vec() };
                if bytes[at..at + size] == whole[..] {
                    continue;
                }
                bytes[at..at + size].copy_from_slice(&whole);
                assert!(try_all(&folder.write(name, bytes)).is_none(), "{name}: size {field} as {value}");
            }
        }
    }
}
