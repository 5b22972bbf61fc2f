//! The sizes that suit the rivals best.

use super::{Bench, DAM, anisotropic, measure::Method, measure::measure, params, scenes, solenthaler};

/// Edges of cells in supports, nodes of blocks and of bricks, that are tried.
const CELLS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
const BLOCKS: [Option<usize>; 4] = [None, Some(16), Some(32), Some(64)];
const BRICKS: [(usize, bool); 4] = [(4, false), (4, true), (8, true), (16, true)];

/// Prints the time of each rival with each size, on one thread.
pub fn run(bench: &Bench) -> Result<(), String> {
    let dam = scenes::all().into_iter().find(|scene| scene.name == DAM).ok_or("no dam break")?;
    let positions = dam.read()?;
    for field in [solenthaler(), anisotropic()?] {
        for cell in [1.0, 0.5] {
            let params = params(&dam, field, cell);
            let scatters = CELLS.into_iter().flat_map(|cell| BLOCKS.map(|block| Method::Scatter { cell, block }));
            let gathers =
                CELLS.into_iter().flat_map(|cell| BRICKS.map(|(brick, thin)| Method::Gather { cell, brick, thin }));
            for methods in [scatters.collect::<Vec<_>>(), gathers.collect()] {
                let mut best = (f64::MAX, None);
                for method in methods {
                    let taken = measure(method, &positions, &params, 1, bench.runs)?;
                    let (ms, mb) = (1e3 * taken.seconds(), taken.bytes as f64 / 1e6);
                    println!("{}, cell {cell} r, {method:?}: {ms:.0} ms, {mb:.1} MB", field.name());
                    if taken.seconds() < best.0 {
                        best = (taken.seconds(), Some(method));
                    }
                }
                println!("best: {:?}", best.1);
            }
        }
    }
    Ok(())
}
