//! Volumes out: what is written reads back as it was, in every format and of every type, and what has no room is told.

mod common;
#[path = "common/samples.rs"]
mod samples;

use std::path::Path;

use common::Folder;
use pellicle_io::{
    Grid, RawVolume, SampleType, Samples, Scaling, Space, VolumeData, VolumeOptions, check_volume_format, read_volume,
    write_volume,
};
use samples::volume_samples::{DIMS, value, volumes};

const OUT: [&str; 8] = ["o.npy", "o.vti", "o.vtk", "o.mha", "o.nrrd", "o.nii", "o.nii.gz", "o.raw"];

/// The type that a file has: scaled values are computed but in NIfTI.
fn kind(name: &str, data: &VolumeData) -> SampleType {
    let found = data.samples.kind();
    match found {
        _ if data.header.scaling == Scaling::default() || name.starts_with("o.nii") => found,
        SampleType::I8 | SampleType::U8 | SampleType::I16 | SampleType::U16 => SampleType::F32,
        _ => SampleType::F64,
    }
}

fn options(name: &str, data: &VolumeData) -> VolumeOptions {
    let raw = name.ends_with(".raw").then(|| RawVolume {
        dims: data.header.dims.map(|n| n as u64),
        kind: kind(name, data),
        components: 1,
        big_endian: false,
        skip: 0,
    });
    VolumeOptions { raw, ..VolumeOptions::default() }
}

fn assert_same(back: &VolumeData, data: &VolumeData, what: &str) {
    let [x, y, z] = data.header.dims;
    assert_eq!(back.header.dims, data.header.dims, "{what}");
    for node in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k]))) {
        assert_eq!(back.value(node), data.value(node), "{what} at {node:?}");
    }
}

#[test]
fn every_sample_reads_back_from_every_format() {
    let folder = Folder::new();
    for sample in volumes() {
        let path = folder.write(sample.name, &sample.bytes);
        let read = VolumeOptions { component: sample.component, frame: sample.frame, ..VolumeOptions::default() };
        let data = read_volume(&path, &read).expect(sample.name);
        for name in OUT {
            let what = format!("{} to {name}", sample.name);
            let out = folder.join(name);
            let written = write_volume(&out, &data).expect(&what);
            let back = read_volume(&out, &options(name, &data)).expect(&what);
            assert_same(&back, &data, &what);
            assert_eq!(back.samples.kind(), kind(name, &data), "{what}");
            let has_place = !matches!(name, "o.npy" | "o.raw");
            if has_place {
                let mut grid = data.header.grid;
                // To and from a patient's right and front.
                let is_turned = match data.header.space {
                    Space::Ras => name == "o.mha",
                    Space::Lps => name.starts_with("o.nii"),
                    Space::Unknown => false,
                };
                if is_turned {
                    [&mut grid.origin].into_iter().chain(&mut grid.steps).for_each(|v| (v[0], v[1]) = (-v[0], -v[1]));
                }
                assert_eq!(back.header.grid, grid, "{what}");
            } else if sample.has_grid {
                assert!(written.left_out.contains(&"spacing and origin".to_owned()), "{what}: {written:?}");
            }
        }
    }
}

/// A volume of shorts from a NRRD.
fn shorts(folder: &Folder) -> VolumeData {
    let bytes: Vec<u8> = (0..60).flat_map(|n| (value([n % 5, n / 5 % 4, n / 20]) as i16).to_le_bytes()).collect();
    let head = "NRRD0005\ntype: int16\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\n\n";
    let path = folder.write("shorts.nrrd", [head.as_bytes(), &bytes].concat());
    read_volume(&path, &VolumeOptions::default()).expect("shorts")
}

#[test]
#[allow(clippy::unnecessary_cast, reason = "the same code serves every type")]
fn every_type_reads_back_from_every_format() {
    let folder = Folder::new();
    let mut data = shorts(&folder);
    macro_rules! of_type {
        ($($kind:ident $type:ty: $low:expr),*) => {[$(Samples::$kind((0..60).map(|n| (n % 40) as $type * 3 as $type + $low).collect())),*]};
    }
    let all = of_type!(
        I8 i8: -100, U8 u8: 70, I16 i16: -30_000, U16 u16: 60_000, I32 i32: -2_000_000_000, U32 u32: 4_000_000_000,
        I64 i64: -9_000_000_000_000_000_000, U64 u64: 18_000_000_000_000_000_000, F32 f32: 0.1, F64 f64: 0.1
    );
    for samples in all {
        data.header.kind = samples.kind();
        data.samples = samples;
        for name in OUT {
            let path = folder.join(name);
            write_volume(&path, &data).expect(name);
            let found = read_volume(&path, &options(name, &data)).expect(name);
            assert_eq!(found.samples, data.samples, "{name}");
        }
    }
}

fn back(path: &Path) -> VolumeData {
    read_volume(path, &VolumeOptions::default()).expect("what was written")
}

#[test]
fn oblique_and_left_handed_places_stay_or_are_refused() {
    let folder = Folder::new();
    let mut data = shorts(&folder);
    let steps = [[0.6, 0.8, 0.0], [-1.6, 1.2, 0.2], [0.0, 0.25, -3.0]];
    data.header.grid = Grid { origin: [1.0 / 3.0, -2.0, 1e5], steps };
    for name in ["o.vti", "o.mha", "o.nrrd", "o.nii"] {
        let path = folder.join(name);
        let written = write_volume(&path, &data).expect(name);
        let found = back(&path);
        // NIfTI-1 is in single precision, which is told; spacings and directions multiply again.
        let close = if name == "o.nii" { 1e-2 } else { 1e-12 };
        assert_eq!(written.narrowed.len(), usize::from(name == "o.nii"));
        let numbers = |grid: &Grid| grid.origin.into_iter().chain(grid.steps.into_iter().flatten()).collect::<Vec<_>>();
        for (a, b) in numbers(&found.header.grid).into_iter().zip(numbers(&data.header.grid)) {
            assert!((a - b).abs() < close, "{name}: {a} {b}");
        }
        assert_same(&found, &data, name);
    }
    let message = write_volume(&folder.join("o.vtk"), &data).expect_err("oblique").to_string();
    assert!(message.contains("directions") && message.contains(".vti"), "{message}");
    data.header.grid = Grid::new([1.0, 2.0, 3.0], [0.5, -1.0, 2.0]);
    assert!(write_volume(&folder.join("o.vtk"), &data).is_err(), "mirrored");
    assert!(!folder.join("o.vtk").exists());
}

#[test]
fn scaled_values_units_and_names_are_carried() {
    let folder = Folder::new();
    let mut data = shorts(&folder);
    data.header.scaling = Scaling { slope: 0.5, intercept: -1024.0 };
    data.header.unit = "mm".into();
    data.header.name = "a <b> & c".into();
    for name in OUT {
        let path = folder.join(name);
        write_volume(&path, &data).expect(name);
        let keeps = name.starts_with("o.nii");
        let mut asked = options(name, &data);
        if let Some(raw) = &mut asked.raw {
            raw.kind = SampleType::F32;
        }
        let found = read_volume(&path, &asked).expect(name);
        assert_same(&found, &data, name);
        assert_eq!(found.samples.kind(), if keeps { SampleType::I16 } else { SampleType::F32 }, "{name}");
        assert_eq!(found.header.unit == "mm", matches!(name, "o.nrrd" | "o.nii" | "o.nii.gz"), "{name}");
        if name == "o.vti" {
            assert_eq!(found.header.name, data.header.name);
        }
    }
}

#[test]
fn a_slope_that_the_first_nifti_rounds_is_computed() {
    let folder = Folder::new();
    let mut data = shorts(&folder);
    for scaling in [Scaling { slope: 0.1, intercept: 0.0 }, Scaling { slope: 1.0, intercept: 1.0 / 3.0 }] {
        data.header.scaling = scaling;
        let path = folder.join("o.nii");
        write_volume(&path, &data).expect("written");
        let found = back(&path);
        assert_eq!((found.samples.kind(), found.header.scaling), (SampleType::F32, Scaling::default()));
        let ([x, y, z], rounded) = (data.header.dims, |node| f64::from(data.value(node) as f32));
        for node in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k]))) {
            assert_eq!(found.value(node), rounded(node), "{node:?}");
        }
    }
}

#[test]
fn long_axes_take_the_second_nifti() {
    let folder = Folder::new();
    let mut data = shorts(&folder);
    data.header.dims = [40_000, 2, 2];
    data.samples = Samples::U8((0..160_000u32).map(|n| (n % 251) as u8).collect());
    data.header.grid = Grid::new([1.0 / 3.0, 0.0, 0.0], [0.1, 0.2, 0.3]);
    let path = folder.join("long.nii");
    let written = write_volume(&path, &data).expect("long");
    assert!(written.narrowed.is_empty());
    let found = back(&path);
    assert_eq!(found.header.grid, data.header.grid);
    assert_eq!(found.samples, data.samples);
}

#[test]
fn names_that_cannot_be_are_refused() {
    let folder = Folder::new();
    let data = shorts(&folder);
    for (name, expected) in [
        ("o.mhd", "write .mha"),
        ("o.nhdr", "write .nrrd"),
        ("o.hdr", ".nii.gz"),
        ("o.f32", "written to .raw"),
        ("o.pvti", "pieces"),
        ("o.ply", "volumes are written to"),
        ("o.foo", "is not known"),
    ] {
        let message = write_volume(&folder.join(name), &data).expect_err(name).to_string();
        assert!(message.contains(expected), "{name}: {message}");
        assert!(!folder.join(name).exists());
    }
    assert!(check_volume_format(Path::new("a.npz")).is_err() && check_volume_format(Path::new("a.NII.gz")).is_ok());
    assert_eq!(DIMS, [5, 4, 3]);
}
