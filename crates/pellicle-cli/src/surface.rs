//! From particles in memory to a surface in a file: what `mesh` and `demo` share. One call makes one frame.

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

use pellicle::post::{
    Finish,
    quads::{Pairing, pair},
    settle::{on_walls, settle},
    snap::Nodes,
};
use pellicle::{
    Attribute, Chunk, Control, Mesh, Params, Reconstructor, ScalarField, Stats, Surface, Tetrahedra, VertexAttribute,
    Walls, crowding,
};
use pellicle_io::{PlyFile, PlyLayout, Up, WriteOptions};

use crate::clock::StageClock;
use crate::cloud::Cloud;
use crate::failure::Failure;
use crate::field;
use crate::finish::Finishing;
use crate::interrupt;
use crate::machine;
use crate::target::Target;
use crate::values::show_bytes;

/// What is to be made.
#[derive(Debug)]
pub struct Order<'a> {
    /// Where the particles come from, for messages and the record in the output.
    pub source: &'a Path,
    /// What the surface is.
    pub params: &'a Params,
    /// Whether the parameters' radius means something; without particles it may not.
    pub is_radius_known: bool,
    /// The file to write.
    pub target: &'a Target,
    /// What was chosen of the source's particles, a line each.
    pub choice: &'a [String],
    /// The attribute that the particles' own radii are from.
    pub radius_attribute: Option<&'a str>,
    /// The axis that points up, for formats that care.
    pub up: Up,
    /// Whether the mesh is wanted in memory too, for a picture of it.
    pub keep_mesh: bool,
    /// Tetrahedra in place of marching cubes.
    pub tetrahedra: Option<Tetrahedra>,
    /// What is done to the mesh before it is written.
    pub finishing: Finishing,
    /// Walls that the surface is cut at; the particles are mirrored in them.
    pub walls: Option<&'a Arc<Walls>>,
}

/// What was made.
#[derive(Debug)]
pub struct Made {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh, but those in quads.
    pub triangles: usize,
    /// Quads, where they were asked for.
    pub quads: Option<usize>,
    /// Size of the file.
    pub bytes: u64,
    /// What the work amounted to.
    pub stats: Stats,
    /// The mesh, if it was to be kept.
    pub mesh: Option<Mesh>,
    /// Attributes that the format has no room for.
    pub left_out: Vec<String>,
}

/// Makes the surface and writes it, in the current pool of threads. The reconstructor's memory is used again from call to
/// call, unless the mesh is finished.
pub fn make(
    cloud: &Cloud,
    order: &Order,
    reconstructor: &mut Reconstructor,
    clock: &StageClock,
) -> Result<Made, Failure> {
    let params = Params { max_memory: memory_left(cloud, order)?, ..order.params.clone() };
    let on_stage = |stage| clock.begin_core(stage);
    let control = Control { cancel: Some(&interrupt::TOKEN), on_stage: Some(&on_stage) };
    let core = |error| Failure::core(order.source, error);
    let Finishing { finish, weighted, quads } = order.finishing;
    let crowding = weighted.then(|| crowding(cloud.positions(), params.support(), &control)).transpose();
    let crowding = crowding.map_err(core)?;
    let mut attributes = cloud.attributes();
    attributes.extend(crowding.as_ref().map(|values| Attribute::new(CROWDING, 1, values)));

    reconstructor.set_walls(order.walls.cloned());
    let path = order.target.path();
    let (mut kept, mut left_out) = (None, Vec::new());
    let made = match order.tetrahedra {
        Some(split) => Source::Whole(
            reconstructor
                .sort(cloud.positions(), &attributes, &params, &control)
                .and_then(|sorted| sorted.weigh()?.sample()?.tetrahedra(split))
                .map_err(core)?,
        ),
        None => {
            Source::Counted(reconstructor.extract(cloud.positions(), &attributes, &params, &control).map_err(core)?)
        }
    };
    let stats = made.stats();
    let (mut vertices, mut triangles) = (stats.vertices as usize, stats.triangles as usize);
    let mut quad_count = None;
    clock.begin("write");
    if let Source::Counted(surface) = &made
        && order.target.is_stream()
        && !order.keep_mesh
        && order.finishing.is_nothing()
    {
        write_stream(surface, &attributes, &params, order)?;
    } else {
        let mut mesh = made.into_mesh().map_err(core)?;
        check_memory(order.finishing.memory(&mesh), &params, order)?;
        if !finish.is_nothing() {
            clock.begin("finish");
            // Finishing can have the memory that the surface took, in place of as much again.
            *reconstructor = Reconstructor::new();
            let mut crowding = crowding.and_then(|_| mesh.attributes.pop()).map(|attribute| attribute.values);
            let (spacing, nodes) = (params.spacing(), Nodes::cubic(params.spacing()));
            if let Some(walls) = order.walls {
                // What is on a wall stays there: it has no weight, nor has what it is merged with, and it is put back.
                let marks = on_walls(&mesh, walls, spacing);
                let weights = crowding.get_or_insert_with(|| vec![f32::MAX; marks.len()]);
                weights
                    .iter_mut()
                    .zip(&marks)
                    .filter(|(_, mark)| **mark > 0.0)
                    .for_each(|(weight, _)| *weight = f32::NAN);
                mesh.attributes.push(VertexAttribute::new(String::new(), 1, marks));
            }
            // The cut at the box waits for the walls: what is put back on a wall must not leave the box.
            let uncut = Finish { clamp: if order.walls.is_some() { None } else { finish.clamp }, ..finish };
            uncut.apply(&mut mesh, &nodes, crowding.as_deref(), &control).map_err(core)?;
            if let Some(walls) = order.walls {
                let marks = mesh.attributes.pop().map(|attribute| attribute.values).unwrap_or_default();
                settle(&mut mesh, walls, &marks, spacing).map_err(core)?;
                let cut = Finish { clamp: finish.clamp, ..Finish::default() };
                cut.apply(&mut mesh, &nodes, None, &control).map_err(core)?;
            }
            (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
        }
        clock.begin("write");
        interrupt::check()?;
        let options = WriteOptions { comments: order.record(), up: order.up, ..WriteOptions::default() };
        if quads {
            let paired = pair(mesh, &Pairing::default(), &control).map_err(core)?;
            (triangles, quad_count) = (paired.mesh.triangles.len(), Some(paired.quads.len()));
            left_out = pellicle_io::write_quad_mesh(path, &paired, &options)?.left_out;
            kept = order.keep_mesh.then(|| paired.triangulated());
        } else {
            left_out = pellicle_io::write_mesh(path, &mesh, &options)?.left_out;
            kept = order.keep_mesh.then_some(mesh);
        }
    }
    let bytes = std::fs::metadata(path).map_err(|error| Failure::file(path, error))?.len();
    Ok(Made { vertices, triangles, quads: quad_count, bytes, stats, mesh: kept, left_out })
}

/// A surface that is counted, or already there.
enum Source<'a> {
    Counted(Surface<'a>),
    Whole((Mesh, Stats)),
}

impl Source<'_> {
    fn stats(&self) -> Stats {
        match self {
            Self::Counted(surface) => surface.stats(),
            Self::Whole((_, stats)) => *stats,
        }
    }

    fn into_mesh(self) -> Result<Mesh, pellicle::Error> {
        match self {
            Self::Counted(surface) => surface.to_mesh(),
            Self::Whole((mesh, _)) => Ok(mesh),
        }
    }
}

/// What the option is called.
pub fn method_name(split: Tetrahedra) -> &'static str {
    match split {
        Tetrahedra::Five => "tetra5",
        Tetrahedra::Six => "tetra6",
        Tetrahedra::BodyCentred => "bcc",
        Tetrahedra::Simplex => "simplex",
        Tetrahedra::Regularised => "regularised",
    }
}

/// What the crowding of particles is called while it travels to the vertices.
const CROWDING: &str = "crowding";

/// Whether finishing fits what the limit leaves besides the mesh.
fn check_memory(needed: u64, params: &Params, order: &Order) -> Result<(), Failure> {
    let what = "finishing the mesh (--smooth, --decimate, --keep, --clamp, --quads)";
    match params.max_memory {
        Some(available) if needed > available => {
            Err(Failure::core(order.source, pellicle::Error::Memory { what, needed, available }))
        }
        _ => Ok(()),
    }
}

/// Writes a PLY file chunk by chunk, while the surface is made: the mesh is never in memory as a whole.
fn write_stream(
    surface: &Surface<'_>,
    attributes: &[Attribute<'_>],
    params: &Params,
    order: &Order,
) -> Result<(), Failure> {
    let origin = surface.origin();
    let layout = PlyLayout {
        quad_count: 0,
        vertex_count: surface.vertex_count() as u64,
        triangle_count: surface.triangle_count() as u64,
        normals: params.normals,
        attributes: attributes.iter().map(|a| (a.name.to_owned(), a.width())).collect(),
        // Far from the origin single precision would move vertices; as in `write_mesh`.
        double: origin != [0.0; 3],
        origin,
        comments: order.record(),
    };
    let file = PlyFile::create(order.target.path(), &layout)?;
    let written = surface.for_each_chunk(|chunk| write_chunk(&file, chunk));
    written.map_err(|broken| match broken {
        Broken::Core(error) => Failure::core(order.source, error),
        Broken::Sink(error) => error.into(),
    })?;
    interrupt::check()?;
    Ok(file.finish()?)
}

fn write_chunk(file: &PlyFile, chunk: &Chunk) -> Result<(), Broken> {
    thread_local! {
        /// What a thread formats its chunks in.
        static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    }
    let attributes: Vec<&[f32]> = chunk.attributes.iter().map(Vec::as_slice).collect();
    BUFFER.with_borrow_mut(|buffer| {
        file.write_vertices(chunk.first_vertex as u64, &chunk.vertices, &chunk.normals, &attributes, buffer)?;
        file.write_triangles(chunk.first_triangle as u64, &chunk.triangles, buffer)?;
        Ok(())
    })
}

/// Why the stream ended.
enum Broken {
    Core(pellicle::Error),
    Sink(pellicle_io::Error),
}

impl From<pellicle::Error> for Broken {
    fn from(error: pellicle::Error) -> Self {
        Self::Core(error)
    }
}

impl From<pellicle_io::Error> for Broken {
    fn from(error: pellicle_io::Error) -> Self {
        Self::Sink(error)
    }
}

/// What the limit leaves for the core: the particles are in memory already. Without a limit it is what the system can
/// give, so that a cell far too small is refused and does not take the machine down.
fn memory_left(cloud: &Cloud, order: &Order) -> Result<Option<u64>, Failure> {
    let Some(limit) = order.params.max_memory else { return Ok(machine::available_memory()) };
    match limit.checked_sub(cloud.bytes()) {
        Some(left @ 1..) => Ok(Some(left)),
        _ => Err(Failure::Memory(format!(
            "{}: the particles alone take {} of memory, {} are allowed (raise --max-memory)",
            order.source.display(),
            show_bytes(cloud.bytes()),
            show_bytes(limit)
        ))),
    }
}

impl Order<'_> {
    /// The parameters that decide the mesh, for the output's header. Threads, memory limit, band and vector unit are
    /// left out: they decide nothing, and files that hold the same mesh shall be the same.
    pub fn record(&self) -> Vec<String> {
        let Params { particle_radius, field, smoothing_length, cell_size, iso, .. } = *self.params;
        let source = self.source.file_name().unwrap_or_default().to_string_lossy();
        let mut lines = vec![format!("pellicle {}", env!("CARGO_PKG_VERSION")), format!("source {source}")];
        lines.extend_from_slice(self.choice);
        if self.is_radius_known {
            lines.push(format!("particle_radius {particle_radius}"));
        }
        if let Some(name) = self.radius_attribute {
            lines.push(format!("radius_attribute {name}"));
        }
        // The SPH field goes without saying, as it always did.
        if field != ScalarField::Sph {
            lines.push(format!("field {}", field::show(field)));
        }
        lines.push(format!("smoothing_length {smoothing_length} radii, cell_size {cell_size} radii, threshold {iso}"));
        lines.extend(self.tetrahedra.map(|split| format!("method {}", method_name(split))));
        lines.extend(self.finishing.record());
        lines
    }
}
