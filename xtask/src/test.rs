//! Every check that a change must pass, in the order in which they fail fastest. All run even when one fails.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::tally::{Tally, failures};
use crate::{python, tidy};

/// How much to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// What a change must pass.
    Usual,
    /// With tests marked `#[ignore]`, and the Python tests that ask for it.
    All,
}

/// Runs everything and ends with the totals alone on a line. Whether nothing failed.
pub fn run(root: &Path, extent: Extent) -> bool {
    let mut report =
        Report { started: Instant::now(), lines: Vec::new(), failures: String::new(), total: Tally::default() };
    report.step("formatting", || succeeds(cargo(root, &["fmt", "--all", "--check"])));
    report.step("lints", || {
        succeeds(cargo(root, &["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]))
    });
    report.step("tidy", || tidy::run(root));
    report.step("documentation", || {
        let mut command = cargo(root, &["doc", "--workspace", "--no-deps", "--quiet"]);
        command.env("RUSTDOCFLAGS", "-D warnings");
        succeeds(command)
    });
    report.suite("Rust tests", || rust_tests(root, extent));
    let built = report.step("release build", || {
        succeeds(cargo(root, &["build", "--release", "--quiet", "--package", "pellicle-cli"]))
    });
    let target = target(root);
    let binary = target.join("release").join(format!("pellicle{}", std::env::consts::EXE_SUFFIX));
    if built {
        report.suite("Python tests", || python::run(root, &target, &binary, extent));
    }
    report.finish()
}

/// What has run so far.
struct Report {
    started: Instant,
    lines: Vec<String>,
    /// What the runners said of tests that failed.
    failures: String,
    total: Tally,
}

impl Report {
    /// A check that counts as one.
    fn step(&mut self, name: &str, check: impl FnOnce() -> bool) -> bool {
        self.suite(name, || (Tally::of_step(check()), String::new())).failed == 0
    }

    /// A check that counts its parts, and gives what its runner printed.
    fn suite(&mut self, name: &str, check: impl FnOnce() -> (Tally, String)) -> Tally {
        println!("== {name}");
        let started = Instant::now();
        let (tally, output) = check();
        self.failures += &failures(&output);
        let verdict = if tally.failed > 0 { "FAILED" } else { "ok" };
        self.lines.push(format!("{name:14} {verdict:6} {tally} ({:.1} s)", started.elapsed().as_secs_f64()));
        self.total = self.total + tally;
        tally
    }

    /// Failures come again at the end: where a log is cut, its middle goes.
    fn finish(self) -> bool {
        if !self.failures.is_empty() {
            println!("== failures\n{}", self.failures);
        }
        println!("== summary, {:.0} s", self.started.elapsed().as_secs_f64());
        for line in &self.lines {
            println!("{line}");
        }
        println!("{}", self.total);
        self.total.failed == 0
    }
}

fn rust_tests(root: &Path, extent: Extent) -> (Tally, String) {
    let mut command = cargo(root, &["test", "--workspace", "--no-fail-fast", "--", "--show-output"]);
    if extent == Extent::All {
        command.arg("--include-ignored");
    }
    let (succeeded, output) = echo(&mut command);
    let tally = Tally::of_cargo(&output);
    // A test that does not build has no summary line.
    let ends = succeeded || tally.failed > 0;
    (if ends { tally } else { tally + Tally::of_step(false) }, output)
}

pub fn cargo(root: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(root);
    command
}

pub fn succeeds(mut command: Command) -> bool {
    match command.status() {
        Ok(status) => status.success(),
        Err(e) => {
            println!("{} cannot be run: {e}", command.get_program().to_string_lossy());
            false
        }
    }
}

/// Runs a command, shows its output as it comes, and returns whether it succeeded and what it wrote to stdout.
pub fn echo(command: &mut Command) -> (bool, String) {
    let mut output = String::new();
    let mut child = match command.stdout(Stdio::piped()).spawn() {
        Ok(child) => child,
        Err(e) => {
            println!("{} cannot be run: {e}", command.get_program().to_string_lossy());
            return (false, output);
        }
    };
    if let Some(stdout) = child.stdout.take() {
        let mut reader = BufReader::new(stdout);
        let mut line = Vec::new();
        while reader.read_until(b'\n', &mut line).is_ok_and(|read| read > 0) {
            let text = String::from_utf8_lossy(&line);
            print!("{text}");
            output.push_str(&text);
            line.clear();
        }
    }
    (child.wait().is_ok_and(|status| status.success()), output)
}

/// Where cargo builds.
pub fn target(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |folder| root.join(folder))
}
