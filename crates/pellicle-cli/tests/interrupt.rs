//! Ctrl-C at any moment leaves a whole file or none.
#![cfg(unix)]

mod common;

use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Stdio};
use std::time::Duration;

use common::{Folder, Run, cube};

/// SIGINT, by its number.
const INTERRUPT: i32 = 2;

#[test]
fn an_interrupted_run_leaves_nothing_half_written() {
    let folder = Folder::new();
    folder.write_xyz("frame.xyz", &cube(90));
    let mut was_interrupted = false;
    // The moment of the signal is random at heart: try many, and expect what is right at each.
    for milliseconds in [5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 120, 150, 200] {
        for signals in [1, 2] {
            was_interrupted |= interrupt(&folder, Duration::from_millis(milliseconds), signals);
        }
    }
    assert!(was_interrupted, "no run was slow enough to be interrupted");
}

/// Runs `mesh` and interrupts it; whether the command itself had to deal with that.
fn interrupt(folder: &Folder, after: Duration, signals: usize) -> bool {
    let mut command =
        folder.command(&["mesh", "frame.xyz", "-r", "0.5", "-c", "0.5", "--normals", "on", "-o", "out.ply"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(after);
    for _ in 0..signals {
        // Fails once the child is gone, which is as good.
        let id = child.id().to_string();
        let _ = Command::new("kill").args(["-INT", &id]).stderr(Stdio::null()).status();
    }
    let output = child.wait_with_output().unwrap();
    let killed = output.status.signal();
    let run = Run::of(output);
    let case = format!("{signals} signals after {after:?}: {run:?}");
    match run.code {
        Some(130) => {
            assert_eq!(folder.files(), ["frame.xyz"], "{case}");
            assert!(run.stderr.contains("interrupted"), "{case}");
            return true;
        }
        Some(0) => {
            assert_eq!(folder.files(), ["frame.xyz", "out.ply"], "{case}");
            folder.run(&["check", "out.ply", "-q"]).expect(0);
            std::fs::remove_file(folder.path("out.ply")).unwrap();
        }
        // Before the command listens, the system ends it: there is no file yet.
        _ => {
            assert_eq!(killed, Some(INTERRUPT), "{case}");
            assert_eq!(folder.files(), ["frame.xyz"], "{case}");
        }
    }
    false
}
