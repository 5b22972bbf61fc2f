//! The sizes that suit the rivals best.

use super::{
    Bench, DAM, anisotropic,
    measure::{Method, measure},
    params,
    report::{Row, Sink},
    scenes::{self, Scene},
    solenthaler,
};

/// Edges of cells in supports, nodes of blocks and of bricks, that are tried.
const CELLS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
const BLOCKS: [Option<usize>; 4] = [None, Some(16), Some(32), Some(64)];
const BRICKS: [(usize, bool); 4] = [(4, false), (4, true), (8, true), (16, true)];

/// Prints the time of each rival with each size, on the dam break or on a frame of one's own: scatter, which is serial, on one
/// thread, gather on those asked for.
pub fn run(bench: &Bench, large: Option<Scene>) -> Result<(), String> {
    let dam = || scenes::all().into_iter().find(|scene| scene.name == DAM);
    let scene = large.or_else(dam).ok_or("no dam break")?;
    let positions = scene.read()?;
    for field in [solenthaler(), anisotropic()?] {
        for cell in [1.0, 0.5] {
            let params = params(&scene, field, cell);
            let scatters = CELLS.into_iter().flat_map(|cell| BLOCKS.map(|block| Method::Scatter { cell, block }));
            let gathers =
                CELLS.into_iter().flat_map(|cell| BRICKS.map(|(brick, thin)| Method::Gather { cell, brick, thin }));
            let (scatters, gathers): (Vec<_>, Vec<_>) = (scatters.collect(), gathers.collect());
            for (methods, threads) in [(scatters, 1), (gathers, bench.threads)] {
                let mut best = (f64::MAX, None);
                for method in methods {
                    let taken = measure(method, &positions, &params, threads, bench.runs)?;
                    let (name, field) = (scene.name, field.name());
                    let row = Row { table: "search", scene: name, method, field, cell, threads, taken: &taken };
                    bench.sink.size(&row);
                    if taken.seconds() < best.0 {
                        best = (taken.seconds(), Some(method));
                    }
                }
                if bench.sink == Sink::Text {
                    println!("best: {:?}", best.1);
                }
            }
        }
    }
    Ok(())
}
