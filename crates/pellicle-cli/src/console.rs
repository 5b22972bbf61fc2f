//! What is said, and where: results on stdout, warnings and errors on stderr; with `--json` one JSON object on stdout and
//! all text on stderr.
//!
//! A reader that has gone away (`pellicle info x | head`) is no error: what it no longer wants is dropped.

use std::fmt::Display;
use std::io::{Write, stderr, stdout};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};

use crate::args::Talk;
use crate::failure::Failure;

/// The way to the user of one run.
#[derive(Debug)]
pub struct Console {
    verb: &'static str,
    talk: Talk,
    warnings: Mutex<Vec<String>>,
    reported: AtomicBool,
}

impl Console {
    /// For one verb, as loud as asked.
    pub fn new(verb: &'static str, talk: Talk) -> Self {
        Self { verb, talk, warnings: Mutex::default(), reported: AtomicBool::new(false) }
    }

    /// A line of the result; silent with `-q`.
    pub fn say(&self, line: impl Display) {
        if !self.talk.quiet {
            self.line(line);
        }
    }

    /// A line for those who asked for more with `-v`.
    pub fn detail(&self, line: impl Display) {
        if self.talk.verbose {
            self.line(line);
        }
    }

    /// Something that the user should know although the work goes on.
    pub fn warn(&self, warning: impl Into<String>) {
        let warning = warning.into();
        let _ = writeln!(stderr(), "warning: {warning}");
        self.warnings().push(warning);
    }

    /// The machine-readable result; the verb, the version and the warnings are added. Only with `--json`.
    pub fn report(&self, report: impl FnOnce() -> Value) {
        if !self.talk.json {
            return;
        }
        self.reported.store(true, Ordering::Relaxed);
        let mut value = json!({
            "command": self.verb,
            "version": env!("CARGO_PKG_VERSION"),
            "warnings": *self.warnings(),
        });
        if let (Some(all), Value::Object(own)) = (value.as_object_mut(), report()) {
            all.extend(own);
        }
        let _ = writeln!(stdout(), "{value:#}");
    }

    /// Why the run ends; with `--json` also as a report, unless the result is out already.
    pub fn fail(&self, failure: &Failure) {
        let _ = writeln!(stderr(), "error: {failure}");
        if !self.reported.load(Ordering::Relaxed) {
            self.report(|| json!({"error": failure.to_string(), "exit_code": failure.exit_code()}));
        }
    }

    fn warnings(&self) -> MutexGuard<'_, Vec<String>> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn line(&self, line: impl Display) {
        let _ = if self.talk.json { writeln!(stderr(), "{line}") } else { writeln!(stdout(), "{line}") };
    }
}
