//! Source files as the rules see them: the text, and the code in it without comments, strings and tests.

use std::path::{Path, PathBuf};

use super::Problem;

/// Folders that hold no source of ours.
const NOT_OURS: [&str; 4] = ["target", "node_modules", "__pycache__", "venv"];
/// Kinds of files that the rules are about.
const KINDS: [&str; 6] = ["rs", "py", "sh", "wgsl", "toml", "md"];

/// One file. `code` and `tested` have the same lines as `text`, so that line numbers agree.
pub struct SourceFile {
    /// From the workspace's folder, with `/`.
    pub path: String,
    pub text: String,
    /// With comments and the insides of strings blanked. Rust only, else empty.
    pub code: String,
    /// `code` without what is compiled for tests only.
    pub code_without_tests: String,
}

impl SourceFile {
    pub fn new(path: &str, text: &str) -> Self {
        let code = if path.ends_with(".rs") { blank_comments_and_strings(text) } else { String::new() };
        let is_test = ["/tests.rs", "_test.rs", "_tests.rs"].iter().any(|end| path.ends_with(end));
        let is_test = is_test || path.split('/').any(|folder| folder == "tests" || folder == "benches");
        let code_without_tests = if is_test { blank(&code) } else { blank_tests(&code) };
        Self { path: path.into(), text: text.into(), code, code_without_tests }
    }

    pub fn problem(&self, line: usize, text: impl Into<String>) -> Problem {
        Problem { file: self.path.clone(), line, text: text.into() }
    }

    /// The module's documentation, `//!` lines without their mark.
    pub fn header(&self) -> String {
        let lines = self.text.lines().take_while(|line| line.starts_with("//!") || line.is_empty());
        lines.filter_map(|line| line.strip_prefix("//!")).collect::<Vec<_>>().join("\n")
    }
}

/// All source files under `root`, in the order of their paths.
pub fn read_all(root: &Path) -> Result<Vec<SourceFile>, String> {
    let mut paths = Vec::new();
    collect(root, &mut paths)?;
    paths.sort();
    let read = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let local = path.strip_prefix(root).unwrap_or(path).to_string_lossy().replace('\\', "/");
        Ok(SourceFile::new(&local, &text))
    };
    paths.iter().map(read).collect()
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) -> Result<(), String> {
    let say = |e: std::io::Error| format!("{}: {e}", folder.display());
    for entry in std::fs::read_dir(folder).map_err(say)? {
        let entry = entry.map_err(say)?;
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        let kind = entry.file_type().map_err(say)?;
        if kind.is_dir() && !name.starts_with('.') && !NOT_OURS.contains(&name.as_ref()) {
            collect(&path, paths)?;
        } else if kind.is_file() && path.extension().is_some_and(|e| KINDS.iter().any(|kind| e == *kind)) {
            paths.push(path);
        }
    }
    Ok(())
}

/// Everything but line ends becomes a space.
fn blank(text: &str) -> String {
    text.chars().map(|c| if c == '\n' { '\n' } else { ' ' }).collect()
}

/// Rust without comments and the insides of string and character literals.
fn blank_comments_and_strings(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let previous = out.chars().next_back();
        let (skip, keep_ends) = match first {
            '/' if rest.starts_with("//") => (rest.find('\n').unwrap_or(rest.len()), false),
            '/' if rest.starts_with("/*") => (comment_length(rest), false),
            '"' => (string_length(rest), true),
            'r' if !previous.is_some_and(is_word) || previous == Some('b') => (raw_string_length(rest), true),
            '\'' => (character_length(rest), true),
            _ => (0, false),
        };
        if skip == 0 {
            out.push(first);
            rest = &rest[first.len_utf8()..];
            continue;
        }
        let blanked = blank(&rest[..skip]);
        if keep_ends {
            out.push('"');
            out.push_str(blanked.get(1..blanked.len().saturating_sub(1)).unwrap_or(""));
            out.push('"');
        } else {
            out.push_str(&blanked);
        }
        rest = &rest[skip..];
    }
    out
}

pub fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Length of a `/* */` comment; they nest.
fn comment_length(rest: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with("/*") {
            (depth, at) = (depth + 1, at + 2);
        } else if rest[at..].starts_with("*/") {
            (depth, at) = (depth - 1, at + 2);
            if depth == 0 {
                break;
            }
        } else {
            at += rest[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    at
}

fn string_length(rest: &str) -> usize {
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

/// 0 when this is a name that begins with r.
fn raw_string_length(rest: &str) -> usize {
    let hashes = rest[1..].chars().take_while(|&c| c == '#').count();
    if !rest[1 + hashes..].starts_with('"') {
        return 0;
    }
    let end = format!("\"{}", "#".repeat(hashes));
    let from = 2 + hashes;
    rest[from..].find(&end).map_or(rest.len(), |at| from + at + end.len())
}

/// 0 when this is a lifetime.
fn character_length(rest: &str) -> usize {
    let mut inner = rest[1..].char_indices();
    match (inner.next(), inner.next()) {
        (Some((_, '\\')), Some(_)) => inner.find(|&(_, c)| c == '\'').map_or(0, |(at, _)| at + 2),
        (Some(_), Some((at, '\''))) => at + 2,
        _ => 0,
    }
}

/// Blanks each item that follows `#[cfg(test)]`.
fn blank_tests(code: &str) -> String {
    const MARK: &str = "#[cfg(test)]";
    let mut out = String::with_capacity(code.len());
    let mut rest = code;
    while let Some(at) = rest.find(MARK) {
        out.push_str(&rest[..at]);
        let end = at + MARK.len() + item_length(&rest[at + MARK.len()..]);
        out.push_str(&blank(&rest[at..end]));
        rest = &rest[end..];
    }
    out + rest
}

/// Length of an item: to its closing brace, or to its semicolon if that comes before any brace.
fn item_length(rest: &str) -> usize {
    let mut depth = 0;
    for (at, c) in rest.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth <= 1 => return at + 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(text: &str) -> String {
        SourceFile::new("crates/x/src/y.rs", text).code
    }

    #[test]
    fn comments_and_strings_are_no_code() {
        let text = "a /* unsafe /* b */ */ c // unsafe\n\"unsafe \\\" x\" r#\"un\"safe\"# '\\'' 'x' d";
        let code = code(text);
        assert!(!code.contains("unsafe") && !code.contains("safe"), "{code}");
        assert!(code.contains('a') && code.contains('c') && code.ends_with('d'), "{code}");
        assert_eq!(code.lines().count(), text.lines().count());
    }

    #[test]
    fn lifetimes_are_no_characters() {
        assert!(code("fn f<'a>(x: &'a str) { unsafe { g('b') } }").contains("unsafe"));
    }

    #[test]
    fn test_modules_are_no_code_and_lines_stay() {
        let file = SourceFile::new("x.rs", "use a;\n#[cfg(test)]\nmod tests {\n  use b;\n}\nuse c;\n");
        assert!(file.code_without_tests.contains("use a;") && file.code_without_tests.contains("use c;"));
        assert!(!file.code_without_tests.contains("use b;"));
        assert_eq!(file.code_without_tests.lines().nth(5), Some("use c;"));
        let file = SourceFile::new("x.rs", "#[cfg(test)]\nmod tests;\nuse c;\n");
        assert!(file.code_without_tests.contains("use c;"));
    }
}
