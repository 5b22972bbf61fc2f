//! The Python tests: an environment with pinned packages under the target folder, and pytest in it.
//!
//! They judge the finished program from outside, with a mesh checker that shares no code with it. Where there is no
//! Python or no network they are counted as skipped, and the reason is shown.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::tally::Tally;
use crate::test::{Extent, echo};

/// Runs `tests/*.py` against the program at `binary`: the counts, and what pytest printed.
pub fn run(root: &Path, target: &Path, binary: &Path, extent: Extent) -> (Tally, String) {
    let python = match interpreter(root, target, extent) {
        Ok(python) => python,
        Err(reason) => {
            let skipped = count_tests(root);
            println!("Python tests skipped, {skipped} of them: {reason}");
            return (Tally { skipped, ..Tally::default() }, String::new());
        }
    };
    let mut command = Command::new(python);
    command.args(["-m", "pytest", "tests", "-q", "-rfEs", "--tb=short", "--color=no"]);
    command.args(["-p", "no:cacheprovider", "-o", "tmp_path_retention_policy=failed"]);
    command.arg("--basetemp").arg(target.join("pytest"));
    command.current_dir(root).env("PELLICLE_BIN", binary).env("PYTHONDONTWRITEBYTECODE", "1");
    if extent == Extent::All {
        command.env("PELLICLE_SLOW", "1");
    }
    let (succeeded, output) = echo(&mut command);
    let tally = match Tally::of_pytest(&output) {
        Some(tally) if succeeded || tally.failed > 0 => tally,
        other => {
            println!("pytest did not come to its end");
            other.unwrap_or_default() + Tally::of_step(false)
        }
    };
    (tally, output)
}

/// The environment's interpreter, made ready; or why there is none. `PELLICLE_PYTHON` names one that has the packages.
pub fn interpreter(root: &Path, target: &Path, extent: Extent) -> Result<PathBuf, String> {
    if let Some(chosen) = std::env::var_os("PELLICLE_PYTHON") {
        return Ok(chosen.into());
    }
    let folder = target.join("venv");
    let mut wanted = vec![root.join("tests/requirements.txt")];
    if extent == Extent::All {
        wanted.push(root.join("tests/requirements-extra.txt"));
    }
    let installed = folder.join("installed.txt");
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let mut pins = String::new();
    for file in &wanted {
        pins += &std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    // What has more packages than are wanted will do.
    if python.exists() && std::fs::read_to_string(&installed).is_ok_and(|found| found.starts_with(&pins)) {
        return Ok(python);
    }
    println!("making {} with the packages of {} files of requirements", folder.display(), wanted.len());
    let name = if cfg!(windows) { "python" } else { "python3" };
    finish("making the environment", Command::new(name).args(["-m", "venv", "--clear"]).arg(&folder))?;
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "2"]);
    wanted.iter().for_each(|file| _ = pip.arg("-r").arg(file));
    finish("installing packages (no network?)", &mut pip)?;
    // Written last: an environment that was left half-made is made again.
    std::fs::write(&installed, pins).map_err(|e| format!("{}: {e}", installed.display()))?;
    Ok(python)
}

fn finish(what: &str, command: &mut Command) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{what} failed ({status})")),
        Err(e) => Err(format!("{what}: {} cannot be run: {e}", command.get_program().to_string_lossy())),
    }
}

/// Test functions in `tests/`, for a count of what was skipped. One that runs over many files counts once.
fn count_tests(root: &Path) -> usize {
    let Ok(entries) = std::fs::read_dir(root.join("tests")) else { return 0 };
    let texts = entries.flatten().filter_map(|entry| std::fs::read_to_string(entry.path()).ok());
    texts.map(|text| text.lines().filter(|line| line.starts_with("def test_")).count()).sum()
}
