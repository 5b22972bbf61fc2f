//! A method module names the source of its method in its header: a `Source:` line with author, title and year, or
//! `Source: this project`, with the reason.

use super::Problem;
use super::source::{SourceFile, is_word};

/// Where methods live.
const METHODS: [&str; 6] = ["field", "fill", "lookup", "march", "post", "remesh"];

pub fn check(file: &SourceFile) -> Vec<Problem> {
    let Some(local) = file.path.strip_prefix("crates/pellicle/src/") else { return Vec::new() };
    let module = local.trim_end_matches(".rs").split('/').next().unwrap_or_default();
    // A file of declarations, or of tests, holds no method.
    let has_code = file.code_without_tests.split(|c| !is_word(c)).any(|word| word == "fn");
    if !METHODS.contains(&module) || !has_code {
        return Vec::new();
    }
    match source(&file.header()) {
        Some(source) if source.starts_with("this project") || names_a_year(&source) => Vec::new(),
        Some(_) => vec![file.problem(1, "the header's Source: line has no year (author, title, year)")],
        None => vec![file.problem(1, "no Source: line in the header (author, title, year; or: this project, and why)")],
    }
}

/// The text from `Source:` to the end of its paragraph.
fn source(header: &str) -> Option<String> {
    let (_, after) = header.split_once("Source:")?;
    let paragraph: Vec<&str> = after.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    Some(paragraph.join(" ").trim().to_string())
}

fn names_a_year(text: &str) -> bool {
    let mut numbers = text.split(|c: char| !c.is_ascii_digit()).filter(|number| number.len() == 4);
    numbers.any(|number| number.starts_with("19") || number.starts_with("20"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(path: &str, text: &str) -> usize {
        check(&SourceFile::new(path, text)).len()
    }

    #[test]
    fn method_without_a_source_fails() {
        assert_eq!(problems("crates/pellicle/src/field/sph.rs", "//! The colour field.\n\nfn f() {}\n"), 1);
        assert_eq!(problems("crates/pellicle/src/field/sph.rs", "//! Source: Müller, a paper\n\nfn f() {}\n"), 1);
    }

    #[test]
    fn named_sources_pass() {
        let paper =
            "//! Fields.\n//!\n//! Source: Müller, Charypar, Gross, \"Particle-based\n//! fluid simulation\", 2003.\n";
        assert_eq!(problems("crates/pellicle/src/field/sph.rs", &format!("{paper}fn f() {{}}\n")), 0);
        assert_eq!(problems("crates/pellicle/src/march/rank.rs", "//! Source: this project; fast.\nfn f() {}\n"), 0);
    }

    #[test]
    fn declarations_tests_and_other_modules_need_none() {
        assert_eq!(problems("crates/pellicle/src/field/mod.rs", "//! Fields.\npub mod sph;\n"), 0);
        assert_eq!(problems("crates/pellicle/src/fill/tests.rs", "//! Tests.\nfn f() {}\n"), 0);
        assert_eq!(problems("crates/pellicle/src/lattice/mod.rs", "//! Integers.\nfn f() {}\n"), 0);
    }
}
