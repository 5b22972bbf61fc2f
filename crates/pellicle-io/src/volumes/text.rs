//! What the formats with a header of text share: lists of numbers and of names.

use super::data::MAX_FILES;
use crate::error::Error;
use crate::source::Source;

/// Lines of a header, at most.
pub(super) const MAX_LINES: usize = 1 << 12;

/// Exactly so many numbers between blanks or commas.
pub(super) fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let words = text.split([' ', '\t', ',']).filter(|word| !word.is_empty());
    let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok()
}

/// Whole numbers between blanks, 4 at most.
pub(super) fn sizes(text: &str) -> Option<Vec<u64>> {
    let sizes: Option<Vec<u64>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    sizes.filter(|sizes| (1..=4).contains(&sizes.len()))
}

/// The names that a pattern such as `slice%03d.raw` stands for, from `first` to `last`.
pub(super) fn pattern(source: &Source<'_>, pattern: &str, range: [i64; 3]) -> Result<Vec<String>, Error> {
    let [first, last, step] = range;
    let wrong = |what: &str| source.fail(format!("'{pattern} {first} {last} {step}' {what}"));
    let parts = pattern.split_once('%').and_then(|(before, rest)| {
        let (width, after) = rest.split_once('d')?;
        let is_padded = width.starts_with('0');
        let width = if width.is_empty() { 0 } else { width.parse::<usize>().ok().filter(|&width| width <= 32)? };
        Some((before, is_padded, width, after))
    });
    let Some((before, is_padded, width, after)) = parts else {
        return Err(wrong("is not a pattern such as slice%03d.raw"));
    };
    if step == 0 || (last.saturating_sub(first)).checked_div(step).is_none_or(|n| n < 0 || n >= MAX_FILES as i64) {
        return Err(wrong("does not count from its first to its last file"));
    }
    let count = (last - first) / step;
    let number = |i: i64| {
        let n = first + i * step;
        if is_padded { format!("{before}{n:0width$}{after}") } else { format!("{before}{n:width$}{after}") }
    };
    Ok((0..=count).map(number).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_have_their_length() {
        assert_eq!(numbers("1, 2.5\t-3e1"), Some([1.0, 2.5, -30.0]));
        assert_eq!(numbers::<3>("1 2"), None);
        assert_eq!(numbers::<3>("1 2 x"), None);
        assert_eq!(sizes("4 5 6"), Some(vec![4, 5, 6]));
        assert_eq!(sizes("4 -5 6"), None);
        assert_eq!(sizes("1 1 1 1 1"), None);
    }

    #[test]
    fn patterns_count_within_reason() {
        let folder = std::env::temp_dir().join(format!("pellicle-pattern-{}", std::process::id()));
        std::fs::write(&folder, "x").unwrap();
        let source = Source::open(&folder).unwrap();
        let names = pattern(&source, "a%03d.raw", [8, 12, 2]).unwrap();
        assert_eq!(names, ["a008.raw", "a010.raw", "a012.raw"]);
        assert_eq!(pattern(&source, "a%d", [3, 1, -2]).unwrap(), ["a3", "a1"]);
        for range in [[1, 2, 0], [2, 1, 1], [0, i64::MAX, 1], [i64::MIN, i64::MAX, 1]] {
            assert!(pattern(&source, "a%d", range).is_err(), "{range:?}");
        }
        assert!(pattern(&source, "a%s", [1, 2, 1]).is_err());
        assert!(pattern(&source, "a%999999d", [1, 2, 1]).is_err());
        std::fs::remove_file(folder).unwrap();
    }
}
