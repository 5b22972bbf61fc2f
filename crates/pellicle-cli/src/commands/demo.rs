//! `demo`: a splash of particles, made here and now, and its surface. No data are needed.

use std::path::{Path, PathBuf};

use pellicle::Params;
use pellicle_io::PositionData;
use pellicle_scenes::{Scene, splash};
use serde_json::json;

use crate::args::DemoArgs;
use crate::clock::StageClock;
use crate::cloud::{Channel, Cloud};
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt;
use crate::machine;
use crate::surface::{Made, Order, make};
use crate::target::Target;
use crate::values::{show_bytes, show_many, show_number, show_vertices};

/// Enough for a crown and its drops, few enough for a second or two on a slow machine.
const PARTICLES: usize = 30_000;
/// Any; this one makes a pretty picture.
const SEED: u64 = 1;
/// What messages and the record in the file call the particles.
const SOURCE: &str = "demo splash";

/// Runs the verb.
pub fn run(args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    let clock = StageClock::start();
    interrupt::listen();
    let target = Target::new(output(&args.output_dir))?;
    target.check()?;
    let lanes = machine::lanes_from_environment()?;
    let pool = machine::thread_pool(machine::default_threads())?;

    clock.begin("splash");
    let scene = splash(PARTICLES, SEED);
    let params = Params { lanes, ..Params::new(f64::from(scene.radius)) };
    let cloud = cloud(scene);
    let made = pool.install(|| {
        let order = Order { source: Path::new(SOURCE), params: &params, is_radius_known: true, target: &target };
        make(&cloud, &order, &clock)
    })?;
    tell(&cloud, &params, &target, &made, &clock, console);
    console.report(|| {
        json!({
            "output": target.path().to_string_lossy(),
            "output_bytes": made.bytes,
            "particles": cloud.len(),
            "vertices": made.vertices,
            "triangles": made.triangles,
            "seconds": clock.total().as_secs_f64(),
        })
    });
    Ok(())
}

fn output(folder: &Path) -> PathBuf {
    if folder == Path::new(".") { PathBuf::from("demo.ply") } else { folder.join("demo.ply") }
}

fn cloud(scene: Scene) -> Cloud {
    let velocity = Channel { name: "velocity".into(), components: 3, values: scene.velocities.into_flattened() };
    Cloud { positions: PositionData::F32(scene.positions), channels: vec![velocity] }
}

fn tell(cloud: &Cloud, params: &Params, target: &Target, made: &Made, clock: &StageClock, console: &Console) {
    let path = target.path().display();
    console.say(format_args!(
        "made a splash: {} of radius {}",
        show_many(cloud.len(), "particle"),
        show_number(params.particle_radius)
    ));
    console.say(format_args!(
        "and its surface: {}, {}, with velocity",
        show_vertices(made.vertices),
        show_many(made.triangles, "triangle")
    ));
    console.say(format_args!("{path}: {} in {:.2} s", show_bytes(made.bytes), clock.total().as_secs_f64()));
    for (name, time) in clock.stages() {
        console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
    }
    console.say(format_args!(
        "\nNext:\n  open {path} in Blender, MeshLab or ParaView\n  pellicle check {path}      is it closed?\n  \
         pellicle mesh FRAME.vtk     your own particles\n  pellicle mesh --help        every option"
    ));
}
