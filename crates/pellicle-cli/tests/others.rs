//! `info`, `check` and `demo`, and a reader that goes away.

mod common;

use std::io::Read;
use std::process::Stdio;

use common::{Folder, cube};

#[test]
fn info_tells_what_particles_there_are_and_what_to_type_next() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(6));
    let run = folder.run(&["info", "frame.xyz"]).expect(0);
    assert!(run.stdout.contains("216 particles"), "{}", run.stdout);
    assert!(run.stdout.contains("pellicle mesh frame.xyz -r 0.5"), "{}", run.stdout);
    let report = folder.run(&["info", "frame.xyz", "--json"]).expect(0).json();
    assert_eq!(report["kind"], "particles");
    assert_eq!(report["particles"], 216);
    assert_eq!(report["box"][1][2], 5.0);
    assert_eq!(report["particle_radius_inferred"], 0.5);
}

#[test]
fn info_tells_types_and_ranges_of_attributes() {
    let folder = Folder::new();
    folder.write("frame.csv", b"x,y,z,vx,vy,vz,mass\n0,0,0,1,2,3,0.5\n1,0,0,-1,2,7,0.25\n");
    let report = folder.run(&["info", "frame.csv", "--json"]).expect(0).json();
    let [velocity, mass] = [0, 1].map(|i| &report["attributes"][i]);
    assert_eq!((velocity["name"].as_str(), velocity["components"].as_u64()), (Some("velocity"), Some(3)));
    assert_eq!(velocity["min"], serde_json::json!([-1.0, 2.0, 3.0]));
    assert_eq!(velocity["max"], serde_json::json!([1.0, 2.0, 7.0]));
    assert_eq!((mass["name"].as_str(), mass["min"][0].as_f64()), (Some("mass"), Some(0.25)));
}

#[test]
fn info_of_bad_particles_warns_and_says_how_to_go_on() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &[[0.0; 3], [1.0, f32::NAN, 0.0], [2.0; 3]]);
    let run = folder.run(&["info", "frame.xyz"]).expect(0);
    assert!(run.stderr.contains("1 particle"), "{}", run.stderr);
    assert!(run.stdout.contains("--drop-invalid"), "{}", run.stdout);
    folder.write_xyz("none.xyz", &[]);
    assert!(folder.run(&["info", "none.xyz"]).expect(0).stdout.contains("0 particles"));
}

#[test]
fn info_tells_a_mesh_from_particles() {
    let folder = Folder::new();
    folder.write("tetrahedron.obj", TETRAHEDRON.as_bytes());
    let report = folder.run(&["info", "tetrahedron.obj", "--json"]).expect(0).json();
    assert_eq!((report["kind"].as_str(), report["triangles"].as_u64()), (Some("mesh"), Some(4)));
    let points = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                  end_header\n0 0 0\n1 0 0\n";
    folder.write("points.ply", points.as_bytes());
    let report = folder.run(&["info", "points.ply", "--json"]).expect(0).json();
    assert_eq!((report["kind"].as_str(), report["particles"].as_u64()), (Some("particles"), Some(2)));
}

#[test]
fn check_tells_the_shapes_of_triangles_and_the_distance_to_another_mesh() {
    let folder = Folder::new();
    folder.write("tetrahedron.obj", TETRAHEDRON.as_bytes());
    folder.write("moved.obj", TETRAHEDRON.replace("v 0 0 1", "v 0 0 2").as_bytes());
    let run = folder.run(&["check", "tetrahedron.obj", "--quality"]).expect(0);
    assert!(run.stdout.contains("radius ratio") && run.stdout.contains("3: 4"), "{}", run.stdout);
    let heads = run.stdout.lines().find(|line| line.contains("median")).unwrap_or_default();
    assert_eq!(heads.split_whitespace().collect::<Vec<_>>().join(" "), "min 1 % 5 % median mean max");
    let report = folder.run(&["check", "tetrahedron.obj", "--reference", "moved.obj", "--json"]).expect(0).json();
    // Three right triangles with two equal sides and an equilateral one.
    assert!((report["quality"]["radius_ratio"]["max"].as_f64().unwrap() - 1.0).abs() < 1e-12);
    assert!((report["quality"]["min_angle"]["min"].as_f64().unwrap() - 45.0).abs() < 1e-5);
    // From (0, 0, 2) the nearest point is (0, 0, 1).
    assert_eq!(report["distance"]["hausdorff"].as_f64(), Some(1.0));
    let report = folder.run(&["check", "tetrahedron.obj", "--json"]).expect(0).json();
    assert!(report["quality"].is_null() && report["distance"].is_null());
}

/// Closed and outward; the last face is left out or turned by the tests.
const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn check_judges_by_words_json_and_exit_code() {
    let folder = Folder::new();
    folder.write("good.obj", TETRAHEDRON.as_bytes());
    let run = folder.run(&["check", "good.obj"]).expect(0);
    assert!(run.stdout.contains("closed, manifold and oriented outward"), "{}", run.stdout);

    folder.write("hole.obj", TETRAHEDRON.replace("f 2 3 4\n", "").as_bytes());
    let run = folder.run(&["check", "hole.obj"]).expect(1);
    assert!(run.stderr.contains("--allow-boundary"), "{}", run.stderr);
    folder.run(&["check", "hole.obj", "--allow-boundary"]).expect(0);
    let report = folder.run(&["check", "hole.obj", "--json"]).expect(1).json();
    assert_eq!((report["passed"].as_bool(), report["boundary_half_edges"].as_u64()), (Some(false), Some(3)));

    folder.write("flipped.obj", TETRAHEDRON.replace("f 2 3 4", "f 2 4 3").as_bytes());
    folder.run(&["check", "flipped.obj", "--allow-boundary"]).expect(1);
    let inward = TETRAHEDRON.replace("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4", "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3");
    folder.write("inward.obj", inward.as_bytes());
    let run = folder.run(&["check", "inward.obj", "-q"]).expect(1);
    assert!(run.stderr.contains("inward") && run.stdout.is_empty(), "{}", run.stderr);
}

#[test]
fn demo_of_a_show_makes_pictures_and_says_what_to_type_next() {
    let folder = Folder::new();
    for show in ["fountain", "blob", "explosion", "monster"] {
        let run = folder.run(&["demo", show, "--frames", "2", "--size", "80x60"]).expect(0);
        assert!(run.stdout.contains("Next:") && run.stdout.contains(&format!("{show}_0001.png")), "{}", run.stdout);
        folder.run(&["demo", show, "--frames", "2", "--size", "80x60", "--output-dir", "d", "-q"]).expect(1);
    }
    assert_eq!(folder.files().len(), 8);
    std::fs::create_dir(folder.path("d")).unwrap();
    folder.run(&["demo", "monster", "--frames", "2", "--size", "80x60", "--output-dir", "d", "-q"]).expect(0);
    let copies = ["monster_0001.png", "d/monster_0001.png"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert!(copies[0] == copies[1], "the show is the same every time");
    let report = folder.run(&["demo", "blob", "--frames", "1", "--size", "80x60", "--json"]).expect(0).json();
    assert!(report["triangles"].as_u64().unwrap() > 10_000, "{report}");
    folder.run(&["demo", "blob", "--frames", "0"]).expect(2);
    folder.run(&["demo", "opera"]).expect(2);
}

#[test]
fn demo_makes_a_closed_surface_and_says_what_to_type_next() {
    let folder = Folder::new();
    let run = folder.run(&["demo"]).expect(0);
    assert!(run.stdout.contains("demo.ply") && run.stdout.contains("pellicle mesh"), "{}", run.stdout);
    assert_eq!(folder.files(), ["demo.glb", "demo.html", "demo.ply", "demo.png"]);
    folder.run(&["check", "demo.glb"]).expect(0);
    let page = std::fs::read_to_string(folder.path("demo.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && !page.contains("http://") && !page.contains("https://"));
    folder.run(&["check", "demo.ply"]).expect(0);
    let report = folder.run(&["info", "demo.ply", "--json"]).expect(0).json();
    assert_eq!(report["attributes"][0]["name"], "velocity");

    std::fs::create_dir(folder.path("d")).unwrap();
    folder.run(&["demo", "--output-dir", "d", "-q"]).expect(0);
    let copies = ["demo.ply", "d/demo.ply"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert!(copies[0] == copies[1], "the demo is the same every time");
    let run = folder.run(&["demo", "--output-dir", "absent"]).expect(1);
    assert!(run.stderr.contains("absent"), "{}", run.stderr);
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(6));
    let mut command = folder.command(&["info", "frame.xyz"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let mut text = String::new();
    child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    assert_eq!((child.wait().unwrap().code(), text.as_str()), (Some(0), ""));
}

#[test]
fn convert_goes_through_formats_and_says_what_they_cannot_hold() {
    let folder = Folder::new();
    folder.write("frame.csv", b"x,y,z,vx,vy,vz,mass\n0,0,0,1,2,3,0.5\n1,0,0,-1,2,7,0.25\n");
    let report = folder.run(&["convert", "frame.csv", "frame.bgeo", "--json"]).expect(0).json();
    assert_eq!((report["kind"].as_str(), report["particles"].as_u64()), (Some("particles"), Some(2)));
    assert_eq!(report["narrowed"], serde_json::json!(["position", "velocity", "mass"]));
    let run = folder.run(&["convert", "frame.bgeo", "frame.xyz"]).expect(0);
    assert!(run.stderr.contains("velocity, mass"), "{}", run.stderr);
    folder.write("tetrahedron.obj", TETRAHEDRON.as_bytes());
    for name in ["a.stl", "a.glb", "a.ply", "a.vtk"] {
        folder.run(&["convert", "tetrahedron.obj", name, "--scale", "2"]).expect(0);
        let report = folder.run(&["check", name, "--json"]).expect(0).json();
        assert_eq!(
            (report["vertices"].as_u64(), report["signed_volume"].as_f64()),
            (Some(4), Some(8.0 / 6.0)),
            "{name}"
        );
    }
    let run = folder.run(&["convert", "a.ply", "a.csv"]).expect(0);
    assert!(run.stderr.contains("vertices only"), "{}", run.stderr);
    folder.run(&["convert", "a.ply", "./a.ply"]).expect(2);
    folder.run(&["convert", "frame.csv", "a.obj"]).expect(1);
}
