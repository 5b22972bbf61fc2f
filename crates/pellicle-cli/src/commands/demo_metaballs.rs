//! `demo metaballs`: inverse-square metaballs by tetrahedra, in three spaces of sampling, and with noise.
//!
//! A string of balls winds away from a camera. Its surface is made three times, each time in as many cells, of the box that the
//! balls take in object space, in view space, and in post-projection space, where cells are as small as their picture. A
//! fourth surface adds noise to the field.

use std::path::Path;

use pellicle::{
    Border, Control, Depth, Domain, Function, Mesh, Metaballs, Noise, Projection, Tetrahedra, TetrahedraParams,
    Turbulent, View, Warp, contour_function_tetrahedra,
};
use pellicle_io::{WriteOptions, check_writable, write_mesh};
use pellicle_render::{Camera, Image, Layer, Lens, Scene, Settings, Surface, Wireframe, draw};
use pellicle_scenes::Random;
use serde_json::json;

use super::demo::inside;
use crate::args::DemoArgs;
use crate::clock::StageClock;
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::picture;
use crate::values::{show_count, show_many};

/// What is made, in order.
const FILES: [&str; 4] = ["metaballs.ply", "turbulence.ply", "metaballs.png", "turbulence.png"];
/// Pixels of each part of a picture.
const PART: (u32, u32) = (720, 720);
/// Cells of a lattice, about, whatever its space.
const CELLS: f64 = 500_000.0;
/// Radii that a ball's field reaches.
const REACH: f64 = 4.0;
/// Radii around a ball that may hold its surface.
const EXTENT: f64 = 3.0;
/// Where the field is 1, as in the talk.
const ISO: f64 = 1.0;

const EYE: [f64; 3] = [0.0, 1.0, 0.0];
const TARGET: [f64; 3] = [2.1, 0.45, -10.0];
/// Vertical angle of view, in degrees.
const ANGLE: f64 = 44.0;
/// Tangent of half of it.
const TANGENT: f64 = 0.404_026_225_8;
/// Depths of the near and the far plane.
const DEPTHS: [f64; 2] = [2.9, 17.0];

/// Runs it.
pub fn run(args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    let clock = StageClock::start();
    interrupt::listen();
    let paths = FILES.map(|name| inside(&args.output_dir, name));
    for path in &paths {
        check_writable(path)?;
    }
    let [ply, rough_ply, png, rough_png] = &paths;
    interrupt::enter(Phase::Working);
    let (balls, meshes, rough) =
        machine::thread_pool(machine::default_threads())?.install(|| -> Result<_, Failure> {
            let placed = string_of_balls();
            let centres: Vec<[f32; 3]> = placed.iter().map(|ball| ball.0.map(|x| x as f32)).collect();
            let radii: Vec<f32> = placed.iter().map(|ball| ball.1 as f32).collect();
            let balls = Metaballs::new(&centres, &radii, REACH).map_err(failure)?;
            clock.begin("surfaces");
            let view = View::new(EYE, TARGET, [0.0, 1.0, 0.0]).map_err(failure)?;
            let projection = Projection::new(view, [TANGENT; 2], DEPTHS[0], DEPTHS[1]).map_err(failure)?;
            let projection = projection.with_depth(Depth::Even);
            let picture_space = projection_space(&placed, &view, &projection);
            let meshes = [
                surface(&balls, &object_space(&placed))?,
                surface(&balls, &view_space(&placed, &view))?,
                surface(&balls, &picture_space)?,
            ];
            let noise = Noise { frequency: 1.6, octaves: 4, seed: 3 };
            let turbulent = Turbulent { function: &balls, noise, amplitude: 0.55 };
            let rough = surface(&turbulent, &picture_space)?;
            interrupt::check()?;
            clock.begin("draw");
            picture::save(&three(&meshes).map_err(|error| Failure::file(png, error))?, png)?;
            picture::save(&two(&meshes[2], &rough).map_err(|error| Failure::file(rough_png, error))?, rough_png)?;
            write_mesh(ply, &meshes[2], &WriteOptions::default())?;
            write_mesh(rough_ply, &rough, &WriteOptions::default())?;
            Ok((balls, meshes, rough))
        })?;
    interrupt::enter(Phase::Written);
    console.say(format_args!(
        "made {} with radii of their own, in about {} cells:",
        show_many(balls.len(), "ball"),
        CELLS
    ));
    for (name, mesh) in NAMES.iter().zip(&meshes).chain([(&"turbulent, in post-projection space", &rough)]) {
        console.say(format_args!("  {name}: {}", show_many(mesh.triangles.len(), "triangle")));
    }
    for (name, time) in clock.stages() {
        console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
    }
    let paths = paths.map(|path| path.to_string_lossy().into_owned());
    console.say(format_args!("wrote {}", paths.join(", ")));
    console.report(|| {
        json!({
            "files": paths,
            "balls": balls.len(),
            "triangles": meshes.each_ref().map(|mesh| mesh.triangles.len()),
            "turbulent_triangles": rough.triangles.len(),
            "seconds": clock.total().as_secs_f64(),
        })
    });
    Ok(())
}

const NAMES: [&str; 3] = ["object space", "view space", "post-projection space"];

/// A ball's centre and radius.
type Ball = ([f64; 3], f64);

/// Balls along a helix that leads away from the camera.
fn string_of_balls() -> Vec<Ball> {
    const COUNT: usize = 90;
    let mut random = Random::new(5);
    let ball = |i: usize| {
        let part = i as f64 / (COUNT - 1) as f64;
        let turn = 22.0 * part;
        let depth = 3.6 + 11.5 * part;
        let wobble = random.in_ball(0.12);
        let middle = [0.22 * depth, 1.0 - 0.1 * depth];
        let centre =
            [middle[0] + 1.1 * turn.cos() + wobble[0], middle[1] + 1.1 * turn.sin() + wobble[1], wobble[2] - depth];
        (centre, random.between(0.12, 0.26))
    };
    (0..COUNT).map(ball).collect()
}

fn surface(function: &dyn Function, domain: &Domain<'_>) -> Result<Mesh, Failure> {
    let params = TetrahedraParams { split: Tetrahedra::Regularised, normals: true };
    let control = Control { cancel: Some(&interrupt::TOKEN), ..Control::default() };
    contour_function_tetrahedra(function, domain, ISO, &params, &control).map_err(failure)
}

fn failure(error: pellicle::Error) -> Failure {
    Failure::core(Path::new("demo metaballs"), error)
}

/// The box of all balls, with room for their surface, in a space to which `place` takes centre and half width.
fn extent(balls: &[Ball], place: impl Fn([f64; 3], f64) -> [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for &(centre, radius) in balls {
        let [low, high] = place(centre, EXTENT * radius);
        for a in 0..3 {
            bounds[0][a] = bounds[0][a].min(low[a]);
            bounds[1][a] = bounds[1][a].max(high[a]);
        }
    }
    bounds
}

fn around(centre: [f64; 3], half: f64) -> [[f64; 3]; 2] {
    [centre.map(|x| x - half), centre.map(|x| x + half)]
}

/// Cubic cells over a box, as many as all have.
fn cubic([low, high]: [[f64; 3]; 2]) -> Domain<'static> {
    let volume: f64 = (0..3).map(|a| high[a] - low[a]).product();
    Domain::covering([low, high], (volume / CELLS).cbrt())
}

fn object_space(balls: &[Ball]) -> Domain<'static> {
    cubic(extent(balls, around))
}

fn view_space<'a>(balls: &[Ball], view: &'a View) -> Domain<'a> {
    cubic(extent(balls, |centre, half| around(view.to_view(centre), half))).warped(view as &dyn Warp)
}

/// As many cells in depth as make all of them as deep as wide.
fn projection_space<'a>(balls: &[Ball], view: &View, projection: &'a Projection) -> Domain<'a> {
    let depth = |z: f64| (z.clamp(DEPTHS[0], DEPTHS[1]) / DEPTHS[0]).ln();
    // In units of the tangent of an angle, and of the logarithm of a distance, which are as long as each other.
    let [low, high] = extent(balls, |centre, half| {
        let [[x0, y0, near], [x1, y1, far]] = around(view.to_view(centre), half);
        let near = near.max(DEPTHS[0]);
        let low = [x0, y0].map(|x| (x / near).min(x / far));
        let high = [x1, y1].map(|x| (x / near).max(x / far));
        [[low[0], low[1], depth(near)], [high[0], high[1], depth(far)]]
    });
    let per_unit = [TANGENT, TANGENT, (DEPTHS[1] / DEPTHS[0]).ln()];
    let volume: f64 = (0..3).map(|a| high[a] - low[a]).product();
    let edge = (volume / CELLS).cbrt();
    Domain {
        low: std::array::from_fn(|a| low[a] / per_unit[a]),
        spacing: per_unit.map(|unit| edge / unit),
        cells: std::array::from_fn(|a| ((high[a] - low[a]) / edge).ceil() as usize),
        border: Border::Closed,
        warp: Some(projection),
    }
}

fn drawn(mesh: &Mesh, caption: String, wires: Option<Wireframe>) -> Result<Image, pellicle_render::Error> {
    let mut settings = Settings::new(PART.0, PART.1);
    settings.caption = Some(caption);
    let camera = Camera { eye: EYE, target: TARGET, up: [0.0, 1.0, 0.0], lens: Lens::Perspective { angle: ANGLE } };
    let scene = Scene { layers: vec![Layer::Mesh(Surface { wireframe: wires, ..Surface::new(mesh) })] };
    draw(&scene, &camera, &settings)
}

fn three(meshes: &[Mesh; 3]) -> Result<Image, pellicle_render::Error> {
    let part = |i: usize| {
        let caption = format!("{}: {} triangles", NAMES[i], show_count(meshes[i].triangles.len()));
        drawn(&meshes[i], caption, Some(Wireframe::default()))
    };
    part(0)?.beside(&part(1)?)?.beside(&part(2)?)
}

fn two(plain: &Mesh, rough: &Mesh) -> Result<Image, pellicle_render::Error> {
    let left = drawn(plain, "sum of r²/d²".into(), None)?;
    left.beside(&drawn(rough, "with noise added".into(), None)?)
}
