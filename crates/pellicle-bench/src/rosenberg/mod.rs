//! dev
use std::time::Instant;

use pellicle::Lanes;
use pellicle::internals::Unit;
use pellicle_scenes::{Balls, ISO, Play, SUPPORT, Show};

use crate::rivals::{Approach, Output, Task, blocks::Blocks, hashed::Hashed};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[arg(long)]
    tune: bool,
    #[arg(long)]
    only: Option<String>,
}

pub fn run(args: &Args) {
    let unit = Unit::new(Lanes::Auto).unwrap();
    for (show, spacing) in [
        (Show::Fountain, 1.0),
        (Show::Fountain, 0.75),
        (Show::Fountain, 0.5),
        (Show::Blob, 0.3),
        (Show::Explosion, 0.6),
    ] {
        let task = Task { spacing, support: f64::from(SUPPORT), iso: ISO };
        let mut play = Play::new(show, 1);
        let mut frames: Vec<Balls> = Vec::new();
        while play.frame() < 300 {
            if play.frame() >= 150 && play.frame() % 15 == 0 {
                frames.push(play.balls().clone());
            }
            play.step();
        }
        let mut out =
            Output { vertices: Vec::with_capacity(1 << 20), indices: Vec::with_capacity(1 << 22), ..Output::default() };
        let mut time = |name: String, a: &mut dyn Approach| {
            if args.only.as_ref().is_some_and(|o| !format!("{} {spacing} {name}", show.name()).contains(o)) {
                return;
            }
            let (mut cubes, mut tris, mut corners) = (0, 0, 0);
            let mut best = f64::INFINITY;
            for _ in 0..3 {
                (cubes, tris, corners) = (0, 0, 0);
                let t = Instant::now();
                for f in &frames {
                    a.update(&f.positions, &f.strengths, &mut out);
                    cubes += out.cubes;
                    tris += out.indices.len() / 3;
                    corners += out.corners;
                }
                best = best.min(t.elapsed().as_secs_f64());
            }
            println!(
                "{} {spacing} {name}: {:.1} fps {:.2} Mcubes/s cubes {} tris {} corners {} cache {}",
                show.name(),
                frames.len() as f64 / best,
                cubes as f64 / best / 1e6,
                cubes / frames.len(),
                tris,
                corners,
                a.cache_bytes()
            );
        };
        for size in [16, 24, 32, 48, 64, 96] {
            for cell in [0.34, 0.5, 1.0] {
                if args.tune || (size == 32 && cell == 1.0) {
                    time(format!("blocks {size} {cell}"), &mut Blocks::new(task, unit, size, cell));
                }
            }
        }
        for cell in [1.0] {
            time(format!("hashed {cell}"), &mut Hashed::new(task, unit, cell));
        }
    }
}
