//! `formats`: which file types are read and written, from the table that reading and writing go by.

use pellicle_io::{FormatInfo, formats};
use serde_json::json;

use crate::args::FormatsArgs;
use crate::console::Console;
use crate::failure::Failure;

/// Runs the verb.
pub fn run(_args: &FormatsArgs, console: &Console) -> Result<(), Failure> {
    console.say(format_args!("{:<28}{:<12}{:<12}{:<10}extensions", "format", "particles", "meshes", "volumes"));
    for info in formats() {
        let FormatInfo { name, extensions, .. } = info;
        let particles = ways(info.reads_particles, info.writes_particles);
        let meshes = ways(info.reads_meshes, info.writes_meshes);
        let volumes = ways(info.reads_volumes, info.writes_volumes);
        let extensions: Vec<String> = extensions.iter().map(|extension| format!(".{extension}")).collect();
        console.say(format_args!("{name:<28}{particles:<12}{meshes:<12}{volumes:<10}{}", extensions.join(" ")));
    }
    console.say("\nA .pvd is written for a sequence, with its frames as .vtp: pellicle mesh f_####.vtk -o name.pvd");
    console.say("Text, dumps and JSON may be gzipped. Which foreign programs agree: docs/src/formats.md");
    console.report(|| {
        let entry = |info: FormatInfo| {
            json!({
                "name": info.name,
                "extensions": info.extensions,
                "reads_particles": info.reads_particles,
                "writes_particles": info.writes_particles,
                "reads_meshes": info.reads_meshes,
                "writes_meshes": info.writes_meshes,
                "writes_quads": info.writes_quads,
                "reads_volumes": info.reads_volumes,
                "writes_volumes": info.writes_volumes,
            })
        };
        json!({"formats": formats().map(entry).collect::<Vec<_>>()})
    });
    Ok(())
}

fn ways(reads: bool, writes: bool) -> &'static str {
    match (reads, writes) {
        (true, true) => "in, out",
        (true, false) => "in",
        (false, true) => "out",
        (false, false) => "-",
    }
}
