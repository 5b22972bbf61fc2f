//! What one method takes for one frame: each run begins without memory.

use std::{sync::Mutex, time::Instant};

use pellicle::internals::{AnisotropicSums, Particles, SolenthalerSums, Summed, Unit, weighed, zeros};
use pellicle::{Band, Control, Lanes, Mesh, Params, Positions, Reconstructor, ScalarField, Stage};
use pellicle_conformance::{allocations::count, in_pool};

use super::{gather::Gather, grid::Grid, handlers::Handlers, scatter::Scatter};

/// A way to make the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// See [`Scatter`]: cells in supports, nodes of a block.
    Scatter { cell: f64, block: Option<usize> },
    /// See [`Gather`]: cells in supports, nodes of a brick, candidates thinned for each tile.
    Gather { cell: f64, brick: usize, thin: bool },
    /// Road A.
    Ours(Band),
}

impl Method {
    /// As rows name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scatter { .. } => "scatter",
            Self::Gather { .. } => "gather",
            Self::Ours(_) => "ours",
        }
    }
}

/// What it took.
#[derive(Debug, Clone, Default)]
pub struct Taken {
    pub field_s: f64,
    pub triangulation_s: f64,
    /// The most that was held at once, the mesh left out.
    pub bytes: u64,
    pub triangles: usize,
    /// Of the paper's band: time to find surface particles, their number, that of surface nodes.
    pub surface: (f64, u64, u64),
    pub mesh: Mesh,
}

impl Taken {
    pub fn seconds(&self) -> f64 {
        self.field_s + self.triangulation_s
    }
}

/// Measures a method on so many threads: the fastest of some runs.
///
/// # Errors
/// Those of the library, in words.
pub fn measure(
    method: Method,
    positions: &[[f32; 3]],
    params: &Params,
    threads: usize,
    runs: usize,
) -> Result<Taken, String> {
    in_pool(threads, || {
        let mut best = run(method, positions, params)?;
        for _ in 1..runs {
            let again = run(method, positions, params)?;
            if again.seconds() < best.seconds() {
                best = again;
            }
        }
        Ok(best)
    })
}

fn run(method: Method, positions: &[[f32; 3]], params: &Params) -> Result<Taken, String> {
    match (method, params.field) {
        (Method::Ours(band), _) => ours(positions, &Params { band, ..params.clone() }),
        (_, ScalarField::Solenthaler(own)) => {
            // It needs nothing of its neighbours before.
            let particles = || {
                let support = params.support();
                let positions = positions.iter().map(|p| p.map(|v| f64::from(v) / support)).collect();
                Ok(Particles { positions, columns: Vec::new(), support })
            };
            rival(method, &SolenthalerSums::new(params, own), params, particles)
        }
        (_, ScalarField::Anisotropic(_)) => {
            let particles = || {
                let (mut reconstructor, control) = (Reconstructor::new(), Control::default());
                let sorted = reconstructor.sort(positions.into(), &[], params, &control);
                sorted.and_then(|sorted| sorted.weigh()).map(|it| weighed(&it)).map_err(|error| error.to_string())
            };
            rival(method, &AnisotropicSums::new(params), params, particles)
        }
        _ => Err("rivals know Solenthaler's field and the anisotropic one".into()),
    }
}

/// Our road, in two stages: until the samples are there; counting and writing.
fn ours(positions: &[[f32; 3]], params: &Params) -> Result<Taken, String> {
    let stages = Mutex::new(Vec::new());
    let on_stage =
        |stage: Stage| stages.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((stage, Instant::now()));
    let control = Control { on_stage: Some(&on_stage), ..Control::default() };
    let mut reconstructor = Reconstructor::new();
    let start = Instant::now();
    let (surface, until_counted) = count(|| reconstructor.extract(Positions::from(positions), &[], params, &control));
    let surface = surface.map_err(|error| error.to_string())?;
    let (mesh, writing) = count(|| surface.to_mesh());
    let end = Instant::now();
    let mesh = mesh.map_err(|error| error.to_string())?;
    let stats = surface.stats();
    let stages = stages.lock().map(|stages| stages.clone()).unwrap_or_default();
    let begun = |stage: Stage| stages.iter().find(|entry| entry.0 == stage).map(|entry| entry.1);
    let counting = begun(Stage::Count).unwrap_or(end);
    let finding =
        begun(Stage::SurfaceParticles).map_or(0.0, |from| (begun(Stage::Active).unwrap_or(end) - from).as_secs_f64());
    Ok(Taken {
        field_s: (counting - start).as_secs_f64(),
        triangulation_s: (end - counting).as_secs_f64(),
        bytes: until_counted.peak.max(until_counted.held + writing.peak - writing.held).unsigned_abs(),
        triangles: mesh.triangles.len(),
        surface: (finding, stats.surface_particles, stats.surface_nodes),
        mesh,
    })
}

/// A rival, in the same two stages.
fn rival<F: Summed<C>, const C: usize>(
    method: Method,
    field: &F,
    params: &Params,
    particles: impl FnOnce() -> Result<Particles, String>,
) -> Result<Taken, String> {
    let unit = Unit::new(Lanes::Auto).ok_or("no vector unit")?;
    let start = Instant::now();
    let (sampled, sampling) = count(|| {
        let particles = particles()?;
        let grid = Grid::around(&particles, params.spacing() / particles.support);
        let mut values = zeros(grid.len());
        match method {
            Method::Scatter { cell, block } => {
                let handlers = &Handlers::new(&particles, grid.origin(), cell);
                let support = particles.support;
                drop(particles);
                unit.run(Scatter { field, handlers, grid: &grid, block, values: &mut values });
                Ok::<_, String>((grid, values, support))
            }
            Method::Gather { cell, brick, thin } => {
                let handlers = &Handlers::new(&particles, grid.origin(), cell);
                let support = particles.support;
                drop(particles);
                Gather { field, handlers, grid: &grid, brick, thin }.run(unit, &mut values);
                Ok((grid, values, support))
            }
            Method::Ours(_) => Err("not a rival".into()),
        }
    });
    let (grid, values, support) = sampled?;
    let sampled = Instant::now();
    let (mesh, writing) = count(|| grid.triangulate(&values, field.iso(), support));
    let end = Instant::now();
    let mesh = mesh?;
    Ok(Taken {
        field_s: (sampled - start).as_secs_f64(),
        triangulation_s: (end - sampled).as_secs_f64(),
        bytes: sampling.peak.max(sampling.held + writing.peak - writing.held).unsigned_abs(),
        triangles: mesh.triangles.len(),
        mesh,
        ..Taken::default()
    })
}

/// Nodes of the rivals' grid.
pub fn grid_nodes(positions: &[[f32; 3]], params: &Params) -> usize {
    let support = params.support();
    let positions = positions.iter().map(|p| p.map(|v| f64::from(v) / support)).collect();
    let particles = Particles { positions, columns: Vec::new(), support };
    Grid::around(&particles, params.spacing() / support).len()
}
