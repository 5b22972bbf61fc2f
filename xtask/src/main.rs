//! Development tasks: `cargo xtask test` runs every check that a change must pass, `cargo xtask tidy` only the rules of
//! the house. Standard library only, so that it builds in a second.

mod formats;
mod python;
mod tally;
mod test;
mod tidy;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask test [--all]   formatting, lints, tidy, docs, Rust tests, Python tests
                                  --all: the slow ones too
       cargo xtask formats        judges all file formats by foreign readers and makes the tables in docs/src/formats.md
       cargo xtask tidy           the rules of the house: see xtask/src/tidy/";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        ["test"] => test::run(&root(), test::Extent::Usual),
        ["test", "--all"] => test::run(&root(), test::Extent::All),
        ["formats"] => formats::run(&root()),
        ["tidy"] => tidy::run(&root()),
        ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            true
        }
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    if done { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The workspace's folder, wherever the task was started.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}
