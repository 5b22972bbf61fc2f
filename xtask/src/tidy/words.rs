//! Words that have no place: what is unfinished, what prints in a library, what opens a file or reads a clock in the core.

use super::Problem;
use super::source::{SourceFile, is_word};

/// Words, where they must not stand (path prefixes), and why.
const FORBIDDEN: &[(&[&str], &[&str], &str)] = &[
    (&["todo!", "unimplemented!", "dbg!"], &[""], "finish it or leave it out"),
    (
        &["println!", "eprintln!", "print!", "eprint!"],
        &[
            "crates/pellicle/src/",
            "crates/pellicle-io/src/",
            "crates/pellicle-render/src/",
            "crates/pellicle-scenes/src/",
        ],
        "a library prints nothing: return it, or hand it to the caller's token",
    ),
    (
        &["std::fs", "std::net", "std::process", "std::time"],
        &["crates/pellicle/src/"],
        "the core knows no files, no processes and no clocks",
    ),
];

pub fn check(file: &SourceFile) -> Vec<Problem> {
    let mut problems = Vec::new();
    for (words, places, reason) in FORBIDDEN {
        if !places.iter().any(|place| file.path.starts_with(place)) {
            continue;
        }
        for (number, line) in file.code_without_tests.lines().enumerate() {
            let found = words.iter().filter(|word| stands_in(word, line));
            problems.extend(found.map(|word| file.problem(number + 1, format!("{word}: {reason}"))));
        }
    }
    problems
}

/// Whether the word stands in the line as a whole.
fn stands_in(word: &str, line: &str) -> bool {
    line.match_indices(word)
        .any(|(at, _)| !line[..at].ends_with(is_word) && !line[at + word.len()..].starts_with(is_word))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(path: &str, text: &str) -> usize {
        check(&SourceFile::new(path, text)).len()
    }

    #[test]
    fn unfinished_code_fails_everywhere() {
        assert_eq!(problems("xtask/src/a.rs", "fn f() { todo!() }\n"), 1);
        assert_eq!(problems("crates/pellicle-cli/src/a.rs", "fn f() { dbg!(1); unimplemented!() }\n"), 2);
        assert_eq!(problems("xtask/src/a.rs", "// todo!()\nfn not_todo() {}\n"), 0);
    }

    #[test]
    fn printing_fails_in_libraries_only() {
        assert_eq!(problems("crates/pellicle/src/a.rs", "fn f() { println!(\"x\") }\n"), 1);
        assert_eq!(problems("crates/pellicle-cli/src/a.rs", "fn f() { println!(\"x\") }\n"), 0);
        assert_eq!(problems("crates/pellicle/src/a.rs", "#[cfg(test)]\nmod tests { fn f() { println!(\"x\") } }\n"), 0);
    }

    #[test]
    fn clocks_and_files_fail_in_the_core() {
        assert_eq!(problems("crates/pellicle/src/a.rs", "use std::time::Instant;\n"), 1);
        assert_eq!(problems("crates/pellicle/src/a.rs", "fn f() { std::fs::read(\"x\"); }\n"), 1);
        assert_eq!(problems("crates/pellicle-io/src/a.rs", "use std::fs::File;\n"), 0);
    }
}
