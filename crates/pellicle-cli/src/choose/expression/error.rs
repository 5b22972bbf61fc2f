//! What is wrong with an expression, shown at its place.

use std::fmt;
use std::ops::Range;

/// Characters of the text that are shown to each side of the place.
const SIDE: usize = 50;

/// A complaint with the text and the place that it is about.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpressionError {
    message: String,
    text: String,
    /// Bytes of the text.
    place: Range<usize>,
}

impl ExpressionError {
    pub(super) fn new(text: &str, place: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), text: text.to_owned(), place }
    }
}

impl std::error::Error for ExpressionError {}

impl fmt::Display for ExpressionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Whatever does not take one column would move the mark.
        let shown: Vec<(usize, char)> =
            self.text.char_indices().map(|(at, c)| (at, if c.is_control() { ' ' } else { c })).collect();
        let column = |byte: usize| shown.partition_point(|&(at, _)| at < byte);
        let (start, end) = (column(self.place.start), column(self.place.end));
        let window = start.saturating_sub(SIDE)..shown.len().min(start + SIDE);
        let (before, after) =
            (if window.start > 0 { "…" } else { "" }, if window.end < shown.len() { "…" } else { "" });
        let text: String = shown[window.clone()].iter().map(|&(_, c)| c).collect();
        let indent = start - window.start + before.chars().count();
        let width = end.min(window.end).saturating_sub(start).max(1);
        write!(f, "{}\n  {before}{text}{after}\n  {:indent$}{:^<width$}", self.message, "", "")
    }
}
