//! `pellicle-bench rosenberg-2008`: figure 7 of Rosenberg & Birdwell 2008 with today's three approaches on one core, beside
//! the paper's numbers. `--json` prints one object a row, `--search` how the rivals' sizes were chosen, `--quick` a tenth of
//! the frames.
//!
//! An approach is timed over the frames of a show, everything from positions to vertices and triangles in the caller's
//! memory; the approaches take turns, and the middle of several rounds counts. Its bytes are the most that a counting
//! allocator saw in use at once while a fresh one made all frames, without the output; what the look-up of particles holds
//! of them is *cache*, the rest *render*.
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7 and figure 7.

mod engine;
mod measure;
mod report;
mod scenes;
mod search;

use pellicle::Lanes;
use pellicle::internals::Unit;

use crate::rivals::{blocks::Blocks, hashed::Hashed};
use engine::Slices;
use measure::{Row, measure};
use scenes::Setting;

/// Runs the verb.
pub fn run(words: &[String]) -> Result<(), String> {
    let (mut json, mut search, mut every) = (false, false, 1);
    for word in words {
        match word.as_str() {
            "--json" => json = true,
            "--search" => search = true,
            "--quick" => every = 10,
            other => return Err(format!("{other}: --json, --search or --quick")),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| error.to_string())?;
    pool.install(|| {
        if search {
            return search::run(every);
        }
        let mut rows = Vec::new();
        for setting in &scenes::ALL {
            let frames = setting.frames(every);
            let new = measure(&frames, approaches(setting)?)?;
            if json {
                new.iter().enumerate().for_each(|(i, row)| println!("{}", report::json(setting, i + 1, row)));
            } else {
                report::scene(setting, &new, frames.len());
            }
            rows.push(new);
        }
        if !json {
            report::ratios(&rows);
        }
        Ok(())
    })
}

/// The three, each with the sizes that suit it best.
fn approaches(setting: &Setting) -> Result<Vec<measure::Maker>, String> {
    let unit = unit()?;
    let (task, block, cells) = (setting.task(), setting.block, setting.cells);
    Slices::new(task)?;
    Ok(vec![
        Box::new(move || Box::new(Slices::new(task).unwrap_or_else(|error| unreachable!("checked before: {error}")))),
        Box::new(move || Box::new(Blocks::new(task, unit, block, cells[0]))),
        Box::new(move || Box::new(Hashed::new(task, unit, cells[1]))),
    ])
}

fn unit() -> Result<Unit, String> {
    Unit::new(Lanes::Auto).ok_or_else(|| "no vector unit".into())
}
