//! Names with a frame number in them: `frame_####.bgeo`, `run/$F/f_$F4.vtk`.
//!
//! | in a name | stands for |
//! |---|---|
//! | `{}` `%d` `$F` | the number, with as many digits as it has |
//! | `####` | at least as many digits as there are `#`, zeros in front; a minus comes before them |
//! | `%04d` `$F4` | at least so many characters, zeros in front, a minus counted among them, as in C |
//!
//! It may stand several times, in folders, too, always for the same number. A `%` or `$` that begins none of these means
//! itself. A name that has no number in it is no pattern, and a file that really is called `a#b.ply` is found by the caller
//! before anything is taken for a pattern.
//!
//! Reading is more generous than writing: `{}` finds `f_7` and `f_007`; a padded form finds longer numbers, too. The names
//! that are found are used as they are.

use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::failure::Failure;

/// A path with one or more places for the number.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    parts: Vec<Part>,
}

/// A component of the path.
#[derive(Debug, Clone, PartialEq)]
enum Part {
    Plain(PathBuf),
    /// Pieces in turn; never empty.
    Numbered(Vec<Piece>),
}

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Text(String),
    Number { width: usize, counts_sign: bool },
}

/// Wider ones are refused: no file name holds more.
const MAX_WIDTH: usize = 200;

impl Pattern {
    /// The pattern in a path; `None` if there is no place for a number.
    ///
    /// # Errors
    /// A pattern in a component that is not UTF-8, or with more digits than a file name holds.
    pub fn parse(path: &Path) -> Result<Option<Self>, Failure> {
        let mut parts = Vec::new();
        for component in path.components() {
            let Component::Normal(name) = component else {
                parts.push(Part::Plain(component.as_os_str().into()));
                continue;
            };
            let pieces = pieces(&name.to_string_lossy());
            let is_number = |piece: &Piece| matches!(piece, Piece::Number { .. });
            if !pieces.iter().any(is_number) {
                parts.push(Part::Plain(name.into()));
                continue;
            }
            let usage = |what: &str| Failure::Usage(format!("{}: {what}", path.display()));
            if name.to_str().is_none() {
                return Err(usage("a name with a frame number must be UTF-8 (rename it, or list the files)"));
            }
            if pieces.iter().any(|piece| matches!(piece, Piece::Number { width, .. } if *width > MAX_WIDTH)) {
                return Err(usage("the frame number has more digits than a file name can hold"));
            }
            parts.push(Part::Numbered(pieces));
        }
        let has_number = parts.iter().any(|part| matches!(part, Part::Numbered(_)));
        Ok(has_number.then_some(Self { parts }))
    }

    /// The path of a frame.
    pub fn name(&self, number: i64) -> PathBuf {
        self.parts.iter().map(|part| part.name(number)).collect()
    }

    /// As C and ffmpeg write it, with `%04d` for the number.
    pub fn printf(&self) -> String {
        let text = |text: &str| text.replace('%', "%%");
        let piece = |piece: &Piece| match piece {
            Piece::Text(plain) => text(plain),
            Piece::Number { width: 0 | 1, .. } => "%d".to_owned(),
            Piece::Number { width, .. } => format!("%0{width}d"),
        };
        let part = |part: &Part| match part {
            Part::Plain(path) => text(&path.to_string_lossy()),
            Part::Numbered(pieces) => pieces.iter().map(piece).collect(),
        };
        self.parts.iter().map(|p| PathBuf::from(part(p))).collect::<PathBuf>().to_string_lossy().into_owned()
    }

    /// Every file that fits, with its number, in numeric order.
    ///
    /// # Errors
    /// A folder that cannot be read, or two files with one number, such as `f_7` and `f_07`.
    pub fn find(&self) -> Result<Vec<(i64, PathBuf)>, Failure> {
        let mut found = vec![(None, PathBuf::new())];
        for (i, part) in self.parts.iter().enumerate() {
            let is_last = i + 1 == self.parts.len();
            let mut next = Vec::new();
            for (number, path) in found {
                match part {
                    Part::Plain(name) => {
                        let path = path.join(name);
                        // What comes before the first number is checked by listing it.
                        if number.is_none() || path.exists() {
                            next.push((number, path));
                        }
                    }
                    Part::Numbered(pieces) => {
                        let fits = list(&path, number.is_some())?.into_iter().filter_map(|name| {
                            let fit = fit(pieces, &name)?;
                            (number.is_none_or(|n| n == fit)).then(|| (Some(fit), path.join(name)))
                        });
                        next.extend(fits.filter(|(_, path)| path.is_dir() != is_last));
                    }
                }
            }
            found = next;
        }
        let mut files: Vec<(i64, PathBuf)> =
            found.into_iter().filter_map(|(number, path)| Some((number?, path))).filter(|(_, p)| p.is_file()).collect();
        files.sort();
        distinct(files)
    }
}

/// Refuses files that share a number. They are in numeric order.
pub(super) fn distinct(files: Vec<(i64, PathBuf)>) -> Result<Vec<(i64, PathBuf)>, Failure> {
    match files.array_windows().find(|[(a, _), (b, _)]| a == b) {
        Some([(number, a), (_, b)]) => Err(Failure::Work(format!(
            "{} and {} are both frame {number} (remove one, or name the files wanted with a padded pattern such as ####)",
            a.display(),
            b.display()
        ))),
        None => Ok(files),
    }
}

/// Names in a folder that are UTF-8; others fit no pattern.
fn list(folder: &Path, may_be_missing: bool) -> Result<Vec<String>, Failure> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let failed = |error: std::io::Error| Failure::file(folder, format_args!("cannot list the folder: {error}"));
    let entries = match fs::read_dir(folder) {
        Err(_) if may_be_missing => return Ok(Vec::new()),
        entries => entries.map_err(failed)?,
    };
    let mut names = Vec::new();
    for entry in entries {
        names.extend(entry.map_err(failed)?.file_name().into_string().ok());
    }
    Ok(names)
}

impl Part {
    fn name(&self, number: i64) -> PathBuf {
        match self {
            Self::Plain(name) => name.clone(),
            Self::Numbered(pieces) => pieces.iter().map(|piece| piece.text(number)).collect::<String>().into(),
        }
    }
}

impl Piece {
    fn text(&self, number: i64) -> String {
        match *self {
            Self::Text(ref text) => text.clone(),
            Self::Number { width, counts_sign } => {
                let width = width + usize::from(number < 0 && !counts_sign);
                format!("{number:0width$}")
            }
        }
    }
}

/// The number that makes the pieces this name, the same at every place.
fn fit(pieces: &[Piece], name: &str) -> Option<i64> {
    // Only the digits in the name can be the number, so there are few to try, and the first place says which.
    let (Piece::Text(first), rest) = pieces.split_first()? else { return fit_rest(pieces, name, None) };
    fit_rest(rest, name.strip_prefix(first.as_str())?, None)
}

fn fit_rest(pieces: &[Piece], name: &str, known: Option<i64>) -> Option<i64> {
    let Some((piece, rest)) = pieces.split_first() else { return if name.is_empty() { known } else { None } };
    match piece {
        Piece::Text(text) => fit_rest(rest, name.strip_prefix(text.as_str())?, known),
        Piece::Number { width, counts_sign } => {
            let sign = usize::from(name.starts_with('-'));
            let digits = name[sign..].bytes().take_while(u8::is_ascii_digit).count();
            // The longest first; shorter ones where digits follow as text.
            (1..=digits).rev().find_map(|digits| {
                let text = &name[..sign + digits];
                let number: i64 = text.parse().ok()?;
                let characters = if *counts_sign { sign + digits } else { digits };
                let is_minus_zero = sign == 1 && number == 0;
                if characters < *width || is_minus_zero || known.is_some_and(|known| known != number) {
                    return None;
                }
                fit_rest(rest, &name[text.len()..], Some(number))
            })
        }
    }
}

/// A name cut at its numbers.
fn pieces(name: &str) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut text = String::new();
    let mut rest = name;
    while let Some(c) = rest.chars().next() {
        if let Some((piece, length)) = number(rest) {
            if !text.is_empty() {
                pieces.push(Piece::Text(std::mem::take(&mut text)));
            }
            pieces.push(piece);
            rest = &rest[length..];
        } else {
            text.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    if !text.is_empty() {
        pieces.push(Piece::Text(text));
    }
    pieces
}

/// The place for a number that the text begins with, and its length.
fn number(text: &str) -> Option<(Piece, usize)> {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    // A number of digits that is no number is far too wide.
    let width = |text: &str| if text.is_empty() { 1 } else { text.parse().unwrap_or(usize::MAX) };
    let hashes = text.bytes().take_while(|&b| b == b'#').count();
    if hashes > 0 {
        return Some((Piece::Number { width: hashes, counts_sign: false }, hashes));
    }
    if text.starts_with("{}") {
        return Some((Piece::Number { width: 1, counts_sign: false }, 2));
    }
    if let Some(rest) = text.strip_prefix('%') {
        let count = digits(rest);
        // Without the 0, C pads with blanks, which no file name has.
        let is_padding = count == 0 || rest.starts_with('0');
        if is_padding && rest[count..].starts_with('d') {
            return Some((Piece::Number { width: width(&rest[..count]), counts_sign: true }, count + 2));
        }
    }
    if let Some(rest) = text.strip_prefix("$F") {
        let count = digits(rest);
        if !rest[count..].starts_with(|c: char| c.is_alphanumeric()) {
            return Some((Piece::Number { width: width(&rest[..count]), counts_sign: true }, count + 2));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::scratch::Folder;

    fn pattern(text: &str) -> Pattern {
        Pattern::parse(Path::new(text)).unwrap_or_else(|e| panic!("{e}")).unwrap_or_else(|| panic!("{text}"))
    }

    #[test]
    fn every_spelling_writes_its_number() {
        for (text, seven, minus) in [
            ("a_{}.ply", "a_7.ply", "a_-12345.ply"),
            ("a_####.ply", "a_0007.ply", "a_-12345.ply"),
            ("a_%d.ply", "a_7.ply", "a_-12345.ply"),
            ("a_%08d.ply", "a_00000007.ply", "a_-0012345.ply"),
            ("a_$F.ply", "a_7.ply", "a_-12345.ply"),
            ("a_$F8.ply", "a_00000007.ply", "a_-0012345.ply"),
            ("########", "00000007", "-00012345"),
            ("r$F/x/b$F3.$F.ply", "r7/x/b007.7.ply", "r-12345/x/b-12345.-12345.ply"),
        ] {
            assert_eq!(pattern(text).name(7), Path::new(seven));
            assert_eq!(pattern(text).name(-12345), Path::new(minus));
        }
        assert_eq!(pattern("/a/../b#").name(1), Path::new("/a/../b1"));
        assert_eq!(pattern("a_{}").name(i64::MIN), Path::new("a_-9223372036854775808"));
    }

    #[test]
    fn what_has_no_number_is_no_pattern() {
        for text in ["a.ply", "a%.ply", "100%", "%4d", "%s", "$FOO", "$F4x", "${F}", "{x}", "a{", "$f", ""] {
            assert_eq!(Pattern::parse(Path::new(text)).unwrap(), None, "{text}");
        }
        for text in [format!("a{}", "#".repeat(300)), "$F99999999999999999999999".into()] {
            assert!(matches!(Pattern::parse(Path::new(&text)), Err(Failure::Usage(_))), "{text}");
        }
    }

    #[test]
    fn names_fit_with_one_number_at_all_places() {
        let fit = |text: &str, name: &str| match &pattern(text).parts[0] {
            Part::Numbered(pieces) => fit(pieces, name),
            Part::Plain(_) => None,
        };
        assert_eq!(fit("f{}.ply", "f12.ply"), Some(12));
        assert_eq!(fit("f{}.ply", "f012.ply"), Some(12));
        assert_eq!(fit("f{}.ply", "f-3.ply"), Some(-3));
        assert_eq!(fit("f-{}.ply", "f-3.ply"), Some(3));
        assert_eq!(fit("f###.ply", "f12.ply"), None);
        assert_eq!(fit("f###.ply", "f1234.ply"), Some(1234));
        assert_eq!(fit("f%03d.ply", "f-12.ply"), Some(-12));
        assert_eq!(fit("f$F_$F4.ply", "f12_0012.ply"), Some(12));
        assert_eq!(fit("f$F_$F4.ply", "f12_0013.ply"), None);
        assert_eq!(fit("f{}0.ply", "f120.ply"), Some(12), "digits may follow as text");
        assert_eq!(fit("{}{}", "77"), Some(7));
        for name in
            ["f.ply", "f1.PLY", "f1.ply2", "xf1.ply", "f99999999999999999999.ply", "f-0.ply", "f-.ply", "f1 .ply"]
        {
            assert_eq!(fit("f{}.ply", name), None, "{name}");
        }
    }

    #[test]
    fn files_come_in_numeric_order_and_folders_may_carry_the_number() {
        let folder =
            Folder::with(&["f_10.ply", "f_2.ply", "f_-1.ply", "f_x.ply", "g_3.ply", "f_5.ply/no", "r1/f1.ply"]);
        folder.add(&["r2/f2.ply", "r3/f4.ply", "r4/x", "deep/r1/s/f1.ply", "deep/r2/f2.ply", "deep/r3/s/f3.ply"]);
        let names = |text: &str| -> Vec<(i64, PathBuf)> {
            let found = pattern(folder.path().join(text).to_str().unwrap()).find().unwrap_or_else(|e| panic!("{e}"));
            found.into_iter().map(|(n, p)| (n, p.strip_prefix(folder.path()).unwrap().to_owned())).collect()
        };
        let expect =
            |list: &[(i64, &str)]| -> Vec<(i64, PathBuf)> { list.iter().map(|&(n, p)| (n, p.into())).collect() };
        assert_eq!(names("f_{}.ply"), expect(&[(-1, "f_-1.ply"), (2, "f_2.ply"), (10, "f_10.ply")]));
        assert_eq!(names("f_##.ply"), expect(&[(10, "f_10.ply")]));
        assert_eq!(names("r$F/f$F.ply"), expect(&[(1, "r1/f1.ply"), (2, "r2/f2.ply")]));
        assert_eq!(names("deep/r#/s/f#.ply"), expect(&[(1, "deep/r1/s/f1.ply"), (3, "deep/r3/s/f3.ply")]));
        assert_eq!(names("h_{}.ply"), []);
        let missing = pattern(folder.path().join("none/f_{}.ply").to_str().unwrap()).find();
        assert!(missing.unwrap_err().to_string().contains("none: cannot list"));
    }

    #[test]
    fn two_files_with_one_number_are_both_named() {
        let folder = Folder::with(&["f_7.ply", "f_007.ply", "f_8.ply"]);
        let found = pattern(folder.path().join("f_{}.ply").to_str().unwrap()).find();
        let message = found.unwrap_err().to_string();
        assert!(message.contains("f_007.ply and ") && message.contains("f_7.ply are both frame 7"), "{message}");
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_not_utf8_are_passed_over() {
        use std::os::unix::ffi::OsStrExt;
        let bad = std::ffi::OsStr::from_bytes(b"f\xff_{}.ply");
        assert!(matches!(Pattern::parse(Path::new(bad)), Err(Failure::Usage(_))));
        let folder = Folder::with(&["f_1.ply"]);
        std::fs::write(folder.path().join(std::ffi::OsStr::from_bytes(b"f_2\xff.ply")), "").unwrap();
        let below = Path::new(std::ffi::OsStr::from_bytes(b"d\xfe")).join("g_{}.ply");
        folder.add(&["f_3.ply"]);
        std::fs::create_dir(folder.path().join(std::ffi::OsStr::from_bytes(b"d\xfe"))).unwrap();
        std::fs::write(folder.path().join(&below).with_file_name("g_4.ply"), "").unwrap();
        assert_eq!(pattern(folder.path().join("f_{}.ply").to_str().unwrap()).find().unwrap().len(), 2);
        let found = Pattern::parse(&folder.path().join(below)).unwrap().unwrap().find().unwrap();
        assert_eq!(found.len(), 1, "only the component with the number need be UTF-8");
    }
}
