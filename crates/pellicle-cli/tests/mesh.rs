//! `mesh`, file to file: defaults, reports, bad input, and what is left on the disk.

mod common;

use common::{Folder, cube, ply_comments};

#[test]
fn the_input_alone_is_enough() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(8));
    let run = folder.run(&["mesh", "frame.xyz"]).expect(0);
    assert!(run.stdout.contains("inferred"), "{}", run.stdout);
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    assert_eq!(folder.files(), ["frame.ply", "frame.xyz"]);
    folder.run(&["check", "frame.ply"]).expect(0);
    let comments = ply_comments(&folder.path("frame.ply")).join("\n");
    for parameter in ["pellicle 0.", "particle_radius ", "smoothing_length 2", "cell_size 0.5", "threshold 0.6"] {
        assert!(comments.contains(parameter), "{parameter} is not in:\n{comments}");
    }
}

#[test]
fn every_output_format_holds_the_same_closed_mesh() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(5));
    let mut counts = Vec::new();
    for name in ["a.ply", "a.obj", "a.vtk"] {
        folder.run(&["mesh", "frame.xyz", "-r", "0.5", "-o", name, "-q"]).expect(0);
        let report = folder.run(&["check", name, "--json"]).expect(0).json();
        assert_eq!(report["passed"], true);
        counts.push((report["vertices"].clone(), report["triangles"].clone(), report["components"].clone()));
    }
    assert!(counts[0].1.as_u64().unwrap() > 0);
    assert!(counts.iter().all(|c| *c == counts[0]), "{counts:?}");
}

#[test]
fn the_bytes_are_the_same_for_any_number_of_threads() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(12));
    for threads in ["1", "2", "7"] {
        let output = format!("{threads}.ply");
        folder.run(&["mesh", "frame.xyz", "-r", "0.5", "-n", threads, "--normals", "on", "-o", &output]).expect(0);
    }
    let one = std::fs::read(folder.path("1.ply")).unwrap();
    for threads in ["2", "7"] {
        assert!(std::fs::read(folder.path(&format!("{threads}.ply"))).unwrap() == one, "{threads} threads");
    }
}

#[test]
fn the_papers_band_is_reported_and_the_same_bytes_with_little_memory() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(24));
    let run = |name: &str, more: &[&str]| {
        let arguments = ["mesh", "frame.xyz", "-r", "0.5", "--band", "paper", "-c", "0.75", "--json", "-o", name];
        folder.run(&[&arguments[..], more].concat()).expect(0).json()
    };
    let report = run("a.ply", &[]);
    assert_eq!(report["parameters"]["band"], "paper");
    // The outermost layer of the cube, and half of the nodes of what it takes.
    assert_eq!(report["surface_particles"], 24 * 24 * 24 - 22 * 22 * 22);
    assert!(report["surface_nodes"].as_u64().unwrap() > 10_000);
    assert!(report["stages"].as_array().unwrap().iter().any(|stage| stage["name"] == "surface"));
    let little = run("b.ply", &["--max-memory", "3M", "--threads", "1"]);
    assert!(little["blocks"].as_u64().unwrap() > 1, "{little}");
    assert!(std::fs::read(folder.path("a.ply")).unwrap() == std::fs::read(folder.path("b.ply")).unwrap());
    folder.run(&["check", "a.ply"]).expect(0);
}

#[test]
fn the_json_report_stands_alone_on_stdout() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(6));
    let run = folder.run(&["mesh", "frame.xyz", "-r", "0.5", "--json", "--threads", "1"]).expect(0);
    let report = run.json();
    assert!(run.stderr.contains("216 particles"), "the text goes to stderr: {}", run.stderr);
    assert_eq!(report["command"], "mesh");
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(report["particles"], 216);
    assert_eq!(report["parameters"]["particle_radius"], 0.5);
    assert_eq!(report["parameters"]["particle_radius_inferred"], false);
    assert_eq!(report["parameters"]["threads"], 1);
    assert!(report["triangles"].as_u64().unwrap() > 0);
    assert_eq!(report["output_bytes"], std::fs::metadata(folder.path("frame.ply")).unwrap().len());
    let stages: Vec<_> = report["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!((stages[0], stages[stages.len() - 1]), ("read", "write"));
    #[cfg(target_os = "linux")]
    assert!(report["peak_memory_bytes"].as_u64().unwrap() > 100_000);
    assert_eq!(report["warnings"].as_array().unwrap().len(), 0);

    let quiet = folder.run(&["mesh", "frame.xyz", "-r", "0.5", "-q"]).expect(0);
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn a_failure_is_reported_in_json_too() {
    let folder = Folder::new();
    let run = folder.run(&["mesh", "absent.xyz", "--json"]).expect(1);
    assert!(run.json()["error"].as_str().unwrap().contains("absent.xyz"));
    assert_eq!(run.json()["exit_code"], 1);
    assert!(run.stderr.starts_with("error: absent.xyz: "), "{}", run.stderr);
}

#[test]
fn no_particles_give_an_empty_mesh_and_a_warning() {
    let folder = Folder::new();
    folder.write("empty.xyz", b"");
    for name in ["empty.ply", "empty.obj", "empty.vtk"] {
        for radius in [&[][..], &["-r", "0.5"]] {
            let run = folder.run(&[&["mesh", "empty.xyz", "-o", name], radius].concat()).expect(0);
            assert!(run.stderr.starts_with("warning: empty.xyz: "), "{}", run.stderr);
        }
        assert_eq!(folder.run(&["check", name, "--json"]).expect(0).json()["triangles"], 0);
    }
}

#[test]
fn too_few_distinct_particles_need_a_radius() {
    let folder = Folder::new();
    for (name, positions) in [("one.xyz", vec![[1.0; 3]]), ("same.xyz", vec![[1.0; 3]; 100])] {
        folder.write_xyz(name, &positions);
        let run = folder.run(&["mesh", name, "-o", "out.ply"]).expect(1);
        assert!(run.stderr.contains("-r"), "{}", run.stderr);
        assert!(!folder.path("out.ply").exists());
        folder.run(&["mesh", name, "-o", "out.ply", "-r", "0.1"]).expect(0);
        folder.run(&["check", "out.ply"]).expect(0);
        std::fs::remove_file(folder.path("out.ply")).unwrap();
    }
}

#[test]
fn positions_that_are_not_finite_are_named_or_dropped() {
    let folder = Folder::new();
    let mut positions = cube(6);
    positions[17][1] = f32::NAN;
    positions[40][2] = f32::NEG_INFINITY;
    folder.write_xyz("bad.xyz", &positions);
    for radius in [&[][..], &["-r", "0.5"]] {
        let run = folder.run(&[&["mesh", "bad.xyz"], radius].concat()).expect(1);
        assert!(run.stderr.contains("particle 17 ") && run.stderr.contains("--drop-invalid"), "{}", run.stderr);
        assert_eq!(folder.files(), ["bad.xyz"]);
    }
    let run = folder.run(&["mesh", "bad.xyz", "-r", "0.5", "--drop-invalid", "--json"]).expect(0);
    assert_eq!(run.json()["particles"], 214);
    assert_eq!(run.json()["particles_dropped"], 2);
    assert!(run.stderr.contains("warning: bad.xyz: 2 particles"), "{}", run.stderr);

    positions.remove(40);
    positions.remove(17);
    folder.write_xyz("good.xyz", &positions);
    folder.run(&["mesh", "good.xyz", "-r", "0.5"]).expect(0);
    let bodies = ["bad.ply", "good.ply"].map(|name| {
        let bytes = std::fs::read(folder.path(name)).unwrap();
        let end = bytes.windows(10).position(|w| w == b"end_header").unwrap();
        bytes[end..].to_vec()
    });
    assert!(bodies[0] == bodies[1], "dropping is the same as never having had them");
}

#[test]
fn attributes_follow_their_particles_when_some_are_dropped() {
    let folder = Folder::new();
    let mut text = String::from("x,y,z,vx,vy,vz,density\n");
    for (i, [x, y, z]) in cube(5).into_iter().enumerate() {
        let x = if i % 7 == 3 { "nan".to_owned() } else { x.to_string() };
        text += &format!("{x},{y},{z},1,2,3,{}\n", if i % 7 == 3 { 1e9 } else { 1000.0 });
    }
    folder.write("frame.csv", text.as_bytes());
    let args = ["mesh", "frame.csv", "-r", "0.5", "--drop-invalid", "--attributes", "density", "-o", "a.ply"];
    folder.run(&args).expect(0);
    let report = folder.run(&["info", "a.ply", "--json"]).expect(0).json();
    let density = &report["attributes"][0];
    assert_eq!(density["name"], "density");
    let (low, high) = (density["min"][0].as_f64().unwrap(), density["max"][0].as_f64().unwrap());
    assert!(low > 999.9 && high < 1000.1, "a dropped particle's value leaked: {low} .. {high}");
}

#[test]
fn attributes_are_chosen_by_name() {
    let folder = Folder::new();
    let mut text = String::from("x,y,z,vx,vy,vz,density\n");
    for [x, y, z] in cube(4) {
        text += &format!("{x},{y},{z},1,2,3,1000\n");
    }
    folder.write("frame.csv", text.as_bytes());
    let carried = |choice: &[&str]| {
        let run = folder.run(&[&["mesh", "frame.csv", "-r", "0.5", "--json"], choice].concat()).expect(0);
        let names = run.json()["parameters"]["attributes"].clone();
        names.as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(carried(&[]), ["velocity"]);
    assert_eq!(carried(&["--attributes", "none"]), Vec::<String>::new());
    assert_eq!(carried(&["--attributes", "density"]), ["density"]);
    for both in ["density,velocity", "velocity,density", "all"] {
        assert_eq!(carried(&["--attributes", both]), ["velocity", "density"], "in the order of the file");
    }
    let run = folder.run(&["mesh", "frame.csv", "-r", "0.5", "--attributes", "colour"]).expect(1);
    assert!(run.stderr.contains("colour") && run.stderr.contains("density"), "{}", run.stderr);
}

#[test]
fn a_missing_output_folder_is_told_before_the_input_is_read() {
    let folder = Folder::new();
    folder.write("broken.xyz", b"12345");
    let run = folder.run(&["mesh", "broken.xyz", "-o", "absent/out.ply"]).expect(1);
    assert!(run.stderr.contains("absent"), "{}", run.stderr);
    let run = folder.run(&["mesh", "broken.xyz"]).expect(1);
    assert!(run.stderr.starts_with("error: broken.xyz: "), "{}", run.stderr);
    assert_eq!(folder.files(), ["broken.xyz"]);
}

#[test]
fn a_failure_leaves_the_output_of_yesterday_alone() {
    let folder = Folder::new();
    let mut positions = cube(4);
    positions[60][0] = f32::NAN;
    folder.write_xyz("frame.xyz", &positions);
    folder.write("out.ply", b"yesterday");
    folder.run(&["mesh", "frame.xyz", "-o", "out.ply"]).expect(1);
    assert_eq!(std::fs::read(folder.path("out.ply")).unwrap(), b"yesterday");
    assert_eq!(folder.files(), ["frame.xyz", "out.ply"]);
}

#[test]
fn a_memory_limit_below_the_particles_is_refused_with_the_number() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(10));
    let run = folder.run(&["mesh", "frame.xyz", "--max-memory", "8K"]).expect(1);
    assert!(run.stderr.contains("11.7 KiB") && run.stderr.contains("--max-memory"), "{}", run.stderr);
    assert_eq!(folder.files(), ["frame.xyz"]);
}

#[test]
fn a_folder_takes_the_mesh_under_its_inputs_name() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(3));
    std::fs::create_dir(folder.path("there")).unwrap();
    for output in ["there", "new/"] {
        folder.run(&["mesh", "frame.xyz", "-o", output]).expect(0);
        folder.run(&["check", &format!("{}/frame.ply", output.trim_end_matches('/'))]).expect(0);
    }
    let run = folder.run(&["mesh", "frame.xyz", "-o", "not/there/"]).expect(1);
    assert!(run.stderr.contains("not/there"), "{}", run.stderr);
}

#[test]
fn particles_are_never_overwritten_by_their_mesh() {
    let folder = Folder::new();
    folder.write("frame.ply", b"ply");
    std::fs::create_dir(folder.path("d")).unwrap();
    for same in ["frame.ply", "./frame.ply", "d/../frame.ply"] {
        let run = folder.run(&["mesh", "frame.ply", "-o", same]).expect(2);
        assert!(run.stderr.contains("overwrite"), "{}", run.stderr);
    }
    assert_eq!(std::fs::read(folder.path("frame.ply")).unwrap(), b"ply");
}

#[test]
fn a_cell_beyond_the_kernel_is_warned_about() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(4));
    let run = folder.run(&["mesh", "frame.xyz", "-r", "0.5", "-c", "100"]).expect(0);
    assert!(run.stderr.contains("warning: ") && run.stderr.contains("-c"), "{}", run.stderr);
}

#[test]
fn tetrahedra_make_a_closed_surface_of_the_same_volume_with_normals_and_attributes() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(6));
    let volume = |method: &str| {
        let out = format!("{method}.ply");
        folder.run(&["mesh", "frame.xyz", "--method", method, "--normals", "on", "-o", &out]).expect(0);
        let report = folder.run(&["check", &out, "--json"]).expect(0).json();
        assert_eq!(report["closed_manifold"], true);
        (report["signed_volume"].as_f64().unwrap(), report["triangles"].as_u64().unwrap())
    };
    let (cubes, five, six, bcc) = (volume("cubes"), volume("tetra5"), volume("tetra6"), volume("bcc"));
    let regular = volume("regularised");
    for other in [five, six, bcc, regular] {
        assert!((other.0 / cubes.0 - 1.0).abs() < 0.01, "{other:?} {cubes:?}");
    }
    assert!(cubes.1 < five.1 && five.1 < six.1 && six.1 < bcc.1 && regular.1 < five.1);
    assert_eq!(volume("simplex"), bcc);
    folder.run(&["mesh", "frame.xyz", "--method", "tetra7"]).expect(2);
}
