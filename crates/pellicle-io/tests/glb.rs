//! Binary glTF as others write it: strips, fans, small and quantized integers, strides, trees of nodes.

mod common;

use common::Folder;
use pellicle_io::read_mesh;

/// A file of this JSON and this binary chunk.
fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let json = json.to_owned() + &" ".repeat(json.len().next_multiple_of(4) - json.len());
    let binary = [binary, &[0; 3][..binary.len().next_multiple_of(4) - binary.len()]].concat();
    let chunk = |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes(), kind, data].concat();
    let body = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &binary)].concat();
    [b"glTF".as_slice(), &2u32.to_le_bytes(), &(12 + body.len() as u32).to_le_bytes(), &body].concat()
}

/// A scene of one node with one primitive over the square 0..1, whose four corners come in the order of a strip. Positions
/// are interleaved with 4 bytes each; indices 0 1 2 3 follow as u8, u16 and u32.
fn square(primitive: &str, node: &str) -> Vec<u8> {
    let mut binary = Vec::new();
    for (i, corner) in [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]].iter().enumerate() {
        corner.iter().for_each(|v| binary.extend_from_slice(&v.to_le_bytes()));
        binary.extend_from_slice(&[i as u8 * 85, 255, 0, 255]);
    }
    // At byte 64, 68 and 76.
    binary.extend_from_slice(&[0, 1, 2, 3]);
    (0..4u16).for_each(|i| binary.extend_from_slice(&i.to_le_bytes()));
    (0..4u32).for_each(|i| binary.extend_from_slice(&i.to_le_bytes()));
    // At byte 92: positions as i8, normalized, 4 bytes apart; the last without its padding.
    binary.extend_from_slice(&[0, 0, 0, 9, 127, 0, 0, 9, 0, 127, 0, 9, 127, 129, 0]);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{node}],"meshes":[{{"primitives":[{{{primitive}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5121,"count":4,"type":"SCALAR"}},{{"bufferView":2,"componentType":5123,"count":4,"type":"SCALAR"}},
        {{"bufferView":3,"componentType":5125,"count":4,"type":"SCALAR"}},
        {{"bufferView":4,"componentType":5120,"normalized":true,"count":4,"type":"VEC3"}},
        {{"bufferView":0,"byteOffset":12,"componentType":5121,"normalized":true,"count":4,"type":"VEC4"}}],
        "bufferViews":[{{"buffer":0,"byteLength":64,"byteStride":16}},{{"buffer":0,"byteOffset":64,"byteLength":4}},
        {{"buffer":0,"byteOffset":68,"byteLength":8}},{{"buffer":0,"byteOffset":76,"byteLength":16}},
        {{"buffer":0,"byteOffset":92,"byteLength":15,"byteStride":4}}],"buffers":[{{"byteLength":108}}]}}"#
    );
    glb(&json, &binary)
}

#[test]
fn strips_fans_and_every_type_of_index_are_read() {
    let folder = Folder::new();
    let cases: [(&str, &[[u32; 3]]); 6] = [
        (r#""attributes":{"POSITION":0},"indices":1,"mode":5"#, &[[0, 1, 2], [1, 3, 2]]),
        (r#""attributes":{"POSITION":0},"indices":2,"mode":5"#, &[[0, 1, 2], [1, 3, 2]]),
        (r#""attributes":{"POSITION":0},"indices":3,"mode":6"#, &[[0, 1, 2], [0, 2, 3]]),
        (r#""attributes":{"POSITION":0}"#, &[[0, 1, 2]]),
        (r#""attributes":{"POSITION":0},"mode":0"#, &[]),
        (r#""attributes":{"POSITION":4},"mode":5"#, &[[0, 1, 2], [1, 3, 2]]),
    ];
    for (primitive, triangles) in cases {
        let path = folder.write("a.glb", square(primitive, r#"{"mesh":0}"#));
        let mesh = read_mesh(&path).unwrap_or_else(|error| panic!("{primitive}: {error}"));
        assert_eq!(mesh.triangles, triangles, "{primitive}");
        assert_eq!(mesh.vertices.len(), 4, "{primitive}");
        let far = if primitive.contains("\"POSITION\":4") { [1., -1., 0.] } else { [1., 1., 0.] };
        assert_eq!(mesh.vertices[3], far, "{primitive}");
    }
}

#[test]
fn normalized_colours_are_read_between_the_positions() {
    let folder = Folder::new();
    let path = folder.write("a.glb", square(r#""attributes":{"POSITION":0,"COLOR_0":5},"mode":5"#, r#"{"mesh":0}"#));
    let mesh = read_mesh(&path).expect("colours");
    assert_eq!((mesh.attributes[0].name.as_str(), mesh.attributes[0].components), ("color", 4));
    assert_eq!(mesh.attributes[0].values[4..8], [85.0 / 255.0, 1.0, 0.0, 1.0]);
}

#[test]
fn nodes_move_turn_and_mirror() {
    let folder = Folder::new();
    let strip = r#""attributes":{"POSITION":0},"mode":5"#;
    let turned =
        r#"{"children":[1],"translation":[10,0,0]},{"mesh":0,"rotation":[0,0,0.70710678,0.70710678],"scale":[2,2,2]}"#;
    let mesh = read_mesh(&folder.write("a.glb", square(strip, turned))).expect("turned");
    let [x, y, z] = mesh.position(3);
    assert!((x - 8.0).abs() < 1e-6 && (y - 2.0).abs() < 1e-6 && z == 0.0, "{x} {y} {z}");
    let mirrored = r#"{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]}"#;
    let mesh = read_mesh(&folder.write("b.glb", square(strip, mirrored))).expect("mirrored");
    assert_eq!(mesh.position(1), [4.0, 0.0, 0.0]);
    assert_eq!(mesh.triangles[0], [0, 2, 1], "a mirror turns triangles inside out, so they are turned back");
    let twice = r#"{"children":[1,1]},{"mesh":0}"#;
    assert!(read_mesh(&folder.write("c.glb", square(strip, twice))).is_err());
}

#[test]
fn compression_is_refused_by_name() {
    let folder = Folder::new();
    let draco = r#""attributes":{"POSITION":0},"extensions":{"KHR_draco_mesh_compression":{"bufferView":0}}"#;
    let message = read_mesh(&folder.write("a.glb", square(draco, r#"{"mesh":0}"#))).expect_err("draco").to_string();
    assert!(message.contains("KHR_draco_mesh_compression"), "{message}");
    let required = r#"{"asset":{"version":"2.0"},"extensionsRequired":["EXT_meshopt_compression"]}"#;
    let message = read_mesh(&folder.write("b.glb", glb(required, &[]))).expect_err("meshopt").to_string();
    assert!(message.contains("EXT_meshopt_compression"), "{message}");
    let old = [b"glTF".as_slice(), &1u32.to_le_bytes(), &[0; 12]].concat();
    assert!(read_mesh(&folder.write("c.glb", old)).expect_err("old").to_string().contains("version 1"));
}
