//! Sequences, file to file: the same bytes as single frames, failures, what is skipped, parts, lists, watching.

mod common;

use std::time::{Duration, Instant};

use common::{Folder, cube, ply_comments};

/// Frames 1 to `count`, each a cube of another size.
fn frames(folder: &Folder, count: usize) {
    for n in 1..=count {
        folder.write_xyz(&format!("f_{n:03}.xyz"), &cube(2 + n % 5));
    }
}

#[test]
fn a_sequence_gives_the_same_bytes_as_its_frames_one_by_one() {
    let folder = Folder::new();
    frames(&folder, 7);
    let report = folder.run(&["mesh", "f_###.xyz", "-o", "all/s_####.ply", "-r", "0.5", "--json"]).expect(0).json();
    assert_eq!((&report["frames_done"], &report["frames_failed"]), (&7.into(), &0.into()));
    for n in 1..=7 {
        folder.run(&["mesh", &format!("f_{n:03}.xyz"), "-o", "one.ply", "-r", "0.5"]).expect(0);
        let one = std::fs::read(folder.path("one.ply")).unwrap();
        assert!(std::fs::read(folder.path(&format!("all/s_{n:04}.ply"))).unwrap() == one, "frame {n}");
        assert_eq!(report["frames"][n - 1]["frame"], n, "frames are told in order");
    }
    // A small limit makes frames wait for each other, and changes nothing.
    folder.run(&["mesh", "f_###.xyz", "-o", "small/", "-r", "0.5", "--max-memory", "3M"]).expect(0);
    for n in 1..=7 {
        let small = std::fs::read(folder.path(&format!("small/f_{n:03}.ply"))).unwrap();
        assert!(small == std::fs::read(folder.path(&format!("all/s_{n:04}.ply"))).unwrap(), "frame {n}");
    }
}

#[test]
fn the_radius_is_that_of_the_first_frame_of_the_whole_sequence_also_for_a_part() {
    let folder = Folder::new();
    folder.write("f_1.xyz", b"");
    folder.write_xyz("f_2.xyz", &cube(6));
    let wide: Vec<[f32; 3]> = cube(6).iter().map(|p| p.map(|x| 3.0 * x)).collect();
    folder.write_xyz("f_3.xyz", &wide);
    folder.write_xyz("f_4.xyz", &wide);
    let radius = |args: &[&str]| {
        let report = folder.run(&[&["mesh", "f_{}.xyz", "-o", "o/", "--json"], args].concat()).expect(0).json();
        report["particle_radius"].as_f64().unwrap()
    };
    let whole = radius(&[]);
    assert!((whole - 0.5).abs() < 0.1, "{whole}");
    assert_eq!(radius(&["--shard", "2/2"]), whole);
    assert_eq!(radius(&["--shard", "1/2", "--skip-existing"]), whole);
    folder.run(&["check", "o/f_1.ply"]).expect(0);
}

#[test]
fn a_failed_frame_is_told_and_the_others_go_on() {
    let folder = Folder::new();
    frames(&folder, 5);
    folder.write("f_003.xyz", b"123");
    let run = folder.run(&["mesh", "f_###.xyz", "-r", "0.5", "--json"]).expect(1);
    let report = run.json();
    assert_eq!(
        (&report["frames_done"], &report["frames_failed"], &report["exit_code"]),
        (&4.into(), &1.into(), &1.into())
    );
    assert_eq!(report["frames"][2]["status"], "failed");
    assert!(report["frames"][2]["error"].as_str().unwrap().contains("f_003.xyz"));
    assert!(run.stderr.contains("f_003.xyz") && run.stderr.contains("1 of 5 frames failed"), "{}", run.stderr);
    assert!(!folder.path("f_003.ply").exists() && folder.path("f_005.ply").exists());
}

#[test]
fn what_is_there_is_skipped_unless_its_particles_are_newer() {
    let folder = Folder::new();
    frames(&folder, 4);
    folder.run(&["mesh", "f_###.xyz", "-r", "0.5"]).expect(0);
    let skip = ["mesh", "f_###.xyz", "-r", "0.5", "--skip-existing", "--json"];
    assert_eq!(folder.run(&skip).expect(0).json()["frames_skipped"], 4);
    std::fs::remove_file(folder.path("f_002.ply")).unwrap();
    let later = std::time::SystemTime::now() + Duration::from_secs(5);
    std::fs::File::options().append(true).open(folder.path("f_004.xyz")).unwrap().set_modified(later).unwrap();
    let report = folder.run(&skip).expect(0).json();
    let status: Vec<_> = report["frames"].as_array().unwrap().iter().map(|f| f["status"].as_str().unwrap()).collect();
    assert_eq!(status, ["skipped", "done", "skipped", "done"]);
}

#[test]
fn what_is_made_later_is_what_it_would_have_been() {
    let folder = Folder::new();
    frames(&folder, 4);
    folder.run(&["mesh", "f_###.xyz"]).expect(0);
    let read = |n: usize| std::fs::read(folder.path(&format!("f_{n:03}.ply"))).unwrap();
    let before = [read(1), read(2)];
    assert!(before[0] != before[1]);
    std::fs::remove_file(folder.path("f_002.ply")).unwrap();
    folder.run(&["mesh", "f_###.xyz", "--skip-existing"]).expect(0);
    assert!([read(1), read(2)] == before);
}

#[test]
fn parts_together_make_the_whole() {
    let folder = Folder::new();
    frames(&folder, 5);
    for part in ["1/3", "2/3", "3/3"] {
        folder.run(&["mesh", "f_###.xyz", "-r", "0.5", "-o", "parts/", "--shard", part]).expect(0);
    }
    assert_eq!(std::fs::read_dir(folder.path("parts")).unwrap().count(), 5);
    let some = folder.run(&["mesh", "f_###.xyz", "-r", "0.5", "-o", "some/", "--frames", "2-5:2", "--json"]).expect(0);
    assert_eq!(some.json()["frames_done"], 2);
    let run = folder.run(&["mesh", "f_###.xyz", "-r", "0.5", "--frames", "4-9"]).expect(1);
    assert!(run.stderr.contains('6'), "the missing frames are named: {}", run.stderr);
}

#[test]
fn a_list_names_every_frame_and_is_a_sequence_itself() {
    let folder = Folder::new();
    frames(&folder, 3);
    folder.run(&["mesh", "f_###.xyz", "-r", "0.5", "-o", "water.pvd"]).expect(0);
    let list = std::fs::read_to_string(folder.path("water.pvd")).unwrap();
    for n in 1..=3 {
        assert!(list.contains(&format!("water_{n:04}.vtp")), "{list}");
    }
    folder.run(&["convert", "water.pvd", "w_{}.stl"]).expect(0);
    folder.run(&["check", "w_2.stl"]).expect(0);
}

#[test]
fn frames_are_meshed_as_they_come() {
    let folder = Folder::new();
    let child = folder
        .command(&["mesh", "f_###.xyz", "-r", "0.5", "-o", "out/", "--watch=4", "--json"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    for n in 1..=3 {
        std::thread::sleep(Duration::from_millis(400));
        // Written in two steps, as a simulation does.
        let bytes: Vec<u8> = cube(3 + n).as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let (first, rest) = bytes.split_at(bytes.len() / 2 / 12 * 12);
        let path = folder.write(&format!("f_{n:03}.xyz"), first);
        std::thread::sleep(Duration::from_millis(300));
        std::io::Write::write_all(&mut std::fs::File::options().append(true).open(path).unwrap(), rest).unwrap();
    }
    let begun = Instant::now();
    let run = common::Run::of(child.wait_with_output().unwrap()).expect(0);
    assert!(begun.elapsed() < Duration::from_secs(60));
    assert_eq!(run.json()["frames_failed"], 0, "{}", run.stderr);
    for n in 1..=3 {
        folder.run(&["mesh", &format!("f_{n:03}.xyz"), "-o", "one.ply", "-r", "0.5"]).expect(0);
        let one = std::fs::read(folder.path("one.ply")).unwrap();
        assert!(std::fs::read(folder.path(&format!("out/f_{n:03}.ply"))).unwrap() == one, "frame {n}");
    }
}

#[test]
fn a_watched_frame_that_is_half_written_at_the_start_is_waited_for_and_a_mended_one_counts() {
    let folder = Folder::new();
    let bytes: Vec<u8> = cube(6).as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    folder.write("f_001.xyz", &bytes[..100]);
    let child = folder
        .command(&["mesh", "f_###.xyz", "-r", "0.5", "-o", "out/", "--watch=5", "--json"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(300));
    folder.write("f_001.xyz", &bytes);
    // This one is not only late: it fails, and is written again.
    folder.write("f_002.xyz", &bytes[..100]);
    std::thread::sleep(Duration::from_millis(3000));
    folder.write("f_002.xyz", &bytes);
    let run = common::Run::of(child.wait_with_output().unwrap()).expect(0);
    assert!(
        !run.stderr.contains("f_001.xyz: 100 bytes") && run.stderr.contains("f_002.xyz: 100 bytes"),
        "{}",
        run.stderr
    );
    let report = run.json();
    assert_eq!((&report["frames_done"], &report["frames_failed"]), (&2.into(), &0.into()));
    assert_eq!(report["frames"].as_array().map(Vec::len), Some(2));
    assert!(folder.path("out/f_002.ply").exists());
}

#[test]
#[cfg(unix)]
fn a_killed_run_leaves_only_whole_files_and_goes_on_where_it_was() {
    let folder = Folder::new();
    for n in 1..=20 {
        folder.write_xyz(&format!("f_{n:03}.xyz"), &cube(28));
    }
    let line = ["mesh", "f_###.xyz", "-r", "0.5", "-o", "out/", "--skip-existing"];
    let mut child = folder.command(&line).stdout(std::process::Stdio::null()).spawn().unwrap();
    let some = || std::fs::read_dir(folder.path("out")).map(Iterator::count).unwrap_or(0);
    let begun = Instant::now();
    while some() < 3 && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let killed = some();
    assert!((3..20).contains(&killed), "killed in the middle: {killed}");
    folder.run(&line).expect(0);
    let mut names: Vec<_> =
        std::fs::read_dir(folder.path("out")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    // Where the file system has no files without names, the killed run leaves hidden ones.
    names.retain(|name| !name.starts_with('.'));
    assert_eq!(names, (1..=20).map(|n| format!("f_{n:03}.ply")).collect::<Vec<_>>());
    folder.run(&["mesh", "f_001.xyz", "-r", "0.5", "-o", "one.ply"]).expect(0);
    let length = std::fs::metadata(folder.path("one.ply")).unwrap().len();
    for name in names {
        // All frames are alike but for the name in the header, which is of the same length.
        assert_eq!(std::fs::metadata(folder.path("out").join(&name)).unwrap().len(), length, "{name}");
    }
}

#[test]
fn a_kept_command_does_the_same_again() {
    let folder = Folder::new();
    frames(&folder, 3);
    let typed = ["mesh", "f_###.xyz", "-r", "0.5", "-c", "0.75", "-o", "a/", "--crop", "0,0,0", "-,2,-"];
    folder.run(&typed).expect(0);
    let kept = folder.run(&[&typed[..], &["--print-config"]].concat()).expect(0).stdout;
    folder.write("kept.toml", kept.as_bytes());
    folder.run(&["mesh", "--config", "kept.toml", "-o", "b/"]).expect(0);
    for n in 1..=3 {
        let read = |part: &str| std::fs::read(folder.path(&format!("{part}/f_{n:03}.ply"))).unwrap();
        assert!(read("a") == read("b"), "frame {n}");
    }
    assert!(ply_comments(&folder.path("a/f_001.ply")).join("\n").contains("crop 0,0,0 inf,2,inf"));
}

#[test]
fn wrong_sequences_are_told_before_any_work() {
    let folder = Folder::new();
    frames(&folder, 2);
    for (line, code, said) in [
        (&["mesh", "f_###.xyz", "-o", "one.ply"][..], 2, "one_####.ply"),
        (&["mesh", "g_###.xyz"], 1, "g_001.xyz"),
        (&["mesh", "f_###.xyz", "--shard", "3/2"], 2, "part 3 of 2"),
        (&["mesh", "f_###.xyz", "--frames", "9-1"], 2, "1-9"),
        (&["mesh", "f_###.xyz", "-o", "f_###.xyz"], 2, "overwrite"),
        (&["mesh", "f_###.xyz", "-o", "s_###.xyz"], 2, "not possible"),
        (&["mesh", "--config", "absent.toml"], 1, "absent.toml"),
        (&["mesh"], 2, "IN"),
    ] {
        let run = folder.run(line).expect(code);
        assert!(run.stderr.contains(said), "{line:?}: {}", run.stderr);
        assert_eq!(folder.files(), ["f_001.xyz", "f_002.xyz"], "{line:?}");
    }
}
