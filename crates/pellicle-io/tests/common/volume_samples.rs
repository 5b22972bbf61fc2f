//! The same small volume in every format and variant that is read: 5 × 4 × 3 samples of which each has a value of its own.

use std::io::Write;

use super::{Order, Order::Big, Order::Little, base64, gzip, lz4, xz, zlib};

pub const DIMS: [usize; 3] = [5, 4, 3];
pub const ORIGIN: [f64; 3] = [10.0, -20.0, 0.5];
pub const SPACING: [f64; 3] = [0.5, 2.0, 1.5];

/// Of a sample; fits into every type.
pub fn value([i, j, k]: [usize; 3]) -> f64 {
    (i + 10 * j + 40 * k) as f64
}

/// A file and how to read it.
pub struct VolumeSample {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Whether the file tells origin and spacing.
    pub has_grid: bool,
    /// The component that holds the values, where there are several.
    pub component: Option<usize>,
    pub frame: usize,
}

/// The places in memory order.
fn nodes(is_x_fastest: bool) -> impl Iterator<Item = [usize; 3]> {
    let [x, y, z] = DIMS;
    (0..x * y * z).map(move |n| match is_x_fastest {
        true => [n % x, n / x % y, n / x / y],
        false => [n / z / y, n / z % y, n % z],
    })
}

/// Bytes of one number.
fn number(value: f64, kind: &str, order: Order) -> Vec<u8> {
    let little = match kind {
        "u1" => vec![value as u8],
        "i1" => vec![value as i8 as u8],
        "i2" => (value as i16).to_le_bytes().to_vec(),
        "i4" => (value as i32).to_le_bytes().to_vec(),
        "i8" => (value as i64).to_le_bytes().to_vec(),
        "f4" => (value as f32).to_le_bytes().to_vec(),
        "f8" => value.to_le_bytes().to_vec(),
        other => panic!("{other}"),
    };
    if order == Big { little.into_iter().rev().collect() } else { little }
}

/// All samples, each as the numbers that `of` makes of it.
fn data<const N: usize>(kind: &str, order: Order, is_x_fastest: bool, of: impl Fn(f64) -> [f64; N]) -> Vec<u8> {
    nodes(is_x_fastest).flat_map(|node| of(value(node))).flat_map(|value| number(value, kind, order)).collect()
}

fn plain(kind: &str, order: Order) -> Vec<u8> {
    data(kind, order, true, |v| [v])
}

fn text() -> String {
    nodes(true).map(|node| format!("{} ", value(node))).collect()
}

fn npy(descr: &str, is_fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let fortran = if is_fortran { "True" } else { "False" };
    let header = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
}

fn npz(is_deflated: bool) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = if is_deflated { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    let members = [
        ("spacing", npy("<f8", false, "(3,)", &[0; 24])),
        ("scan", npy("<i2", false, "(3, 4, 5)", &plain("i2", Little))),
    ];
    for (name, bytes) in members {
        zip.start_file(format!("{name}.npy"), options).expect("in memory");
        zip.write_all(&bytes).expect("in memory");
    }
    zip.finish().expect("in memory").into_inner()
}

/// A VTK XML image: of one piece, or of two that share a layer. `cells` puts the samples into cells.
struct Vti {
    head: &'static str,
    format: &'static str,
    kind: &'static str,
    in_cells: bool,
    /// The data of an array of these values.
    encode: fn(&[f64]) -> Vec<u8>,
    layers: &'static [[usize; 2]],
}

fn vti(of: &Vti) -> Vec<u8> {
    let [x, y, z] = DIMS;
    let more = usize::from(of.in_cells);
    let extent = |[low, high]: [usize; 2]| format!("0 {} 0 {} {} {}", x - 1 + more, y - 1 + more, low, high + more);
    let origin: Vec<f64> = (0..3).map(|a| ORIGIN[a] - if of.in_cells { SPACING[a] / 2.0 } else { 0.0 }).collect();
    let mut out = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" {}>\n<ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"0.5 2 1.5\">\n",
        of.head,
        extent([0, z - 1]),
        origin[0],
        origin[1],
        origin[2]
    )
    .into_bytes();
    let mut appended = Vec::new();
    let section = if of.in_cells { "CellData" } else { "PointData" };
    for &[low, high] in of.layers {
        let values: Vec<f64> = nodes(true).filter(|[_, _, k]| (low..=high).contains(k)).map(value).collect();
        let place = appended.len();
        let encoded = (of.encode)(&values);
        write!(
            out,
            "<Piece Extent=\"{}\"><{section} Scalars=\"rho\"><DataArray type=\"{}\" Name=\"rho\" format=\"{}\" offset=\"{place}\">",
            extent([low, high]),
            of.kind,
            of.format
        )
        .expect("in memory");
        if of.format == "appended" {
            appended.extend(encoded)
        } else {
            out.extend(encoded)
        }
        writeln!(out, "</DataArray></{section}></Piece>").expect("in memory");
    }
    out.extend_from_slice(b"</ImageData>\n");
    if of.format == "appended" {
        let encoding = if of.head.contains("compressor=\"vtkZ") { "base64" } else { "raw" };
        write!(out, "<AppendedData encoding=\"{encoding}\">\n_").expect("in memory");
        out.extend(appended);
        out.extend_from_slice(b"\n</AppendedData>\n");
    }
    out.extend_from_slice(b"</VTKFile>\n");
    out
}

fn numbers(values: &[f64], kind: &str, order: Order) -> Vec<u8> {
    values.iter().flat_map(|&v| number(v, kind, order)).collect()
}

/// One compressed block after its sizes of 32 bits.
fn block(plain: &[u8], packed: &[u8]) -> [Vec<u8>; 2] {
    let sizes = [1, plain.len() as u32, 0, packed.len() as u32];
    [sizes.iter().flat_map(|size| size.to_le_bytes()).collect(), packed.to_vec()]
}

fn vtk(is_binary: bool, in_cells: bool) -> Vec<u8> {
    let [x, y, z] = DIMS.map(|n| n + usize::from(in_cells));
    let origin: Vec<f64> = (0..3).map(|a| ORIGIN[a] - if in_cells { SPACING[a] / 2.0 } else { 0.0 }).collect();
    let (format, owner) =
        (if is_binary { "BINARY" } else { "ASCII" }, if in_cells { "CELL_DATA" } else { "POINT_DATA" });
    let mut out = format!(
        "# vtk DataFile Version 3.0\ntitle\n{format}\nDATASET STRUCTURED_POINTS\nDIMENSIONS {x} {y} {z}\nORIGIN {} {} {}\n\
         SPACING 0.5 2 1.5\n{owner} 60\nSCALARS rho short 1\nLOOKUP_TABLE default\n",
        origin[0], origin[1], origin[2]
    )
    .into_bytes();
    if is_binary {
        out.extend(plain("i2", Big))
    } else {
        out.extend(text().into_bytes())
    }
    out.extend_from_slice(b"\nFIELD more 1\nrest 2 60 unsigned_char\n");
    if is_binary {
        out.extend([0; 120])
    } else {
        out.extend("0 ".repeat(120).into_bytes())
    }
    out
}

fn mhd(more: &str, kind: &str, data: &[u8]) -> Vec<u8> {
    let head = format!(
        "ObjectType = Image\nNDims = 3\n{more}Offset = 10 -20 0.5\nElementSpacing = 0.5 2 1.5\nDimSize = 5 4 3\nElementType = {kind}\n\
         ElementDataFile = LOCAL\n"
    );
    [head.as_bytes(), data].concat()
}

fn nrrd(more: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("NRRD0004\n# a comment\n{more}\ndimension: 3\nsizes: 5 4 3\n\n");
    [head.as_bytes(), data].concat()
}

/// What a NIfTI file lies at.
const SFORM: [[f64; 4]; 3] = [[0.5, 0.0, 0.0, 10.0], [0.0, 2.0, 0.0, -20.0], [0.0, 0.0, 1.5, 0.5]];

fn nifti(is_second: bool, order: Order, frames: i64, kind: (i16, &str), samples: &[u8]) -> Vec<u8> {
    let mut head = vec![0; if is_second { 540 } else { 348 }];
    let mut put = |at: usize, bytes: Vec<u8>| head[at..at + bytes.len()].copy_from_slice(&bytes);
    let real = |v: f64| number(v, if is_second { "f8" } else { "f4" }, order);
    let short = |v: i16| number(v.into(), "i2", order);
    let size = if is_second { 8 } else { 4 };
    let dims = [4, 5, 4, 3, frames, 1, 1, 1];
    put(0, number(if is_second { 540.0 } else { 348.0 }, "i4", order));
    for (i, &n) in dims.iter().enumerate() {
        if is_second { put(16 + 8 * i, number(n as f64, "i8", order)) } else { put(40 + 2 * i, short(n as i16)) }
    }
    let offset = if is_second { 544 } else { 352 };
    for (row, values) in SFORM.iter().enumerate() {
        for (column, &v) in values.iter().enumerate() {
            put(if is_second { 400 } else { 280 } + size * (4 * row + column), real(v));
        }
    }
    let (code, bytes) = kind;
    let bits = short(8 * number(0.0, bytes, order).len() as i16);
    // Twice the value less one, so that the scaling is seen.
    let (slope, intercept) = (real(0.5), real(0.5));
    if is_second {
        put(4, b"n+2\0\r\n\x1a\n".to_vec());
        put(12, short(code));
        put(14, bits);
        put(168, number(f64::from(offset), "i8", order));
        put(176, slope);
        put(184, intercept);
        put(348, number(1.0, "i4", order));
        put(500, number(2.0, "i4", order));
    } else {
        put(344, b"n+1\0".to_vec());
        put(70, short(code));
        put(72, bits);
        put(108, real(f64::from(offset)));
        put(112, slope);
        put(116, intercept);
        put(254, short(1));
        put(123, vec![2]);
    }
    head.resize(offset as usize, 0);
    [head, samples.to_vec()].concat()
}

/// Every sample.
pub fn volumes() -> Vec<VolumeSample> {
    let mut all = Vec::new();
    let mut add = |name, has_grid, bytes| all.push(VolumeSample { name, bytes, has_grid, component: None, frame: 0 });
    let twice = |kind, order| data(kind, order, true, |v| [2.0 * v - 1.0]);
    add("volume.npy", false, npy("<f4", false, "(3, 4, 5)", &plain("f4", Little)));
    add("volume_big.npy", false, npy(">f8", false, "(3, 4, 5)", &plain("f8", Big)));
    add("volume_bytes.npy", false, npy("|u1", false, "(3, 4, 5)", &plain("u1", Little)));
    add("volume_fortran.npy", false, npy("<i4", true, "(3, 4, 5)", &data("i4", Little, false, |v| [v])));
    add("volume.npz", false, npz(false));
    add("volume_deflated.npz", false, npz(true));
    let v1 = "version=\"0.1\" byte_order=\"LittleEndian\"";
    let one: &[[usize; 2]] = &[[0, 2]];
    let ascii: fn(&[f64]) -> Vec<u8> = |v| v.iter().map(|v| format!("{v} ")).collect::<String>().into_bytes();
    let in_text: fn(&[f64]) -> Vec<u8> = |v| {
        let bytes = numbers(v, "f8", Little);
        base64(&[(bytes.len() as u32).to_le_bytes().to_vec(), bytes].concat()).into_bytes()
    };
    let raw: fn(&[f64]) -> Vec<u8> = |v| {
        let bytes = numbers(v, "i2", Big);
        [(bytes.len() as u64).to_be_bytes().to_vec(), bytes].concat()
    };
    let zlibbed: fn(&[f64]) -> Vec<u8> = |v| {
        let bytes = numbers(v, "u1", Little);
        block(&bytes, &zlib(&bytes)).iter().flat_map(|part| base64(part).into_bytes()).collect()
    };
    let lz4ed: fn(&[f64]) -> Vec<u8> = |v| {
        let bytes = numbers(v, "i8", Little);
        block(&bytes, &lz4(&bytes)).concat()
    };
    let xzed: fn(&[f64]) -> Vec<u8> = |v| {
        let bytes = numbers(v, "f4", Little);
        block(&bytes, &xz(&bytes)).concat()
    };
    let v2 = "version=\"1.0\" byte_order=\"BigEndian\" header_type=\"UInt64\"";
    let zip = "version=\"0.1\" byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"";
    let lz = "version=\"0.1\" byte_order=\"LittleEndian\" compressor=\"vtkLZ4DataCompressor\"";
    let lzma = "version=\"0.1\" byte_order=\"LittleEndian\" compressor=\"vtkLZMADataCompressor\"";
    let two: &[[usize; 2]] = &[[0, 1], [1, 2]];
    let apart: &[[usize; 2]] = &[[0, 0], [1, 2]];
    for (name, head, format, kind, in_cells, encode, layers) in [
        ("ascii.vti", v1, "ascii", "Int32", false, ascii, one),
        ("base64.vti", v1, "binary", "Float64", false, in_text, one),
        ("raw.vti", v2, "appended", "Int16", false, raw, one),
        ("zlib.vti", zip, "appended", "UInt8", false, zlibbed, one),
        ("lz4.vti", lz, "appended", "Int64", false, lz4ed, one),
        ("xz.vti", lzma, "appended", "Float32", false, xzed, one),
        ("cells.vti", v1, "ascii", "Float32", true, ascii, one),
        ("pieces.vti", v2, "appended", "Int16", false, raw, two),
        ("cell_pieces.vti", v1, "ascii", "UInt8", true, ascii, apart),
    ] {
        add(name, true, vti(&Vti { head, format, kind, in_cells, encode, layers }));
    }
    add("volume.vtk", true, vtk(true, false));
    add("volume_ascii.vtk", true, vtk(false, false));
    add("volume_cells.vtk", true, vtk(true, true));
    add("little.mhd", true, mhd("", "MET_FLOAT", &plain("f4", Little)));
    add("big.mha", true, mhd("BinaryDataByteOrderMSB = True\n", "MET_SHORT", &plain("i2", Big)));
    add("zlib.mha", true, mhd("CompressedData = True\n", "MET_DOUBLE", &zlib(&plain("f8", Little))));
    add("ascii.mha", true, mhd("BinaryData = False\n", "MET_UCHAR", text().as_bytes()));
    add("long.mha", true, mhd("", "MET_LONG", &plain("i8", Little)));
    let places = "spacings: 0.5 2 1.5\naxis mins: 10 -20 0.5";
    let vectors =
        "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,2,0) (0,0,1.5)\nspace origin: (10,-20,0.5)";
    add("raw.nrrd", true, nrrd(&format!("type: float\nencoding: raw\nendian: little\n{places}"), &plain("f4", Little)));
    let packed = gzip(&plain("i2", Big));
    add("gzip.nrrd", true, nrrd(&format!("type: short\nencoding: gzip\nendian: big\n{vectors}"), &packed));
    add("text.nrrd", true, nrrd(&format!("type: uint8\nencoding: ascii\n{vectors}"), text().as_bytes()));
    add("little.nii", true, nifti(false, Little, 1, (16, "f4"), &twice("f4", Little)));
    add("big.nii.gz", true, gzip(&nifti(false, Big, 1, (4, "i2"), &twice("i2", Big))));
    add("second.nii", true, nifti(true, Little, 1, (64, "f8"), &twice("f8", Little)));
    let mut several = |name, has_grid, bytes, component, frame| {
        all.push(VolumeSample { name, bytes, has_grid, component, frame });
    };
    let vectors = data("f4", Little, true, |v| [0.0, v, 7.0]);
    several("vectors.npy", false, npy("<f4", false, "(3, 4, 5, 3)", &vectors), Some(1), 0);
    let planes = [data("u1", Little, false, |_| [9.0]), data("u1", Little, false, |v| [v])].concat();
    several("vectors_fortran.npy", false, npy("|u1", true, "(3, 4, 5, 2)", &planes), Some(1), 0);
    let rgb = data("u1", Little, true, |v| [0.0, 1.0, v]);
    several("rgb.mha", true, mhd("ElementNumberOfChannels = 3\n", "MET_UCHAR", &rgb), Some(2), 0);
    let steps = [twice("i2", Little).iter().map(|_| 0).collect(), twice("i2", Little)].concat();
    several("steps.nii", true, nifti(false, Little, 2, (4, "i2"), &steps), None, 1);
    all
}
