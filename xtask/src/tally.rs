//! Counts of passed, failed and skipped, read from the summaries that test runners print.

/// How many checks passed, failed, or were not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    pub passed: usize,
    pub failed: usize,
    pub skipped: usize,
}

/// A Rust test that cannot run prints a line that begins with this, with what is missing, and returns: the harness has
/// no word for it, so it would count as passed.
const SKIP_MARK: &str = "SKIPPED: ";

impl Tally {
    /// Sums the `test result:` lines of `cargo test`. Ignored tests are skipped ones, and so are those that say so.
    pub fn of_cargo(output: &str) -> Self {
        let results = output.lines().filter_map(|line| line.trim().strip_prefix("test result: "));
        let mut tally = results.map(|line| counts(line, ';')).fold(Self::default(), std::ops::Add::add);
        let said = output.lines().filter(|line| line.starts_with(SKIP_MARK)).count().min(tally.passed);
        tally.passed -= said;
        tally.skipped += said;
        tally
    }

    /// Reads the last line of pytest's output, such as `1 failed, 2 passed, 3 skipped in 4.56s`, with or without rules
    /// of equal signs. `None` when there is no such line: pytest broke before its end.
    pub fn of_pytest(output: &str) -> Option<Self> {
        let ends_in_time = |line: &&str| line.contains(" in ") && line.trim_matches(['=', ' ']).ends_with(['s', ')']);
        let last = output.lines().rev().find(ends_in_time)?;
        let (summary, _) = last.trim_matches(['=', ' ']).rsplit_once(" in ")?;
        let tally = counts(summary, ',');
        (tally != Self::default() || summary.starts_with("no tests ran")).then_some(tally)
    }

    /// One check that passed or failed.
    pub fn of_step(passed: bool) -> Self {
        Self { passed: usize::from(passed), failed: usize::from(!passed), skipped: 0 }
    }
}

/// What a runner said of tests that failed: of `cargo test` the sections headed `failures:`, with
/// what the tests printed, of pytest the lines of its short summary. Empty if none did.
pub fn failures(output: &str) -> String {
    let mut said = String::new();
    let mut is_inside = false;
    for line in output.lines() {
        is_inside = match line {
            "failures:" => true,
            _ => is_inside && !line.starts_with("test result: "),
        };
        if is_inside || ["FAILED ", "ERROR "].iter().any(|mark| line.starts_with(mark)) {
            said += line;
            said.push('\n');
        }
    }
    said
}

/// `ok. 5 passed; 0 failed; …` or `2 passed, 1 skipped`: numbers before words.
fn counts(line: &str, separator: char) -> Tally {
    let mut tally = Tally::default();
    for part in line.split(separator) {
        let words: Vec<&str> = part.split_whitespace().collect();
        for pair in words.windows(2) {
            let Ok(count) = pair[0].parse::<usize>() else { continue };
            match pair[1] {
                "passed" | "xfailed" => tally.passed += count,
                "failed" | "error" | "errors" | "xpassed" => tally.failed += count,
                "ignored" | "skipped" => tally.skipped += count,
                _ => {}
            }
        }
    }
    tally
}

impl std::ops::Add for Tally {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            passed: self.passed + other.passed,
            failed: self.failed + other.failed,
            skipped: self.skipped + other.skipped,
        }
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally(passed: usize, failed: usize, skipped: usize) -> Tally {
        Tally { passed, failed, skipped }
    }

    #[test]
    fn cargo_summaries_are_summed() {
        let output = "running 3 tests\n\
            test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 7 filtered out; finished in 0.00s\n\
            test result: FAILED. 4 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.00s\n";
        assert_eq!(Tally::of_cargo(output), tally(7, 2, 1));
    }

    #[test]
    fn rust_test_that_says_it_was_skipped_did_not_pass() {
        let output = "---- frames stdout ----\nSKIPPED: frames: no folder data\n\n\
            test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n";
        assert_eq!(Tally::of_cargo(output), tally(2, 0, 1));
    }

    #[test]
    fn pytest_summary_is_read_with_and_without_rules() {
        let quiet = "..s\nSKIPPED [1] tests/test_meshes.py:3: no data\n2 passed, 1 skipped in 0.12s\n";
        assert_eq!(Tally::of_pytest(quiet), Some(tally(2, 0, 1)));
        let loud = "===== 1 failed, 2 passed, 3 errors in 65.12s (0:01:05) =====\n";
        assert_eq!(Tally::of_pytest(loud), Some(tally(2, 4, 0)));
        assert_eq!(Tally::of_pytest("no tests ran in 0.01s\n"), Some(Tally::default()));
    }

    #[test]
    fn what_failed_is_said_again_and_nothing_else() {
        let cargo = "test a ... ok\ntest b ... FAILED\n\nsuccesses:\n\n---- a stdout ----\nfine\n\nfailures:\n\n\
            ---- b stdout ----\nleft: 1\n\nfailures:\n    b\n\n\
            test result: FAILED. 1 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n\
            running 1 test\n";
        assert_eq!(failures(cargo), "failures:\n\n---- b stdout ----\nleft: 1\n\nfailures:\n    b\n\n");
        let pytest = "..F\nFAILED tests/test_meshes.py::test_closed - assert 1 == 2\n1 failed, 2 passed in 0.12s\n";
        assert_eq!(failures(pytest), "FAILED tests/test_meshes.py::test_closed - assert 1 == 2\n");
        assert_eq!(failures("test a ... ok\n"), "");
    }

    #[test]
    fn pytest_that_broke_has_no_summary() {
        assert_eq!(Tally::of_pytest("ImportError: no module named pytest\n"), None);
        assert_eq!(Tally::of_pytest(""), None);
    }
}
