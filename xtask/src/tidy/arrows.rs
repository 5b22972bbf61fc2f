//! In the core, a module uses only modules to its left, so that reading order is module order is data order.
//!
//! Paths from `crate::` and those that climb to the root by `super::` are followed; names that the root re-exports
//! (`crate::Mesh`) count as the module that they come from. Tests may use everything, and so may `lib.rs`, `pipeline` and `internals`.

use std::collections::HashMap;

use super::Problem;
use super::source::{SourceFile, is_word};

const CORE: &str = "crates/pellicle/src/";

/// Left to right. Modules of one group may use each other.
const ORDER: &[&[&str]] = &[
    &["math", "error", "progress", "stats", "params"],
    &["particles"],
    &["lattice"],
    &["lookup"],
    &["field"],
    &["fill"],
    &["bricks"],
    &["march", "remesh"],
    &["mesh"],
    &["post"],
    &["sink"],
];

/// See everything.
const EXEMPT: &[&str] = &["lib", "pipeline", "internals"];

/// Which module each name comes from that `lib.rs` re-exports.
pub struct Roots(HashMap<String, String>);

impl Roots {
    pub fn of(files: &[SourceFile]) -> Self {
        let lib = files.iter().find(|file| file.path == format!("{CORE}lib.rs"));
        let mut names = HashMap::new();
        for statement in lib.map_or("", |lib| lib.code.as_str()).split(';') {
            let Some((_, tree)) = statement.split_once("use ") else { continue };
            for path in flatten(tree) {
                if let [module, .., name] = &path[..] {
                    names.insert(name.clone(), module.clone());
                }
            }
        }
        Self(names)
    }
}

pub fn check(file: &SourceFile, roots: &Roots) -> Vec<Problem> {
    let Some(local) = file.path.strip_prefix(CORE) else { return Vec::new() };
    let here = module_path(local);
    let Some(module) = here.first().filter(|module| !EXEMPT.contains(&module.as_str())) else { return Vec::new() };
    let Some(rank) = rank(module) else {
        return vec![file.problem(1, format!("{module} has no place in the order of xtask/src/tidy/arrows.rs"))];
    };
    let mut problems = Vec::new();
    for (line, name) in used_from_root(&file.code_without_tests, here.len()) {
        let used = roots.0.get(&name).unwrap_or(&name);
        if used == "pipeline" || self::rank(used).is_some_and(|used| used > rank) {
            problems.push(file.problem(line, format!("{module} uses {used}, which stands to its right")));
        }
    }
    problems
}

fn rank(module: &str) -> Option<usize> {
    ORDER.iter().position(|group| group.contains(&module))
}

/// `march/cubes/mod.rs` is march, cubes. `lib.rs` is lib.
fn module_path(local: &str) -> Vec<String> {
    let mut path: Vec<String> = local.trim_end_matches(".rs").split('/').map(String::from).collect();
    if path.len() > 1 && path.last().is_some_and(|last| last == "mod") {
        path.pop();
    }
    path
}

/// The first names, after the root, of all paths in the code, with their lines. `depth` is how many times `super::`
/// leads from here to the root.
fn used_from_root(code: &str, depth: usize) -> Vec<(usize, String)> {
    let mut used = Vec::new();
    let climb = "super::".repeat(depth);
    for prefix in ["crate::", &climb] {
        for (at, _) in code.match_indices(prefix) {
            let before = &code[..at];
            if before.ends_with(is_word) || before.ends_with("super::") || before.ends_with('$') {
                continue;
            }
            let line = before.matches('\n').count() + 1;
            let names = flatten(&code[at + prefix.len()..]).into_iter().filter_map(|path| path.into_iter().next());
            used.extend(names.map(|name| (line, name)));
        }
    }
    used.sort();
    used.dedup();
    used
}

/// The paths of a use tree such as `a::{b, c::{d, e as f}}`: here a b, a c d, a c f. Stops where the tree ends.
fn flatten(tree: &str) -> Vec<Vec<String>> {
    let mut tokens = Tokens(tree);
    let mut paths = Vec::new();
    tokens.tree(&[], &mut paths);
    paths
}

struct Tokens<'a>(&'a str);

impl Tokens<'_> {
    fn tree(&mut self, prefix: &[String], paths: &mut Vec<Vec<String>>) {
        let mut path = prefix.to_vec();
        loop {
            if self.take("{") {
                while !self.take("}") {
                    self.tree(&path, paths);
                    if !self.take(",") && !self.0.trim_start().starts_with('}') {
                        return;
                    }
                }
                return;
            }
            let Some(word) = self.word() else { break };
            if word != "self" {
                path.push(word);
            }
            if !self.take("::") {
                break;
            }
        }
        if self.take("as ")
            && let Some(name) = self.word()
        {
            path.pop();
            path.push(name);
        }
        paths.push(path);
    }

    fn take(&mut self, token: &str) -> bool {
        let rest = self.0.trim_start().strip_prefix(token);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn word(&mut self) -> Option<String> {
        let rest = self.0.trim_start();
        let end = rest.find(|c| !is_word(c) && c != '*').unwrap_or(rest.len());
        self.0 = &rest[end..];
        (end > 0).then(|| rest[..end].to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIB: &str =
        "pub mod mesh;\nmod error;\npub use error::Error;\npub use mesh::{Mesh, check::Report as Judge};\n";

    fn problems(local: &str, text: &str) -> Vec<Problem> {
        let lib = SourceFile::new(&format!("{CORE}lib.rs"), LIB);
        let roots = Roots::of(&[lib]);
        check(&SourceFile::new(&format!("{CORE}{local}"), text), &roots)
    }

    #[test]
    fn backward_use_fails() {
        assert_eq!(problems("field/sph.rs", "use crate::math::Vec3;\nuse crate::mesh::Mesh;\n")[0].line, 2);
        assert_eq!(problems("field/sph.rs", "use crate::{math, fill::Slab};\n").len(), 1);
        assert_eq!(problems("error.rs", "fn f(p: crate::particles::Positions) {}\n").len(), 1);
    }

    #[test]
    fn forward_and_sideways_use_pass() {
        assert_eq!(problems("march/cubes/emit.rs", "use crate::{bricks::Brick, remesh, field::{a, b}};\n"), []);
        assert_eq!(problems("mesh/check.rs", "use super::Mesh;\nuse crate::Error;\n"), []);
    }

    #[test]
    fn re_exports_count_as_their_module() {
        assert_eq!(problems("field/sph.rs", "use crate::Mesh;\n").len(), 1);
        assert_eq!(problems("field/sph.rs", "use crate::{Error, Judge};\n").len(), 1);
        assert_eq!(problems("field/sph.rs", "use crate::Error;\n"), []);
    }

    #[test]
    fn climbing_to_the_root_counts() {
        assert_eq!(problems("field/sph.rs", "use super::super::sink;\n").len(), 1);
        assert_eq!(problems("field/sph.rs", "use super::mesh;\n"), []);
        assert_eq!(problems("field/mod.rs", "use super::mesh;\n").len(), 1);
    }

    #[test]
    fn pipeline_sees_all_and_nobody_sees_it() {
        assert_eq!(problems("pipeline.rs", "use crate::sink;\nuse crate::field;\n"), []);
        assert_eq!(problems("sink/mod.rs", "use crate::pipeline::Road;\n").len(), 1);
    }

    #[test]
    fn tests_and_comments_are_free() {
        assert_eq!(
            problems("field/sph.rs", "/// See [`crate::mesh::Mesh`].\n#[cfg(test)]\nmod tests { use crate::mesh; }\n"),
            []
        );
        assert_eq!(problems("field/sph/tests.rs", "use crate::mesh;\n"), []);
    }

    #[test]
    fn module_without_a_place_fails() {
        assert_eq!(problems("utils.rs", "").len(), 1);
    }

    #[test]
    fn use_trees_are_flattened() {
        let paths: Vec<String> = flatten("a::{b, c::{d, e as f}, self}; x").iter().map(|p| p.join(" ")).collect();
        assert_eq!(paths, ["a b", "a c d", "a c f", "a"]);
    }
}
