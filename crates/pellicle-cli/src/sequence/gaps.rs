//! Frames that are not there, put in words.

/// Runs of missing frames that a message shows.
const SHOWN: usize = 5;

/// Frames that are missing between two that are there, every `step`th.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// The first frame missing.
    pub first: i64,
    /// The last one.
    pub last: i64,
    /// How many.
    pub count: u64,
}

/// The gaps in ascending numbers, which may go in steps, as in 0, 10, 20: the greatest common divisor of their differences.
pub fn gaps(numbers: &[i64]) -> Vec<Gap> {
    // Differences of ascending numbers fit.
    let differences = numbers.array_windows().map(|[a, b]| b.abs_diff(*a));
    let step = differences.fold(0, gcd);
    let Ok(signed) = i64::try_from(step) else { return Vec::new() };
    if signed == 0 {
        return Vec::new();
    }
    let gap = |[a, b]: &[i64; 2]| {
        let count = b.abs_diff(*a) / step;
        (count > 1).then(|| Gap { first: a + signed, last: b - signed, count: count - 1 })
    };
    numbers.array_windows().filter_map(gap).collect()
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Gaps for a reader: `3 frames are missing: 4, 7-8`.
pub fn gaps_text(gaps: &[Gap]) -> String {
    let total: u64 = gaps.iter().map(|gap| gap.count).sum();
    let run = |gap: &Gap| match gap.count {
        1 => gap.first.to_string(),
        2 => format!("{}, {}", gap.first, gap.last),
        _ => format!("{} to {}", gap.first, gap.last),
    };
    let shown: Vec<String> = gaps.iter().take(SHOWN).map(run).collect();
    let more = if gaps.len() > SHOWN { " …" } else { "" };
    let verb = if total == 1 { "frame is" } else { "frames are" };
    format!("{total} {verb} missing: {}{more}", shown.join(", "))
}

/// Ascending single numbers as gaps, neighbors joined.
pub fn runs(numbers: &[i64]) -> Vec<Gap> {
    let run = |run: &[i64]| Gap { first: run[0], last: run[run.len() - 1], count: run.len() as u64 };
    numbers.chunk_by(|a, b| b.abs_diff(*a) == 1).map(run).collect()
}

/// `100 frames, 1 to 100`, of ascending numbers.
pub fn span_text(numbers: &[i64]) -> String {
    match numbers {
        [] => "no frames".to_owned(),
        [one] => format!("frame {one}"),
        [first, .., last] => format!("{} frames, {first} to {last}", numbers.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_follow_the_step_of_the_numbers() {
        let found = |numbers: &[i64]| gaps_text(&gaps(numbers));
        assert_eq!(gaps(&[1, 2, 3]), []);
        assert_eq!(gaps(&[-10, 0, 10]), []);
        assert_eq!(gaps(&[5]), []);
        assert_eq!(gaps(&[]), []);
        assert_eq!(found(&[1, 2, 4, 5]), "1 frame is missing: 3");
        assert_eq!(found(&[0, 10, 40, 60]), "3 frames are missing: 20, 30, 50");
        assert_eq!(found(&[-1, 0, 10]), "9 frames are missing: 1 to 9");
        assert_eq!(
            found(&[0, 1, 1_000_000_000_000_000_000]),
            "999999999999999998 frames are missing: 2 to 999999999999999999"
        );
        assert_eq!(gaps(&[i64::MIN, i64::MAX]), []);
        assert_eq!(found(&[0, 1, 3, 5, 7, 9, 11, 13]), "6 frames are missing: 2, 4, 6, 8, 10 …");
    }

    #[test]
    fn single_numbers_are_joined() {
        assert_eq!(gaps_text(&runs(&[3, 5, 6, 7, 9])), "5 frames are missing: 3, 5 to 7, 9");
        assert_eq!(span_text(&[1, 2, 9]), "3 frames, 1 to 9");
    }
}
