//! The same few particles in every format and variant that is read.
#![allow(dead_code, reason = "no test uses all of it")]

use std::io::Write;

#[path = "array_samples.rs"]
mod array_samples;
#[path = "text_samples.rs"]
mod text_samples;
#[path = "volume_samples.rs"]
pub mod volume_samples;

/// A file and what it holds besides positions.
pub struct Sample {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Whether the file has velocity and density.
    pub has_attributes: bool,
}

pub const COUNT: usize = 40;

pub fn position(i: usize) -> [f32; 3] {
    [i as f32 * 0.25, 1.0 - i as f32 * 0.5, (i % 7) as f32 * 0.125]
}

pub fn velocity(i: usize) -> [f32; 3] {
    [-(i as f32), 0.5, i as f32 * 2.0]
}

pub fn density(i: usize) -> f32 {
    1000.0 + i as f32
}

#[derive(Clone, Copy, PartialEq)]
pub enum Order {
    Little,
    Big,
    Text,
}
use Order::{Big, Little, Text};

fn put(out: &mut Vec<u8>, value: f32, is_double: bool, order: Order) {
    match (order, is_double) {
        (Little, false) => out.extend_from_slice(&value.to_le_bytes()),
        (Big, false) => out.extend_from_slice(&value.to_be_bytes()),
        (Little, true) => out.extend_from_slice(&f64::from(value).to_le_bytes()),
        (Big, true) => out.extend_from_slice(&f64::from(value).to_be_bytes()),
        (Text, _) => out.extend_from_slice(format!("{value} ").as_bytes()),
    }
}

fn put_int(out: &mut Vec<u8>, value: i32, order: Order) {
    match order {
        Little => out.extend_from_slice(&value.to_le_bytes()),
        Big => out.extend_from_slice(&value.to_be_bytes()),
        Text => out.extend_from_slice(format!("{value} ").as_bytes()),
    }
}

fn array(values: impl Iterator<Item = f32>, is_double: bool, order: Order) -> Vec<u8> {
    let mut out = Vec::new();
    values.for_each(|value| put(&mut out, value, is_double, order));
    out
}

fn row(i: usize) -> [f32; 7] {
    let (p, v) = (position(i), velocity(i));
    [p[0], p[1], p[2], v[0], v[1], v[2], density(i)]
}

fn npy(descr: &str, is_fortran: bool, columns: usize, order: Order) -> Vec<u8> {
    let order_name = if is_fortran { "True" } else { "False" };
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': {order_name}, 'shape': ({COUNT}, {columns}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    let is_double = descr.ends_with('8');
    if is_fortran {
        (0..columns).for_each(|c| out.extend(array((0..COUNT).map(|i| row(i)[c]), is_double, order)));
    } else {
        (0..COUNT).for_each(|i| out.extend(array(row(i).into_iter().take(columns), is_double, order)));
    }
    out
}

/// PLY with an element before the vertices, one with a list, and a list among the vertices.
fn ply(order: Order, is_double: bool, has_lists: bool) -> Vec<u8> {
    let format = match order {
        Little => "binary_little_endian",
        Big => "binary_big_endian",
        Text => "ascii",
    };
    let kind = if is_double { "double" } else { "float" };
    let list = if has_lists { "property list uchar int neighbours\n" } else { "" };
    let mut out = format!(
        "ply\nformat {format} 1.0\ncomment a test\nelement camera 2\nproperty int id\nproperty list uchar short views\n\
         element vertex {COUNT}\nproperty {kind} x\nproperty {kind} y\n{list}property {kind} z\nproperty float density\n\
         property float vx\nproperty float vy\nproperty float vz\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let byte = |out: &mut Vec<u8>, value: u8| match order {
        Text => out.extend_from_slice(format!("{value} ").as_bytes()),
        _ => out.push(value),
    };
    let end = |out: &mut Vec<u8>| out.extend_from_slice(if order == Text { b"\n" } else { b"" });
    for id in 0..2u8 {
        put_int(&mut out, i32::from(id), order);
        byte(&mut out, id);
        match order {
            Text => out.extend_from_slice("7 ".repeat(id.into()).as_bytes()),
            _ => out.extend_from_slice(&[0, 7][..2 * usize::from(id)]),
        }
        end(&mut out);
    }
    for i in 0..COUNT {
        let r = row(i);
        put(&mut out, r[0], is_double, order);
        put(&mut out, r[1], is_double, order);
        if has_lists {
            byte(&mut out, (i % 3) as u8);
            (0..i % 3).for_each(|k| put_int(&mut out, k as i32, order));
        }
        put(&mut out, r[2], is_double, order);
        put(&mut out, r[6], false, order);
        r[3..6].iter().for_each(|&v| put(&mut out, v, false, order));
        end(&mut out);
    }
    byte(&mut out, 3);
    (0..3).for_each(|k| put_int(&mut out, k, order));
    end(&mut out);
    out
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

fn lz4(bytes: &[u8]) -> Vec<u8> {
    lz4_flex::block::compress(bytes)
}

fn xz(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::with_preset(1)).expect("in memory");
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

/// `others` says how many primitives, groups and other attributes there are, of which `tail` holds the data.
fn bgeo(others: [i32; 6], tail: &[u8]) -> Vec<u8> {
    let mut out = b"BgeoV".to_vec();
    let [primitives, point_groups, primitive_groups, of_vertices, of_primitives, of_all] = others;
    [5, COUNT as i32, primitives, point_groups, primitive_groups, 3, of_vertices, of_primitives, of_all]
        .iter()
        .for_each(|&v| put_int(&mut out, v, Big));
    let define = |out: &mut Vec<u8>, name: &str, size: u16, kind: i32| {
        out.extend_from_slice(&(name.len() as u16).to_be_bytes());
        out.extend_from_slice(name.as_bytes());
        out.extend_from_slice(&size.to_be_bytes());
        put_int(out, kind, Big);
    };
    define(&mut out, "v", 3, 5);
    out.extend_from_slice(&[0; 12]);
    define(&mut out, "material", 1, 4);
    put_int(&mut out, 2, Big);
    for name in ["water", "oil"] {
        out.extend_from_slice(&(name.len() as u16).to_be_bytes());
        out.extend_from_slice(name.as_bytes());
    }
    define(&mut out, "density", 1, 0);
    out.extend_from_slice(&[0; 4]);
    for i in 0..COUNT {
        let r = row(i);
        out.extend(array(r[..3].iter().copied().chain([1.0]).chain(r[3..6].iter().copied()), false, Big));
        put_int(&mut out, (i % 2) as i32, Big);
        put(&mut out, r[6], false, Big);
    }
    out.extend_from_slice(tail);
    out
}

fn vtk(order: Order, is_new: bool, dataset: &str) -> Vec<u8> {
    let (version, format) = (if is_new { "5.1" } else { "2.0" }, if order == Text { "ASCII" } else { "BINARY" });
    let mut out = format!("# vtk DataFile Version {version}\na test\n{format}\nDATASET {dataset}\n").into_bytes();
    let text = |out: &mut Vec<u8>, text: &str| out.extend_from_slice(text.as_bytes());
    let metadata = "\nMETADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n";
    text(&mut out, "FIELD FieldData 1\nTIME 1 1 double\n");
    put(&mut out, 2.5, true, order);
    text(&mut out, &format!("\nPOINTS {COUNT} float\n"));
    (0..COUNT).for_each(|i| out.extend(array(position(i).into_iter(), false, order)));
    text(&mut out, metadata);
    let key = if dataset == "POLYDATA" { "VERTICES" } else { "CELLS" };
    let long = |out: &mut Vec<u8>, value: usize| match order {
        Text => out.extend_from_slice(format!("{value} ").as_bytes()),
        _ => out.extend_from_slice(&(value as i64).to_be_bytes()),
    };
    if is_new {
        text(&mut out, &format!("{key} {} {COUNT}\nOFFSETS vtktypeint64\n", COUNT + 1));
        (0..=COUNT).for_each(|i| long(&mut out, i));
        text(&mut out, "\nCONNECTIVITY vtktypeint64\n");
        (0..COUNT).for_each(|i| long(&mut out, i));
    } else {
        text(&mut out, &format!("{key} {COUNT} {}\n", 2 * COUNT));
        (0..COUNT).for_each(|i| [1, i as i32].iter().for_each(|&v| put_int(&mut out, v, order)));
    }
    if dataset != "POLYDATA" {
        text(&mut out, &format!("\nCELL_TYPES {COUNT}\n"));
        (0..COUNT).for_each(|_| put_int(&mut out, 1, order));
    }
    text(&mut out, &format!("\nCELL_DATA {COUNT}\nSCALARS cell float\nLOOKUP_TABLE default\n"));
    out.extend(array((0..COUNT).map(|i| i as f32), false, order));
    text(&mut out, &format!("\nPOINT_DATA {COUNT}\nSCALARS density float 1\nLOOKUP_TABLE mine\n"));
    out.extend(array((0..COUNT).map(density), false, order));
    text(&mut out, "\nLOOKUP_TABLE mine 2\n");
    match order {
        Text => text(&mut out, "0 0 0 1 1 1 1 1\n"),
        _ => out.extend_from_slice(b"\n\n\n\n\n\n\n\n"),
    }
    text(&mut out, "FIELD FieldData 2\n");
    text(&mut out, &format!("a%20name 2 {COUNT} int\n"));
    (0..2 * COUNT).for_each(|i| put_int(&mut out, i as i32, order));
    text(&mut out, metadata);
    text(&mut out, &format!("Vel 3 {COUNT} float\n"));
    (0..COUNT).for_each(|i| out.extend(array(velocity(i).into_iter(), false, order)));
    text(&mut out, metadata);
    out
}

pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for part in bytes.chunks(3) {
        let bits = u32::from_be_bytes([0, part[0], *part.get(1).unwrap_or(&0), *part.get(2).unwrap_or(&0)]);
        for i in 0..4 {
            let is_padding = i > part.len();
            out.push(if is_padding { '=' } else { ALPHABET[(bits >> (18 - 6 * i) & 63) as usize] as char });
        }
    }
    out
}

/// How a VTU sample is written.
#[derive(Clone, Copy)]
struct Vtu {
    order: Order,
    format: &'static str,
    /// `raw` or `base64` where the format is appended.
    encoding: &'static str,
    /// Name of VTK's compressor and what it does, if any.
    compressor: Option<Compressor>,
    has_long_sizes: bool,
}

type Compressor = (&'static str, fn(&[u8]) -> Vec<u8>);
const ZLIB: Option<Compressor> = Some(("vtkZLibDataCompressor", zlib));
const LZ4: Option<Compressor> = Some(("vtkLZ4DataCompressor", lz4));
const LZMA: Option<Compressor> = Some(("vtkLZMADataCompressor", xz));

impl Vtu {
    fn size(self, value: usize) -> Vec<u8> {
        match (self.order, self.has_long_sizes) {
            (Big, false) => (value as u32).to_be_bytes().to_vec(),
            (Big, true) => (value as u64).to_be_bytes().to_vec(),
            (_, false) => (value as u32).to_le_bytes().to_vec(),
            (_, true) => (value as u64).to_le_bytes().to_vec(),
        }
    }

    /// Sizes and data, as text or bytes.
    fn encode(self, values: impl Iterator<Item = f32>) -> Vec<u8> {
        if self.format == "ascii" {
            return array(values, false, Text);
        }
        let plain = array(values, false, self.order);
        let text = |bytes: &[u8]| {
            if self.format == "appended" && self.encoding == "raw" {
                bytes.to_vec()
            } else {
                base64(bytes).into_bytes()
            }
        };
        let Some((_, compress)) = self.compressor else {
            return text(&[self.size(plain.len()), plain].concat());
        };
        const BLOCK: usize = 100;
        let blocks: Vec<Vec<u8>> = plain.chunks(BLOCK).map(compress).collect();
        let mut sizes = [self.size(blocks.len()), self.size(BLOCK), self.size(plain.len() % BLOCK)].concat();
        blocks.iter().for_each(|block| sizes.extend(self.size(block.len())));
        [text(&sizes), text(&blocks.concat())].concat()
    }

    fn write(self, kind: &str) -> Vec<u8> {
        let order = if self.order == Big { "BigEndian" } else { "LittleEndian" };
        let header = if self.has_long_sizes { " header_type=\"UInt64\"" } else { "" };
        let compressor = self.compressor.map_or(String::new(), |(name, _)| format!(" compressor=\"{name}\""));
        let mut out = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"{order}\"{header}{compressor}>\n<{kind}>\n\
             <FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" format=\"ascii\">1.5</DataArray></FieldData>\n"
        )
        .into_bytes();
        let mut appended = Vec::new();
        let mut array = |out: &mut Vec<u8>, name: &str, components: usize, values: Vec<f32>| {
            let data = self.encode(values.into_iter());
            let format = self.format;
            let open = format!(
                "<DataArray type=\"Float32\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"{format}\""
            );
            out.extend_from_slice(open.as_bytes());
            if format == "appended" {
                out.extend_from_slice(format!(" offset=\"{}\"/>\n", appended.len()).as_bytes());
                appended.extend_from_slice(&data);
            } else {
                out.extend_from_slice(b">\n");
                out.extend_from_slice(&data);
                out.extend_from_slice(b"\n</DataArray>\n");
            }
        };
        for piece in [0..0, 0..COUNT / 4, COUNT / 4..COUNT] {
            out.extend_from_slice(
                format!("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"0\">\n<PointData>\n", piece.len()).as_bytes(),
            );
            array(&mut out, "velocity", 3, piece.clone().flat_map(velocity).collect());
            array(&mut out, "density", 1, piece.clone().map(density).collect());
            out.extend_from_slice(b"</PointData>\n<CellData/>\n<Points>\n");
            array(&mut out, "Points", 3, piece.clone().flat_map(position).collect());
            out.extend_from_slice(b"</Points>\n<Cells></Cells>\n</Piece>\n");
        }
        out.extend_from_slice(format!("</{kind}>\n").as_bytes());
        if self.format == "appended" {
            out.extend_from_slice(format!("<AppendedData encoding=\"{}\">\n _", self.encoding).as_bytes());
            out.extend_from_slice(&appended);
            out.extend_from_slice(b"\n</AppendedData>\n");
        }
        out.extend_from_slice(b"</VTKFile>\n");
        out
    }
}

fn csv(header: &str, separator: &str, has_attributes: bool) -> Vec<u8> {
    let mut out = String::from(header);
    for i in 0..COUNT {
        let values: Vec<String> =
            row(i).iter().take(if has_attributes { 7 } else { 3 }).map(|v| v.to_string()).collect();
        out.push_str(&values.join(separator));
        out.push_str(if i % 2 == 0 { "\n" } else { "\r\n" });
    }
    out.into_bytes()
}

/// Every format and variant.
pub fn all() -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut add = |name, has_attributes, bytes| samples.push(Sample { name, bytes, has_attributes });
    add("raw.xyz", false, (0..COUNT).flat_map(|i| array(position(i).into_iter(), false, Little)).collect());
    add("raw.f64", false, (0..COUNT).flat_map(|i| array(position(i).into_iter(), true, Little)).collect());
    add("c3.npy", false, npy("<f4", false, 3, Little));
    add("c3_double.npy", false, npy("<f8", false, 3, Little));
    add("c3_big.npy", false, npy(">f4", false, 3, Big));
    add("c7.npy", true, npy("<f4", false, 7, Little));
    add("c7_fortran.npy", true, npy("<f8", true, 7, Little));
    add("c7_big_fortran.npy", true, npy(">f4", true, 7, Big));
    add("little.ply", true, ply(Little, false, false));
    add("big.ply", true, ply(Big, true, false));
    add("ascii.ply", true, ply(Text, false, false));
    add("little_lists.ply", true, ply(Little, true, true));
    add("big_lists.ply", true, ply(Big, false, true));
    add("ascii_lists.ply", true, ply(Text, true, true));
    let plain = bgeo([0; 6], b"\0\xff");
    add("plain.bgeo", true, plain.clone());
    add("packed.bgeo", true, gzip(&plain));
    // Groups, a polygon and a name for the whole follow the points, as Houdini writes them.
    let tail = b"\0\x05water\0\0\0\0\x28\0\x04name\0\x01\0\0\0\x04\0\0\0\x01\0\x03dam\0\0\0\0\0\xff";
    add("groups.bgeo", true, bgeo([1, 1, 0, 0, 0, 1], tail));
    for (is_new, binary, ascii) in [(false, "old.vtk", "old_ascii.vtk"), (true, "new.vtk", "new_ascii.vtk")] {
        add(binary, true, vtk(Big, is_new, "POLYDATA"));
        add(ascii, true, vtk(Text, is_new, "UNSTRUCTURED_GRID"));
    }
    let vtu = |order, format, encoding, compressor, has_long_sizes| {
        Vtu { order, format, encoding, compressor, has_long_sizes }.write("UnstructuredGrid")
    };
    add("ascii.vtu", true, vtu(Little, "ascii", "", None, false));
    add("inline.vtu", true, vtu(Little, "binary", "", None, true));
    add("inline_big.vtu", true, vtu(Big, "binary", "", None, false));
    add("inline_zlib.vtu", true, vtu(Little, "binary", "", ZLIB, false));
    add("inline_zlib_big.vtu", true, vtu(Big, "binary", "", ZLIB, true));
    add("raw.vtu", true, vtu(Little, "appended", "raw", None, true));
    add("raw_zlib_big.vtu", true, vtu(Big, "appended", "raw", ZLIB, false));
    add("base64.vtu", true, vtu(Little, "appended", "base64", None, false));
    add("base64_zlib.vtu", true, vtu(Little, "appended", "base64", ZLIB, true));
    add("inline_lz4.vtu", true, vtu(Little, "binary", "", LZ4, true));
    add("raw_lz4_big.vtu", true, vtu(Big, "appended", "raw", LZ4, false));
    add("inline_lzma.vtu", true, vtu(Little, "binary", "", LZMA, false));
    add("raw_lzma.vtu", true, vtu(Little, "appended", "raw", LZMA, true));
    let poly = Vtu { order: Little, format: "appended", encoding: "raw", compressor: ZLIB, has_long_sizes: false };
    add("raw_zlib.vtp", true, poly.write("PolyData"));
    if cfg!(feature = "hdf5") {
        add("snapshot.hdf5", true, include_bytes!("../samples/snapshot.hdf5").to_vec());
        add("steps.vtkhdf", true, include_bytes!("../samples/steps.vtkhdf").to_vec());
    }
    add("comma.csv", true, csv("X,Y,Z,vx,vy,vz,density\n", ",", true));
    add("semicolon.csv", true, csv("\u{feff}\"x\";\"y\";\"z\";vel_x;vel_y;vel_z;density\n", ";", true));
    add("tab.csv", true, csv("# by a program\n\n# x\ty\tz\tvx\tvy\tvz\tdensity\n", "\t", true));
    add("space.txt", false, csv("", "   ", false));
    add("plain.csv", false, csv("", ", ", false));
    samples.extend(text_samples::text());
    samples.extend(array_samples::arrays());
    samples
}

/// A mesh of 30 points in VTK's XML: 20 polygons and a strip of 8 triangles, or 26 triangles of a grid in two pieces.
pub fn mesh_xml(is_grid: bool) -> Vec<u8> {
    let numbers = |values: &mut dyn Iterator<Item = usize>| values.map(|v| format!("{v} ")).collect::<String>();
    let list = |name: &str, values: &mut dyn Iterator<Item = usize>| {
        format!("<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{}</DataArray>", numbers(values))
    };
    let points = |count: usize| {
        let values: String = (0..count).map(|i| format!("{i} 0.5 -1 ")).collect();
        format!("<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">{values}</DataArray></Points>")
    };
    let corners = |triangles: usize| (0..triangles).flat_map(|i| [i, i + 1, i + 2]);
    let cells = |triangles: usize| {
        list("connectivity", &mut corners(triangles)) + &list("offsets", &mut (1..=triangles).map(|i| 3 * i))
    };
    let (kind, pieces) = if is_grid {
        let piece = |triangles: usize| {
            let types = list("types", &mut std::iter::repeat_n(5, triangles));
            let (points, cells) = (points(15), cells(triangles));
            format!(
                "<Piece NumberOfPoints=\"15\" NumberOfCells=\"{triangles}\">{points}<Cells>{cells}{types}</Cells></Piece>"
            )
        };
        ("UnstructuredGrid", piece(13) + &piece(13))
    } else {
        let strip = list("connectivity", &mut (0..10)) + &list("offsets", &mut std::iter::once(10));
        let (points, cells) = (points(30), cells(20));
        let piece = format!(
            "<Piece NumberOfPoints=\"30\" NumberOfPolys=\"20\" NumberOfStrips=\"1\">{points}<Polys>{cells}</Polys>\
             <Strips>{strip}</Strips></Piece>"
        );
        ("PolyData", piece)
    };
    format!("<VTKFile type=\"{kind}\"><{kind}>{pieces}</{kind}></VTKFile>").into_bytes()
}
