//! Many frames: reading the next, meshing the present and writing the last overlap.
//!
//! ```text
//! reader  (own threads)  frame 3 | frame 4 | …          one frame ahead, waits while nobody takes it
//! mesher  (the pool)     frame 1 ........ | frame 3 ..
//! mesher  (the pool)       frame 2 ........ | frame 4 .. what one cannot use of the pool, the other does
//! ```
//!
//! The meshers share one pool of `--threads` threads: where a frame has serial work or waits for the disk, the other one
//! computes. So a sequence keeps all processors busy, at the price of about three frames in memory. With `--max-memory`
//! each gets a part of it; a frame that needs more is tried again alone with all of it.
//!
//! A frame that fails is reported, and the others go on.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, OnceLock, PoisonError, RwLock};
use std::time::Instant;

use pellicle::Reconstructor;
use pellicle_io::write_pvd;
use rayon::ThreadPool;
use serde_json::{Value, json};

use crate::clock::StageClock;
use crate::console::Console;
use crate::failure::Failure;
use crate::frame::{Loaded, Outcome, load};
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::plan::{Frame, Plan, is_done};
use crate::resolve::MeshJob;
use crate::target::Target;
use crate::values::{show_many, show_number};
use crate::watch::{Watch, is_settled};

/// Frames that are meshed at the same time.
const AT_ONCE: usize = 2;

/// How a frame ended.
enum Ending {
    Done(Box<Outcome>),
    /// Its mesh was there.
    Skipped,
    Failed(Failure),
}

/// A frame on its way from the reader to a mesher.
struct Parcel {
    frame: Frame,
    loaded: Loaded,
    radius: Option<f64>,
}

struct Series<'a> {
    job: &'a MeshJob,
    plan: &'a Plan,
    console: &'a Console,
    /// One for the whole sequence, so that the surface does not breathe with what is inferred. Empty until a frame has
    /// particles.
    radius: OnceLock<f64>,
    /// Held to read by frames that share the memory, to write by one that needs all of it.
    memory: RwLock<()>,
    endings: Mutex<Vec<(Frame, Ending)>>,
}

/// Makes all frames of the plan.
pub fn run(job: &MeshJob, plan: &Plan, console: &Console) -> Result<(), Failure> {
    let begun = Instant::now();
    interrupt::enter(Phase::Working);
    let meshing = machine::separate_pool(job.threads)?;
    let reading = machine::separate_pool(job.threads)?;
    let (radius, mut first) = common_radius(job, plan, &reading, console)?;
    let radius = radius.map_or_else(OnceLock::new, OnceLock::from);
    let series = Series { job, plan, console, radius, memory: RwLock::new(()), endings: Mutex::default() };
    // Watched frames are counted as they are found.
    console.begin_progress(if job.watch.is_some() { 0 } else { plan.frames.len() });
    let (sender, receiver) = sync_channel(0);
    let receiver = Mutex::new(receiver);
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| series.mesh_all(&receiver, &meshing));
        }
        series.read_all(&mut first, sender, &reading);
    });
    console.end_progress();
    let radius = series.radius.get().copied();
    let endings = series.endings.into_inner().unwrap_or_else(PoisonError::into_inner);
    Report { job, radius, endings, seconds: begun.elapsed().as_secs_f64() }.finish(plan, console)
}

/// The radius as given, or inferred from the first frame of the whole sequence that has particles, whichever frames are
/// to be made here. The particles of that frame come along if it is the first to be made.
fn common_radius(
    job: &MeshJob,
    plan: &Plan,
    reading: &ThreadPool,
    console: &Console,
) -> Result<(Option<f64>, Option<Loaded>), Failure> {
    if job.radius.is_some() {
        return Ok((job.radius, None));
    }
    let is_watched = job.watch.is_some();
    for frame in plan.whole.iter().filter(|frame| !is_watched || is_settled(&frame.input)) {
        interrupt::check()?;
        // What is wrong with it is said when its turn comes.
        let Ok(loaded) = reading.install(|| load(job, frame, StageClock::start())) else { continue };
        if let Ok(Some(radius)) = reading.install(|| loaded.infer(job, &frame.input)) {
            tell_radius(frame, radius, console);
            let is_first = plan.frames.first().is_some_and(|f| f.input == frame.input && f.step == frame.step);
            // Of watched frames nobody knows which comes first.
            return Ok((Some(radius), (is_first && !is_watched).then_some(loaded)));
        }
    }
    Ok((None, None))
}

fn tell_radius(frame: &Frame, radius: f64, console: &Console) {
    let file = frame.input.display();
    console.say(format_args!("{file}: radius {}, inferred from the spacing (-r sets it)", show_number(radius)));
}

impl Series<'_> {
    /// Reads frame after frame, in order, one ahead of the meshers.
    fn read_all(&self, first: &mut Option<Loaded>, meshers: SyncSender<Parcel>, reading: &ThreadPool) {
        let mut watch = self.job.watch.map(Watch::new);
        let mut frames = if watch.is_some() { Vec::new() } else { self.plan.frames.clone() };
        loop {
            for frame in std::mem::take(&mut frames) {
                if interrupt::is_asked() {
                    return;
                }
                // Of the first frame, whether it is wanted or skipped.
                let early = first.take();
                if self.job.skip_existing && is_done(&frame) {
                    self.end(frame, Ending::Skipped);
                    continue;
                }
                let loaded = match early {
                    Some(loaded) => Ok(loaded),
                    None => reading.install(|| load(self.job, &frame, StageClock::start())),
                };
                let parcel = loaded.and_then(|loaded| {
                    let radius = reading.install(|| self.radius_for(&frame, &loaded))?;
                    Ok(Parcel { frame: frame.clone(), loaded, radius })
                });
                match parcel {
                    // The meshers live as long as there is a sender.
                    Ok(parcel) => drop(meshers.send(parcel)),
                    Err(failure) => self.end(frame, Ending::Failed(failure)),
                }
            }
            match watch.as_mut().and_then(|watch| watch.wait(self.job, self.console)) {
                Some(more) => {
                    self.console.more_progress(more.len());
                    frames = more;
                }
                None => return,
            }
        }
    }

    /// The sequence's radius; where none is known yet, as in a watched folder that was empty, this frame's is taken for all.
    fn radius_for(&self, frame: &Frame, loaded: &Loaded) -> Result<Option<f64>, Failure> {
        if let Some(&radius) = self.radius.get() {
            return Ok(Some(radius));
        }
        let inferred = loaded.infer(self.job, &frame.input)?;
        if let Some(radius) = inferred {
            tell_radius(frame, radius, self.console);
            // Only the reader's thread comes here.
            let _ = self.radius.set(radius);
        }
        Ok(inferred)
    }

    /// Meshes what is handed over, until the reader is gone.
    fn mesh_all(&self, parcels: &Mutex<Receiver<Parcel>>, pool: &ThreadPool) {
        let mut reconstructor = Reconstructor::new();
        loop {
            let parcel = parcels.lock().unwrap_or_else(PoisonError::into_inner).recv();
            let Ok(Parcel { frame, mut loaded, radius }) = parcel else { return };
            let ending = match self.mesh(&frame, &mut loaded, radius, &mut reconstructor, pool) {
                Ok(outcome) => Ending::Done(Box::new(outcome)),
                Err(failure) => Ending::Failed(failure),
            };
            loaded.tell_choice(&frame.input, self.console);
            self.end(frame, ending);
        }
    }

    fn mesh(
        &self,
        frame: &Frame,
        loaded: &mut Loaded,
        radius: Option<f64>,
        reconstructor: &mut Reconstructor,
        pool: &ThreadPool,
    ) -> Result<Outcome, Failure> {
        interrupt::check()?;
        self.plan.prepare(frame)?;
        Target::new(frame.output.clone())?.check()?;
        // Besides the frames that are meshed, one is being read.
        let share = self.job.params.max_memory.map(|all| all / (AT_ONCE as u64 + 1));
        let together = {
            let _sharing = self.memory.read();
            pool.install(|| loaded.mesh(self.job, frame, radius, share, reconstructor))
        };
        match together {
            Err(Failure::Memory(_)) => {
                let _alone = self.memory.write();
                // What the last frame left is memory, too.
                *reconstructor = Reconstructor::new();
                pool.install(|| loaded.mesh(self.job, frame, radius, None, reconstructor))
            }
            other => other,
        }
    }

    /// Keeps how a frame ended, and says it.
    fn end(&self, frame: Frame, ending: Ending) {
        match &ending {
            Ending::Done(outcome) => {
                outcome.warn(self.job, &frame, self.console);
                self.console.progress_line(outcome.line(&frame));
            }
            Ending::Skipped => self.console.detail(format_args!("{}: is there", frame.output.display())),
            Ending::Failed(failure) if failure.is_interruption() => {}
            Ending::Failed(failure) => self.console.frame_failed(failure),
        }
        self.console.advance_progress();
        let mut endings = self.endings.lock().unwrap_or_else(PoisonError::into_inner);
        // A watched frame that has changed is made again, and the last time counts.
        let is_same = |(earlier, _): &&mut (Frame, Ending)| {
            self.job.watch.is_some() && earlier.input == frame.input && earlier.step == frame.step
        };
        match endings.iter_mut().find(is_same) {
            Some(earlier) => earlier.1 = ending,
            None => endings.push((frame, ending)),
        }
    }
}

/// What is said when all is over.
struct Report<'a> {
    job: &'a MeshJob,
    radius: Option<f64>,
    endings: Vec<(Frame, Ending)>,
    seconds: f64,
}

impl Report<'_> {
    fn finish(mut self, plan: &Plan, console: &Console) -> Result<(), Failure> {
        // Frames end in any order; they are told in that of the sequence.
        let place = |frame: &Frame| {
            let same = |f: &Frame| f.input == frame.input && f.step == frame.step;
            plan.frames.iter().position(same).unwrap_or(usize::MAX)
        };
        self.endings.sort_by_cached_key(|(frame, _)| (place(frame), frame.number, frame.input.clone()));
        let count = |wanted: fn(&Ending) -> bool| self.endings.iter().filter(|(_, e)| wanted(e)).count();
        let done = count(|e| matches!(e, Ending::Done(_)));
        let skipped = count(|e| matches!(e, Ending::Skipped));
        let failed = count(|e| matches!(e, Ending::Failed(f) if !f.is_interruption()));
        if let Some(list) = &plan.pvd {
            self.write_list(list, plan)?;
            console.say(format_args!("{}: the list of frames, for ParaView", list.display()));
        }
        let rate = done as f64 / self.seconds.max(1e-9);
        console.say(format_args!(
            "{} done, {skipped} skipped, {failed} failed in {:.2} s ({rate:.1} frames/s)",
            show_many(done, "frame"),
            self.seconds
        ));
        let was_interrupted = interrupt::is_asked() && self.job.watch.is_none();
        let failure = if was_interrupted {
            Some(Failure::Interrupted)
        } else if failed > 0 {
            let all = show_many(self.endings.len(), "frame");
            Some(Failure::Work(format!("{failed} of {all} failed; what is wrong with each stands above")))
        } else {
            None
        };
        console.report(|| self.as_json(plan, done, skipped, failed, failure.as_ref()));
        interrupt::enter(Phase::Written);
        failure.map_or(Ok(()), Err)
    }

    /// The list names every frame of the sequence whose mesh is there, or is made elsewhere by another shard.
    fn write_list(&self, list: &std::path::Path, plan: &Plan) -> Result<(), Failure> {
        let failed = |frame: &Frame| {
            let ending = self.endings.iter().find(|(f, _)| f.output == frame.output);
            matches!(ending, Some((_, Ending::Failed(_))))
        };
        let here = self.endings.iter().map(|(frame, _)| frame);
        let mut frames: Vec<&Frame> = plan.whole.iter().chain(here).filter(|frame| !failed(frame)).collect();
        frames.sort_by(|a, b| a.output.cmp(&b.output));
        frames.dedup_by(|a, b| a.output == b.output);
        frames.sort_by_key(|frame| frame.number);
        let time = |(i, frame): (usize, &&Frame)| frame.time.or(frame.number.map(|n| n as f64)).unwrap_or(i as f64);
        let entries: Vec<_> = frames.iter().enumerate().map(|entry| (time(entry), entry.1.output.clone())).collect();
        Ok(write_pvd(list, &entries)?)
    }

    fn as_json(&self, plan: &Plan, done: usize, skipped: usize, failed: usize, failure: Option<&Failure>) -> Value {
        let first_done = self.endings.iter().find_map(|(_, ending)| match ending {
            Ending::Done(outcome) => Some(outcome.parameters(self.job)),
            _ => None,
        });
        let frames = self.endings.iter().map(|(frame, ending)| {
            let mut value = match ending {
                Ending::Done(outcome) => outcome.as_json(frame),
                _ => json!({
                    "input": frame.input.to_string_lossy(),
                    "output": frame.output.to_string_lossy(),
                }),
            };
            value["frame"] = json!(frame.number);
            value["time"] = json!(frame.time);
            value["status"] = json!(match ending {
                Ending::Done(_) => "done",
                Ending::Skipped => "skipped",
                Ending::Failed(failure) => {
                    value["error"] = json!(failure.to_string());
                    "failed"
                }
            });
            value
        });
        json!({
            "frames": frames.collect::<Vec<_>>(),
            "frames_done": done,
            "frames_skipped": skipped,
            "frames_failed": failed,
            "particle_radius": self.radius,
            "parameters": first_done,
            "pvd": plan.pvd.as_ref().map(|path| path.to_string_lossy()),
            "seconds": self.seconds,
            "peak_memory_bytes": machine::peak_memory(),
            "error": failure.map(ToString::to_string),
            "exit_code": failure.map_or(0, Failure::exit_code),
        })
    }
}
