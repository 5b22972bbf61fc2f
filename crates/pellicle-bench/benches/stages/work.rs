//! What is timed, and how: through the public interface only, by looking at the clock whenever a stage begins.
//!
//! | name | from | to | throughput in |
//! |---|---|---|---|
//! | sort, density, active | the call that the stage begins | the call that the next begins | particles |
//! | fill | the same | the same | bricks filled |
//! | count | the same | `extract` returns | triangles |
//! | emit | the same | `write_mesh` returns: the mesh is in memory | triangles |
//! | write | a counted surface | a finished PLY file, written chunk by chunk as it is made: emit is part of it | bytes |
//! | whole | particles in memory | a mesh in memory | particles |
//!
//! A stage that begins more than once in a run adds up.

use std::error::Error;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use criterion::Throughput;
use pellicle::{Control, Mesh, Reconstructor, Stage, Stats, Surface};
use pellicle_io::{PlyFile, PlyLayout};

use crate::inputs::Input;

/// A piece of the road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Work {
    /// One stage of the library.
    Stage(Stage),
    /// From a counted surface to a file.
    Write,
    /// From particles to a mesh, both in memory.
    Whole,
}

/// In the order in which they run.
pub const WORKS: [(&str, Work); 8] = [
    ("sort", Work::Stage(Stage::Sort)),
    ("density", Work::Stage(Stage::Density)),
    ("active", Work::Stage(Stage::Active)),
    ("fill", Work::Stage(Stage::Fill)),
    ("count", Work::Stage(Stage::Count)),
    ("emit", Work::Stage(Stage::Emit)),
    ("write", Work::Write),
    ("whole", Work::Whole),
];

/// What throughput is counted in.
#[derive(Debug)]
pub struct Sizes {
    stats: Stats,
    /// Of the PLY file.
    bytes: u64,
}

impl Work {
    /// What a run of it deals with.
    pub fn throughput(self, sizes: &Sizes) -> Throughput {
        match self {
            Self::Stage(Stage::Fill) => Throughput::Elements(sizes.stats.bricks_filled),
            Self::Stage(Stage::Count | Stage::Emit) => Throughput::Elements(sizes.stats.triangles),
            Self::Stage(_) | Self::Whole => Throughput::Elements(sizes.stats.particles),
            Self::Write => Throughput::Bytes(sizes.bytes),
        }
    }
}

/// Nobody watches.
const UNWATCHED: Control<'static> = Control { cancel: None, on_stage: None };

/// Makes the surface and its file once.
pub fn measure_sizes(reconstructor: &mut Reconstructor, input: &Input, file: &Path) -> Sizes {
    let surface = extract(reconstructor, input, &UNWATCHED);
    write(&surface, file).expect("the file can be written");
    Sizes { stats: surface.stats(), bytes: std::fs::metadata(file).expect("the file is there").len() }
}

/// Time of one stage, summed over `runs` runs of all stages up to it.
pub fn time_stage(
    reconstructor: &mut Reconstructor,
    mesh: &mut Mesh,
    input: &Input,
    stage: Stage,
    runs: u64,
) -> Duration {
    let watch = Mutex::new(Watch::default());
    let on_stage = |begun| watch.lock().expect("no stage panics").turn(begun == stage);
    let control = Control { on_stage: Some(&on_stage), ..UNWATCHED };
    for _ in 0..runs {
        let surface = extract(reconstructor, input, &control);
        if stage == Stage::Emit {
            surface.write_mesh(mesh).expect("the mesh fits in memory");
        }
        watch.lock().expect("no stage panics").turn(false);
    }
    watch.into_inner().expect("no stage panics").total
}

/// Time of writing a counted surface to a file, over and over.
pub fn time_write(reconstructor: &mut Reconstructor, input: &Input, file: &Path, runs: u64) -> Duration {
    let surface = extract(reconstructor, input, &UNWATCHED);
    let start = Instant::now();
    for _ in 0..runs {
        write(&surface, file).expect("the file can be written");
    }
    start.elapsed()
}

/// Time from particles to a mesh.
pub fn time_whole(reconstructor: &mut Reconstructor, mesh: &mut Mesh, input: &Input, runs: u64) -> Duration {
    let start = Instant::now();
    for _ in 0..runs {
        extract(reconstructor, input, &UNWATCHED).write_mesh(mesh).expect("the mesh fits in memory");
    }
    start.elapsed()
}

fn extract<'a>(reconstructor: &'a mut Reconstructor, input: &'a Input, control: &'a Control<'a>) -> Surface<'a> {
    reconstructor.extract((&input.positions).into(), &[], &input.params, control).expect("the input has a surface")
}

/// As the command line does it: each thread makes a chunk and puts it at its place in the file.
fn write(surface: &Surface<'_>, path: &Path) -> Result<(), Box<dyn Error + Send + Sync>> {
    let layout = PlyLayout {
        vertex_count: surface.vertex_count() as u64,
        triangle_count: surface.triangle_count() as u64,
        origin: surface.origin(),
        ..PlyLayout::default()
    };
    let file = PlyFile::create(path, &layout)?;
    surface.for_each_chunk(|chunk| -> Result<(), Box<dyn Error + Send + Sync>> {
        thread_local! {
            static BUFFER: std::cell::RefCell<Vec<u8>> = const { std::cell::RefCell::new(Vec::new()) };
        }
        BUFFER.with_borrow_mut(|buffer| {
            file.write_vertices(chunk.first_vertex as u64, &chunk.vertices, &[], &[], buffer)?;
            file.write_triangles(chunk.first_triangle as u64, &chunk.triangles, buffer)?;
            Ok(())
        })
    })?;
    Ok(file.finish()?)
}

/// A stop watch.
#[derive(Default)]
struct Watch {
    since: Option<Instant>,
    total: Duration,
}

impl Watch {
    /// Stops if it runs, then starts if asked to.
    fn turn(&mut self, on: bool) {
        let now = Instant::now();
        self.total += self.since.take().map_or(Duration::ZERO, |since| now - since);
        self.since = on.then_some(now);
    }
}
