//! Road B: particles → blocks → columns → slices → sink, every frame.

mod params;
#[cfg(test)]
mod tests;

pub use params::{Frame, Metaball, Params};

use std::sync::Mutex;

use crate::{
    Control, Error, Positions,
    bricks::blocks::{Block, Blocks},
    field::{
        density,
        falloff::{InverseSquare, Spline, Triquet, Wyvill},
    },
    lattice::Lattice,
    lookup::{cells::Cells, columns::Placed},
    march::slices::{Blend, FOREIGN, March, Piece, Plain, Radial, Scene, Seam, Shading, Skin, Work},
    math::{
        ranges::{PerItem, for_each_part},
        simd::Unit,
    },
    sink::{Part, Sink},
};

/// Particles of a frame: positions, and what may differ between them.
#[derive(Debug, Clone, Copy)]
pub struct Particles<'a> {
    /// Positions in world units.
    pub positions: Positions<'a>,
    /// Reach of each in world units, greater than 0 and at most [`Params::reach`]; without, all have that.
    pub reaches: Option<&'a [f32]>,
    /// Factor of each one's contribution, at least 0; without, 1.
    pub strengths: Option<&'a [f32]>,
}

impl<'a, P: Into<Positions<'a>>> From<P> for Particles<'a> {
    fn from(positions: P) -> Self {
        Self { positions: positions.into(), reaches: None, strengths: None }
    }
}

/// Makes a surface over moving particles every frame, in memory that it keeps: after the first frames of a scene it
/// allocates nothing.
///
/// Runs in the current rayon pool, a block a task. The surface is the same, byte for byte, for any number of threads.
///
/// ```
/// use pellicle::{Mesh, realtime::{Engine, Params}};
///
/// let mut engine = Engine::new(Params::new(3.0, 0.5))?;
/// let (mut mesh, mut particles) = (Mesh::default(), vec![[0.0f32; 3], [1.5, 0.0, 0.0]]);
/// for _ in 0..3 {
///     particles[1][0] += 0.1;
///     let frame = engine.update(&particles, &mut mesh)?;
///     assert_eq!(frame.triangles, mesh.triangles.len());
/// }
/// # Ok::<(), pellicle::Error>(())
/// ```
pub struct Engine<K: Skin = Plain> {
    params: Params,
    skin: K,
    unit: Unit,
    placed: Vec<Placed>,
    blocks: Blocks,
    cells: Cells,
    weights: Vec<f32>,
    /// One a thread.
    works: Vec<Mutex<Work<K::Corner>>>,
    pieces: Vec<Piece<K::Vertex>>,
    seams: Seams,
}

/// Numbers of vertices that later blocks refer to.
#[derive(Default)]
struct Seams {
    /// Keys and numbers, block after block.
    entries: Vec<(u32, u32)>,
    /// Where each block's begin.
    starts: Vec<u32>,
    resolved: Vec<u32>,
}

/// Stands for a vertex that the owner did not make.
const MISSING: u32 = u32::MAX;

impl Engine {
    /// An engine for surfaces with positions and, by choice, normals.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: Params) -> Result<Self, Error> {
        Self::with_skin(params, Plain)
    }
}

impl<K: Skin> Engine<K> {
    /// An engine for surfaces that carry the user's data.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn with_skin(params: Params, skin: K) -> Result<Self, Error> {
        params.check()?;
        let unit = Unit::new(params.lanes).ok_or(Error::Parameter {
            name: "lanes",
            value: f64::NAN,
            must: "a vector unit that this machine has; choose Auto",
        })?;
        Ok(Self {
            params,
            skin,
            unit,
            placed: Vec::new(),
            blocks: Blocks::default(),
            cells: Cells::default(),
            weights: Vec::new(),
            works: Vec::new(),
            pieces: Vec::new(),
            seams: Seams::default(),
        })
    }

    /// The parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The skin.
    pub fn skin(&self) -> &K {
        &self.skin
    }

    /// The skin, to be changed between frames.
    pub fn skin_mut(&mut self) -> &mut K {
        &mut self.skin
    }

    /// Makes the surface of these particles and writes it to the sink. No particles give an empty surface.
    ///
    /// # Errors
    /// [`Error::NotFinite`] and [`Error::OutsideLattice`] for the first particle that cannot be placed;
    /// [`Error::Parameter`], [`Error::Length`] for reaches or strengths out of range or of the wrong number;
    /// [`Error::Count`] when the surface has too many vertices, or more than the sink can take.
    pub fn update<'a>(
        &mut self,
        particles: impl Into<Particles<'a>>,
        sink: &mut impl Sink<K::Vertex>,
    ) -> Result<Frame, Error> {
        let particles = particles.into();
        self.place(&particles)?;
        let varied = particles.reaches.is_some() || particles.strengths.is_some();
        match (self.params.field, varied) {
            (Metaball::Triquet, false) => self.march(&Radial::<_, false>(Triquet), sink),
            (Metaball::Triquet, true) => self.march(&Radial::<_, true>(Triquet), sink),
            (Metaball::Wyvill, false) => self.march(&Radial::<_, false>(Wyvill), sink),
            (Metaball::Wyvill, true) => self.march(&Radial::<_, true>(Wyvill), sink),
            (Metaball::InverseSquare { radius }, varied) => {
                let falloff = InverseSquare { radius_sq: (radius * radius) as f32 };
                if varied {
                    self.march(&Radial::<_, true>(falloff), sink)
                } else {
                    self.march(&Radial::<_, false>(falloff), sink)
                }
            }
            (Metaball::Sph, _) => self.march(&Radial::<_, true>(Spline), sink),
        }
    }

    /// Puts the particles on the lattice.
    fn place(&mut self, particles: &Particles<'_>) -> Result<(), Error> {
        let n = particles.positions.len();
        for (what, values) in [("reaches", particles.reaches), ("strengths", particles.strengths)] {
            if let Some(values) = values.filter(|values| values.len() != n) {
                return Err(Error::Length { what: what.into(), found: values.len(), expected: n });
            }
        }
        if n >= FOREIGN as usize {
            return Err(Error::Count { what: "particles", needed: n as u64, available: u64::from(FOREIGN) - 1 });
        }
        let (reach, spacing) = (self.params.reach, self.params.spacing);
        let lattice = Lattice { spacing, support: reach };
        let per_spacing = 1.0 / spacing;
        self.placed.clear();
        for i in 0..n {
            let position = particles.positions.get(i);
            lattice.check(i, position)?;
            let (node, offset) = Lattice::nearest(position.map(|v| v * per_spacing));
            let own = particles.reaches.map_or(reach, |values| f64::from(values[i]));
            if !(own > 0.0 && own <= reach * (1.0 + 1e-6) && own * per_spacing > 1e-6) {
                return Err(Error::Parameter {
                    name: "reaches",
                    value: own,
                    must: "greater than 0, at most the reach",
                });
            }
            let strength = particles.strengths.map_or(1.0, |values| values[i]);
            if !(0.0..=f32::MAX).contains(&strength) {
                return Err(Error::Parameter { name: "strengths", value: strength.into(), must: "finite, at least 0" });
            }
            let reach = (own * per_spacing) as f32;
            self.placed.push(Placed { node, offset, reach, strength, index: i as u32 });
        }
        if self.params.field == Metaball::Sph {
            self.weigh(particles.positions, lattice)?;
        }
        Ok(())
    }

    /// Strengths of the SPH colour field, as the bulk road computes them.
    fn weigh(&mut self, positions: Positions<'_>, lattice: Lattice) -> Result<(), Error> {
        self.cells.build(positions, lattice)?;
        density::weights(self.unit, &self.cells, &Control::default(), &mut self.weights);
        let reach = (self.params.reach / self.params.spacing) as f32;
        for (&index, &weight) in self.cells.order().iter().zip(&self.weights) {
            let placed = &mut self.placed[index as usize];
            (placed.strength, placed.reach) = (weight, reach);
        }
        Ok(())
    }

    fn march(&mut self, blend: &impl Blend, sink: &mut impl Sink<K::Vertex>) -> Result<Frame, Error> {
        let size = self.params.block.map(|n| n as i32);
        self.blocks.cut(size, &self.placed, |_| Some(0));
        let origin = self.origin(size);
        let shading = match (self.params.normals, size_of::<K::Corner>() + size_of::<K::Vertex>() > 0) {
            (false, false) => Shading::None,
            (true, false) => Shading::Normals,
            (false, true) => Shading::Data,
            (true, true) => Shading::NormalsAndData,
        };
        let scene = Scene {
            blend,
            skin: &self.skin,
            iso: self.params.iso as f32,
            seeds: self.params.seeds,
            shading,
            particles: &self.placed,
            origin,
            spacing: self.params.spacing,
        };
        let threads = rayon::current_num_threads();
        let batch = if threads == 1 { 1 } else { 8 * threads };
        self.works.resize_with(threads.max(self.works.len()), Mutex::default);
        self.pieces.resize_with(batch.max(self.pieces.len()), Piece::default);
        self.seams.begin();
        let mut frame = Frame { particles: self.placed.len(), blocks: self.blocks.blocks.len(), ..Frame::default() };
        sink.begin(origin.map(|n| f64::from(n) * self.params.spacing));
        for first in (0..self.blocks.blocks.len()).step_by(batch) {
            let blocks = &self.blocks.blocks[first..self.blocks.blocks.len().min(first + batch)];
            let job =
                Job { unit: self.unit, scene: &scene, blocks: &self.blocks, params: &self.params, works: &self.works };
            job.run(blocks, &mut self.pieces[..blocks.len()]);
            for piece in &mut self.pieces[..blocks.len()] {
                frame.counts.add(&piece.counts);
                self.seams.resolve(piece, &mut frame)?;
                sink.append(Part {
                    first_vertex: frame.vertices,
                    first_triangle: frame.triangles,
                    positions: &piece.positions,
                    normals: &piece.normals,
                    data: &piece.data,
                    triangles: &piece.triangles,
                });
                frame.vertices += piece.positions.len();
                frame.triangles += piece.triangles.len();
            }
        }
        frame.particle_bytes = self.placed.len() * size_of::<Placed>() + self.blocks.bytes();
        frame.seam_bytes = self.seams.entries.len() * 8 + self.seams.starts.len() * 4;
        sink.end()?;
        Ok(frame)
    }

    /// The node that positions count from: the world's origin, unless the blocks lie so far from it that offsets in `f32`
    /// would lose more than about a thousandth of a cell; then one near their middle.
    fn origin(&self, size: [i32; 3]) -> [i32; 3] {
        const NEAR: i64 = 1 << 14;
        std::array::from_fn(|a| {
            let nodes = self.blocks.blocks.iter().map(|block| i64::from(block.at[a]) * i64::from(size[a]));
            let (low, high) = nodes.fold((i64::MAX, i64::MIN), |(low, high), n| (low.min(n), high.max(n)));
            if low > high || (low > -NEAR && high < NEAR) { 0 } else { ((low + high) / 2 / NEAR * NEAR) as i32 }
        })
    }
}

/// Marching some blocks, on as many threads as there are.
struct Job<'a, B, K: Skin> {
    unit: Unit,
    scene: &'a Scene<'a, B, K>,
    blocks: &'a Blocks,
    params: &'a Params,
    works: &'a [Mutex<Work<K::Corner>>],
}

impl<B: Blend, K: Skin> Job<'_, B, K> {
    fn run(&self, blocks: &[Block], pieces: &mut [Piece<K::Vertex>]) {
        for_each_part(0..blocks.len(), PerItem(pieces, 1), &|i| i, &|i, piece: PerItem<'_, _>| {
            let block = &blocks[i];
            let thread = rayon::current_thread_index().unwrap_or(0) % self.works.len();
            let mut work = self.works[thread].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let seam =
                Seam { around: self.blocks.around(block), margin: self.params.margin(), cells: self.params.block };
            let first = std::array::from_fn(|a| block.at[a] * self.params.block[a] as i32);
            let members = self.blocks.members(block);
            self.unit.run(March { scene: self.scene, first, seam, members, work: &mut work, piece: &mut piece.0[0] });
        });
    }
}

impl Seams {
    fn begin(&mut self) {
        self.entries.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    /// Turns a piece's own numbers into those of the whole surface, and remembers those that later pieces may refer to.
    /// `frame` holds the counts of what came before.
    fn resolve<V>(&mut self, piece: &mut Piece<V>, frame: &mut Frame) -> Result<(), Error> {
        let base = frame.vertices as u64;
        let end = base + piece.positions.len() as u64;
        if end > u64::from(FOREIGN) {
            return Err(Error::Count { what: "vertices", needed: end, available: u64::from(FOREIGN) });
        }
        let base = base as u32;
        self.entries.extend(piece.shared.iter().map(|&(key, vertex)| (key, vertex + base)));
        self.starts.push(self.entries.len() as u32);
        self.resolved.clear();
        for reference in &piece.foreign {
            let of = self.starts[reference.block as usize] as usize..self.starts[reference.block as usize + 1] as usize;
            let notes = &self.entries[of];
            let found = notes.binary_search_by_key(&reference.key, |&(key, _)| key);
            self.resolved.push(found.map_or(MISSING, |at| notes[at].1));
        }
        let mut missing = 0;
        for triangle in &mut piece.triangles {
            for vertex in triangle.iter_mut() {
                *vertex =
                    if *vertex & FOREIGN == 0 { *vertex + base } else { self.resolved[(*vertex ^ FOREIGN) as usize] };
            }
            missing += usize::from(triangle.contains(&MISSING));
        }
        if missing > 0 {
            frame.unmatched += missing;
            piece.triangles.retain(|triangle| !triangle.contains(&MISSING));
        }
        Ok(())
    }
}
