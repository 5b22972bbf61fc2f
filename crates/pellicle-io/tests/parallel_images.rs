//! Images in several files (`.pvti`): pieces in any encoding, ghost levels, and what is wrong with a list.

mod common;

use std::path::PathBuf;

use common::Folder;
use pellicle_io::{Grid, Placement, SampleType, VolumeData, VolumeOptions, holds_volume, open_volume, read_volume};

/// First and last point along each axis.
type Extent = [i64; 6];

const WHOLE: Extent = [-2, 5, 1, 6, 0, 4];

fn value([i, j, k]: [i64; 3]) -> i16 {
    (100 * k + 10 * j + i) as i16
}

fn text(extent: Extent) -> String {
    extent.map(|n| n.to_string()).join(" ")
}

/// A piece in a file: its points, or its cells, have their value, but for ghosts beyond `own`, which have nonsense.
fn piece(extent: Extent, own: Extent, in_cells: bool, is_raw: bool) -> Vec<u8> {
    let [a, b, c, d, e, f] = extent;
    let end = |n: i64| if in_cells { n - 1 } else { n };
    let mut values = Vec::new();
    for k in e..=end(f) {
        for j in c..=end(d) {
            for i in a..=end(b) {
                let is_own =
                    [i, j, k].iter().enumerate().all(|(axis, n)| (own[2 * axis]..=end(own[2 * axis + 1])).contains(n));
                values.push(if is_own { value([i, j, k]) } else { -1 });
            }
        }
    }
    let section = if in_cells { "CellData" } else { "PointData" };
    let mut out = format!(
        "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\">\n\
         <ImageData WholeExtent=\"{}\" Origin=\"1 2 3\" Spacing=\"0.5 2 1.5\"><Piece Extent=\"{}\"><{section}>",
        text(WHOLE),
        text(extent)
    )
    .into_bytes();
    let array = |format: &str| format!("<DataArray type=\"Int16\" Name=\"rho\" {format}>");
    if is_raw {
        out.extend(array("format=\"appended\" offset=\"0\"").into_bytes());
    } else {
        out.extend(array("format=\"ascii\"").into_bytes());
        out.extend(values.iter().map(|v| format!("{v} ")).collect::<String>().into_bytes());
    }
    out.extend(format!("</DataArray></{section}></Piece></ImageData>\n").into_bytes());
    if is_raw {
        out.extend(b"<AppendedData encoding=\"raw\">_");
        out.extend(((2 * values.len()) as u32).to_le_bytes());
        out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        out.extend(b"</AppendedData>");
    }
    out.extend(b"</VTKFile>\n");
    out
}

fn list(pieces: &[(Extent, &str)], in_cells: bool) -> String {
    let section = if in_cells { "PCellData" } else { "PPointData" };
    let pieces: String = pieces
        .iter()
        .map(|(extent, file)| format!("<Piece Extent=\"{}\" Source=\"{file}\"/>\n", text(*extent)))
        .collect();
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PImageData\" version=\"1.0\">\n\
         <PImageData WholeExtent=\"{}\" GhostLevel=\"1\" Origin=\"1 2 3\" Spacing=\"0.5 2 1.5\">\n\
         <{section} Scalars=\"rho\"><PDataArray type=\"Int16\" Name=\"rho\"/></{section}>\n{pieces}</PImageData></VTKFile>\n",
        text(WHOLE)
    )
}

const LOW: Extent = [-2, 2, 1, 6, 0, 4];
const HIGH: Extent = [2, 5, 1, 6, 0, 4];

/// Two pieces, one in text with a ghost level, one raw with two.
fn two(folder: &Folder, in_cells: bool) -> PathBuf {
    std::fs::create_dir_all(folder.join("parts")).expect("a folder");
    folder.write("parts/low.vti", piece([-2, 3, 1, 6, 0, 4], LOW, in_cells, false));
    folder.write("parts/high.vti", piece([0, 5, 1, 6, 0, 4], HIGH, in_cells, true));
    folder.write("all.pvti", list(&[(LOW, "parts/low.vti"), (HIGH, "parts/high.vti")], in_cells))
}

fn check(volume: &VolumeData, in_cells: bool) {
    let more = usize::from(!in_cells);
    assert_eq!(volume.header.dims, [7 + more, 5 + more, 4 + more]);
    assert_eq!((volume.header.kind, volume.header.name.as_str()), (SampleType::I16, "rho"));
    let [x, y, z] = volume.header.dims;
    for node in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k]))) {
        let at = [node[0] as i64 - 2, node[1] as i64 + 1, node[2] as i64];
        assert_eq!(volume.value(node), f64::from(value(at)), "{node:?}");
    }
    let origin = if in_cells { [0.25, 5.0, 3.75] } else { [0.0, 4.0, 3.0] };
    assert_eq!(volume.header.grid, Grid::new(origin, [0.5, 2.0, 1.5]));
}

#[test]
fn pieces_in_any_encoding_are_put_together_without_their_ghosts() {
    for in_cells in [false, true] {
        let folder = Folder::new();
        let path = two(&folder, in_cells);
        assert!(holds_volume(&path).expect("a list"));
        let volume = read_volume(&path, &VolumeOptions::default()).expect("two pieces");
        check(&volume, in_cells);
        assert_eq!(volume.header.placement, if in_cells { Placement::Cells } else { Placement::Points });
        assert!(open_volume(&path, &VolumeOptions::default()).expect("a list").why_no_layers().is_some());
        // By its content, too.
        let other = folder.write("all.xml", std::fs::read(&path).expect("written"));
        check(&read_volume(&other, &VolumeOptions::default()).expect("two pieces"), in_cells);
    }
}

#[test]
fn one_piece_may_be_all_and_one_may_be_empty() {
    let folder = Folder::new();
    folder.write("all.vti", piece(WHOLE, WHOLE, false, true));
    let path = folder.write("one.pvti", list(&[([0, -1, 0, -1, 0, -1], "none.vti"), (WHOLE, "./all.vti")], false));
    check(&read_volume(&path, &VolumeOptions::default()).expect("one piece"), false);
    // A later piece of a part counts where they overlap.
    folder.write("part.vti", piece(LOW, [9, 9, 9, 9, 9, 9], false, false));
    let both = folder.write("both.pvti", list(&[(WHOLE, "all.vti"), (LOW, "part.vti")], false));
    let volume = read_volume(&both, &VolumeOptions::default()).expect("two pieces");
    assert_eq!((volume.value([0, 0, 0]), volume.value([7, 5, 4])), (-1.0, f64::from(value([5, 6, 4]))));
}

#[test]
fn what_is_wrong_with_a_list_is_told() {
    let folder = Folder::new();
    let path = two(&folder, false);
    let good = std::fs::read_to_string(&path).expect("written");
    let outside = folder.write("outside.vti", piece(HIGH, HIGH, false, false));
    for (from, to, expected) in [
        ("parts/high.vti", "parts/gone.vti", "gone.vti' cannot be read"),
        ("parts/high.vti", "parts", "is no file"),
        ("parts/high.vti", "../outside.vti", "not in the folder of the list"),
        ("parts/high.vti", "parts/../../x.vti", "not in the folder of the list"),
        ("parts/high.vti", outside.to_str().expect("a name"), "not in the folder of the list"),
        ("parts/high.vti", "", "not in the folder of the list"),
        ("parts/high.vti", "parts/low.vti", "none has sample [4, 1, 0]"),
        ("parts/high.vti", "all.pvti", "pieces are .vti files"),
        ("Extent=\"2 5", "Extent=\"4 5", "are missing"),
        ("WholeExtent=\"-2 5", "WholeExtent=\"-2 6", "none has sample [6, 1, 0]"),
        ("WholeExtent=\"-2 5", "WholeExtent=\"-2 x", "WholeExtent"),
        (" Extent=\"2 5 1 6 0 4\"", "", "has no Extent"),
        ("Extent=\"2 5 1", "Extent=\"2 -5 1", "are missing"),
        ("type=\"Int16\"", "type=\"Int32\"", "is not in every Piece"),
        ("Name=\"rho\"", "Name=\"phi\"", "is not in every Piece"),
        ("<PDataArray type=\"Int16\" Name=\"rho\"/>", "", "no array"),
        ("</VTKFile>", "", "cut short"),
    ] {
        assert!(good.contains(from), "{from}");
        let bad = folder.write("bad.pvti", good.replacen(from, to, 1));
        let message = read_volume(&bad, &VolumeOptions::default()).expect_err(to).to_string();
        assert!(message.contains(expected), "{from} -> {to}: {message}");
    }
    // A small list may not ask for much memory.
    let wide = "\"0 2147483000 0 30000 0 30000\"";
    let huge = good.replace("\"-2 5 1 6 0 4\"", wide).replace("\"2 5 1 6 0 4\"", wide);
    let message =
        read_volume(&folder.write("huge.pvti", huge), &VolumeOptions::default()).expect_err("huge").to_string();
    assert!(message.contains("out of proportion") || message.contains("more than can be counted"), "{message}");
    // Nor may one that names the same file again and again: its bytes are there once.
    let again = format!("<Piece Extent=\"{}\" Source=\"parts/high.vti\"/>\n", text([0, 149, 0, 149, 0, 149]));
    let many = good
        .replace("\"-2 5 1 6 0 4\"", "\"0 149 0 149 0 149\"")
        .replace("</PImageData>", &(again.repeat(200) + "</PImageData>"));
    let limited = VolumeOptions { inflated_limit: None, ..VolumeOptions::default() };
    let message = read_volume(&folder.write("many.pvti", many), &limited).expect_err("many").to_string();
    assert!(message.contains("out of proportion"), "{message}");
    // A piece that is cut short names itself.
    let bytes = std::fs::read(folder.join("parts/high.vti")).expect("written");
    folder.write("parts/high.vti", &bytes[..bytes.len() - 60]);
    let message = read_volume(&path, &VolumeOptions::default()).expect_err("cut").to_string();
    assert!(message.contains("high.vti"), "{message}");
}

#[test]
fn a_list_of_an_image_is_no_list_of_particles() {
    let folder = Folder::new();
    let path = two(&folder, false);
    let message = pellicle_io::read_particles(&path, &pellicle_io::ReadOptions::default()).expect_err("a volume");
    assert!(message.to_string().contains("volume"), "{message}");
}
