//! Particles and meshes out, and in again: every format, every type of value, nothing lost without a word.

mod common;

use common::{Folder, attribute, positions, read};
use pellicle::{Mesh, VertexAttribute};
use pellicle_io::{
    AttributeValues, Content, Error, Format, ParticleAttribute, Particles, PositionData, ReadOptions, Up, WriteOptions,
    formats, read_content, read_mesh, write_mesh, write_particles, write_pvd,
};

const COUNT: usize = 30_000;

fn single(i: usize) -> f32 {
    (i as f32 - 7.5) * 0.3
}

/// Every type of value, with names that formats translate.
fn particles(is_double: bool) -> Particles {
    let add = |name: &str, components: usize, values: AttributeValues| ParticleAttribute {
        name: name.into(),
        components,
        values,
    };
    let f32s = |n: usize| AttributeValues::F32((0..n).map(single).collect());
    Particles {
        positions: if is_double {
            PositionData::F64((0..COUNT).map(|i| [i as f64 / 3.0, -1e-9, 1e6 + 0.1 * i as f64]).collect())
        } else {
            PositionData::F32((0..COUNT).map(|i| [single(i), -0.0, i as f32]).collect())
        },
        attributes: vec![
            add("velocity", 3, f32s(3 * COUNT)),
            add("radius", 1, f32s(COUNT)),
            add("strain", 6, f32s(6 * COUNT)),
            add("temperature", 1, AttributeValues::F64((0..COUNT).map(|i| i as f64 / 7.0).collect())),
            add("material", 1, AttributeValues::I32((0..COUNT).map(|i| -(i as i32)).collect())),
            add("id", 1, AttributeValues::I64((0..COUNT).map(|i| i as i64).collect())),
            add("hash", 1, AttributeValues::I64((0..COUNT).map(|i| (1 << 60) + i as i64).collect())),
        ],
    }
}

fn options() -> WriteOptions {
    WriteOptions { comments: vec!["made -- by\na test".into(), "x".into()], ..WriteOptions::default() }
}

/// The numbers of an attribute, whatever their type.
fn numbers(attribute: &ParticleAttribute) -> Vec<f64> {
    match &attribute.values {
        AttributeValues::F32(v) => v.iter().map(|&x| x.into()).collect(),
        AttributeValues::F64(v) => v.clone(),
        AttributeValues::I32(v) => v.iter().map(|&x| x.into()).collect(),
        AttributeValues::I64(v) => v.iter().map(|&x| x as f64).collect(),
    }
}

/// What a format does: its name, whether it has double precision, what it leaves out.
const BINARY: [(&str, bool, &[&str]); 6] = [
    ("a.ply", true, &["hash"]),
    ("a.bgeo", false, &["hash"]),
    ("a.bgeo.gz", false, &["hash"]),
    ("a.vtk", true, &[]),
    ("a.vtu", true, &[]),
    ("a.vtp", true, &[]),
];

#[test]
fn particles_come_back_bit_by_bit_from_binary_formats() {
    let folder = Folder::new();
    for (name, has_double, lost) in BINARY {
        for is_double in [false, true] {
            let particles = particles(is_double);
            let path = folder.join(name);
            let written = write_particles(&path, &particles, &options()).expect(name);
            assert_eq!(written.left_out, lost, "{name}");
            let narrowed: &[&str] = match (has_double, is_double) {
                (true, _) => &[],
                (false, true) => &["position", "temperature"],
                (false, false) => &["temperature"],
            };
            assert_eq!(written.narrowed, narrowed, "{name}");
            let found = read(&path).expect(name);
            if has_double || !is_double {
                assert_eq!(found.positions, particles.positions, "{name}");
            }
            assert_eq!(found.attributes.len(), particles.attributes.len() - lost.len(), "{name}");
            for expected in particles.attributes.iter().filter(|a| !lost.contains(&a.name.as_str())) {
                let found = attribute(&found, &expected.name);
                if has_double || !matches!(expected.values, AttributeValues::F64(_)) {
                    assert_eq!(numbers(found), numbers(expected), "{name}: {}", expected.name);
                } else {
                    assert_eq!(found.to_f32(), expected.to_f32(), "{name}: {}", expected.name);
                }
                if name.starts_with("a.v") {
                    assert_eq!(found, expected, "{name}: types stay");
                }
            }
        }
    }
}

#[test]
fn csv_has_digits_enough_for_every_value() {
    let folder = Folder::new();
    for name in ["a.csv", "a.tsv", "a.txt"] {
        for is_double in [false, true] {
            let particles = particles(is_double);
            let written = write_particles(&folder.join(name), &particles, &options()).expect(name);
            assert_eq!(written, Default::default());
            let found = read(&folder.join(name)).expect(name);
            match &particles.positions {
                PositionData::F64(_) => assert_eq!(positions(&found), positions(&particles), "{name}"),
                PositionData::F32(expected) => {
                    let single = |p: &[f64; 3]| p.map(|x| x as f32);
                    assert_eq!(positions(&found).iter().map(single).collect::<Vec<_>>(), *expected, "{name}");
                }
            }
            for expected in &particles.attributes {
                assert_eq!(attribute(&found, &expected.name).to_f32(), expected.to_f32(), "{name}: {}", expected.name);
            }
        }
    }
}

#[test]
fn formats_of_positions_alone_say_what_they_leave_out() {
    let folder = Folder::new();
    let (single, double) = (particles(false), particles(true));
    for (name, particles, bytes) in [
        ("a.xyz", &single, 12),
        ("b.xyz", &double, 12),
        ("a.f64", &single, 24),
        ("b.f64", &double, 24),
        ("a.npy", &double, 24),
    ] {
        let written = write_particles(&folder.join(name), particles, &options()).expect(name);
        assert_eq!(written.left_out.len(), 7, "{name}");
        assert_eq!(written.narrowed, if name == "b.xyz" { vec!["position"] } else { Vec::new() }, "{name}");
        let found = std::fs::read(folder.join(name)).expect(name);
        let data = &found[found.len() - bytes * COUNT..];
        assert!(found.len() - data.len() == if name == "a.npy" { 128 } else { 0 }, "{name}");
        let expected = positions(particles);
        let last = expected[COUNT - 1][2];
        let tail = &data[data.len() - bytes / 3..];
        match <[u8; 8]>::try_from(tail) {
            Ok(tail) => assert_eq!(f64::from_le_bytes(tail), last, "{name}"),
            Err(_) => assert_eq!(tail, (last as f32).to_le_bytes(), "{name}"),
        }
    }
    assert_eq!(read(&folder.join("a.xyz")).expect("raw").positions, single.positions);
    assert_eq!(read(&folder.join("a.npy")).expect("npy").positions, double.positions);
}

#[test]
fn no_particles_are_a_valid_file_in_every_format() {
    let folder = Folder::new();
    let mut none = particles(false);
    none.positions = PositionData::F32(Vec::new());
    none.attributes.iter_mut().for_each(|a| a.values = AttributeValues::F32(Vec::new()));
    for format in formats() {
        let path = folder.join(&format!("none.{}", format.extensions[0]));
        if format.writes_particles {
            write_particles(&path, &none, &WriteOptions::default()).expect(format.name);
            if format.reads_particles {
                assert_eq!(read(&path).expect(format.name).positions.len(), 0, "{}", format.name);
            }
        }
        if format.writes_meshes {
            write_mesh(&path, &Mesh::default(), &options()).expect(format.name);
            assert!(std::fs::metadata(&path).expect(format.name).len() > 0 || format.format == Format::Obj);
            if format.reads_meshes {
                assert_eq!(read_mesh(&path).expect(format.name), Mesh::default(), "{}", format.name);
            }
        }
    }
}

#[test]
fn attributes_of_the_wrong_length_are_refused() {
    let folder = Folder::new();
    let mut wrong = particles(false);
    wrong.attributes[1].values = AttributeValues::F32(vec![0.0; 3]);
    for format in formats().filter(|format| format.writes_particles) {
        let path = folder.join(&format!("a.{}", format.extensions[0]));
        let error = write_particles(&path, &wrong, &options()).expect_err(format.name);
        assert!(matches!(error, Error::Length { .. }), "{error}");
    }
    assert_eq!(folder.entries(), 0);
}

#[test]
fn json_refuses_nan_with_the_particle_that_has_it() {
    let folder = Folder::new();
    let mut bad = particles(false);
    if let AttributeValues::F32(values) = &mut bad.attributes[0].values {
        values[7] = f32::NAN;
    }
    let message = write_particles(&folder.join("a.json"), &bad, &options()).expect_err("NaN").to_string();
    assert!(message.contains("velocity of particle 2"), "{message}");
    assert_eq!(folder.entries(), 0);
}

/// A tetrahedron.
fn tetrahedron() -> Mesh {
    Mesh {
        vertices: vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 2.]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..Mesh::default()
    }
}

#[test]
fn stl_comes_back_welded() {
    let folder = Folder::new();
    let mut mesh = tetrahedron();
    mesh.normals = vec![[0.0, 0.0, 1.0]; 4];
    mesh.attributes = vec![VertexAttribute::new("density", 1, vec![1.0; 4])];
    let written = write_mesh(&folder.join("a.stl"), &mesh, &options()).expect("written");
    assert_eq!(written.left_out, ["normal", "density"]);
    let found = read_mesh(&folder.join("a.stl")).expect("stl");
    assert_eq!(found.vertices.len(), 4);
    let corners =
        |mesh: &Mesh| -> Vec<_> { mesh.triangles.iter().map(|t| t.map(|i| mesh.position(i as usize))).collect() };
    assert_eq!(corners(&found), corners(&mesh));
}

#[test]
fn stl_in_text_and_binary_that_begins_like_text_are_read() {
    let folder = Folder::new();
    let text = "solid thing\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   VERTEX 1e0 0 0\n   vertex 0 1 0\n  endloop\n \
                endfacet\nendsolid thing\nsolid other\nfacet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 -0\n\
                endloop\nendfacet\nendsolid\n";
    let mesh = read_mesh(&folder.write("a.stl", text)).expect("text");
    assert_eq!((mesh.vertices.len(), mesh.triangles.as_slice()), (4, &[[0, 1, 2], [1, 3, 2]][..]));
    let mut binary = Vec::from(*b"solid but binary, as some programs write it");
    binary.resize(80, b' ');
    binary.extend_from_slice(&1u32.to_le_bytes());
    binary.extend_from_slice(&[0; 12]);
    [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().for_each(|v| binary.extend_from_slice(&v.to_le_bytes()));
    binary.extend_from_slice(&[0; 2]);
    let mesh = read_mesh(&folder.write("b.stl", &binary)).expect("binary");
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    for (name, text, expected) in [
        ("c.stl", text.replace("endfacet\nendsolid thing", ""), "not complete"),
        ("d.stl", text.replace("1e0", "one"), "in line 5: three numbers"),
        ("e.stl", text[..text.len() - 9].to_owned(), "cut short"),
        ("f.stl", "hello".to_owned(), "no STL file"),
    ] {
        let message = read_mesh(&folder.write(name, text)).expect_err(name).to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn glb_is_in_metres_with_y_up() {
    let folder = Folder::new();
    let mut mesh = tetrahedron();
    mesh.normals = vec![[0.0, 0.0, 1.0]; 4];
    mesh.origin = [10.0, 20.0, 30.0];
    let options = WriteOptions { up: Up::Z, metres_per_unit: 0.5, ..options() };
    let path = folder.join("a.glb");
    write_mesh(&path, &mesh, &options).expect("written");
    let found = read_mesh(&path).expect("glb");
    for i in 0..4 {
        let [x, y, z] = mesh.position(i);
        let (expected, there) = ([0.5 * x, 0.5 * z, -0.5 * y], found.position(i));
        assert!((0..3).all(|axis| (expected[axis] - there[axis]).abs() < 1e-5), "{expected:?} {there:?}");
        assert!((found.normals[i][1] - 1.0).abs() < 1e-6);
    }
    assert_eq!(found.triangles, mesh.triangles);
}

#[test]
fn glb_is_what_the_gltf_crate_expects() {
    let folder = Folder::new();
    let mut mesh = tetrahedron();
    mesh.origin = [1e6, 0.0, -2.5];
    mesh.normals = vec![[0.0, 1.0, 0.0]; 4];
    mesh.attributes = vec![
        VertexAttribute::new("velocity", 3, (0..12).map(|i| i as f32).collect()),
        VertexAttribute::new("color", 4, vec![0.5; 16]),
    ];
    let path = folder.join("a.glb");
    write_mesh(&path, &mesh, &options()).expect("written");
    // The crate validates what it opens.
    let gltf = gltf::Gltf::open(&path).expect("a valid file");
    let blob = gltf.blob.clone().expect("a binary chunk");
    let node = gltf.default_scene().and_then(|scene| scene.nodes().next()).expect("a node");
    assert_eq!(node.transform().decomposed().0, [1e6, 0.0, -2.5]);
    let primitive = node.mesh().and_then(|mesh| mesh.primitives().next()).expect("a primitive");
    assert_eq!(primitive.bounding_box().max, [1.0, 1.0, 2.0]);
    let reader = primitive.reader(|_| Some(&blob));
    assert_eq!(reader.read_positions().expect("positions").collect::<Vec<_>>(), mesh.vertices);
    assert_eq!(reader.read_normals().expect("normals").collect::<Vec<_>>(), mesh.normals);
    let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
    assert_eq!(indices, mesh.triangles.as_flattened());
    assert_eq!(reader.read_colors(0).expect("colours").into_rgba_f32().count(), 4);
    assert!(primitive.get(&gltf::Semantic::Extras("VELOCITY".into())).is_some());
    // An empty scene is valid, too.
    write_mesh(&path, &Mesh::default(), &options()).expect("written");
    assert_eq!(gltf::Gltf::open(&path).expect("a valid file").meshes().count(), 0);
}

#[test]
fn wrong_indices_and_nan_are_refused_where_the_format_cannot_hold_them() {
    let folder = Folder::new();
    let mut wrong = tetrahedron();
    wrong.triangles[1][2] = 9;
    for name in ["a.stl", "a.glb"] {
        let message = write_mesh(&folder.join(name), &wrong, &options()).expect_err(name).to_string();
        assert!(message.contains("triangle 1") && message.contains("there are 4"), "{message}");
    }
    let mut nan = tetrahedron();
    nan.vertices[2][0] = f32::NAN;
    let message = write_mesh(&folder.join("a.glb"), &nan, &options()).expect_err("NaN").to_string();
    assert!(message.contains("vertex 2"), "{message}");
    assert_eq!(folder.entries(), 0);
}

#[test]
fn colours_go_through_obj() {
    let folder = Folder::new();
    let mut mesh = tetrahedron();
    let values = (0..12).map(|i| i as f32 / 12.0).collect();
    mesh.attributes = vec![VertexAttribute::new("color", 3, values)];
    assert_eq!(write_mesh(&folder.join("a.obj"), &mesh, &options()).expect("written"), Default::default());
    assert_eq!(read_mesh(&folder.join("a.obj")).expect("obj"), mesh);
}

#[test]
fn a_file_with_faces_is_a_mesh_and_any_other_holds_particles() {
    let folder = Folder::new();
    let (mesh, all) = (tetrahedron(), common::all());
    for name in ["a.ply", "a.vtk", "a.obj", "a.stl", "a.glb"] {
        write_mesh(&folder.join(name), &mesh, &options()).expect(name);
        let Content::Mesh(found) = read_content(&folder.join(name), &all).expect(name) else {
            panic!("{name}: no mesh")
        };
        assert_eq!(found.triangles.len(), 4, "{name}");
        let wrong = ReadOptions { frame: 1, ..common::all() };
        assert!(read_content(&folder.join(name), &wrong).is_err(), "{name}");
    }
    let particles = particles(false);
    for name in ["b.ply", "b.vtk", "b.vtu", "b.vtp", "b.bgeo", "b.xyz", "b.csv", "b.npy"] {
        write_particles(&folder.join(name), &particles, &options()).expect(name);
        let content = read_content(&folder.join(name), &all).expect(name);
        assert!(matches!(content, Content::Particles(found) if found.positions.len() == COUNT), "{name}");
    }
    let grid = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n\
                CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n";
    assert!(matches!(read_content(&folder.write("c.vtk", grid), &all), Ok(Content::Mesh(_))));
    let named =
        ReadOptions { attributes: pellicle_io::AttributeChoice::Names(vec!["mass".into()]), ..ReadOptions::default() };
    assert!(matches!(read_content(&folder.join("a.ply"), &named), Err(Error::NoAttribute { .. })));
}

#[test]
fn a_pvd_names_files_relative_to_itself() {
    let folder = Folder::new();
    let files = [(0.0, folder.join("a & b.vtp")), (0.5, folder.join("sub/c.vtp")), (1.0, "/elsewhere/d.vtp".into())];
    write_pvd(&folder.join("all.pvd"), &files).expect("written");
    let text = std::fs::read_to_string(folder.join("all.pvd")).expect("text");
    assert!(text.contains("timestep=\"0.5\"") && text.contains("file=\"sub/c.vtp\""), "{text}");
    assert!(text.contains("file=\"a &amp; b.vtp\"") && text.contains("elsewhere/d.vtp\""), "{text}");
    assert!(write_pvd(&folder.join("all.pvd"), &[(f64::NAN, folder.join("a"))]).is_err());
}
