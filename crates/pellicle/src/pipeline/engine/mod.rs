//! Road B: particles → blocks → lists of bricks (or columns) → layers (or slices) → sink, every frame.

mod job;
mod keep;
mod levels;
mod params;
mod seams;
#[cfg(test)]
mod tests;
mod view;
mod work;

pub use keep::Reuse;
pub use levels::Region;
pub use params::{Frame, MOST_LEVELS, Metaball, Params};
pub use view::{Sweep, View};

use crate::{
    Control, Error, Positions,
    bricks::blocks::Blocks,
    field::{
        density,
        falloff::{Any, InverseSquare, Triquet},
    },
    lattice::Lattice,
    lookup::{cells::Cells, columns::Placed},
    march::slices::{
        Blend, Clock, Custom, CustomField, FOREIGN, Lap, Piece, Plain, Radial, Scene, Shading, Sight, Skin, Times,
    },
    math::{
        simd::Unit,
        vector::{Axes, dot, from_axes},
    },
    sink::Sink,
};
use job::Job;
use keep::{Keep, Slot};
use seams::Seams;
use view::{block_key, corners};
use work::{Needs, Work};

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
/// Runs in the current rayon pool: threads take block after block, and whoever is done with one writes what is next in their
/// order, so that a sink is used by one thread at a time, but not always the same. The surface is the same, byte for byte,
/// for any number of threads.
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
    view: Option<View>,
    clock: Option<Clock>,
    /// Time of the stages before the march.
    times: Times,
    placed: Vec<Placed>,
    blocks: Blocks,
    cells: Cells,
    weights: Vec<f32>,
    /// One a thread.
    works: Vec<Work<K::Corner>>,
    keep: Keep<K::Vertex>,
    seams: Seams,
    detail: levels::Detail<K>,
}

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
            view: None,
            clock: None,
            times: Times::default(),
            placed: Vec::new(),
            blocks: Blocks::default(),
            cells: Cells::default(),
            weights: Vec::new(),
            works: Vec::new(),
            keep: Keep::default(),
            seams: Seams::default(),
            detail: levels::Detail::default(),
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
        // Whatever was kept may look different now.
        self.keep.forget();
        &mut self.skin
    }

    /// From the next frame on, triangles come in this viewer's order; with `None`, block by block and slab by slab along z.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a place that is not finite or a direction of no length.
    pub fn set_view(&mut self, view: Option<View>) -> Result<(), Error> {
        view.map_or(Ok(()), |view| view.check())?;
        self.view = view;
        Ok(())
    }

    /// From the next frame on, [`Frame::times`] are measured by this clock.
    ///
    /// ```
    /// use std::{sync::LazyLock, time::Instant};
    ///
    /// static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    /// let mut engine = pellicle::realtime::Engine::new(pellicle::realtime::Params::new(3.0, 1.0))?;
    /// engine.set_clock(Some(|| START.elapsed().as_nanos() as u64));
    /// let frame = engine.update(&[[0.0f32; 3]], &mut pellicle::Mesh::default())?;
    /// assert!(frame.times.surface > 0);
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    pub fn set_clock(&mut self, clock: Option<Clock>) {
        self.clock = clock;
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
        sink: &mut (impl Sink<K::Vertex> + Send),
    ) -> Result<Frame, Error> {
        self.update_visible(particles, sink, |_| true)
    }

    /// As [`update`](Self::update), but leaves out the blocks that are not `visible`, which is asked with a block's eight
    /// corners in world units. Where a block is left out the surface is open; all else is as it would be with it.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    pub fn update_visible<'a>(
        &mut self,
        particles: impl Into<Particles<'a>>,
        sink: &mut (impl Sink<K::Vertex> + Send),
        mut visible: impl FnMut(&[[f64; 3]; 8]) -> bool,
    ) -> Result<Frame, Error> {
        let particles = particles.into();
        let axes = self.prepare(&particles, self.params.block, &mut visible)?;
        let varied = particles.reaches.is_some() || particles.strengths.is_some();
        // The paper's metaball of particles that do not differ has a march of its own; the others share one.
        if self.params.field == Metaball::Triquet && !varied {
            return self.march(axes, &Radial::<_, false>(Triquet), sink);
        }
        self.march(axes, &Radial::<_, true>(self.falloff()), sink)
    }

    fn falloff(&self) -> Any {
        match self.params.field {
            Metaball::Triquet => Any::Triquet,
            Metaball::Wyvill => Any::Wyvill,
            Metaball::InverseSquare { radius } => {
                Any::InverseSquare(InverseSquare { radius_sq: (radius * radius) as f32 })
            }
            Metaball::Sph => Any::Spline,
        }
    }

    /// As [`update`](Self::update), with a field of the user's in place of [`Params::field`].
    ///
    /// # Errors
    /// As [`update`](Self::update).
    pub fn update_custom<'a>(
        &mut self,
        particles: impl Into<Particles<'a>>,
        field: &impl CustomField,
        sink: &mut (impl Sink<K::Vertex> + Send),
    ) -> Result<Frame, Error> {
        // Of the user's field nobody knows whether it changed: nothing of before holds, nor of this frame later on.
        self.keep.forget();
        let axes = self.prepare(&particles.into(), self.params.block, &mut |_| true)?;
        let frame = self.march(axes, &Custom(field), sink);
        self.keep.forget();
        frame
    }

    /// What comes before the march, with blocks of so many cubes. Gives the pose of the lattice.
    fn prepare(
        &mut self,
        particles: &Particles<'_>,
        block: [usize; 3],
        visible: &mut dyn FnMut(&[[f64; 3]; 8]) -> bool,
    ) -> Result<Option<Axes>, Error> {
        let mut lap = Lap::new(self.clock);
        let axes = self.view.map(|view| view.axes());
        self.place(particles, axes.as_ref())?;
        self.times.place = lap.next();
        self.cut(axes.as_ref(), block, visible);
        self.times.cut = lap.next();
        Ok(axes)
    }

    /// Puts the particles on the lattice.
    fn place(&mut self, particles: &Particles<'_>, axes: Option<&Axes>) -> Result<(), Error> {
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
        self.placed.reserve_exact(n);
        for i in 0..n {
            let position = particles.positions.get(i);
            lattice.check(i, position)?;
            let position = axes.map_or(position, |axes| axes.map(|axis| dot(axis, position)));
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

    /// Cuts the world into blocks, in the viewer's order.
    fn cut(&mut self, axes: Option<&Axes>, block: [usize; 3], visible: &mut dyn FnMut(&[[f64; 3]; 8]) -> bool) {
        let spacing = self.params.spacing;
        let sight = self.sight(axes);
        self.blocks.cut(block.map(|n| n as i32), &self.placed, |at| {
            visible(&corners(axes, at, block, spacing)).then(|| sight.map_or(0, |sight| block_key(at, block, &sight)))
        });
    }

    /// The viewer in the lattice with these axes.
    fn sight(&self, axes: Option<&Axes>) -> Option<Sight> {
        self.view.zip(axes).map(|(view, axes)| Sight {
            order: view.order,
            sorting: view.sorting,
            cube: view.cube(axes, self.params.spacing),
        })
    }

    /// What vertices get.
    fn shading(&self) -> Shading {
        match (self.params.normals, size_of::<K::Corner>() + size_of::<K::Vertex>() > 0) {
            (false, false) => Shading::None,
            (true, false) => Shading::Normals,
            (false, true) => Shading::Data,
            (true, true) => Shading::NormalsAndData,
        }
    }

    fn march(
        &mut self,
        axes: Option<Axes>,
        blend: &impl Blend,
        sink: &mut (impl Sink<K::Vertex> + Send),
    ) -> Result<Frame, Error> {
        let mut lap = Lap::new(self.clock);
        let origin = self.origin(self.params.block.map(|n| n as i32));
        let shading = self.shading();
        let scene = Scene {
            blend,
            skin: &self.skin,
            iso: self.params.iso as f32,
            seeds: self.params.seeds,
            shading,
            particles: &self.placed,
            origin,
            spacing: self.params.spacing,
            axes,
            clock: self.clock,
        };
        let sight = self.sight(axes.as_ref());
        let threads = rayon::current_num_threads();
        let reuse = self.params.reuse == Reuse::Unchanged;
        let alone = !reuse && threads == 1;
        let slots = match (reuse, alone) {
            (true, _) => self.blocks.blocks.len().max(1),
            (_, true) => 1,
            _ => 8 * threads,
        };
        self.works.resize_with(threads.max(self.works.len()), Work::default);
        if reuse {
            self.keep.arrange(&self.blocks, origin, axes);
        } else {
            self.keep.forget();
            self.keep.kept.resize_with(slots.max(self.keep.kept.len()), Slot::default);
        }
        self.seams.begin();
        let mut frame = Frame {
            particles: self.placed.len(),
            blocks: self.blocks.blocks.len(),
            times: self.times,
            ..Frame::default()
        };
        sink.begin(from_axes(axes.as_ref(), origin.map(|n| f64::from(n) * self.params.spacing)));
        let job = Job { unit: self.unit, scene: &scene, sight, blocks: &self.blocks, params: &self.params, reuse };
        let (kept, works) = (&mut self.keep.kept[..slots], &mut self.works[..threads]);
        if alone {
            // Nobody works beside: what there is of the surface is written as soon as it is made.
            for block in &self.blocks.blocks {
                let (kept, around) = (kept[0].get(), self.blocks.around(block));
                self.seams.begin_block(&frame);
                let (seams, frame, mut written) = (&mut self.seams, &mut frame, Ok(()));
                let mut drain = |piece: &mut Piece<K::Vertex>| {
                    if written.is_ok() {
                        written = seams.write(piece, &around, frame, sink);
                    }
                    piece.drain();
                };
                job.march(block, kept, &mut works[0], Some(&mut drain));
                written?;
                frame.take(kept);
                self.seams.write(&kept.piece, &around, frame, sink)?;
                self.seams.end_block(&kept.piece);
            }
        } else {
            let (seams, frame) = (&mut self.seams, &mut frame);
            job.run(kept, works, |kept| {
                frame.take(kept);
                seams.begin_block(frame);
                seams.write(&kept.piece, &kept.around, frame, sink)?;
                seams.end_block(&kept.piece);
                Ok(())
            })?;
        }
        let needs = self.works.iter().fold(Needs::default(), |needs, work| needs.join(&work.needs()));
        self.works.iter_mut().for_each(|work| work.provide(&needs));
        frame.particle_bytes = self.placed.len() * size_of::<Placed>() + self.blocks.bytes();
        frame.kept_bytes = if reuse { self.keep.bytes(frame.blocks) } else { 0 };
        frame.seam_bytes = self.seams.bytes();
        frame.levels[0] = frame.blocks;
        sink.end()?;
        frame.times.surface = lap.next();
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
