//! Meshes out and in again; streamed and failing output.

mod common;

use std::fs;

use common::Folder;
use pellicle::{Mesh, VertexAttribute};
use pellicle_io::{Error, PlyFile, PlyLayout, WriteOptions, check_writable, read_mesh, write_mesh};

/// A strip of triangles with normals and attributes, long enough for several chunks and tasks.
fn strip(count: u32, has_normals: bool, has_attributes: bool, origin: [f64; 3]) -> Mesh {
    let vertices: Vec<[f32; 3]> = (0..count).map(|i| [i as f32 * 0.5, (i % 2) as f32, -(i as f32)]).collect();
    let normals = (0..count).map(|i| [0.0, (i % 3) as f32, 1.0]).collect();
    let attribute = |name: &str, components: usize| {
        VertexAttribute::new(name, components, (0..count as usize * components).map(|i| i as f32 - 0.25).collect())
    };
    Mesh {
        origin,
        normals: if has_normals { normals } else { Vec::new() },
        triangles: (2..count).map(|i| [i - 2, i - 1, i]).collect(),
        attributes: if has_attributes {
            vec![attribute("velocity", 3), attribute("density", 1), attribute("strain", 6)]
        } else {
            Vec::new()
        },
        vertices,
    }
}

fn options() -> WriteOptions {
    WriteOptions { comments: vec!["pellicle mesh\nradius 0.025".into(), "cell 0.5".into()], ..WriteOptions::default() }
}

#[test]
fn meshes_come_back_as_they_were_written() {
    let folder = Folder::new();
    for (has_normals, has_attributes) in [(false, false), (true, false), (false, true), (true, true)] {
        let mesh = strip(40_000, has_normals, has_attributes, [0.0; 3]);
        for name in ["a.ply", "a.obj", "a.vtk", "a.glb"] {
            let path = folder.join(name);
            let written = write_mesh(&path, &mesh, &options()).expect(name);
            let lost =
                if name == "a.obj" { mesh.attributes.iter().map(|a| a.name.clone()).collect() } else { Vec::new() };
            assert_eq!(written.left_out, lost, "{name}");
            let found = read_mesh(&path).expect(name);
            assert!(found.vertices == mesh.vertices && found.triangles == mesh.triangles, "{name}");
            assert_eq!(found.normals, mesh.normals, "{name}");
            if name != "a.obj" {
                // Names come sorted from glTF.
                for attribute in &mesh.attributes {
                    assert!(found.attributes.contains(attribute), "{name}: {}", attribute.name);
                }
                assert_eq!(found.attributes.len(), mesh.attributes.len(), "{name}");
            }
            let head = fs::read(&path).expect(name);
            let head = String::from_utf8_lossy(&head[..head.len().min(4000)]).into_owned();
            let said = head.contains("pellicle mesh radius 0.025") || head.contains(r"pellicle mesh\nradius 0.025");
            assert!(said && head.contains("cell 0.5"), "{head}");
        }
    }
    assert_eq!(folder.entries(), 4);
}

#[test]
fn empty_meshes_can_be_written_and_read() {
    let folder = Folder::new();
    for name in ["a.ply", "a.obj", "a.vtk", "a.glb", "a.stl"] {
        let path = folder.join(name);
        write_mesh(&path, &Mesh::default(), &WriteOptions::default()).expect(name);
        assert_eq!(read_mesh(&path).expect(name), Mesh::default(), "{name}");
    }
}

#[test]
fn far_from_the_origin_nothing_collapses() {
    let folder = Folder::new();
    let mesh = strip(100, false, false, [5.0e7, -3.0e7, 0.0]);
    for name in ["a.ply", "a.obj", "a.vtk", "a.glb"] {
        let path = folder.join(name);
        write_mesh(&path, &mesh, &WriteOptions::default()).expect(name);
        let found = read_mesh(&path).expect(name);
        for i in 0..mesh.vertices.len() {
            assert_eq!(found.position(i), mesh.position(i), "{name}");
        }
    }
}

#[test]
fn ranges_written_out_of_order_by_several_threads_give_the_same_bytes() {
    let folder = Folder::new();
    for (case, origin) in [(0, [0.0; 3]), (1, [1.0e6, 0.0, 2.0])] {
        for (has_normals, has_attributes) in [(false, false), (true, true)] {
            let mesh = strip(20_011, has_normals, has_attributes, origin);
            let (whole, pieces) = (folder.join("whole.ply"), folder.join("pieces.ply"));
            write_mesh(&whole, &mesh, &options()).expect("written");
            let layout = PlyLayout {
                quad_count: 0,
                vertex_count: mesh.vertices.len() as u64,
                triangle_count: mesh.triangles.len() as u64,
                normals: has_normals,
                attributes: mesh.attributes.iter().map(|a| (a.name.clone(), a.components)).collect(),
                double: case == 1,
                origin,
                comments: options().comments,
            };
            let file = PlyFile::create(&pieces, &layout).expect("created");
            std::thread::scope(|scope| {
                for thread in 0..3 {
                    let (file, mesh) = (&file, &mesh);
                    scope.spawn(move || write_every_third(file, mesh, thread));
                }
            });
            assert!(!pieces.exists());
            file.finish().expect("complete");
            assert!(fs::read(&whole).expect("it is there") == fs::read(&pieces).expect("it is there"));
            fs::remove_file(&pieces).expect("it is there");
        }
    }
}

/// Writes every third range of 1000, last first.
fn write_every_third(file: &PlyFile, mesh: &Mesh, thread: usize) {
    let mut buffer = Vec::new();
    for first in (0..mesh.vertices.len()).step_by(1000).skip(thread).step_by(3).collect::<Vec<_>>().into_iter().rev() {
        let range = first..mesh.vertices.len().min(first + 1000);
        let normals = mesh.normals.get(range.clone()).unwrap_or_default();
        let values: Vec<&[f32]> =
            mesh.attributes.iter().map(|a| &a.values[range.start * a.components..range.end * a.components]).collect();
        file.write_vertices(first as u64, &mesh.vertices[range], normals, &values, &mut buffer).expect("in range");
    }
    for first in (0..mesh.triangles.len()).step_by(1000).skip(thread).step_by(3) {
        let range = first..mesh.triangles.len().min(first + 1000);
        file.write_triangles(first as u64, &mesh.triangles[range], &mut buffer).expect("in range");
    }
}

#[test]
fn a_file_with_a_hole_is_not_finished() {
    let folder = Folder::new();
    let path = folder.join("a.ply");
    let layout = PlyLayout { vertex_count: 3, triangle_count: 1, ..PlyLayout::default() };
    let file = PlyFile::create(&path, &layout).expect("created");
    file.write_vertices(0, &[[0.0; 3]; 3], &[], &[], &mut Vec::new()).expect("in range");
    assert!(file.write_vertices(1, &[[0.0; 3]; 3], &[], &[], &mut Vec::new()).is_err());
    assert!(file.write_vertices(0, &[[0.0; 3]], &[[0.0; 3]], &[], &mut Vec::new()).is_err());
    assert!(file.write_triangles(u64::MAX, &[[0, 1, 2]], &mut Vec::new()).is_err());
    assert!(matches!(file.finish(), Err(Error::Length { .. })));
    assert_eq!(folder.entries(), 0);
}

#[test]
fn output_that_cannot_be_written_is_told_and_leaves_nothing() {
    let folder = Folder::new();
    let mesh = strip(10, false, false, [0.0; 3]);
    let missing = folder.join("none/a.ply");
    for result in [write_mesh(&missing, &mesh, &options()).map(drop), check_writable(&missing)] {
        let message = result.expect_err("there is no folder").to_string();
        assert!(message.contains("none does not exist"), "{message}");
    }
    let message = write_mesh(&folder.join("a.doc"), &mesh, &options()).expect_err("no such format").to_string();
    assert!(message.contains(".ply") && message.contains(".obj"), "{message}");
    let mut wrong = mesh.clone();
    wrong.normals = vec![[0.0; 3]; 3];
    assert!(matches!(write_mesh(&folder.join("a.ply"), &wrong, &options()), Err(Error::Length { .. })));
    assert_eq!(folder.entries(), 0);
    // What was there before stays.
    let path = folder.write("old.ply", b"old");
    assert!(write_mesh(&path, &wrong, &options()).is_err());
    assert_eq!(fs::read(&path).expect("it is there"), b"old");
}

#[cfg(unix)]
#[test]
fn a_link_is_followed_and_stays_a_link() {
    let folder = Folder::new();
    let (target, link) = (folder.write("target.ply", b"old"), folder.join("link.ply"));
    std::os::unix::fs::symlink(&target, &link).expect("a link");
    write_mesh(&link, &strip(3, false, false, [0.0; 3]), &options()).expect("written");
    assert!(fs::symlink_metadata(&link).expect("it is there").is_symlink());
    assert_eq!(read_mesh(&target).expect("a mesh").vertices.len(), 3);
}

#[test]
fn foreign_meshes_are_read() {
    let folder = Folder::new();
    let ply = "ply\nformat ascii 1.0\nelement face 2\nproperty uchar red\nproperty list uchar uint vertex_index\n\
               element vertex 4\nproperty double x\nproperty double y\nproperty double z\nend_header\n\
               7 4 0 1 2 3\n7 3 0 2 3\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let obj = "# a comment\nmtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
               usemtl m\ns off\nf 1/1/1 2/1/1 3/1/1 4/1/1 # quad\nf -4//1 -2//1 -1//1\n";
    let vtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 1 1 0 0 1 0\n\
               CELLS 3 11\n4 0 1 2 3\n3 0 2 3\n1 0\nCELL_TYPES 3\n9 5 1\n";
    for (name, text) in [("a.ply", ply), ("a.obj", obj), ("a.vtk", vtk)] {
        let mesh = read_mesh(&folder.write(name, text)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(mesh.vertices, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]], "{name}");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]], "{name}");
        assert!(mesh.normals.is_empty(), "{name}");
    }
}

#[test]
fn wrong_faces_are_told() {
    let folder = Folder::new();
    let cases = [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "in line 4 refers to vertex 4, but there are 3"),
        ("b.obj", "v 0 0 0\nf 1 2\n", "in line 2: a face has 2 corners"),
        ("c.obj", "v 0 0\n", "in line 1: three numbers"),
        ("d.obj", "\u{1}\u{2}\n", "in line 1"),
        ("e.obj", "v 0 0 0\nf -2 1 1\n", "in line 2"),
        (
            "a.vtk",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\nPOLYGONS 1 4\n3 0 0 1\n",
            "vertex 1, but there are 1",
        ),
        (
            "b.vtk",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\nCELLS 1 5\n4 0 0 0 0\nCELL_TYPES 1\n10\n",
            "1 tetrahedra (type 10)",
        ),
    ];
    for (name, text, expected) in cases {
        let message = read_mesh(&folder.write(name, text)).expect_err(name).to_string();
        assert!(message.contains(expected), "{message}");
    }
    // A wrong index behind thousands of right ones, where triangles are read many at a time.
    let mut mesh = strip(9000, false, false, [0.0; 3]);
    mesh.triangles[8000] = [1, 2, 9000];
    let path = folder.join("a.ply");
    write_mesh(&path, &mesh, &options()).expect("written");
    assert!(read_mesh(&path).expect_err("a wrong index").to_string().contains("vertex 9000"));
}
