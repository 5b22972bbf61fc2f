//! `convert IN OUT`: particles, meshes or volumes to another format, one file or a sequence.

mod volume;

use std::path::Path;

use pellicle::Mesh;
use pellicle_io::{
    AttributeValues, Content, ParticleAttribute, Particles, PositionData, ReadOptions, Up, WriteOptions, Written,
    check_mesh_format, check_particle_format, check_volume_format, check_writable, read_content, write_mesh,
    write_particles, write_pvd,
};
use serde_json::json;

use crate::args::ConvertArgs;
use crate::batch::{self, Made};
use crate::choose::{Choice, Chosen, Invalid, transform};
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::plan::{Absent, Frame, Plan, is_done};
use crate::resolve::{Files, keep_carried, selection};
use crate::values::{show_bytes, show_many, show_vertices};
use volume::Volumes;

/// All that `convert` was asked to do, but for the list of frames.
struct Job<'a> {
    args: &'a ConvertArgs,
    read: ReadOptions,
    choice: Choice,
    volumes: Volumes,
    up: Up,
}

/// Runs the verb.
pub fn run(args: &ConvertArgs, console: &Console) -> Result<(), Failure> {
    interrupt::listen();
    let (Some(input), Some(output)) = (&args.input, &args.output) else {
        return Err(Failure::Usage("convert needs the names of two files: IN and OUT".into()));
    };
    let files = Files::resolve(std::slice::from_ref(input), Some(output), "ply", &args.frames)?;
    let (read, choice) = selection(&args.from, args.attributes.clone(), Invalid::Keep)?;
    let plan = Plan::new(&files, Absent::Refuse, console)?;
    for frame in plan.single.iter().chain(plan.frames.first()) {
        let others = check_particle_format(&frame.output).or_else(|_| check_volume_format(&frame.output));
        if let (Err(error), Err(_)) = (check_mesh_format(&frame.output), others) {
            return Err(Failure::Usage(error.to_string()));
        }
    }
    let volumes = Volumes::new(args, choice.crop);
    let job = Job { args, read, choice, volumes, up: args.from.up.into() };
    interrupt::enter(Phase::Working);
    machine::thread_pool(machine::default_threads())?.install(|| {
        batch::run(
            &plan,
            |frame| args.frames.skip_existing && is_done(frame),
            console,
            |frame| job.convert(frame, console),
        )
    })?;
    if let Some(list) = &plan.pvd {
        let time = |(i, frame): (usize, &Frame)| frame.time.or(frame.number.map(|n| n as f64)).unwrap_or(i as f64);
        let entries: Vec<_> =
            plan.whole.iter().enumerate().map(|entry| (time(entry), entry.1.output.clone())).collect();
        write_pvd(list, &entries)?;
        console.say(format_args!("{}: the list of frames, for ParaView", list.display()));
    }
    Ok(())
}

impl Job<'_> {
    fn convert(&self, frame: &Frame, console: &Console) -> Result<Made, Failure> {
        let (input, output) = (&frame.input, &frame.output);
        check_writable(output)?;
        if self.volumes.are_in(frame)? {
            return self.volumes.convert(frame, console);
        }
        let read = ReadOptions { frame: frame.step.unwrap_or(self.read.frame), ..self.read.clone() };
        let content = read_content(input, &read)?;
        interrupt::check()?;
        let options = self.write_options(input);
        let (said, mut report, written) = match content {
            Content::Mesh(mut mesh) if check_mesh_format(output).is_ok() => {
                self.refuse_choice(input)?;
                transform::scale_mesh(&mut mesh, self.choice.scale.unwrap_or(1.0));
                let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
                let said = format!("mesh of {}, {}", show_vertices(vertices), show_many(triangles, "triangle"));
                let report = json!({"kind": "mesh", "vertices": vertices, "triangles": triangles});
                (said, report, write_mesh(output, &mesh, &options)?)
            }
            content => {
                let mut particles = match content {
                    Content::Particles(particles) => particles,
                    Content::Mesh(mesh) => {
                        console.warn(format!("{}: this format holds no faces: vertices only", output.display()));
                        vertices(mesh)
                    }
                };
                let chosen = self.choice.apply(&mut particles, input)?;
                tell_invalid(&chosen, input, console);
                keep_carried(&self.args.attributes, &self.read.also, &mut particles);
                let Chosen { dropped_invalid, cropped, filtered, kept } = chosen;
                let report = json!({
                    "kind": "particles",
                    "particles": kept,
                    "particles_dropped": dropped_invalid,
                    "particles_cropped": cropped,
                    "particles_filtered": filtered,
                });
                (show_many(kept, "particle"), report, write_particles(output, &particles, &options)?)
            }
        };
        tell_losses(&written, output, console);
        let bytes = std::fs::metadata(output).map_err(|error| Failure::file(output, error))?.len();
        report["left_out"] = json!(written.left_out);
        report["narrowed"] = json!(written.narrowed);
        report["output_bytes"] = json!(bytes);
        let line = format!("{} -> {}: {said}, {}", input.display(), output.display(), show_bytes(bytes));
        Ok(Made { line, report })
    }

    fn write_options(&self, input: &Path) -> WriteOptions {
        let source = input.file_name().unwrap_or_default().to_string_lossy();
        WriteOptions {
            comments: [format!("pellicle {}", env!("CARGO_PKG_VERSION")), format!("source {source}")]
                .into_iter()
                .chain(self.choice.record())
                .collect(),
            up: self.up,
            metres_per_unit: self.args.metres_per_unit,
        }
    }

    /// Vertices cannot be left out without their faces.
    fn refuse_choice(&self, input: &Path) -> Result<(), Failure> {
        let Choice { invalid, crop, filter, .. } = &self.choice;
        if *invalid == Invalid::Drop || crop.is_some() || filter.is_some() {
            let what = "this is a mesh: --where, --crop and --drop-invalid choose among particles";
            return Err(Failure::file(input, what));
        }
        Ok(())
    }
}

fn tell_invalid(chosen: &Chosen, input: &Path, console: &Console) {
    if chosen.dropped_invalid > 0 {
        let particles = show_many(chosen.dropped_invalid, "particle");
        console.warn(format!("{}: {particles} left out, whose positions are not finite", input.display()));
    }
}

fn tell_losses(written: &Written, output: &Path, console: &Console) {
    let file = output.display();
    if !written.left_out.is_empty() {
        console.warn(format!("{file}: this format has no room for {}: left out", written.left_out.join(", ")));
    }
    if !written.narrowed.is_empty() {
        let names = written.narrowed.join(", ");
        console.warn(format!("{file}: this format has less precision or fewer components for {names}"));
    }
}

/// The vertices of a mesh as particles.
fn vertices(mesh: Mesh) -> Particles {
    let positions = if mesh.origin == [0.0; 3] {
        PositionData::F32(mesh.vertices)
    } else {
        PositionData::F64((0..mesh.vertices.len()).map(|i| mesh.position(i)).collect())
    };
    let normals = (!mesh.normals.is_empty()).then(|| ParticleAttribute {
        name: "normal".into(),
        components: 3,
        values: AttributeValues::F32(mesh.normals.into_flattened()),
    });
    let others = mesh.attributes.into_iter().map(|attribute| ParticleAttribute {
        name: attribute.name,
        components: attribute.components,
        values: AttributeValues::F32(attribute.values),
    });
    Particles { positions, attributes: normals.into_iter().chain(others).collect() }
}
