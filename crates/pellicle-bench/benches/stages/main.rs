//! Times every stage of road A, from particles in memory to triangles in memory or in a file.
//!
//! ```sh
//! cargo bench -p pellicle-bench                          # everything, under three minutes on two cores
//! cargo bench -p pellicle-bench -- 'splash.*/fill/'      # one input, one stage
//! ```
//!
//! A benchmark is named `INPUT-cCELL/STAGE/tTHREADS`; [`inputs`] has the inputs, [`work`] says what each stage spans and
//! what its throughput counts. All times are wall time of a [`pellicle::Reconstructor`] that has seen the same particles
//! before, so memory is there already: what a frame costs in the middle of a sequence. Reading is not part of it.

mod inputs;
mod work;

use std::path::Path;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode};
use pellicle::{Mesh, Reconstructor};

use inputs::Input;
use work::{WORKS, Work};

const THREADS: [usize; 2] = [1, 2];

fn main() {
    // A stage is timed within a run of the whole road, so samples are dear: few of them, and all of equal length. The
    // command line may ask for more.
    let mut criterion = Criterion::default()
        .sample_size(10)
        .nresamples(10_000)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    for input in inputs::all() {
        bench(&mut criterion, &input);
    }
    criterion.final_summary();
}

/// Every stage on one input, for every number of threads.
fn bench(criterion: &mut Criterion, input: &Input) {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bench-{}.ply", std::process::id()));
    let (mut reconstructor, mut mesh) = (Reconstructor::new(), Mesh::default());
    let sizes = work::measure_sizes(&mut reconstructor, input, &file);
    let mut group = criterion.benchmark_group(&input.name);
    group.sampling_mode(SamplingMode::Flat);
    for (name, work) in WORKS {
        group.throughput(work.throughput(&sizes));
        for threads in THREADS {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads");
            group.bench_function(BenchmarkId::new(name, format!("t{threads}")), |bencher| {
                bencher.iter_custom(|runs| {
                    pool.install(|| match work {
                        Work::Stage(stage) => work::time_stage(&mut reconstructor, &mut mesh, input, stage, runs),
                        Work::Write => work::time_write(&mut reconstructor, input, &file, runs),
                        Work::Whole => work::time_whole(&mut reconstructor, &mut mesh, input, runs),
                    })
                });
            });
        }
    }
    group.finish();
    // What is left behind lies in the build folder and does no harm.
    let _ = std::fs::remove_file(&file);
}
