//! `convert IN OUT`: one file of particles or a mesh to another format.

use pellicle::Mesh;
use pellicle_io::{
    AttributeValues, Content, ParticleAttribute, Particles, PositionData, RawType, ReadOptions, Up, WriteOptions,
    Written, check_mesh_format, check_particle_format, check_writable, read_content, write_mesh, write_particles,
};
use serde_json::json;

use crate::args::{ConvertArgs, RawArg, UpArg};
use crate::console::Console;
use crate::failure::Failure;
use crate::machine;
use crate::resolve::same_file;
use crate::values::{show_bytes, show_many, show_vertices};

/// Runs the verb.
pub fn run(args: &ConvertArgs, console: &Console) -> Result<(), Failure> {
    if same_file(&args.input, &args.output) {
        let file = args.input.display();
        return Err(Failure::Usage(format!("{file}: the output would overwrite its input (choose another name)")));
    }
    if let (Err(error), Err(_)) = (check_mesh_format(&args.output), check_particle_format(&args.output)) {
        return Err(Failure::Usage(error.to_string()));
    }
    check_writable(&args.output)?;
    machine::thread_pool(machine::default_threads())?.install(|| convert(args, console))
}

fn convert(args: &ConvertArgs, console: &Console) -> Result<(), Failure> {
    let content = read_content(&args.input, &read_options(args))?;
    let options = write_options(args);
    let (said, counts, dropped, written) = match content {
        Content::Mesh(mut mesh) if check_mesh_format(&args.output).is_ok() => {
            if args.drop_invalid && mesh.vertices.as_flattened().iter().any(|x| !x.is_finite()) {
                let what = "vertices of a mesh are not finite: they cannot be left out without its faces";
                return Err(Failure::file(&args.input, what));
            }
            scale_mesh(&mut mesh, args.scale);
            let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
            let said = format!("mesh of {}, {}", show_vertices(vertices), show_many(triangles, "triangle"));
            let counts = json!({"kind": "mesh", "vertices": vertices, "triangles": triangles});
            (said, counts, 0, write_mesh(&args.output, &mesh, &options)?)
        }
        content => {
            let mut particles = match content {
                Content::Particles(particles) => particles,
                Content::Mesh(mesh) => {
                    console.warn(format!("{}: this format holds no faces: vertices only", args.output.display()));
                    vertices(mesh)
                }
            };
            let dropped = if args.drop_invalid { drop_invalid(&mut particles) } else { 0 };
            scale_particles(&mut particles, args.scale);
            let count = particles.positions.len();
            let counts = json!({"kind": "particles", "particles": count});
            (show_many(count, "particle"), counts, dropped, write_particles(&args.output, &particles, &options)?)
        }
    };
    tell(args, console, &said, dropped, &written)?;
    console.report(|| {
        let mut report = counts;
        report["input"] = json!(args.input.to_string_lossy());
        report["output"] = json!(args.output.to_string_lossy());
        report["particles_dropped"] = json!(dropped);
        report["left_out"] = json!(written.left_out);
        report["narrowed"] = json!(written.narrowed);
        report
    });
    Ok(())
}

fn tell(args: &ConvertArgs, console: &Console, said: &str, dropped: usize, written: &Written) -> Result<(), Failure> {
    let file = args.output.display();
    if dropped > 0 {
        let particles = show_many(dropped, "particle");
        console.warn(format!("{}: {particles} left out, whose positions are not finite", args.input.display()));
    }
    if !written.left_out.is_empty() {
        console.warn(format!("{file}: this format has no room for {}: left out", written.left_out.join(", ")));
    }
    if !written.narrowed.is_empty() {
        let names = written.narrowed.join(", ");
        console.warn(format!("{file}: this format has less precision or fewer components for {names}"));
    }
    let bytes = std::fs::metadata(&args.output).map_err(|error| Failure::file(&args.output, error))?.len();
    console.say(format_args!("{}: {said}", args.input.display()));
    console.say(format_args!("{file}: {}", show_bytes(bytes)));
    Ok(())
}

fn read_options(args: &ConvertArgs) -> ReadOptions {
    ReadOptions {
        attributes: args.attributes.clone(),
        also: Vec::new(),
        array: args.array.clone(),
        frame: args.frame,
        raw: match args.raw {
            None => RawType::Auto,
            Some(RawArg::F32) => RawType::F32,
            Some(RawArg::F64) => RawType::F64,
        },
    }
}

fn write_options(args: &ConvertArgs) -> WriteOptions {
    let source = args.input.file_name().unwrap_or_default().to_string_lossy();
    WriteOptions {
        comments: vec![format!("pellicle {}", env!("CARGO_PKG_VERSION")), format!("source {source}")],
        up: match args.up {
            UpArg::Y => Up::Y,
            UpArg::Z => Up::Z,
        },
        metres_per_unit: args.metres_per_unit,
    }
}

/// Attributes that are lengths, or lengths per time.
fn is_length(name: &str) -> bool {
    matches!(name, "radius" | "velocity")
}

fn scale_mesh(mesh: &mut Mesh, factor: f64) {
    if factor == 1.0 {
        return;
    }
    mesh.origin = mesh.origin.map(|x| x * factor);
    mesh.vertices.as_flattened_mut().iter_mut().for_each(|x| *x = (f64::from(*x) * factor) as f32);
    for attribute in mesh.attributes.iter_mut().filter(|a| is_length(&a.name)) {
        attribute.values.iter_mut().for_each(|x| *x = (f64::from(*x) * factor) as f32);
    }
}

fn scale_particles(particles: &mut Particles, factor: f64) {
    if factor == 1.0 {
        return;
    }
    match &mut particles.positions {
        PositionData::F32(p) => p.as_flattened_mut().iter_mut().for_each(|x| *x = (f64::from(*x) * factor) as f32),
        PositionData::F64(p) => p.as_flattened_mut().iter_mut().for_each(|x| *x *= factor),
    }
    for attribute in particles.attributes.iter_mut().filter(|a| is_length(&a.name)) {
        attribute.values = match std::mem::replace(&mut attribute.values, AttributeValues::F32(Vec::new())) {
            AttributeValues::F32(v) => {
                AttributeValues::F32(v.iter().map(|&x| (f64::from(x) * factor) as f32).collect())
            }
            AttributeValues::F64(v) => AttributeValues::F64(v.iter().map(|&x| x * factor).collect()),
            AttributeValues::I32(v) => AttributeValues::F64(v.iter().map(|&x| f64::from(x) * factor).collect()),
            AttributeValues::I64(v) => AttributeValues::F64(v.iter().map(|&x| x as f64 * factor).collect()),
        };
    }
}

/// The vertices of a mesh, with all that belongs to them.
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

/// Leaves out particles whose position is not finite, with their values; returns how many.
fn drop_invalid(particles: &mut Particles) -> usize {
    let view = particles.positions.view();
    let keep: Vec<bool> = (0..view.len()).map(|i| view.get(i).iter().all(|x| x.is_finite())).collect();
    let dropped = keep.iter().filter(|&&keep| !keep).count();
    if dropped == 0 {
        return 0;
    }
    match &mut particles.positions {
        PositionData::F32(p) => retain(p, &keep, 1),
        PositionData::F64(p) => retain(p, &keep, 1),
    }
    for attribute in &mut particles.attributes {
        let each = attribute.components;
        match &mut attribute.values {
            AttributeValues::F32(v) => retain(v, &keep, each),
            AttributeValues::F64(v) => retain(v, &keep, each),
            AttributeValues::I32(v) => retain(v, &keep, each),
            AttributeValues::I64(v) => retain(v, &keep, each),
        }
    }
    dropped
}

/// Keeps the values, `each` per particle, of the particles that `keep` says.
fn retain<T>(values: &mut Vec<T>, keep: &[bool], each: usize) {
    let mut index = 0;
    values.retain(|_| {
        let kept = keep[index / each];
        index += 1;
        kept
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_scaled_and_nothing_else() {
        let add = |name: &str, values| ParticleAttribute { name: name.into(), components: 1, values };
        let mut particles = Particles {
            positions: PositionData::F64(vec![[1.0, f64::NAN, 0.0], [1.0, 2.0, 3.0]]),
            attributes: vec![
                add("radius", AttributeValues::F32(vec![9.0, 0.5])),
                add("density", AttributeValues::I32(vec![7, 8])),
            ],
        };
        assert_eq!(drop_invalid(&mut particles), 1);
        scale_particles(&mut particles, 2.0);
        assert_eq!(particles.positions, PositionData::F64(vec![[2.0, 4.0, 6.0]]));
        assert_eq!(particles.attributes[0].values, AttributeValues::F32(vec![1.0]));
        assert_eq!(particles.attributes[1].values, AttributeValues::I32(vec![8]));
    }
}
