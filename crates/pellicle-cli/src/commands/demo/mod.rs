//! `demo`, alone: a splash of particles, made here and now, its surface, and pictures of both. No data are needed.

mod show;

use std::path::{Path, PathBuf};

use pellicle::{Carry, Params, Reconstructor};
use pellicle_io::{PositionData, Up, WriteOptions, check_writable, write_file, write_mesh};
use pellicle_render::{Framing, Image, Page, Scene, Settings, draw, page};
use pellicle_scenes::{Show, splash};
use serde_json::json;

use crate::args::{DemoArg, DemoArgs};
use crate::clock::StageClock;
use crate::cloud::{Channel, Cloud};
use crate::console::Console;
use crate::failure::Failure;
use crate::finish::Finishing;
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::picture;
use crate::surface::{Order, make};
use crate::target::Target;
use crate::values::{show_bytes, show_many, show_number, show_vertices};

/// Enough for a crown and its drops, few enough for a second or two on a slow machine.
const PARTICLES: usize = 30_000;
/// Any; this one makes a pretty picture.
const SEED: u64 = 1;
/// What messages and the record in the file call the particles.
const SOURCE: &str = "demo splash";
/// Pixels of each half of the picture.
const HALF: (u32, u32) = (960, 720);
/// What is made, in order.
const FILES: [&str; 4] = ["demo.ply", "demo.glb", "demo.png", "demo.html"];

/// Runs the verb.
pub fn run(args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    match args.what {
        DemoArg::Splash => show_splash(args, console),
        DemoArg::Metaballs => super::demo_metaballs::run(args, console),
        DemoArg::Fountain => show::run(Show::Fountain, args, console),
        DemoArg::Blob => show::run(Show::Blob, args, console),
        DemoArg::Explosion => show::run(Show::Explosion, args, console),
        DemoArg::Monster => show::run(Show::Monster, args, console),
    }
}

fn show_splash(args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    let clock = StageClock::start();
    interrupt::listen();
    let [ply, glb, png, html] = FILES.map(|name| inside(&args.output_dir, name));
    for path in [&ply, &glb, &png, &html] {
        check_writable(path)?;
    }
    let target = Target::new(ply.clone())?;
    let lanes = machine::lanes_from_environment()?;
    let pool = machine::thread_pool(machine::default_threads())?;

    clock.begin("splash");
    let scene = splash(PARTICLES, SEED);
    let params = Params { lanes, normals: true, ..Params::new(f64::from(scene.radius)) };
    let values = scene.velocities.into_flattened();
    let velocity = Channel { name: "velocity".into(), components: 3, values, carry: Carry::Mean };
    let cloud =
        Cloud { positions: PositionData::F32(scene.positions), channels: vec![velocity], radii: None, ghosts: 0 };
    interrupt::enter(Phase::Working);
    let made = pool.install(|| -> Result<_, Failure> {
        let source = Path::new(SOURCE);
        let order = Order {
            source,
            params: &params,
            is_radius_known: true,
            target: &target,
            choice: &[],
            radius_attribute: None,
            up: Up::Y,
            keep_mesh: true,
            tetrahedra: None,
            finishing: Finishing::default(),
            walls: None,
        };
        let mut made = make(&cloud, &order, &mut Reconstructor::new(), &clock)?;
        let mesh = made.mesh.take().unwrap_or_default();
        write_mesh(&glb, &mesh, &WriteOptions { comments: order.record(), ..WriteOptions::default() })?;
        clock.begin("draw");
        interrupt::check()?;
        let image = both(&cloud, &mesh, &params).map_err(|error| Failure::file(&png, error))?;
        picture::save(&image, &png)?;
        let text =
            page(&mesh, &Page::new("A splash, meshed by pellicle")).map_err(|error| Failure::file(&html, error))?;
        write_file(&html, &text)?;
        Ok(made)
    })?;
    interrupt::enter(Phase::Written);
    console.say(format_args!(
        "made a splash: {} of radius {}",
        show_many(cloud.len(), "particle"),
        show_number(params.particle_radius)
    ));
    console.say(format_args!(
        "and its surface: {}, {}, with velocity and normals",
        show_vertices(made.vertices),
        show_many(made.triangles, "triangle")
    ));
    let seconds = clock.total().as_secs_f64();
    for (name, time) in clock.stages() {
        console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
    }
    console.say(format_args!("{}: {} in {seconds:.2} s", ply.display(), show_bytes(made.bytes)));
    let [ply, glb, png, html] = [&ply, &glb, &png, &html].map(|path| path.to_string_lossy());
    console.say(format_args!(
        "\nNext:\n  open {html} in a browser, {png} is its picture\n  open {ply} or {glb} in Blender, MeshLab or ParaView\n  \
         pellicle check {ply}             is it closed?\n  \
         pellicle mesh FRAME.vtk             your own particles\n  \
         pellicle mesh frame_####.vtk -o out/   and all of them\n  \
         pellicle mesh --help                every option\n  \
         pellicle demo monster               250 particles that move, a picture a frame"
    ));
    console.report(|| {
        json!({
            "output": ply,
            "files": [ply, glb, png, html],
            "output_bytes": made.bytes,
            "particles": cloud.len(),
            "vertices": made.vertices,
            "triangles": made.triangles,
            "seconds": seconds,
        })
    });
    Ok(())
}

/// A file in a folder, without a leading dot.
pub fn inside(folder: &Path, name: &str) -> PathBuf {
    if folder == Path::new(".") { name.into() } else { folder.join(name) }
}

/// The particles beside their surface, seen from the same place.
fn both(cloud: &Cloud, mesh: &pellicle::Mesh, params: &Params) -> Result<Image, pellicle_render::Error> {
    let particles = Scene::of_spheres(cloud.positions(), params.particle_radius);
    let surface = Scene::of_mesh(mesh);
    let bounds = particles.bounds().union(&surface.bounds());
    let mut settings = Settings::new(HALF.0, HALF.1);
    let camera = Framing::default().fit(&bounds, settings.aspect())?;
    settings.caption = Some(show_many(cloud.len(), "particle").to_string());
    let left = draw(&particles, &camera, &settings)?;
    settings.caption = Some(format!("their surface: {}", show_many(mesh.triangles.len(), "triangle")));
    left.beside(&draw(&surface, &camera, &settings)?)
}
