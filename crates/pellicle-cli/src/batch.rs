//! Frame after frame, for verbs whose work on one frame uses all processors by itself or waits for the disk: `convert` and
//! `render`. A frame that fails is reported, and the others go on.

use std::time::Instant;

use serde_json::{Value, json};

use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::plan::{Frame, Plan};
use crate::values::show_many;

/// What was made of one frame: a line for people, and what there is to report.
pub struct Made {
    /// For people.
    pub line: String,
    /// For machines.
    pub report: Value,
}

/// Does `work` on each frame of the plan but those that are done already.
pub fn run(
    plan: &Plan,
    is_done: impl Fn(&Frame) -> bool,
    console: &Console,
    work: impl Fn(&Frame) -> Result<Made, Failure>,
) -> Result<(), Failure> {
    let begun = Instant::now();
    if let Some(frame) = &plan.single {
        if is_done(frame) {
            console.say(format_args!("{}: is there", frame.output.display()));
            console.report(|| report(frame, "skipped"));
            return Ok(());
        }
        plan.prepare(frame)?;
        let made = work(frame)?;
        interrupt::enter(Phase::Written);
        console.say(made.line);
        console.report(|| joined(report(frame, "done"), made.report));
        return Ok(());
    }
    console.begin_progress(plan.frames.len());
    let mut reports = Vec::with_capacity(plan.frames.len());
    let (mut done, mut skipped, mut failed) = (0, 0, 0);
    for frame in &plan.frames {
        if interrupt::is_asked() {
            break;
        }
        if is_done(frame) {
            skipped += 1;
            reports.push(report(frame, "skipped"));
            console.detail(format_args!("{}: is there", frame.output.display()));
        } else {
            match plan.prepare(frame).and_then(|()| work(frame)) {
                Ok(made) => {
                    done += 1;
                    console.progress_line(&made.line);
                    reports.push(joined(report(frame, "done"), made.report));
                }
                Err(failure) => {
                    failed += 1;
                    console.frame_failed(&failure);
                    reports.push(joined(report(frame, "failed"), json!({"error": failure.to_string()})));
                }
            }
        }
        console.advance_progress();
    }
    console.end_progress();
    let seconds = begun.elapsed().as_secs_f64();
    let all = show_many(done, "frame");
    console.say(format_args!("{all} done, {skipped} skipped, {failed} failed in {seconds:.2} s"));
    let failure = if interrupt::is_asked() {
        Some(Failure::Interrupted)
    } else if failed > 0 {
        let all = show_many(reports.len(), "frame");
        Some(Failure::Work(format!("{failed} of {all} failed; what is wrong with each stands above")))
    } else {
        None
    };
    console.report(|| {
        json!({
            "frames": reports,
            "frames_done": done,
            "frames_skipped": skipped,
            "frames_failed": failed,
            "seconds": seconds,
            "peak_memory_bytes": machine::peak_memory(),
            "error": failure.as_ref().map(ToString::to_string),
            "exit_code": failure.as_ref().map_or(0, Failure::exit_code),
        })
    });
    failure.map_or(Ok(()), Err)
}

fn report(frame: &Frame, status: &str) -> Value {
    json!({
        "input": frame.input.to_string_lossy(),
        "output": frame.output.to_string_lossy(),
        "frame": frame.number,
        "time": frame.time,
        "status": status,
    })
}

fn joined(mut all: Value, more: Value) -> Value {
    if let (Some(all), Value::Object(more)) = (all.as_object_mut(), more) {
        all.extend(more);
    }
    all
}
