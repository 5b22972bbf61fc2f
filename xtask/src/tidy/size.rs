//! No file of code over 500 lines: past that there are two concepts in it.

use super::Problem;
use super::source::SourceFile;

const MOST: usize = 500;

/// Written by a program, read by nobody.
const GENERATED: &[&str] = &["crates/pellicle/src/march/tables.rs"];

pub fn check(file: &SourceFile) -> Vec<Problem> {
    let lines = file.text.lines().count();
    let is_text = file.path.ends_with(".md");
    if lines <= MOST || is_text || GENERATED.contains(&file.path.as_str()) {
        return Vec::new();
    }
    vec![file.problem(MOST + 1, format!("{lines} lines, {MOST} are allowed: split it by concept"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_501_is_one_too_many() {
        assert_eq!(check(&SourceFile::new("a.rs", &"x\n".repeat(500))), []);
        assert_eq!(check(&SourceFile::new("a.rs", &"x\n".repeat(501))).len(), 1);
        assert_eq!(check(&SourceFile::new("CHANGELOG.md", &"x\n".repeat(501))), []);
        assert_eq!(check(&SourceFile::new(GENERATED[0], &"x\n".repeat(501))), []);
    }
}
