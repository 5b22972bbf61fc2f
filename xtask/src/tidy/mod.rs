//! The rules of the house, where a program can check them. Each rule is one file with its list of exceptions on top.
//!
//! | file | rule |
//! |---|---|
//! | `arrows` | in the core, a module uses only modules to its left |
//! | `size` | no file over 500 lines |
//! | `safety` | `unsafe` only where it is listed, each use with its reason |
//! | `sources` | a method module says where its method is from |
//! | `dependencies` | each dependency has its line in `docs/dependencies.md` |
//! | `words` | nothing unfinished; the libraries print nothing, the core opens no files and reads no clock |

mod arrows;
mod dependencies;
mod safety;
mod size;
mod source;
mod sources;
mod words;

use std::path::Path;

use source::SourceFile;

/// A broken rule. Shown as `file:line: text`.
#[derive(Debug, PartialEq, Eq)]
struct Problem {
    file: String,
    /// From 1.
    line: usize,
    text: String,
}

/// Checks the workspace and prints what is wrong. Whether nothing is.
pub fn run(root: &Path) -> bool {
    let files = match source::read_all(root) {
        Ok(files) => files,
        Err(e) => {
            println!("tidy: {e}");
            return false;
        }
    };
    let problems = check(&files);
    for Problem { file, line, text } in &problems {
        println!("{file}:{line}: {text}");
    }
    println!("tidy: {} files, {} problems", files.len(), problems.len());
    problems.is_empty()
}

fn check(files: &[SourceFile]) -> Vec<Problem> {
    let roots = arrows::Roots::of(files);
    let explained = dependencies::Explained::of(files);
    let rules = |file| {
        [
            arrows::check(file, &roots),
            size::check(file),
            safety::check(file),
            sources::check(file),
            dependencies::check(file, &explained),
            words::check(file),
        ]
    };
    files.iter().flat_map(rules).flatten().collect()
}
