//! `unsafe` stands only in files listed here, each use under a comment that says why it is sound.

use super::Problem;
use super::source::{SourceFile, is_word};

/// Files that may hold `unsafe`; a path that ends in `/` means all files of that folder.
const ALLOWED: &[&str] = &[
    // Advice to the system about fresh memory.
    "crates/pellicle/src/math/memory.rs",
    "crates/pellicle/src/math/simd.rs",
    "crates/pellicle/src/math/simd/",
    // An allocator that counts.
    "crates/pellicle-conformance/src/allocations.rs",
];

pub fn check(file: &SourceFile) -> Vec<Problem> {
    let listed = ALLOWED.iter().any(|&path| file.path == path || path.ends_with('/') && file.path.starts_with(path));
    let judge = |(number, code): (usize, &str)| match (uses_unsafe(code), listed) {
        (false, _) => None,
        (true, false) => Some(file.problem(number + 1, "unsafe outside the files listed in xtask/src/tidy/safety.rs")),
        (true, true) if is_explained(&file.text, number) => None,
        (true, true) => Some(file.problem(number + 1, "unsafe without a SAFETY comment above it")),
    };
    file.code.lines().enumerate().filter_map(judge).collect()
}

/// Whether a line of code has the keyword, other than in the type of a function pointer.
fn uses_unsafe(code: &str) -> bool {
    code.match_indices("unsafe").any(|(at, word)| {
        let (before, after) = (&code[..at], &code[at + word.len()..]);
        let whole = !before.ends_with(is_word) && !after.starts_with(is_word);
        whole && !after.trim_start().starts_with("fn(") && !after.trim_start().starts_with("extern \"C\" fn(")
    })
}

/// Whether the line, or the comments and attributes above its statement, say SAFETY or have a section `# Safety`.
fn is_explained(text: &str, number: usize) -> bool {
    let says = |line: &str| line.contains("SAFETY:") || line.contains("# Safety");
    let lines: Vec<&str> = text.lines().collect();
    if says(lines[number]) {
        return true;
    }
    for line in lines[..number].iter().rev().map(|line| line.trim()) {
        if line.starts_with("//") {
            if says(line) {
                return true;
            }
        } else if !line.starts_with("#[") && (line.is_empty() || line.ends_with([';', '{', '}'])) {
            return false;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const LISTED: &str = "crates/pellicle/src/math/simd/avx2.rs";

    fn problems(path: &str, text: &str) -> usize {
        check(&SourceFile::new(path, text)).len()
    }

    #[test]
    fn unsafe_in_an_unlisted_file_fails() {
        assert_eq!(problems("crates/pellicle/src/fill/simd.rs", "// SAFETY: none\nunsafe { f() }\n"), 1);
    }

    #[test]
    fn unsafe_in_a_listed_file_needs_its_comment() {
        assert_eq!(problems(LISTED, "fn f() {\n    unsafe { g() }\n}\n"), 1);
        assert_eq!(problems(LISTED, "fn f() {\n    // SAFETY: because\n    unsafe { g() }\n}\n"), 0);
        assert_eq!(problems(LISTED, "// SAFETY: because\nlet x =\n    unsafe { g() };\n"), 0);
        assert_eq!(problems(LISTED, "// SAFETY: of another\nf();\nunsafe { g() };\n"), 1);
    }

    #[test]
    fn unsafe_function_needs_its_section() {
        assert_eq!(problems(LISTED, "/// # Safety\n/// AVX2 must be there.\n#[inline]\npub unsafe fn f() {}\n"), 0);
        assert_eq!(problems(LISTED, "/// Fast.\npub unsafe fn f() {}\n"), 1);
    }

    #[test]
    fn the_word_alone_is_no_use() {
        assert_eq!(problems("a.rs", "// unsafe\n#![forbid(unsafe_code)]\nlet s = \"unsafe\";\n"), 0);
        assert_eq!(problems(LISTED, "struct F(unsafe fn(*const f32));\n"), 0);
    }
}
