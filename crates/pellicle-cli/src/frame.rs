//! One frame, from file to file: read, choose, split off the spray, reconstruct, write, draw. A single input and the
//! frames of a sequence go the same way.

use std::path::Path;
use std::time::Duration;

use pellicle::{Control, Error, Params, Reconstructor, infer_radius};
use pellicle_io::{Particles, ReadOptions, WriteOptions, read_particles, write_particles};
use serde_json::{Value, json};

use crate::choose::{Chosen, Invalid};
use crate::clock::StageClock;
use crate::cloud::Cloud;
use crate::console::Console;
use crate::failure::Failure;
use crate::field;
use crate::interrupt;
use crate::machine;
use crate::picture;
use crate::plan::Frame;
use crate::resolve::MeshJob;
use crate::spray;
use crate::surface::{Made, Order, make, method_name};
use crate::target::Target;
use crate::values::{show_bytes, show_faces, show_many, show_number, show_vertices};

/// The particles of a frame, read and chosen.
#[derive(Debug)]
pub struct Loaded {
    particles: Particles,
    /// Their own radii, if they have any.
    radii: Option<Vec<f32>>,
    chosen: Chosen,
    /// How many are in the file of spray, once they are.
    sprayed: Option<usize>,
    /// What was made of them for an attempt that failed.
    cloud: Option<Cloud>,
    /// When reading began, with the time that it took.
    clock: StageClock,
}

/// A finished frame.
#[derive(Debug)]
pub struct Outcome {
    particles: usize,
    chosen: Chosen,
    /// Particles in the file of spray.
    sprayed: Option<usize>,
    radius: Option<f64>,
    attributes: Vec<String>,
    made: Made,
    stages: Vec<(&'static str, Duration)>,
    seconds: f64,
}

/// Reads the particles of a frame and chooses among them.
pub fn load(job: &MeshJob, frame: &Frame, clock: StageClock) -> Result<Loaded, Failure> {
    clock.begin("read");
    let options = ReadOptions { frame: frame.step.unwrap_or(job.read.frame), ..job.read.clone() };
    let mut particles = read_particles(&frame.input, &options)?;
    let chosen = job.choice.apply(&mut particles, &frame.input)?;
    let radii = job.keep_carried(&mut particles, &frame.input)?;
    clock.pause();
    Ok(Loaded { particles, radii, chosen, sprayed: None, cloud: None, clock })
}

impl Loaded {
    /// The radius that the particles' spacing suggests. `None` without particles, or where all coincide.
    pub fn infer(&self, job: &MeshJob, input: &Path) -> Result<Option<f64>, Failure> {
        // Spacings of positions that are not finite mean nothing, so these are looked for first.
        let view = self.particles.positions.view();
        let invalid = (0..view.len()).map(|i| (i, view.get(i))).find(|(_, p)| !p.iter().all(|x| x.is_finite()));
        if let Some((index, position)) = invalid {
            return Err(Failure::core(input, Error::NotFinite { index, position }));
        }
        let radius = infer_radius(view);
        if radius.is_none() && !view.is_empty() && job.radius.is_none() {
            return Err(Failure::file(
                input,
                "the particle radius cannot be inferred from fewer than two distinct positions (give it with -r)",
            ));
        }
        Ok(radius)
    }

    /// Says what was read.
    pub fn announce(&self, input: &Path, console: &Console) {
        console.say(format_args!("{}: {}", input.display(), show_many(self.particles.positions.len(), "particle")));
    }

    /// Warns of particles that were left out for being wrong, and tells how many were not chosen.
    pub fn tell_choice(&self, input: &Path, console: &Console) {
        let Chosen { dropped_invalid: invalid, cropped, filtered, kept } = self.chosen;
        if invalid > 0 {
            console.warn(format!(
                "{}: {} left out, whose positions are not finite; {} stay",
                input.display(),
                show_many(invalid, "particle"),
                show_many(kept + cropped + filtered, "particle"),
            ));
        }
        if cropped + filtered > 0 {
            console.say(format_args!(
                "  {} outside the box and {} for which the condition does not hold left out",
                show_many(cropped, "particle"),
                show_many(filtered, "particle"),
            ));
        }
    }

    /// Makes the surface of the frame and writes what belongs to it, in the current pool of threads. `limit` is the
    /// memory for it; `None` leaves it to the job.
    pub fn mesh(
        &mut self,
        job: &MeshJob,
        frame: &Frame,
        radius: Option<f64>,
        limit: Option<u64>,
        reconstructor: &mut Reconstructor,
    ) -> Result<Outcome, Failure> {
        let max_memory = limit.or(job.params.max_memory);
        let params =
            Params { particle_radius: radius.unwrap_or(job.params.particle_radius), max_memory, ..job.params.clone() };
        if let (Some(path), None) = (&frame.spray, self.sprayed) {
            self.clock.begin("spray");
            let control = Control { cancel: Some(&interrupt::TOKEN), ..Control::default() };
            let spray = spray::split(&mut self.particles, &mut self.radii, &params, &control, &frame.input)?;
            write_particles(path, &spray, &WriteOptions { up: job.up, ..WriteOptions::default() })?;
            self.sprayed = Some(spray.positions.len());
        }
        let target = Target::new(frame.output.clone())?;
        // A frame may be tried again with more memory.
        let cloud = self.cloud.take().unwrap_or_else(|| {
            let mut cloud = Cloud { radii: self.radii.take(), ..Cloud::from(std::mem::take(&mut self.particles)) };
            if job.normal_velocity {
                cloud.add_normal_velocity(job.carry.wants("velocity", 3));
            }
            if let Some(walls) = &job.walls {
                cloud.mirror(walls, &params);
            }
            cloud
        });
        let choice = [job.choice.record(), job.walls_record.clone()].concat();
        let order = Order {
            choice: &choice,
            radius_attribute: job.radius_attribute.as_deref(),
            source: &frame.input,
            params: &params,
            is_radius_known: radius.is_some(),
            target: &target,
            up: job.up,
            keep_mesh: frame.png.is_some(),
            tetrahedra: job.tetrahedra,
            finishing: job.finishing,
            walls: job.walls.as_ref(),
        };
        let made = make(&cloud, &order, reconstructor, &self.clock);
        let (particles, attributes) =
            (cloud.len() - cloud.ghosts, cloud.channels.iter().map(|c| c.name.clone()).collect());
        let mut made = match made {
            Ok(made) => made,
            Err(failure) => {
                self.cloud = Some(cloud);
                return Err(failure);
            }
        };
        if let (Some(path), Some(mesh)) = (&frame.png, made.mesh.take()) {
            self.clock.begin("draw");
            picture::of_mesh(&mesh, job.up, path)?;
        }
        Ok(Outcome {
            particles,
            chosen: self.chosen,
            sprayed: self.sprayed,
            radius,
            attributes,
            made,
            stages: self.clock.stages(),
            seconds: self.clock.working().as_secs_f64(),
        })
    }
}

impl Outcome {
    /// Warns of a surface that is not there although particles are.
    pub fn warn(&self, job: &MeshJob, frame: &Frame, console: &Console) {
        let input = frame.input.display();
        if self.particles == 0 {
            console.warn(format!("{input}: there are no particles, so the mesh is empty"));
        } else if self.made.triangles == 0 && self.made.quads.unwrap_or(0) == 0 {
            console.warn(format!(
                "{input}: no surface: the field exceeds {} nowhere on the lattice (check -r, lower -t, or use a \
                 smaller -c)",
                job.params.iso
            ));
        }
        if !self.made.left_out.is_empty() {
            let names = self.made.left_out.join(", ");
            console.warn(format!("{}: this format has no room for {names}: left out", frame.output.display()));
        }
    }

    /// What a single run says in the end.
    pub fn tell(&self, job: &MeshJob, frame: &Frame, console: &Console) {
        let Made { vertices, triangles, quads, bytes, .. } = self.made;
        if let (Some(count), Some(path)) = (self.sprayed, &frame.spray) {
            console.say(format_args!("  spray: {} in {}", show_many(count, "particle"), path.display()));
        }
        console.say(format_args!("  surface: {}, {}", show_vertices(vertices), show_faces(triangles, quads)));
        let path = frame.output.display();
        console.say(format_args!("{path}: {} in {:.3} s", show_bytes(bytes), self.seconds));
        if let Some(png) = &frame.png {
            console.say(format_args!("{}: its picture", png.display()));
        }
        for (name, time) in &self.stages {
            console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
        }
        if let Some(peak) = machine::peak_memory() {
            let threads = show_many(job.threads.get(), "thread");
            console.detail(format_args!("  peak memory {}, {threads}", show_bytes(peak)));
        }
    }

    /// What a sequence says of it.
    pub fn line(&self, frame: &Frame) -> String {
        format!(
            "{} -> {}: {}, {}, {:.3} s",
            frame.input.display(),
            frame.output.display(),
            show_many(self.particles, "particle"),
            show_faces(self.made.triangles, self.made.quads),
            self.seconds
        )
    }

    /// Everything about it.
    pub fn as_json(&self, frame: &Frame) -> Value {
        let Self { made, chosen, .. } = self;
        let stage = |(name, time): &(&str, Duration)| json!({"name": name, "seconds": time.as_secs_f64()});
        json!({
            "input": frame.input.to_string_lossy(),
            "output": frame.output.to_string_lossy(),
            "png": frame.png.as_ref().map(|path| path.to_string_lossy()),
            "output_bytes": made.bytes,
            "particles": self.particles,
            "particles_dropped": chosen.dropped_invalid,
            "particles_cropped": chosen.cropped,
            "particles_filtered": chosen.filtered,
            "particles_sprayed": self.sprayed,
            "particle_radius": self.radius,
            "vertices": made.vertices,
            "triangles": made.triangles,
            "quads": made.quads,
            "bricks_filled": made.stats.bricks_filled,
            "bricks_crossed": made.stats.bricks_crossed,
            "blocks": made.stats.blocks,
            "surface_particles": made.stats.surface_particles,
            "surface_nodes": made.stats.surface_nodes,
            "stages": self.stages.iter().map(stage).collect::<Vec<_>>(),
            "seconds": self.seconds,
        })
    }

    /// The parameters that it was made with, for reports.
    pub fn parameters(&self, job: &MeshJob) -> Value {
        let params = &job.params;
        json!({
            "particle_radius": self.radius,
            "particle_radius_inferred": job.radius.is_none() && self.radius.is_some(),
            "field": field::show(params.field),
            "radius_attribute": job.radius_attribute,
            "smoothing_length": params.smoothing_length,
            "cell_size": params.cell_size,
            "threshold": params.iso,
            "band": format!("{:?}", params.band).to_lowercase(),
            "method": job.tetrahedra.map_or("cubes", |split| method_name(split)),
            "normals": params.normals,
            "attributes": self.attributes,
            "drop_invalid": job.choice.invalid == Invalid::Drop,
            "threads": job.threads.get(),
            "max_memory_bytes": params.max_memory,
            "lanes": format!("{:?}", params.lanes).to_lowercase(),
        })
    }

    /// Names of what is carried, and the radius, for those who asked for more.
    pub fn tell_parameters(&self, job: &MeshJob, console: &Console) {
        let params = &job.params;
        if let (Some(radius), Some(_)) = (self.radius, job.radius) {
            console.detail(format_args!("  radius {}, as given", show_number(radius)));
        }
        console.detail(format_args!(
            "  field {}, smoothing length {} radii, cell {} radii, threshold {}",
            field::show(params.field),
            params.smoothing_length,
            params.cell_size,
            params.iso
        ));
        if !self.attributes.is_empty() {
            console.detail(format_args!("  carries {}", self.attributes.join(", ")));
        }
    }
}
