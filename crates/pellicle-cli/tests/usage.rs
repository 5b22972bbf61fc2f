//! The command line itself: help, wrong usage, exit codes that need no data.

mod common;

use common::{Folder, cube};

/// A screen: what a terminal of common size shows, two lines left for the prompt.
const SCREEN: usize = 50;

#[test]
fn help_fits_on_a_screen_and_names_every_default() {
    let folder = Folder::new();
    for verb in [
        &[][..],
        &["mesh"],
        &["convert"],
        &["render"],
        &["info"],
        &["check"],
        &["demo"],
        &["formats"],
        &["fields"],
        &["completions"],
        &["man"],
    ] {
        let run = folder.run(&[verb, &["--help"]].concat()).expect(0);
        let lines = run.stdout.lines().count();
        assert!(lines <= SCREEN, "{verb:?}: {lines} lines\n{}", run.stdout);
        assert!(run.stderr.is_empty());
    }
    let help = folder.run(&["mesh", "--help"]).stdout;
    for option in help.split("\n  -").skip(1) {
        let flag = ["--json", "--quiet", "--verbose", "--help"].iter().any(|f| option.contains(f));
        assert!(flag || option.contains("default:"), "no default: -{option}");
    }
}

#[test]
fn no_arguments_show_the_help_as_a_usage_error() {
    let run = Folder::new().run(&[]).expect(2);
    assert!(run.stderr.contains("pellicle demo"), "{}", run.stderr);
}

#[test]
fn values_that_cannot_mean_anything_are_usage_errors_before_any_file_is_read() {
    let folder = Folder::new();
    for wrong in [
        &["-r", "0"][..],
        &["-r", "nan"],
        &["-r", "-1"],
        &["-r", "inf"],
        &["-l", "0"],
        &["-c", "-0.5"],
        &["-t", "0"],
        &["-t", "x"],
        &["--field", "mud"],
        &["--field", "solenthaler:t-high=0"],
        &["--field", "solenthaler", "-l", "0.5"],
        &["--field", "solenthaler", "-t", "2"],
        &["--band", "wide"],
        &["--band", "paper", "--method", "tetra5"],
        &["--band", "paper", "--wall", "plane=0,0,1,0"],
        &["--normals", "maybe"],
        &["--attributes", "a,,b"],
        &["--threads", "0"],
        &["--threads", "1000000"],
        &["-n", "-1"],
        &["--max-memory", "lots"],
        &["--max-memory", "0"],
        &["-o", "surface.csv"],
        &["-o", "surface"],
        &["-q", "-v"],
        &["--no-such-option"],
    ] {
        let run = folder.run(&[&["mesh", "absent.xyz"], wrong].concat()).expect(2);
        assert!(run.stderr.starts_with("error: "), "{wrong:?}: {}", run.stderr);
        assert!(run.stdout.is_empty(), "{wrong:?}");
    }
    let run = folder.run(&["mesh", "absent.xyz", "-r", "0"]);
    assert!(run.stderr.contains("must be a finite number greater than 0"), "{}", run.stderr);
}

#[test]
fn an_unknown_vector_unit_is_a_usage_error_and_every_known_one_gives_the_same_bytes() {
    let folder = Folder::new();
    folder.write_xyz("cube.xyz", &common::cube(6));
    let mesh = |lanes: &str| {
        let mut command = folder.command(&["mesh", "cube.xyz", "-o", "cube.ply", "-r", "0.5", "-c", "0.5"]);
        common::Run::of(command.env("PELLICLE_LANES", lanes).output().unwrap())
    };
    let run = mesh("sse9").expect(2);
    assert!(run.stderr.contains("avx512, avx2 or portable"), "{}", run.stderr);
    assert_eq!(folder.files(), ["cube.xyz"]);

    mesh("portable").expect(0);
    let portable = std::fs::read(folder.path("cube.ply")).unwrap();
    for lanes in ["auto", "avx2", "avx512"] {
        let run = mesh(lanes);
        if run.code == Some(1) && run.stderr.contains("no such vector unit") {
            println!("{lanes} is not compared: this machine lacks it");
            continue;
        }
        run.expect(0);
        assert!(std::fs::read(folder.path("cube.ply")).unwrap() == portable, "{lanes}");
    }
}

#[test]
fn errors_tell_what_was_likely_meant() {
    let folder = Folder::new();
    folder.write_xyz("frame_0001.xyz", &cube(3));
    let fails = |line: &[&str], code, hint: &str| {
        let run = folder.run(line).expect(code);
        assert!(run.stderr.contains(hint), "{line:?}: {}", run.stderr);
    };
    fails(&["mesh", "fram_0001.xyz"], 1, "(is it frame_0001.xyz?)");
    fails(&["mesh", "other.xyz"], 1, "cannot open");
    fails(&["mesh", "frame_0001.xyz", "-o", "a.png"], 2, "--png");
    fails(&["check", "frame_0001.xyz"], 1, "with raw XYZ this is not possible: meshes are read from .ply");
    fails(&["mehs"], 2, "'mesh'");
    fails(&["mesh", "frame_0001.xyz", "--cel", "1"], 2, "'--cell'");
}
