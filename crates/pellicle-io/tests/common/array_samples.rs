//! The particles of `samples` in files of arrays: NumPy's, JSON, DualSPHysics'.

use std::io::Write;

use super::{Big, COUNT, Little, Order, Sample, array, density, gzip, position, put_int, row, velocity};

/// An NPY file of any type and shape.
fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut out = b"\x93NUMPY\x02\x00".to_vec();
    out.extend_from_slice(&(header.len() as u32).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    out.extend_from_slice(data);
    out
}

fn structured() -> Vec<u8> {
    let descr = "[('name', '<U1'), ('pos', '<f4', (3,)), ('', '|V2'), ('vx', '<f8'), ('vy', '<f8'), ('vz', '<f8'), ('density', '<f4')]";
    let mut data = Vec::new();
    for i in 0..COUNT {
        data.extend_from_slice(b"a\0\0\0");
        data.extend(array(position(i).into_iter(), false, Little));
        data.extend_from_slice(b"??");
        data.extend(array(velocity(i).into_iter(), true, Little));
        data.extend(array([density(i)].into_iter(), false, Little));
    }
    npy(descr, &format!("({COUNT},)"), &data)
}

/// Half precision, which holds these positions exactly.
fn halves() -> Vec<u8> {
    let bits = |value: f32| {
        let bits = value.to_bits();
        let (sign, exponent, fraction) = (bits >> 16 & 0x8000, (bits >> 23 & 0xff) as i32 - 112, bits >> 13 & 0x3ff);
        if value == 0.0 { sign as u16 } else { (sign | (exponent as u32) << 10 | fraction) as u16 }
    };
    let data: Vec<u8> = (0..COUNT).flat_map(position).flat_map(|x| bits(x).to_be_bytes()).collect();
    npy("'>f2'", &format!("({COUNT}, 3)"), &data)
}

fn npz(is_deflated: bool, position_name: &str) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = if is_deflated { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    let shape = format!("({COUNT}, 3)");
    let floats = |values: Vec<f32>| array(values.into_iter(), false, Little);
    let members = [
        ("dt", npy("'<f8'", "()", &0.5f64.to_le_bytes())),
        ("names", npy("'<U1'", &format!("({COUNT},)"), &[0; 4 * COUNT])),
        ("other", npy("'<f4'", "(5, 2)", &[0; 40])),
        ("v", npy("'<f4'", &shape, &floats((0..COUNT).flat_map(velocity).collect()))),
        (position_name, npy("'<f4'", &shape, &floats((0..COUNT).flat_map(position).collect()))),
        ("density", npy("'<f4'", &format!("({COUNT},)"), &floats((0..COUNT).map(density).collect()))),
    ];
    for (name, bytes) in members {
        zip.start_file(format!("{name}.npy"), options).expect("in memory");
        zip.write_all(&bytes).expect("in memory");
    }
    zip.finish().expect("in memory").into_inner()
}

fn text(out: &mut Vec<u8>, text: &str, order: Order) {
    put_int(out, text.len() as i32, order);
    out.extend_from_slice(text.as_bytes());
}

/// Prefixes a definition with its size.
fn define(out: &mut Vec<u8>, definition: &[u8], order: Order) {
    put_int(out, definition.len() as i32, order);
    out.extend_from_slice(definition);
}

fn bi4_item(name: &str, arrays: i32, items: i32, order: Order) -> Vec<u8> {
    let mut values = Vec::new();
    text(&mut values, "\nVALUES", order);
    put_int(&mut values, 1, order);
    text(&mut values, "TimeStep", order);
    put_int(&mut values, 12, order);
    values.extend(array([0.5].into_iter(), true, order));
    let mut definition = Vec::new();
    text(&mut definition, "\nITEM\n", order);
    text(&mut definition, name, order);
    [0, 0].iter().for_each(|&hidden| put_int(&mut definition, hidden, order));
    text(&mut definition, "%.7E", order);
    text(&mut definition, "%.15E", order);
    [arrays, items, values.len() as i32].iter().for_each(|&n| put_int(&mut definition, n, order));
    let mut out = Vec::new();
    define(&mut out, &definition, order);
    out.extend(values);
    out
}

fn bi4_array(name: &str, kind: i32, data: &[u8], is_long: bool, order: Order) -> Vec<u8> {
    let mut definition = Vec::new();
    text(&mut definition, "\nARRAY", order);
    text(&mut definition, name, order);
    put_int(&mut definition, 0, order);
    put_int(&mut definition, kind, order);
    for size in [COUNT, data.len()] {
        match (is_long, order) {
            (false, _) => put_int(&mut definition, size as i32, order),
            (true, Big) => definition.extend_from_slice(&(size as u64).to_be_bytes()),
            (true, _) => definition.extend_from_slice(&(size as u64).to_le_bytes()),
        }
    }
    let mut out = Vec::new();
    define(&mut out, &definition, order);
    out.extend_from_slice(data);
    out
}

fn bi4(order: Order, is_double: bool, is_long: bool) -> Vec<u8> {
    let mut out = b"#FileJBD JPartDataBi4".to_vec();
    out.resize(58, b' ');
    out.extend_from_slice(b"\n\0");
    out.extend_from_slice(&[u8::from(order == Big) + if is_long { 10 } else { 0 }, u8::from(is_long), 0, 0]);
    out.extend(bi4_item("JPartDataBi4", 0, 1, order));
    out.extend(bi4_item("PART_0001", 4, 0, order));
    let mut ids = Vec::new();
    (0..COUNT).for_each(|i| put_int(&mut ids, i as i32, order));
    let (name, kind) = if is_double { ("Posd", 23) } else { ("Pos", 22) };
    let positions = array((0..COUNT).flat_map(position), is_double, order);
    out.extend(bi4_array("Idp", 8, &ids, is_long, order));
    out.extend(bi4_array(name, kind, &positions, is_long, order));
    out.extend(bi4_array("Vel", 22, &array((0..COUNT).flat_map(velocity), false, order), is_long, order));
    out.extend(bi4_array("Rhop", 11, &array((0..COUNT).map(density), false, order), is_long, order));
    out
}

fn json(prefix: &str, suffix: &str, item: impl Fn([f32; 7]) -> String) -> Vec<u8> {
    let items: Vec<String> = (0..COUNT).map(|i| item(row(i))).collect();
    format!("{prefix}[{}]{suffix}\n", items.join(",\n")).into_bytes()
}

fn json_objects() -> Vec<u8> {
    let member = |name: &str, item: fn([f32; 7]) -> String| {
        String::from_utf8(json(&format!("\"{name}\": "), "", item)).expect("it is text")
    };
    let members = [
        "\"comment\": {\"deep\": [[[1], \"]\"]]}".to_owned(),
        member("density", |r| format!("{}", r[6])),
        member("velocity", |r| format!("{}, {}, {}", r[3], r[4], r[5])),
        member("Positions", |r| format!("[{}, {}, {}]", r[0], r[1], r[2])),
    ];
    format!("{{{}}}", members.join(",")).into_bytes()
}

pub fn arrays() -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut add = |name, has_attributes, bytes| samples.push(Sample { name, bytes, has_attributes });
    add("structured.npy", true, structured());
    add("halves.npy", false, halves());
    add("stored.npz", true, npz(false, "positions"));
    add("deflated.npz", true, npz(true, "Pos"));
    add("only.npz", true, npz(false, "x"));
    add("rows.json", false, json("", "", |r| format!("[{}, {}, {}]", r[0], r[1], r[2])));
    add("flat.json", false, json(" ", "", |r| format!("{}, {}, {}", r[0], r[1], r[2])));
    add("seven.json", true, json("", "", |r| format!("{r:?}")));
    let members = |r: [f32; 7]| {
        format!(
            "{{\"name\": \"a\", \"z\": {}, \"vx\": {}, \"vy\": {}, \"vz\": {}, \"x\": {}, \"y\": {}, \"density\": {}}}",
            r[2], r[3], r[4], r[5], r[0], r[1], r[6]
        )
    };
    add("members.json", true, json("\u{feff}", "", members));
    let nested =
        |r: [f32; 7]| format!("{{\"position\": {:?}, \"vel\": {:?}, \"density\": {:e}}}", &r[..3], &r[3..6], r[6]);
    add("nested.json", true, json("{\"particles\": ", "}", nested));
    add("packed.json.gz", true, gzip(&json("", "", nested)));
    add("arrays.json", true, json_objects());
    add("single.bi4", true, bi4(Little, false, false));
    add("double_big.bi4", true, bi4(Big, true, false));
    add("long.bi4", true, bi4(Little, true, true));
    samples
}
