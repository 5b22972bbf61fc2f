//! What is said, and where: results on stdout, warnings and errors on stderr; with `--json` one JSON object on stdout and
//! all text on stderr.
//!
//! A sequence shows a progress bar on stderr where that is a terminal; lines go above it.
//!
//! A reader that has gone away (`pellicle info x | head`) is no error: what it no longer wants is dropped.

use std::fmt::Display;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pellicle_io::printable;
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
    progress: Mutex<Option<ProgressBar>>,
}

impl Console {
    /// For one verb, as loud as asked.
    pub fn new(verb: &'static str, talk: Talk) -> Self {
        Self { verb, talk, warnings: Mutex::default(), reported: AtomicBool::new(false), progress: Mutex::default() }
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
        self.beside_bar(|| drop(writeln!(stderr(), "warning: {}", plain(&warning))));
        self.warnings().push(warning);
    }

    /// A frame of a sequence failed, and the others go on.
    pub fn frame_failed(&self, failure: &Failure) {
        self.beside_bar(|| drop(writeln!(stderr(), "error: {}", plain(failure))));
    }

    /// From now on the frames of a sequence are counted.
    pub fn begin_progress(&self, frames: usize) {
        let is_wanted = !self.talk.quiet && stderr().is_terminal();
        if !is_wanted {
            return;
        }
        let bar = ProgressBar::with_draw_target(Some(frames as u64), ProgressDrawTarget::stderr());
        // The template is ours and right; without it the bar has its usual look.
        let style = ProgressStyle::with_template("[{bar:30}] frame {pos} of {len}, {elapsed} gone, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        bar.tick();
        *self.progress() = Some(bar);
    }

    /// More frames have come.
    pub fn more_progress(&self, frames: usize) {
        if let Some(bar) = &*self.progress() {
            bar.inc_length(frames as u64);
        }
    }

    /// One more frame is over.
    pub fn advance_progress(&self) {
        if let Some(bar) = &*self.progress() {
            bar.inc(1);
        }
    }

    /// The sequence is over.
    pub fn end_progress(&self) {
        if let Some(bar) = self.progress().take() {
            bar.finish_and_clear();
        }
    }

    /// A line about a finished frame: where a bar shows the progress, only for those who asked for more.
    pub fn progress_line(&self, line: impl Display) {
        let has_bar = self.progress().is_some();
        if has_bar { self.detail(line) } else { self.say(line) }
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
        let _ = writeln!(stderr(), "error: {}", plain(failure));
        if !self.reported.load(Ordering::Relaxed) {
            self.report(|| json!({"error": failure.to_string(), "exit_code": failure.exit_code()}));
        }
    }

    fn warnings(&self) -> MutexGuard<'_, Vec<String>> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn line(&self, line: impl Display) {
        let line = plain(line);
        self.beside_bar(|| {
            let _ = if self.talk.json { writeln!(stderr(), "{line}") } else { writeln!(stdout(), "{line}") };
        });
    }

    /// Prints where the bar is not in the way.
    fn beside_bar(&self, print: impl FnOnce()) {
        match &*self.progress() {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    fn progress(&self) -> MutexGuard<'_, Option<ProgressBar>> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Text without anything that would steer the terminal: names come from files and folders of any origin.
fn plain(text: impl Display) -> String {
    text.to_string().split('\n').map(printable).collect::<Vec<_>>().join("\n")
}
