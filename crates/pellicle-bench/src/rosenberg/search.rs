//! The sizes that suit the rivals best.

use super::{measure::measure, scenes, unit};
use crate::rivals::{Approach, blocks::Blocks, hashed::Hashed};

/// Cubes along a block's edge, and edges of cells in supports, that are tried.
const BLOCKS: [usize; 6] = [16, 24, 32, 48, 64, 96];
const CELLS: [f64; 4] = [0.34, 0.5, 1.0, 1.5];

/// Prints the speed of each rival with each size.
pub fn run(every: usize) -> Result<(), String> {
    let unit = unit()?;
    for setting in &scenes::ALL {
        let (task, frames) = (setting.task(), setting.frames(every));
        let mut best = [0.0, 0.0];
        let mut says = [String::new(), String::new()];
        let tries = BLOCKS.map(Some).into_iter().chain([None]);
        for (block, cell) in tries.flat_map(|block| CELLS.map(|cell| (block, cell))) {
            let (rival, name) = match block {
                Some(block) => (0, format!("approach 2, blocks of {block:>2}, cells of {cell}")),
                None => (1, format!("approach 3, cells of {cell}")),
            };
            let make = move || -> Box<dyn Approach> {
                match block {
                    Some(block) => Box::new(Blocks::new(task, unit, block, cell)),
                    None => Box::new(Hashed::new(task, unit, cell)),
                }
            };
            let row = measure(&frames, vec![Box::new(make)])?[0];
            let bytes = (row.render_bytes + row.cache_bytes) as f64 / 1e6;
            println!("{} S={} {name}: {:.1} fps, {bytes:.3} MB", setting.show.name(), setting.spacing, row.fps);
            if row.fps > best[rival] {
                (best[rival], says[rival]) = (row.fps, name);
            }
        }
        println!("best: {}; {}", says[0], says[1]);
    }
    Ok(())
}
