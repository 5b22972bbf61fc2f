//! Each road on one screen. Road A: particles → cells → density → band (coarse samples, fill, close) → count → emit.
//! Road B, every frame: particles → blocks → columns → slices → sink, in [`engine`]. Road C is [`contour`].

mod chosen;
mod contour;
pub(crate) mod engine;
mod labels;
mod sampled;
mod surface;
mod surface_boxes;
mod tetrahedra;

pub use contour::{
    Contour, ContourParams, ContourPiece, ContourStream, PoolUse, StreamSample, StreamShape, VertexNormals, contour,
    contour_function,
};
pub use labels::{LabelParams, contour_labels};
pub use surface::{Chunk, Surface};
pub use tetrahedra::{Tetrahedra, TetrahedraParams, contour_function_tetrahedra, contour_tetrahedra};

use std::sync::Arc;

use chosen::{Chosen, Moved};
use surface_boxes::SurfaceBoxes;

use crate::{
    Attribute, Band, Carry, Control, Error, Mesh, Params, Positions, Stage, Walls,
    bricks::{
        band::{self, Grain, Look},
        budget::Budget,
        store::Source,
    },
    fill::{
        any::AnyField,
        brick_origin,
        walled::{WallLattice, Walled},
    },
    lattice::{Lattice, OCTET},
    lookup::cells::Cells,
    march::cubes::{count::Counted, emit::Frame},
    math::{bits::ones, simd::Unit},
};

/// Positions in, mesh out, with default parameters for particles of one radius or with [`Params`] of your own.
///
/// Runs in the current rayon pool. For a sequence of frames keep a [`Reconstructor`], which reuses its memory.
///
/// ```
/// // A drop of 5 × 5 × 5 particles, 0.1 apart.
/// let positions: Vec<[f32; 3]> =
///     (0..125).map(|i| [i % 5, i / 5 % 5, i / 25].map(|v| v as f32 * 0.1)).collect();
/// let mesh = pellicle::reconstruct(&positions, &pellicle::Params::new(0.05))?;
/// assert!(mesh.triangles.len() > 1000);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// See [`Reconstructor::extract`].
pub fn reconstruct<'a>(positions: impl Into<Positions<'a>>, params: &Params) -> Result<Mesh, Error> {
    Reconstructor::new().extract(positions.into(), &[], params, &Control::default())?.to_mesh()
}

/// Turns frames of particles into surfaces. Owns all working memory; a second frame of the same size allocates next to
/// nothing.
#[derive(Default)]
pub struct Reconstructor {
    cells: Cells,
    /// What each particle brings to the field besides its position, in canonical order.
    columns: Vec<Vec<f32>>,
    moved: Moved,
    surface: SurfaceBoxes,
    band: band::Band,
    counted: Counted,
    chunks: Vec<usize>,
    walls: Option<Arc<Walls>>,
}

impl Reconstructor {
    /// With no memory yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Walls that the surfaces to come are cut at; see [`Walls`], also for the particles that must be mirrored before.
    pub fn set_walls(&mut self, walls: Option<Arc<Walls>>) {
        self.walls = walls.filter(|walls| !walls.is_empty());
    }

    /// Finds and counts the surface of the particles; the result writes it, whole or in chunks. Runs in the current rayon
    /// pool. No particles give an empty surface.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range, [`Error::NotFinite`] and [`Error::OutsideLattice`] for the first
    /// particle that cannot be placed, [`Error::Length`] for an attribute of the wrong length, [`Error::Memory`] and
    /// [`Error::Count`] when the surface would be too large, [`Error::Cancelled`].
    pub fn extract<'a>(
        &'a mut self,
        positions: Positions<'a>,
        attributes: &'a [Attribute<'a>],
        params: &'a Params,
        control: &'a Control<'a>,
    ) -> Result<Surface<'a>, Error> {
        self.sort(positions, attributes, params, control)?.weigh()?.sample_by(Grain::Eighths)?.count()
    }

    /// The first stage alone, for those who want what lies between: [`Sorted`], then [`Weighed`], [`Sampled`], and the
    /// [`Surface`] that [`extract`](Self::extract) gives at once.
    ///
    /// ```
    /// # use pellicle::{Control, Params, Reconstructor};
    /// let positions: Vec<[f32; 3]> = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|v| v as f32 * 0.1)).collect();
    /// let (params, control, mut reconstructor) = (Params::new(0.05), Control::default(), Reconstructor::new());
    /// let weighed = reconstructor.sort((&positions).into(), &[], &params, &control)?.weigh()?;
    /// let total: f64 = weighed.volumes().expect("the SPH field has volumes").sum();
    /// assert!(total > 27.0 * 0.1f64.powi(3));
    /// let mut highest = 0.0f32;
    /// let sampled = weighed.sample()?;
    /// sampled.for_each_brick(|_, values| highest = values.iter().copied().fold(highest, f32::max));
    /// assert!(highest > 0.6);
    /// assert!(sampled.count()?.triangle_count() > 100);
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`extract`](Self::extract).
    pub fn sort<'a>(
        &'a mut self,
        positions: Positions<'a>,
        attributes: &'a [Attribute<'a>],
        params: &'a Params,
        control: &'a Control<'a>,
    ) -> Result<Sorted<'a>, Error> {
        params.check()?;
        check_attributes(attributes, positions.len())?;
        let unit = Unit::new(params.lanes).ok_or(Error::Parameter {
            name: "lanes",
            value: f64::NAN,
            must: "a vector unit that this machine has; choose Auto",
        })?;
        let Chosen { field, sampler, support, columns } = chosen::choose(params, positions)?;
        let lattice = Lattice { spacing: params.spacing(), support };
        let surface = if params.band == Band::Paper { SurfaceBoxes::BYTES_PER_PARTICLE } else { 0 };
        let budget = budget(params.max_memory, positions.len(), columns, surface)?;
        control.begin(Stage::Sort)?;
        self.cells.build(positions, lattice)?;
        Ok(Sorted(Job { from: self, unit, field, sampler, lattice, budget, params, positions, attributes, control }))
    }

    fn wall_lattice(&self, spacing: f64) -> Option<WallLattice> {
        self.walls.clone().map(|walls| WallLattice { walls, spacing })
    }

    /// Cuts the octets into chunks of a few thousand vertices: enough to share among threads, few enough to stay in the
    /// second-level cache while they are written.
    fn cut_chunks(&mut self) {
        const CHUNK_VERTICES: u32 = 4096;
        self.chunks.clear();
        self.chunks.push(0);
        let parts = &self.counted.parts;
        let mut first = 0;
        for (i, part) in parts.iter().enumerate() {
            if part.first_vertex - first >= CHUNK_VERTICES || i + 1 == parts.len() {
                self.chunks.push(i);
                first = part.first_vertex;
            }
        }
        self.chunks.dedup();
    }

    /// The node that vertices count from. The world's origin, unless the surface lies so far from it that offsets in `f32`
    /// would lose more than about a thousandth of a cell; then a node near its middle.
    fn origin(&self) -> [i32; 3] {
        const NEAR: i32 = 1 << 14;
        let octets = &self.band.fine.octets;
        let parts = self.counted.parts.split_last().map_or(&[][..], |(_, parts)| parts);
        std::array::from_fn(|a| {
            let nodes = parts.iter().map(|part| i64::from(octets[part.octet as usize].at[a]) * i64::from(OCTET));
            let (low, high) = nodes.fold((i64::MAX, i64::MIN), |(low, high), n| (low.min(n), high.max(n)));
            if low > high || (low > -i64::from(NEAR) && high < i64::from(NEAR)) {
                return 0;
            }
            ((low + high) / 2).div_euclid(NEAR.into()) as i32 * NEAR
        })
    }
}

/// What every stage knows.
struct Job<'a> {
    from: &'a mut Reconstructor,
    unit: Unit,
    field: Box<dyn AnyField>,
    sampler: Option<Box<dyn AnyField>>,
    lattice: Lattice,
    budget: Budget,
    params: &'a Params,
    positions: Positions<'a>,
    attributes: &'a [Attribute<'a>],
    control: &'a Control<'a>,
}

/// Particles in their canonical order: by cell, then by the caller's index.
pub struct Sorted<'a>(Job<'a>);

impl<'a> Sorted<'a> {
    /// The caller's index of each particle, in canonical order.
    pub fn order(&self) -> &[u32] {
        self.0.from.cells.order()
    }

    /// Computes what each particle brings to the field: densities, hence volumes, where it asks for them.
    ///
    /// # Errors
    /// [`Error::OutsideLattice`] where a field moves particles out of what it can look up, [`Error::Cancelled`].
    pub fn weigh(self) -> Result<Weighed<'a>, Error> {
        let Self(mut job) = self;
        job.control.begin(Stage::Density)?;
        job.lattice = chosen::weigh(&mut *job.from, job.unit, job.lattice, job.params, job.positions, job.control)?;
        job.control.check()?;
        if let Some(lattice) = job.from.wall_lattice(job.lattice.spacing) {
            let support = job.lattice.support;
            let walled = |field, lattice| Box::new(Walled { field, lattice, support }) as Box<dyn AnyField>;
            job.sampler = job.sampler.map(|field| walled(field, lattice.clone()));
            job.field = walled(job.field, lattice);
        }
        Ok(Weighed(job))
    }
}

/// Sorted particles with their volumes.
pub struct Weighed<'a>(Job<'a>);

impl<'a> Weighed<'a> {
    /// The caller's index of each particle, in canonical order.
    pub fn order(&self) -> &[u32] {
        self.0.from.cells.order()
    }

    /// Volume m/ρ of each particle in cubic world units, in canonical order; `None` where the field asks for none.
    pub fn volumes(&self) -> Option<impl Iterator<Item = f64> + '_> {
        let Job { from, lattice, params, .. } = &self.0;
        chosen::volumes(params.field, *lattice, &from.columns, from.cells.len())
    }

    /// What rivals begin with.
    #[cfg(feature = "internals")]
    pub(crate) fn parts(&self) -> (&Cells, &[Vec<f32>], f64) {
        (&self.0.from.cells, &self.0.from.columns, self.0.lattice.support)
    }

    /// Samples the field where the surface may be.
    ///
    /// # Errors
    /// [`Error::Memory`] when the lattice near the surface does not fit the limit, [`Error::Parameter`] for [`Band::Paper`] where there
    /// are walls, [`Error::Cancelled`].
    pub fn sample(self) -> Result<Sampled<'a>, Error> {
        self.sample_by(Grain::Bricks)
    }

    /// A surface needs fewer samples than who looks at them.
    fn sample_by(self, grain: Grain) -> Result<Sampled<'a>, Error> {
        let Self(job) = self;
        let has_walls = job.from.walls.is_some();
        let Reconstructor { cells, columns, band, surface, .. } = &mut *job.from;
        surface.clear();
        let look = match job.params.band {
            Band::Auto => Look::Band,
            Band::Full => Look::Everywhere,
            Band::Paper if has_walls => {
                let must = "auto or full where there are walls: no surface particle tells where a wall cuts the fluid";
                return Err(Error::Parameter { name: "band", value: f64::NAN, must });
            }
            Band::Paper => {
                job.control.begin(Stage::SurfaceParticles)?;
                Look::Near(surface.find(job.unit, job.params, job.positions, job.control)?)
            }
        };
        let columns = &chosen::slices(columns);
        let source = Source { unit: job.unit, field: &*job.field, cells, columns, control: job.control };
        let sampler = Source { field: job.sampler.as_deref().unwrap_or(&*job.field), ..source };
        band.find(&source, &sampler, job.lattice.step(), look, grain, job.budget)?;
        Ok(Sampled(job))
    }
}

/// The field's samples in bricks of 4×4×4 nodes, wherever the surface may be.
pub struct Sampled<'a>(Job<'a>);

impl<'a> Sampled<'a> {
    /// Calls `work` with each brick, in no particular order: its first node's index along each axis (node i lies at
    /// i · spacing), and its 64 values, x fastest. Nothing is called where the values were not kept because of the memory
    /// limit.
    pub fn for_each_brick(&self, mut work: impl FnMut([i32; 3], &[f32; 64])) {
        if !self.0.from.band.has_values {
            return;
        }
        let fine = &self.0.from.band.fine;
        for octet in &fine.octets {
            for brick in ones(octet.filled.into()) {
                let first = brick_origin(brick);
                work(std::array::from_fn(|a| octet.at[a] * OCTET + first[a]), &fine.values(octet, brick).all());
            }
        }
    }

    /// Counts crossings and triangles.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`, [`Error::Cancelled`].
    pub fn count(self) -> Result<Surface<'a>, Error> {
        let Self(Job { from, unit, field, lattice, params, attributes, control, .. }) = self;
        control.begin(Stage::Count)?;
        from.counted.count(unit, &from.band.fine, &from.band.marks)?;
        control.check()?;
        from.cut_chunks();
        let frame = Frame { origin: from.origin(), spacing: lattice.spacing };
        let walls = from.wall_lattice(lattice.spacing);
        Ok(Surface { from, unit, field, lattice, walls, frame, params, attributes, control })
    }
}

/// A limit, of which the sorted particles, their columns and the bytes that finding surface particles takes of each have their
/// part.
fn budget(max_memory: Option<u64>, particles: usize, columns: usize, surface: u64) -> Result<Budget, Error> {
    let taken = particles as u64 * (Cells::BYTES_PER_PARTICLE + (columns * size_of::<f32>()) as u64 + surface);
    let bytes = max_memory.unwrap_or(u64::MAX);
    if taken > bytes {
        return Err(Error::Memory { what: "the particles alone", needed: taken, available: bytes });
    }
    Ok(Budget { bytes, taken })
}

fn check_attributes(attributes: &[Attribute<'_>], particles: usize) -> Result<(), Error> {
    for attribute in attributes {
        let expected = particles * attribute.components;
        if attribute.components == 0 || attribute.values.len() != expected {
            let what = format!("attribute {} with {} components", attribute.name, attribute.components);
            return Err(Error::Length { what, found: attribute.values.len(), expected });
        }
        if attribute.carry == Carry::NormalSpeed && attribute.components != 3 {
            let what = format!("a velocity of {}", attribute.name);
            return Err(Error::Length { what, found: attribute.components, expected: 3 });
        }
    }
    Ok(())
}
