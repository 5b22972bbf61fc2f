//! Volumes: every variant of every format gives the same samples in the same places; what is wrong with one is told.

mod common;
#[path = "common/samples.rs"]
mod samples;

use std::path::Path;
use std::time::{Duration, Instant};

use common::Folder;
use pellicle_io::{
    Axes, Error, Grid, Order, Placement, RawVolume, SampleType, Samples, VolumeData, VolumeHeader, VolumeOptions,
    holds_volume, open_volume, read_volume,
};
use samples::volume_samples::{DIMS, ORIGIN, SPACING, VolumeSample, value, volumes};

fn options(sample: &VolumeSample) -> VolumeOptions {
    VolumeOptions { component: sample.component, frame: sample.frame, ..VolumeOptions::default() }
}

fn assert_values(volume: &VolumeData, name: &str) {
    let [x, y, z] = DIMS;
    assert_eq!(volume.header.dims, DIMS, "{name}");
    assert_eq!(volume.samples.len(), x * y * z, "{name}");
    for node in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k]))) {
        assert_eq!(volume.value(node), value(node), "{name} at {node:?}");
    }
}

#[test]
fn every_variant_of_every_format_holds_the_same_volume() {
    let folder = Folder::new();
    for sample in volumes() {
        let path = folder.write(sample.name, &sample.bytes);
        let volume = read_volume(&path, &options(&sample)).expect(sample.name);
        assert_values(&volume, sample.name);
        let grid = if sample.has_grid { Grid::new(ORIGIN, SPACING) } else { Grid::default() };
        assert_eq!(volume.header.grid, grid, "{}", sample.name);
        assert!(holds_volume(&path).expect(sample.name), "{}", sample.name);
        let placement = if sample.name.contains("cell") { Placement::Cells } else { Placement::Points };
        assert_eq!(volume.header.placement, placement, "{}", sample.name);
    }
}

#[test]
fn layers_are_the_same_samples_in_the_same_order() {
    let folder = Folder::new();
    let mut in_layers = 0;
    for sample in volumes() {
        let path = folder.write(sample.name, &sample.bytes);
        let whole = read_volume(&path, &options(&sample)).expect(sample.name);
        let mut file = open_volume(&path, &options(&sample)).expect(sample.name);
        let kind = file.header().kind;
        let mut samples = Samples::with_capacity(kind, 0);
        if file.why_no_layers().is_some() {
            assert!(file.read_layers(1, &mut samples).is_err(), "{}", sample.name);
            continue;
        }
        in_layers += 1;
        file.read_layers(1, &mut samples).expect(sample.name);
        file.read_layers(2, &mut samples).expect(sample.name);
        assert_eq!(samples, whole.samples, "{}", sample.name);
    }
    assert!(in_layers >= 15, "{in_layers}");
}

#[test]
fn a_negative_slope_turns_the_order_around_and_keeps_the_values() {
    let folder = Folder::new();
    for name in ["little.nii", "big.nii.gz", "steps.nii"] {
        let sample = volumes().into_iter().find(|sample| sample.name == name).expect(name);
        let (is_packed, is_big) = (name.ends_with(".gz"), name.starts_with("big"));
        let mut bytes = if is_packed { inflate(&sample.bytes) } else { sample.bytes.clone() };
        let slope = if is_big { (-0.5f32).to_be_bytes() } else { (-0.5f32).to_le_bytes() };
        bytes[112..116].copy_from_slice(&slope);
        let path = folder.write("reversed.nii", &bytes);
        let volume = read_volume(&path, &options(&sample)).expect(name);
        assert!(volume.header.scaling.slope > 0.0, "{name}");
        // Samples are 2v − 1, so that −0.5 · sample + 0.5 is 1 − v.
        assert_eq!(volume.value([3, 2, 1]), 1.0 - value([3, 2, 1]), "{name}");
        let mut file = open_volume(&path, &options(&sample)).expect(name);
        let mut samples = Samples::with_capacity(file.header().kind, 0);
        file.read_layers(2, &mut samples).expect(name);
        file.read_layers(1, &mut samples).expect(name);
        assert_eq!(samples, volume.samples, "{name}");
    }
}

fn inflate(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(bytes), &mut out).expect("sound");
    out
}

#[test]
fn arrays_components_steps_and_axes_are_chosen_or_asked_for() {
    let folder = Folder::new();
    let write = |name: &str| {
        let sample = volumes().into_iter().find(|sample| sample.name == name).expect(name);
        folder.write(name, sample.bytes)
    };
    let with = |path: &Path, options: VolumeOptions| read_volume(path, &options).map_err(|error| error.to_string());
    let array = |name: &str| VolumeOptions { array: Some(name.into()), ..VolumeOptions::default() };
    let component = |c| VolumeOptions { component: Some(c), ..VolumeOptions::default() };
    let frame = |frame| VolumeOptions { frame, ..VolumeOptions::default() };

    let path = write("volume.vtk");
    assert_values(&with(&path, array("rho")).unwrap(), "rho");
    assert_values(&with(&path, array("point/rho")).unwrap(), "point/rho");
    assert!(with(&path, array("cell/rho")).unwrap_err().contains("there are: point/rho, point/rest"));
    let rest = VolumeOptions { array: Some("rest".into()), ..component(1) };
    assert_eq!(with(&path, rest).unwrap().value([1, 1, 1]), 0.0);
    assert!(with(&path, array("rest")).unwrap_err().contains("2 components"));
    let archive = write("volume.npz");
    assert!(with(&archive, array("scann")).unwrap_err().contains("scan [3, 4, 5]"));
    assert_values(&with(&archive, array("scan.npy")).unwrap(), "scan");
    let colours = write("rgb.mha");
    assert!(with(&colours, frame(0)).unwrap_err().contains("choose one, 0 to 2"));
    assert!(with(&colours, component(3)).unwrap_err().contains("no component 3"));
    assert_eq!(with(&colours, component(1)).unwrap().value([0, 0, 0]), 1.0);
    assert!(with(&colours, array("red")).unwrap_err().contains("no named arrays"));
    let steps = write("steps.nii");
    assert_eq!(with(&steps, frame(0)).unwrap().samples.get_f64(7), 0.0);
    assert!(with(&steps, frame(2)).unwrap_err().contains("holds 2"));
    assert!(with(&path, frame(1)).unwrap_err().contains("no time step 1"));

    let array = write("volume.npy");
    let turned = with(&array, VolumeOptions { axes: Axes::Xyz, ..VolumeOptions::default() }).unwrap();
    assert_eq!((turned.header.dims, turned.header.order), ([3, 4, 5], Order::ZFastest));
    assert_eq!(turned.value([2, 1, 4]), value([4, 1, 2]));
    let fortran = write("volume_fortran.npy");
    let turned = with(&fortran, VolumeOptions { axes: Axes::Xyz, ..VolumeOptions::default() }).unwrap();
    assert_eq!((turned.header.order, turned.value([2, 1, 4])), (Order::XFastest, value([4, 1, 2])));
}

#[test]
fn raw_files_must_have_just_the_size_that_they_are_said_to_have() {
    let folder = Folder::new();
    let mut bytes = b"head".to_vec();
    for k in 0..3 {
        for j in 0..4 {
            (0..5).for_each(|i| bytes.extend((value([i, j, k]) as i16).to_be_bytes()));
        }
    }
    let raw = RawVolume { dims: [5, 4, 3], kind: SampleType::I16, components: 1, big_endian: true, skip: 4 };
    let path = folder.write("a.bin", &bytes);
    let read = |raw: RawVolume| read_volume(&path, &VolumeOptions { raw: Some(raw), ..VolumeOptions::default() });
    assert_values(&read(raw.clone()).unwrap(), "raw");
    for wrong in [
        RawVolume { dims: [5, 4, 4], ..raw.clone() },
        RawVolume { dims: [5, 4, 2], ..raw.clone() },
        RawVolume { dims: [u64::MAX, u64::MAX, 2], ..raw.clone() },
        RawVolume { dims: [1 << 31, 2, 2], ..raw.clone() },
        RawVolume { dims: [60, 1, 1], ..raw.clone() },
        RawVolume { kind: SampleType::U8, ..raw.clone() },
        RawVolume { skip: 2, ..raw.clone() },
        RawVolume { skip: u64::MAX, ..raw.clone() },
    ] {
        let message = read(wrong.clone()).expect_err("wrong").to_string();
        assert!(message.starts_with(&path.display().to_string()), "{wrong:?}: {message}");
    }
    let untold = read_volume(&folder.write("a.raw", &bytes), &VolumeOptions::default()).expect_err("untold");
    assert!(untold.to_string().contains("dimensions"), "{untold}");
}

#[test]
fn data_beside_the_header_in_one_file_or_several() {
    let folder = Folder::new();
    let layer =
        |k: usize| -> Vec<u8> { (0..20).flat_map(|n| (value([n % 5, n / 5, k]) as i16).to_le_bytes()).collect() };
    folder.write("all.raw", (0..3).flat_map(layer).collect::<Vec<u8>>());
    (0..3).for_each(|k| drop(folder.write(&format!("s{:02}.raw", k + 1), layer(k))));
    let mhd = |data: &str| {
        format!(
            "NDims = 3\nDimSize = 5 4 3\nElementSpacing = 0.5 2 1.5\nOffset = 10 -20 0.5\nElementType = MET_SHORT\nElementDataFile = {data}\n"
        )
    };
    let nrrd = |data: &str| {
        format!(
            "NRRD0005\ntype: int16\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\nspacings: 0.5 2 1.5\naxis mins: 10 -20 0.5\ndata file: {data}\n"
        )
    };
    for (name, text) in [
        ("a.mhd", mhd("all.raw")),
        ("b.mhd", mhd("s%02d.raw 1 3 1")),
        ("c.mhd", mhd("LIST\ns01.raw\ns02.raw\ns03.raw")),
        ("a.nhdr", nrrd("all.raw")),
        ("b.nhdr", nrrd("s%02d.raw 1 3 1 2")),
        ("c.nhdr", nrrd("LIST\ns01.raw\ns02.raw\ns03.raw")),
    ] {
        let path = folder.write(name, text);
        let volume = read_volume(&path, &VolumeOptions::default()).expect(name);
        assert_values(&volume, name);
        assert_eq!(volume.header.grid, Grid::new(ORIGIN, SPACING), "{name}");
    }
    folder.write("s02.raw", [0; 30]);
    for (name, text, expected) in [
        ("d.mhd", mhd("s%02d.raw 1 3"), "another size"),
        ("e.mhd", mhd("s%02d.raw 3 9"), "s04.raw"),
        ("f.mhd", mhd("none.raw"), "none.raw"),
        ("g.mhd", mhd("s01.raw"), "cut short"),
        ("h.mhd", mhd("LIST"), "0 files"),
    ] {
        let message = read_volume(&folder.write(name, text), &VolumeOptions::default()).expect_err(name).to_string();
        assert!(message.contains(expected), "{name}: {message}");
    }
    // A pair of header and data, named by either.
    let nii = volumes().into_iter().find(|sample| sample.name == "little.nii").expect("little.nii").bytes;
    let mut head = nii[..348].to_vec();
    head[344..348].copy_from_slice(b"ni1\0");
    head[108..112].copy_from_slice(&0f32.to_le_bytes());
    let (hdr, img) = (folder.write("p.hdr", head), folder.write("p.img", &nii[352..]));
    for path in [hdr, img] {
        assert_values(&read_volume(&path, &VolumeOptions::default()).expect("a pair"), "a pair");
    }
}

/// Replaces the first `from` by `to`.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).expect(from);
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn headers_that_lie_are_told() {
    let folder = Folder::new();
    let all = volumes();
    for (name, from, to, expected) in [
        ("volume.npy", "(3, 4, 5)", "(3, 4, 6)", "cut short"),
        ("volume.npy", "(3, 4, 5)", "(3, 20)", "three axes"),
        ("volume.npy", "(3, 4, 5)", "(60, 1, 1)", "at least 2"),
        ("volume.npy", "(3, 4, 5)", "(3, 4, -5)", "numbers"),
        ("volume.npy", "(3, 4, 5)", "(0, 4, 5)", "at least 2"),
        ("volume.npy", "(3, 4, 5)", "(4294967298, 4, 5)", "more than can be counted"),
        ("volume.npy", "(3, 4, 5)", "(2048, 2048, 513)", "cut short"),
        ("volume.npy", "<f4", "<c8", "floats"),
        ("ascii.vti", "0 4 0 3 0 2\" Origin", "0 4 0 3 0 3\" Origin", "missing"),
        ("ascii.vti", "0 4 0 3 0 2\" Origin", "0 4 0 3 0 -1\" Origin", "is empty or too large"),
        ("ascii.vti", "0 4 0 3 0 2\" Origin", "0 4 0 3 0 x\" Origin", "WholeExtent"),
        ("raw.vti", "0 4 0 3 0 2\"><Point", "0 4 0 3 0 3\"><Point", "beyond the WholeExtent"),
        ("raw.vti", "Int16", "Int32", "expected"),
        ("ascii.vti", "Spacing=\"0.5 2", "Spacing=\"0.5 0", "along y is 0"),
        ("ascii.vti", "\"Int32\"", "\"Strin\"", "no array"),
        ("volume.vtk", "DIMENSIONS 5", "DIMENSIONS 6", "are not 6 × 4 × 3"),
        ("volume.vtk", "DIMENSIONS 5", "DIMENSIONS -5", "not a count"),
        ("volume.vtk", "STRUCTURED_POINTS", "RECTILINEAR_GRID ", "RECTILINEAR_GRID"),
        ("little.mhd", "DimSize = 5 4 3", "DimSize = 5 4 9", "cut short"),
        ("little.mhd", "DimSize = 5 4 3", "DimSize = 5 4 -3", "not understood"),
        ("little.mhd", "DimSize = 5 4 3", "DimSize = 5 4", "three dimensions"),
        ("little.mhd", "DimSize = 5 4 3", "DimSize = 60 1 1", "at least 2"),
        ("little.mhd", "MET_FLOAT", "MET_FLOOT", "MET_FLOOT"),
        ("little.mhd", "ElementSpacing = 0.5", "ElementSpacing = nan", "not all finite"),
        ("raw.nrrd", "sizes: 5 4 3", "sizes: 5 4 9", "cut short"),
        ("raw.nrrd", "sizes: 5 4 3", "sizes: 5 12", "number of 'sizes'"),
        ("raw.nrrd", "encoding: raw", "encoding: bzip2", "raw, gzip or text"),
        ("raw.nrrd", "type: float", "type: block", "'block'"),
        ("raw.nrrd", "endian: little\n", "", "endian"),
        ("gzip.nrrd", "(0,0,1.5)", "(0,2,0.0)", "in a plane"),
    ] {
        let bytes = &all.iter().find(|sample| sample.name == name).expect(name).bytes;
        let mut bytes = replaced(bytes, from, to);
        if name.ends_with(".npy") {
            let end = bytes.iter().position(|&b| b == b'\n').expect("the header's end");
            bytes[8..10].copy_from_slice(&(end as u16 - 9).to_le_bytes());
        }
        let path = folder.write(name, bytes);
        let message = read_volume(&path, &VolumeOptions::default()).expect_err(to).to_string();
        assert!(
            message.contains(expected) && message.starts_with(&path.display().to_string()),
            "{name} {to}: {message}"
        );
    }
    let nii = &all.iter().find(|sample| sample.name == "little.nii").expect("little.nii").bytes;
    for (at, to, expected) in [
        (42, 0i16, "empty"),
        (42, -5, "empty"),
        (42, 32767, "cut short"),
        (46, 1, "at least 2"),
        (40, 2, "2 dimensions"),
        (70, 32, "complex"),
        (70, 1, "single bits"),
        (70, 99, "data type 99"),
        (344, 0, "ANALYZE"),
        (110, 0, "within the header"),
    ] {
        let mut bytes = nii.clone();
        bytes[at..at + 2].copy_from_slice(&to.to_le_bytes());
        let message = read_volume(&folder.write("a.nii", bytes), &VolumeOptions::default()).expect_err("").to_string();
        assert!(message.contains(expected), "{at} {to}: {message}");
    }
}

#[test]
fn volumes_cut_short_are_never_volumes_and_never_slow() {
    let folder = Folder::new();
    for sample in volumes() {
        for i in 0..50 {
            let path = folder.write(sample.name, &sample.bytes[..sample.bytes.len() * i / 50]);
            let start = Instant::now();
            match read_volume(&path, &options(&sample)) {
                Ok(volume) => {
                    // Only what stands behind the samples may be missing: other arrays, the end of a last number.
                    let is_whole = volume.samples.len() == 60 && i > 24;
                    assert!(is_whole, "{} cut at {i}/50 gives {} samples", sample.name, volume.samples.len());
                }
                Err(error) => {
                    let message = error.to_string();
                    // A name of data beside it may be cut, too.
                    let named = if sample.name.contains(".mh") { folder.join("") } else { path };
                    assert!(message.starts_with(&named.display().to_string()), "{message}");
                }
            }
            assert!(start.elapsed() < Duration::from_secs(5), "{}", sample.name);
        }
    }
}

#[test]
fn real_volumes_have_the_dims_and_ranges_that_are_known() {
    let Some(data) = common::data() else { return };
    for (name, dims, low, high) in [
        ("sphere48.vti", [48, 48, 48], -1.032_050_8, 0.663_147_87),
        ("torus48.mhd", [48, 48, 48], -1.069_551_7, 0.198_718_26),
        ("gyroid48.nrrd", [48, 48, 48], -1.499_162_3, 1.499_162_3),
        ("hydrogen_3dz2_64.vtk", [64, 64, 64], 0.0, 1.0),
        ("metaballs40.npy", [40, 40, 40], 8.3e-14, 0.989_322_2),
        ("mni152_t1_1mm.nii.gz", [197, 233, 189], 0.0, 255.0),
        ("nibabel_anatomical.nii", [33, 41, 25], -610.0, 30393.0),
        ("pyvista_channels.vti", [250, 250, 100], 0.0, 4.0),
    ] {
        let path = data.join("volumes").join(name);
        if !path.exists() {
            println!("SKIPPED: {name}");
            continue;
        }
        let volume = read_volume(&path, &VolumeOptions::default()).expect(name);
        let VolumeHeader { dims: found, scaling, .. } = volume.header;
        assert_eq!(found, dims, "{name}");
        let values = (0..volume.samples.len()).map(|i| scaling.value(volume.samples.get_f64(i)));
        let (least, most) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        println!("{name}: {least} to {most}");
        assert!(most <= high * (1.0 + 1e-6) && least >= low - 0.02, "{name}: {least} to {most}");
    }
}

#[test]
fn what_is_no_volume_says_what_it_is() {
    let folder = Folder::new();
    let error = |name: &str, bytes: &[u8]| match read_volume(&folder.write(name, bytes), &VolumeOptions::default()) {
        Ok(_) => panic!("{name}"),
        Err(error @ (Error::Unsupported { .. } | Error::Format { .. })) => error.to_string(),
        Err(other) => panic!("{other}"),
    };
    assert!(error("a.ply", b"ply\n").contains(".nrrd"));
    assert!(error("a.nrrd", b"ply\n").contains("PLY"));
    assert!(error("a.nii", b"NRRD0004\n").contains("NRRD"));
    assert!(error("a.mhd", b"").contains("ElementDataFile"));
    assert!(error("a.vti", b"<VTKFile type=\"PolyData\"></VTKFile>").contains("no image"));
    let particles = pellicle_io::read_particles(&folder.write("b.nrrd", b"NRRD0004\n"), &Default::default());
    assert!(particles.expect_err("a volume").to_string().contains("volume"));
}
