//! Wall time per stage. The library reads no clocks: it says when a stage begins, and this file looks at the watch.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use pellicle::Stage;

/// A watch that knows which stage runs.
#[derive(Debug)]
pub struct StageClock {
    begun: Instant,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    running: Option<(&'static str, Instant)>,
    /// In the order of first appearance; a stage that comes again, as when the work is cut in blocks, adds up.
    done: Vec<(&'static str, Duration)>,
}

impl StageClock {
    /// Starts now.
    pub fn start() -> Self {
        Self { begun: Instant::now(), state: Mutex::default() }
    }

    /// A stage of the core begins, and the one before it ends.
    pub fn begin_core(&self, stage: Stage) {
        self.begin(match stage {
            Stage::Sort => "sort",
            Stage::Density => "density",
            Stage::SurfaceParticles => "surface",
            Stage::Active => "active",
            Stage::Fill => "fill",
            Stage::Count => "count",
            // Triangles go to the file as they are made: one stage for whoever waits.
            Stage::Emit => "write",
            _ => "other",
        });
    }

    /// A stage begins, and the one before it ends.
    pub fn begin(&self, name: &'static str) {
        let now = Instant::now();
        let mut state = self.state();
        state.end(now);
        state.running = Some((name, now));
    }

    /// The running stage ends, and none begins.
    pub fn pause(&self) {
        self.state().end(Instant::now());
    }

    /// Time in stages so far, pauses left out.
    pub fn working(&self) -> Duration {
        self.stages().iter().map(|stage| stage.1).sum()
    }

    /// The stages so far with their times, in order; the running one ends.
    pub fn stages(&self) -> Vec<(&'static str, Duration)> {
        let mut state = self.state();
        state.end(Instant::now());
        state.done.clone()
    }

    /// Time since the start.
    pub fn total(&self) -> Duration {
        self.begun.elapsed()
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        // The state is consistent after every statement, so a panic elsewhere does not spoil it.
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl State {
    fn end(&mut self, now: Instant) {
        let Some((name, since)) = self.running.take() else { return };
        match self.done.iter_mut().find(|(n, _)| *n == name) {
            Some((_, time)) => *time += now - since,
            None => self.done.push((name, now - since)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_that_comes_again_adds_up_in_its_first_place() {
        let clock = StageClock::start();
        for name in ["read", "fill", "write", "fill", "write"] {
            clock.begin(name);
            std::thread::sleep(Duration::from_millis(2));
        }
        let stages = clock.stages();
        assert_eq!(stages.iter().map(|s| s.0).collect::<Vec<_>>(), ["read", "fill", "write"]);
        assert!(stages[1].1 >= Duration::from_millis(4), "{stages:?}");
        assert!(stages.iter().map(|s| s.1).sum::<Duration>() <= clock.total());
        assert_eq!(clock.stages(), stages, "asking again changes nothing");
    }
}
