//! Each dependency has its line in `docs/dependencies.md`: why it, what was the runner-up.

use std::collections::HashSet;

use super::Problem;
use super::source::SourceFile;

const REASONS: &str = "docs/dependencies.md";

/// Names that stand in the first cell of a table's row.
pub struct Explained(HashSet<String>);

impl Explained {
    pub fn of(files: &[SourceFile]) -> Self {
        let text = files.iter().find(|file| file.path == REASONS).map_or("", |file| file.text.as_str());
        let cells = text.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
        Self(cells.flat_map(|cell| cell.split(',')).map(|name| name.trim().to_string()).collect())
    }
}

pub fn check(file: &SourceFile, explained: &Explained) -> Vec<Problem> {
    if !file.path.ends_with("Cargo.toml") {
        return Vec::new();
    }
    let mut problems = Vec::new();
    let mut among_dependencies = false;
    for (number, line) in file.text.lines().enumerate() {
        if let Some(section) = line.strip_prefix('[') {
            among_dependencies = section.trim_end().ends_with("dependencies]");
            continue;
        }
        let name = line.split(['=', '.']).next().unwrap_or_default().trim();
        let is_dependency = among_dependencies && !name.is_empty() && !name.starts_with('#');
        // Crates of the workspace need no reason.
        if is_dependency && !name.starts_with("pellicle") && !explained.0.contains(name) {
            problems.push(
                file.problem(number + 1, format!("{name} has no line in {REASONS}: why it, what was the runner-up")),
            );
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependency_without_a_reason_fails() {
        let reasons =
            SourceFile::new(REASONS, "| crate | why |\n|---|---|\n| rayon | threads |\n| numpy, scipy | judge |\n");
        let explained = Explained::of(&[reasons]);
        let manifest = "[package]\nname = \"x\"\n[dependencies]\nrayon.workspace = true\npellicle = { path = \"..\" }\n\
            anyhow = \"1\"\n# no more\n[lints]\nworkspace = true\n";
        let problems = check(&SourceFile::new("crates/x/Cargo.toml", manifest), &explained);
        assert_eq!(problems.iter().map(|problem| problem.line).collect::<Vec<_>>(), [6]);
    }
}
