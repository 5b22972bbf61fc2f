//! `mesh IN...`: particles of files to surfaces in files.

use pellicle::Reconstructor;

use crate::args::MeshArgs;
use crate::clock::StageClock;
use crate::console::Console;
use crate::failure::Failure;
use crate::frame::load;
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::plan::{Absent, Frame, Plan};
use crate::resolve::MeshJob;
use crate::series;
use crate::target::Target;
use crate::values::show_number;

/// Runs the verb.
pub fn run(args: &MeshArgs, console: &Console) -> Result<(), Failure> {
    let clock = StageClock::start();
    interrupt::listen();
    let job = MeshJob::resolve(args)?;
    let absent = if job.watch.is_some() { Absent::Await } else { Absent::Refuse };
    let plan = Plan::new(&job.files, absent, console)?;
    // A name that cannot be written is known before the first frame is read.
    for frame in plan.single.iter().chain(plan.frames.first()) {
        Target::new(frame.output.clone())?;
        job.finishing.check_format(&frame.output)?;
    }
    warn_of_coarse_cells(&job, console);
    match &plan.single {
        Some(frame) => {
            plan.prepare(frame)?;
            machine::thread_pool(job.threads)?.install(|| single(&job, frame, clock, console))
        }
        None => series::run(&job, &plan, console),
    }
}

/// One input, one output, and no thread but those of the pool: small frames take milliseconds.
fn single(job: &MeshJob, frame: &Frame, clock: StageClock, console: &Console) -> Result<(), Failure> {
    Target::new(frame.output.clone())?.check()?;
    let mut loaded = load(job, frame, clock)?;
    loaded.announce(&frame.input, console);
    loaded.tell_choice(&frame.input, console);
    let radius = match job.radius {
        Some(radius) => Some(radius),
        None => {
            let radius = loaded.infer(job, &frame.input)?;
            if let Some(radius) = radius {
                console.say(format_args!("  radius {}, inferred from their spacing (-r sets it)", show_number(radius)));
            }
            radius
        }
    };
    interrupt::enter(Phase::Working);
    let outcome = loaded.mesh(job, frame, radius, None, &mut Reconstructor::new())?;
    interrupt::enter(Phase::Written);
    outcome.warn(job, frame, console);
    outcome.tell_parameters(job, console);
    outcome.tell(job, frame, console);
    console.report(|| {
        let mut report = outcome.as_json(frame);
        report["parameters"] = outcome.parameters(job);
        report["peak_memory_bytes"] = machine::peak_memory().into();
        report
    });
    Ok(())
}

fn warn_of_coarse_cells(job: &MeshJob, console: &Console) {
    let params = &job.params;
    let support = 2.0 * params.smoothing_length;
    if params.cell_size > support {
        console.warn(format!(
            "a cell of {} radii is larger than the kernel's support of {support} radii: most particles fall between \
             the lattice's nodes and leave no trace (use a smaller -c)",
            params.cell_size
        ));
    }
}
