//! `demo fountain|blob|explosion|monster`: a show of particles, its surface made every frame by the real-time engine, and a
//! picture of every frame.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use pellicle::Mesh;
use pellicle::realtime::{Engine, Params, Particles};
use pellicle::sink::Shaded;
use pellicle_io::check_writable;
use pellicle_render::{Bounds, Color, Framing, Image, Layer, Paint, Scene, Settings, Surface, Texture, draw};
use pellicle_scenes::{Balls, FRAMES, ISO, LimbSkin, Play, SUPPORT, Show};
use serde_json::json;

use crate::args::DemoArgs;
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt::{self, Phase};
use crate::machine;
use crate::picture;
use crate::values::show_many;

/// Any; fixed, so that everybody sees the same.
const SEED: u64 = 1;

/// Runs the verb for one show.
pub fn run(show: Show, args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    interrupt::listen();
    let count = args.frames.get();
    let paths: Vec<PathBuf> = (0..count).map(|i| path(&args.output_dir, show, i)).collect();
    if let Some(first) = paths.first() {
        check_writable(first)?;
    }
    let pool = machine::thread_pool(machine::default_threads())?;
    let look = Look::of(show);
    let mut play = Play::new(show, SEED);
    let mut stage = Stage::new(show, &look)?;
    let mut updates = Vec::with_capacity(count);
    let mut triangles = 0;
    let start = Instant::now();
    interrupt::enter(Phase::Working);
    for (i, path) in paths.iter().enumerate() {
        interrupt::check()?;
        // Spread over the whole show: of one picture the middle, of two the quarters.
        while play.frame() < (2 * i + 1) * FRAMES / (2 * count) {
            play.step();
        }
        pool.install(|| -> Result<(), Failure> {
            updates.push(stage.update(play.balls())?);
            triangles += stage.triangles();
            let settings =
                Settings { caption: Some(stage.caption(play.frame())), ..Settings::new(args.size.0, args.size.1) };
            let image = stage.picture(&look, play.frame(), &settings).map_err(|error| Failure::file(path, error))?;
            picture::save(&image, path)
        })?;
    }
    interrupt::enter(Phase::Written);
    updates.sort_unstable();
    let middle = updates[count / 2].as_secs_f64();
    let (first, last) = (paths[0].display(), paths[count - 1].display());
    let seconds = start.elapsed().as_secs_f64();
    console.say(format_args!("{}: {first} to {last} in {seconds:.1} s", show_many(count, "picture")));
    console.say(format_args!(
        "its surface took {:.2} ms a frame, {} triangles on average",
        1e3 * middle,
        triangles / count
    ));
    let pattern = path_pattern(&args.output_dir, show);
    console.say(format_args!(
        "\nNext:\n  ffmpeg -framerate 30 -i {} {}.mp4   a film of it\n  pellicle demo {} --frames {FRAMES}   every frame\n  pellicle \
         demo {}   another show\n  cargo doc -p pellicle --open   pellicle::realtime, what made the surface",
        pattern.display(),
        show.name(),
        show.name(),
        next(show).name()
    ));
    console.report(|| {
        json!({
            "show": show.name(),
            "files": paths,
            "frames": count,
            "triangles": triangles,
            "update_seconds": middle,
            "seconds": seconds,
        })
    });
    Ok(())
}

fn path(folder: &Path, show: Show, number: usize) -> PathBuf {
    super::inside(folder, &format!("{}_{number:04}.png", show.name()))
}

/// As ffmpeg writes it.
fn path_pattern(folder: &Path, show: Show) -> PathBuf {
    super::inside(folder, &format!("{}_%04d.png", show.name()))
}

/// The show to suggest after this.
fn next(show: Show) -> Show {
    let at = Show::ALL.iter().position(|&other| other == show).unwrap_or(0);
    Show::ALL[(at + 1) % Show::ALL.len()]
}

/// How a show is looked at.
struct Look {
    spacing: f64,
    color: Color,
    framing: Framing,
    /// What is in the picture at the first and the last frame.
    bounds: [Bounds; 2],
    /// Height of the ground, half its edge.
    ground: Option<(f32, f32)>,
}

impl Look {
    fn of(show: Show) -> Self {
        let within = |min, max| Bounds { min, max };
        let framing = |azimuth, elevation| Framing { azimuth, elevation, ..Framing::default() };
        match show {
            Show::Fountain => Self {
                spacing: 0.5,
                color: Color::WATER,
                framing: framing(30.0, 16.0),
                bounds: [within([-27.0, 0.0, -27.0], [27.0, 39.0, 27.0]); 2],
                ground: Some((-0.6, 90.0)),
            },
            Show::Blob => Self {
                spacing: 0.25,
                color: Color([126, 196, 92]),
                framing: framing(25.0, 18.0),
                bounds: [within([-12.5, -9.5, -10.0], [12.5, 10.5, 10.0]); 2],
                ground: None,
            },
            Show::Explosion => Self {
                spacing: 0.4,
                color: Color([236, 132, 58]),
                framing: framing(30.0, 14.0),
                bounds: [within([-9.0; 3], [9.0; 3]), within([-38.0, -44.0, -38.0], [38.0, 30.0, 38.0])],
                ground: None,
            },
            Show::Monster => Self {
                spacing: 0.3,
                color: Color::WATER,
                framing: framing(-34.0, 15.0),
                bounds: [within([-13.0, 0.0, -13.0], [21.0, 31.5, 13.0]); 2],
                ground: Some((-1.5, 60.0)),
            },
        }
    }

    /// What is in the picture at a frame: it grows at an even pace.
    fn bounds(&self, frame: usize) -> Bounds {
        let t = frame as f64 / FRAMES as f64;
        let [first, last] = &self.bounds;
        let between = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
        Bounds { min: between(first.min, last.min), max: between(first.max, last.max) }
    }
}

/// The engine, what it made last, and what stands around.
struct Stage {
    show: Show,
    engine: Engine<LimbSkin>,
    made: Shaded<[f32; 2]>,
    ground: Option<Mesh>,
    wall: Mesh,
    hide: Image,
}

impl Stage {
    fn new(show: Show, look: &Look) -> Result<Self, Failure> {
        let lanes = machine::lanes_from_environment()?;
        let params = Params { iso: ISO.into(), lanes, ..Params::new(SUPPORT.into(), look.spacing) };
        let engine = Engine::with_skin(params, LimbSkin::default()).map_err(|error| of_show(show, error))?;
        let ground = look.ground.map(|(y, half)| square([0.0, y, 0.0], [0.0, 0.0, half], [half, 0.0, 0.0]));
        let hide = hide().map_err(|error| of_show(show, error))?;
        Ok(Self {
            show,
            engine,
            made: Shaded::default(),
            ground,
            wall: square([20.6, 0.0, 0.0], [0.0, 0.0, 60.0], [0.0, 60.0, 0.0]),
            hide,
        })
    }

    /// Makes the surface of a frame, and tells how long that took.
    fn update(&mut self, balls: &Balls) -> Result<Duration, Failure> {
        self.engine.skin_mut().take(balls);
        let varied = balls.strengths.iter().any(|&s| s != 1.0);
        let particles = Particles {
            positions: (&balls.positions).into(),
            reaches: None,
            strengths: varied.then_some(&balls.strengths[..]),
        };
        let start = Instant::now();
        self.engine.update(particles, &mut self.made).map_err(|error| of_show(self.show, error))?;
        Ok(start.elapsed())
    }

    fn triangles(&self) -> usize {
        self.made.mesh.triangles.len()
    }

    fn caption(&self, frame: usize) -> String {
        format!("{} · frame {frame} · {}", self.show.name(), show_many(self.triangles(), "triangle"))
    }

    fn picture(&self, look: &Look, frame: usize, settings: &Settings) -> Result<Image, pellicle_render::Error> {
        let paint = match self.show {
            // Around, three times the pattern; along, once in four units.
            Show::Monster => Paint::Texture(Texture {
                image: &self.hide,
                coordinates: self.made.data.iter().map(|&[u, v]| [3.0 * u, v / 4.0]).collect(),
            }),
            _ => Paint::Plain(look.color),
        };
        let mut layers = vec![Layer::Mesh(Surface { paint, ..Surface::new(&self.made.mesh) })];
        let grey = |mesh| Layer::Mesh(Surface { paint: Paint::Plain(Color([196, 200, 204])), ..Surface::new(mesh) });
        layers.extend(self.ground.as_ref().map(grey));
        if self.show == Show::Monster {
            layers.push(grey(&self.wall));
        }
        let camera = look.framing.fit(&look.bounds(frame), settings.aspect())?;
        draw(&Scene { layers }, &camera, settings)
    }
}

/// What went wrong with the show itself, not with a file.
fn of_show(show: Show, error: impl std::fmt::Display) -> Failure {
    Failure::file(Path::new(show.name()), error)
}

/// A square, by its middle and its half edges; it faces where their cross product points.
fn square(middle: [f32; 3], u: [f32; 3], v: [f32; 3]) -> Mesh {
    let corner = |s: f32, t: f32| std::array::from_fn(|a| middle[a] + s * u[a] + t * v[a]);
    Mesh {
        vertices: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The monster's hide: scales in rows, each row half a scale on, on dark skin.
fn hide() -> Result<Image, pellicle_render::Error> {
    const SIZE: u32 = 128;
    Image::from_fn(SIZE, SIZE, |x, y| {
        let cell = SIZE / 4;
        let row = y / cell;
        let shifted = (x + row % 2 * cell / 2) % SIZE;
        let [across, down] = [shifted % cell, y % cell].map(|v| (f64::from(v) + 0.5) / f64::from(cell) - 0.5);
        let from_middle = (across * across + 0.8 * down * down).sqrt();
        let bright = (1.25 - 1.9 * from_middle).clamp(0.25, 1.0) * (0.85 + 0.3 * down);
        let warm = f64::from((shifted / cell * 7 + row * 5) % 4) / 4.0;
        let color = [150.0 + 80.0 * warm, 214.0 - 40.0 * warm, 118.0 - 30.0 * warm];
        Color(color.map(|c| (c * bright).round().clamp(0.0, 255.0) as u8))
    })
}
