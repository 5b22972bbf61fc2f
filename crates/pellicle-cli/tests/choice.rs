//! Which particles make the surface, from the command line: `--where`, `--crop`, `--scale`, `--spray`; pictures.

mod common;

use common::{Folder, cube, ply_comments};

/// A cube of fluid (type 0) and a cube of wall (type 1) beside it, and a lone drop.
fn scene(folder: &Folder) {
    let mut text = "x,y,z,type,vx,vy,vz\n".to_owned();
    for [x, y, z] in cube(6) {
        text += &format!("{x},{y},{z},0,1,0,0\n{},{y},{z},1,0,0,0\n", x + 40.0);
    }
    text += "-40,0,0,0,0,0,5\n";
    folder.write("scene.csv", text.as_bytes());
}

fn mesh(folder: &Folder, args: &[&str]) -> serde_json::Value {
    folder.run(&[&["mesh", "scene.csv", "-r", "0.5", "-o", "out.ply", "--json"], args].concat()).expect(0).json()
}

fn components(folder: &Folder) -> u64 {
    folder.run(&["check", "out.ply", "--json"]).expect(0).json()["components"].as_u64().unwrap()
}

#[test]
fn particles_are_chosen_by_attribute_and_by_place() {
    let folder = Folder::new();
    scene(&folder);
    mesh(&folder, &[]);
    assert_eq!(components(&folder), 3);
    let report = mesh(&folder, &["--where", "type == 0"]);
    assert_eq!((&report["particles"], &report["particles_filtered"]), (&217.into(), &216.into()));
    assert_eq!(components(&folder), 2);
    assert_eq!(report["parameters"]["attributes"], serde_json::json!(["velocity"]), "the type is not carried");
    assert!(ply_comments(&folder.path("out.ply")).join("\n").contains("where type == 0"));
    let report = mesh(&folder, &["--crop", "-1,-1,-1", "6,6,6"]);
    assert_eq!((&report["particles"], &report["particles_cropped"]), (&216.into(), &217.into()));
    assert_eq!(components(&folder), 1);
    let run = folder.run(&["mesh", "scene.csv", "-r", "0.5", "--where", "typ == 0"]).expect(1);
    assert!(run.stderr.contains("type"), "{}", run.stderr);
    let run = folder.run(&["mesh", "scene.csv", "--where", "type = 0"]).expect(2);
    assert!(run.stderr.contains("=="), "{}", run.stderr);
}

#[test]
fn lengths_are_scaled_before_all_else() {
    let folder = Folder::new();
    scene(&folder);
    let plain = mesh(&folder, &["--where", "x < 20"]);
    let scaled = folder
        .run(&["mesh", "scene.csv", "--scale", "0.01", "--where", "x < 0.2", "-r", "0.005", "-o", "s.ply", "--json"])
        .expect(0)
        .json();
    assert_eq!(plain["particles"], scaled["particles"]);
    let info = folder.run(&["info", "s.ply", "--json"]).expect(0).json();
    assert!((info["box"][1][1].as_f64().unwrap() - 0.055).abs() < 0.01, "{info}");
    assert!((info["attributes"][0]["max"][2].as_f64().unwrap() - 0.05).abs() < 1e-6, "{info}");
}

#[test]
fn spray_goes_apart_and_the_rest_is_what_it_was() {
    let folder = Folder::new();
    scene(&folder);
    let report = mesh(&folder, &["--spray", "spray.csv", "--attributes", "all"]);
    assert_eq!((&report["particles"], &report["particles_sprayed"]), (&432.into(), &1.into()));
    assert_eq!(components(&folder), 2);
    let spray = folder.run(&["info", "spray.csv", "--json"]).expect(0).json();
    assert_eq!(spray["particles"], 1);
    let radius = spray["attributes"].as_array().unwrap().iter().find(|a| a["name"] == "radius").unwrap();
    assert_eq!(radius["max"][0], 0.5);
}

#[test]
fn a_picture_is_drawn_at_once_and_pictures_of_files() {
    let folder = Folder::new();
    scene(&folder);
    mesh(&folder, &["--png", "now.png"]);
    let render = |args: &[&str]| folder.run(&[&["render"], args, &["--size", "160x90"]].concat());
    render(&["out.ply", "-o", "mesh.png"]).expect(0);
    render(&["scene.csv", "-o", "points.png", "--color-by", "velocity"]).expect(0);
    render(&["out.ply", "-o", "turn_##.png", "--turntable", "3"]).expect(0);
    let picture = |name: &str| std::fs::read(folder.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    for name in ["now.png", "mesh.png", "points.png", "turn_01.png", "turn_02.png", "turn_03.png"] {
        assert!(picture(name).starts_with(b"\x89PNG"), "{name}");
    }
    assert_ne!(picture("turn_01.png"), picture("turn_02.png"), "it turns");
    render(&["out.ply", "-o", "again.png"]).expect(0);
    assert!(picture("again.png") == picture("mesh.png"));
    let run = render(&["out.ply", "--color-by", "heat"]).expect(1);
    assert!(run.stderr.contains("velocity"), "the names there are: {}", run.stderr);
    render(&["out.ply", "-o", "a.jpg"]).expect(2);
    render(&["out.ply", "--turntable", "3", "-o", "one.png"]).expect(2);
}
