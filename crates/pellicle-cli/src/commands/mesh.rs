//! `mesh IN`: particles of a file to a surface in a file.

use std::path::Path;

use pellicle::{Error, Params, infer_radius};
use pellicle_io::{ReadOptions, read_particles};
use serde_json::{Value, json};

use crate::args::MeshArgs;
use crate::clock::StageClock;
use crate::cloud::Cloud;
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt;
use crate::machine;
use crate::resolve::MeshJob;
use crate::surface::{Made, Order, make};
use crate::values::{show_bytes, show_many, show_number, show_vertices};

/// Runs the verb.
pub fn run(args: &MeshArgs, console: &Console) -> Result<(), Failure> {
    let clock = StageClock::start();
    interrupt::listen();
    let job = MeshJob::resolve(args)?;
    job.target.check()?;
    machine::thread_pool(job.threads)?.install(|| mesh(&job, console, &clock))
}

fn mesh(job: &MeshJob, console: &Console, clock: &StageClock) -> Result<(), Failure> {
    clock.begin("read");
    let mut cloud = Cloud::from(read_particles(
        &job.input,
        &ReadOptions { attributes: job.carry.clone(), ..ReadOptions::default() },
    )?);
    console.say(format_args!("{}: {}", job.input.display(), show_many(cloud.len(), "particle")));
    let dropped = if job.drop_invalid { drop_invalid(job, &mut cloud, console) } else { 0 };

    clock.begin("infer");
    let radius = find_radius(job, &cloud)?;
    announce(job, &cloud, radius, console);

    let params = Params { particle_radius: radius.unwrap_or(job.params.particle_radius), ..job.params.clone() };
    let order = Order { source: &job.input, params: &params, is_radius_known: radius.is_some(), target: &job.target };
    let made = make(&cloud, &order, clock)?;
    if made.triangles == 0 && cloud.len() > 0 {
        console.warn(format!(
            "{}: no surface: the field exceeds {} nowhere on the lattice (check -r, lower -t, or use a smaller -c)",
            job.input.display(),
            params.iso
        ));
    }
    if !made.left_out.is_empty() {
        console.warn(format!(
            "{}: this format has no room for {}: left out (.ply has)",
            job.target.path().display(),
            made.left_out.join(", ")
        ));
    }
    let outcome = Outcome { job, cloud: &cloud, dropped, radius, made: &made, clock };
    outcome.tell(console);
    console.report(|| outcome.as_json());
    Ok(())
}

fn drop_invalid(job: &MeshJob, cloud: &mut Cloud, console: &Console) -> usize {
    let dropped = cloud.drop_invalid();
    if dropped > 0 {
        console.warn(format!(
            "{}: {} left out, whose positions are not finite; {} stay",
            job.input.display(),
            show_many(dropped, "particle"),
            show_many(cloud.len(), "particle"),
        ));
    }
    dropped
}

/// The radius as given or inferred. `None` without particles, where it does not matter.
fn find_radius(job: &MeshJob, cloud: &Cloud) -> Result<Option<f64>, Failure> {
    if job.radius.is_some() || cloud.len() == 0 {
        return Ok(job.radius);
    }
    // Spacings of positions that are not finite mean nothing, so these are looked for first.
    if let Some((index, position)) = cloud.first_invalid() {
        return Err(Failure::core(&job.input, Error::NotFinite { index, position }));
    }
    match infer_radius(cloud.positions()) {
        Some(radius) => Ok(Some(radius)),
        None => Err(Failure::file(
            &job.input,
            "the particle radius cannot be inferred from fewer than two distinct positions (give it with -r)",
        )),
    }
}

/// Says what was chosen, and what is likely to disappoint.
fn announce(job: &MeshJob, cloud: &Cloud, radius: Option<f64>, console: &Console) {
    let params = &job.params;
    let file = job.input.display();
    if cloud.len() == 0 {
        console.warn(format!("{file}: there are no particles, so the mesh is empty"));
    }
    match (radius, job.radius) {
        (Some(radius), Some(_)) => console.detail(format_args!("  radius {}, as given", show_number(radius))),
        (Some(radius), None) => {
            console.say(format_args!("  radius {}, inferred from their spacing (-r sets it)", show_number(radius)));
        }
        (None, _) => {}
    }
    console.detail(format_args!(
        "  smoothing length {} radii, cell {} radii, threshold {}",
        params.smoothing_length, params.cell_size, params.iso
    ));
    let support = 2.0 * params.smoothing_length;
    if params.cell_size > support {
        console.warn(format!(
            "a cell of {} radii is larger than the kernel's support of {support} radii: most particles fall between \
             the lattice's nodes and leave no trace (use a smaller -c)",
            params.cell_size
        ));
    }
    let names: Vec<&str> = cloud.channels.iter().map(|c| c.name.as_str()).collect();
    if !names.is_empty() {
        console.detail(format_args!("  carries {}", names.join(", ")));
    }
}

/// A finished job.
struct Outcome<'a> {
    job: &'a MeshJob,
    cloud: &'a Cloud,
    dropped: usize,
    radius: Option<f64>,
    made: &'a Made,
    clock: &'a StageClock,
}

impl Outcome<'_> {
    fn tell(&self, console: &Console) {
        let Made { vertices, triangles, bytes, .. } = *self.made;
        console.say(format_args!("  surface: {}, {}", show_vertices(vertices), show_many(triangles, "triangle")));
        let seconds = self.clock.total().as_secs_f64();
        let path: &Path = self.job.target.path();
        console.say(format_args!("{}: {} in {seconds:.3} s", path.display(), show_bytes(bytes)));
        for (name, time) in self.clock.stages() {
            console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
        }
        if let Some(peak) = machine::peak_memory() {
            console.detail(format_args!(
                "  peak memory {}, {}",
                show_bytes(peak),
                show_many(self.job.threads.get(), "thread")
            ));
        }
    }

    fn as_json(&self) -> Value {
        let Self { job, made, .. } = *self;
        let stage = |(name, time): (&str, std::time::Duration)| json!({"name": name, "seconds": time.as_secs_f64()});
        json!({
            "input": job.input.to_string_lossy(),
            "output": job.target.path().to_string_lossy(),
            "output_bytes": made.bytes,
            "particles": self.cloud.len(),
            "particles_dropped": self.dropped,
            "vertices": made.vertices,
            "triangles": made.triangles,
            "bricks_filled": made.stats.bricks_filled,
            "bricks_crossed": made.stats.bricks_crossed,
            "blocks": made.stats.blocks,
            "parameters": self.parameters(),
            "stages": self.clock.stages().into_iter().map(stage).collect::<Vec<_>>(),
            "seconds": self.clock.total().as_secs_f64(),
            "peak_memory_bytes": machine::peak_memory(),
        })
    }

    fn parameters(&self) -> Value {
        let params = &self.job.params;
        json!({
            "particle_radius": self.radius,
            "particle_radius_inferred": self.job.radius.is_none() && self.radius.is_some(),
            "smoothing_length": params.smoothing_length,
            "cell_size": params.cell_size,
            "threshold": params.iso,
            "band": format!("{:?}", params.band).to_lowercase(),
            "normals": params.normals,
            "attributes": self.cloud.channels.iter().map(|c| &c.name).collect::<Vec<_>>(),
            "drop_invalid": self.job.drop_invalid,
            "threads": self.job.threads.get(),
            "max_memory_bytes": params.max_memory,
            "lanes": format!("{:?}", params.lanes).to_lowercase(),
        })
    }
}
