//! Road B with a cell size for each block: particles → blocks → levels → columns → cells and transition cells → sink.
//!
//! Vertices of a block may be those of blocks that come later, so all vertices go to the sink before all triangles; both in
//! the order of blocks, which is the viewer's if there is one.

use super::{
    Blend, Custom, CustomField, Engine, Frame, MOST_LEVELS, Metaball, Particles, Placed, Radial, Reuse, Scene, Sink,
    Skin, Triquet, view::corners,
};
use crate::{
    Error,
    bricks::levels::ABSENT,
    lookup::columns::Room,
    march::{
        levels::{Columned, Place, Pool, Scratch, Surface, Vertices, fit_pool},
        slices::{Lap, Seeds},
    },
    math::vector::{Axes, from_axes},
    sink::Part,
};

/// The part of the world that a block takes, in world units: where a view turns the lattice
/// ([`Sweep::Rotated`](super::Sweep::Rotated)), the least box around it whose faces are not turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Its lowest corner.
    pub low: [f64; 3],
    /// Its highest corner.
    pub high: [f64; 3],
}

impl Region {
    /// The least region that holds these points.
    fn around(points: &[[f64; 3]; 8]) -> Self {
        let bound = |pick: fn(f64, f64) -> f64| {
            std::array::from_fn(|a| points[1..].iter().fold(points[0][a], |bound, p| pick(bound, p[a])))
        };
        Self { low: bound(f64::min), high: bound(f64::max) }
    }

    /// Distance of its nearest point from a point: 0 within.
    pub fn distance(&self, from: [f64; 3]) -> f64 {
        let beyond = |a: usize| (self.low[a] - from[a]).max(from[a] - self.high[a]).max(0.0);
        (0..3).map(|a| beyond(a) * beyond(a)).sum::<f64>().sqrt()
    }

    /// A level by distance from an eye: 0 up to the distance `near`, and one more each time the distance doubles, so that a
    /// cell looks about as large everywhere.
    ///
    /// ```
    /// use pellicle::realtime::Region;
    ///
    /// let block = Region { low: [0.0; 3], high: [1.0; 3] };
    /// let level = |x: f64| block.level_by_distance([x, 0.5, 0.5], 10.0);
    /// assert_eq!([5.0, 12.0, 25.0, 60.0].map(level), [0, 1, 2, 3]);
    /// ```
    pub fn level_by_distance(&self, eye: [f64; 3], near: f64) -> u8 {
        let distance = self.distance(eye);
        (0..MOST_LEVELS as i32 - 1).take_while(|&level| distance > near * f64::from(1 << level)).count() as u8
    }
}

/// What the engine keeps for levels.
pub(super) struct Detail<K: Skin> {
    surface: Surface,
    pool: Pool<Scratch, K::Corner>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    data: Vec<K::Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl<K: Skin> Default for Detail<K> {
    fn default() -> Self {
        Self {
            surface: Surface::default(),
            pool: Vec::new(),
            positions: Vec::new(),
            normals: Vec::new(),
            data: Vec::new(),
            triangles: Vec::new(),
        }
    }
}

/// Which level a block shall have.
pub(super) type Wish<'a> = &'a mut dyn FnMut(&Region) -> u8;
/// Whether a block is shown, given its eight corners.
type Visible<'a> = &'a mut dyn FnMut(&[[f64; 3]; 8]) -> bool;

impl<K: Skin> Engine<K> {
    /// The coarsest level that blocks can have: their size must be a multiple of the coarsest cell.
    pub fn coarsest_level(&self) -> u8 {
        let size = self.params.block.iter().map(|n| n.trailing_zeros()).min().unwrap_or(0);
        size.min(MOST_LEVELS as u32 - 1) as u8
    }

    /// As [`update`](Self::update), with a cell size for each block: `wish` is asked for the level of every block that
    /// particles reach. At level 0 cells have the edge [`Params::spacing`](super::Params::spacing), at each further level
    /// twice that, up to [`coarsest_level`](Self::coarsest_level). Levels of blocks that touch, if only in a corner, are
    /// made to differ by one at most, by refining what is too coarse. The surface is closed, across levels, too. With a
    /// [view](Self::set_view) triangles come in the viewer's order.
    ///
    /// ```
    /// use pellicle::{Mesh, realtime::{Engine, Params}};
    ///
    /// let mut engine = Engine::new(Params { block: [16; 3], ..Params::new(3.0, 0.25) })?;
    /// let particles: Vec<[f32; 3]> = (0..40).map(|i| [i as f32 * 0.5, 0.0, 0.0]).collect();
    /// let mut mesh = Mesh::default();
    /// let eye = [0.0; 3];
    /// let frame = engine.update_with_levels(&particles, |block| block.level_by_distance(eye, 3.0), &mut mesh)?;
    /// assert!(frame.levels[0] > 0 && frame.levels[1] > 0);
    /// assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`update`](Self::update); [`Error::Parameter`] for blocks that are not cubes, seeds from particles and reuse, which
    /// do not go with levels.
    pub fn update_with_levels<'a>(
        &mut self,
        particles: impl Into<Particles<'a>>,
        wish: impl FnMut(&Region) -> u8,
        sink: &mut impl Sink<K::Vertex>,
    ) -> Result<Frame, Error> {
        self.update_visible_with_levels(particles, |_| true, wish, sink)
    }

    /// As [`update_with_levels`](Self::update_with_levels), but leaves out the blocks that are not `visible`, which is asked
    /// with a block's eight corners in world units, as in [`update_visible`](Self::update_visible). Blocks that are left out
    /// are asked for their levels and balanced like others. So what is left is as it would be with them, vertex for vertex:
    /// the surface is open where a block is left out, and nowhere else. Between a coarse block and a finer one that is left
    /// out it ends a quarter of a coarse cell before the border, where transition cells would begin.
    ///
    /// # Errors
    /// As [`update_with_levels`](Self::update_with_levels).
    pub fn update_visible_with_levels<'a>(
        &mut self,
        particles: impl Into<Particles<'a>>,
        mut visible: impl FnMut(&[[f64; 3]; 8]) -> bool,
        mut wish: impl FnMut(&Region) -> u8,
        sink: &mut impl Sink<K::Vertex>,
    ) -> Result<Frame, Error> {
        self.check_levels()?;
        let particles = particles.into();
        let axes = self.prepare(&particles, &mut |_| true)?;
        self.choose(axes.as_ref(), &mut visible, &mut wish);
        let varied = particles.reaches.is_some() || particles.strengths.is_some();
        if self.params.field == Metaball::Triquet && !varied {
            return self.march_levels(axes, &Radial::<_, false>(Triquet), sink);
        }
        self.march_levels(axes, &Radial::<_, true>(self.falloff()), sink)
    }

    /// As [`update_with_levels`](Self::update_with_levels), with a field of the user's in place of
    /// [`Params::field`](super::Params::field). Every node of every block is evaluated, at each level its own.
    ///
    /// # Errors
    /// As [`update_with_levels`](Self::update_with_levels).
    pub fn update_custom_with_levels<'a>(
        &mut self,
        particles: impl Into<Particles<'a>>,
        field: &impl CustomField,
        mut wish: impl FnMut(&Region) -> u8,
        sink: &mut impl Sink<K::Vertex>,
    ) -> Result<Frame, Error> {
        self.check_levels()?;
        let axes = self.prepare(&particles.into(), &mut |_| true)?;
        self.choose(axes.as_ref(), &mut |_| true, &mut wish);
        self.march_levels(axes, &Custom(field), sink)
    }

    /// What does not go with levels.
    fn check_levels(&self) -> Result<(), Error> {
        let refuse = |name, value: f64, must| Err(Error::Parameter { name, value, must });
        let [side, other, last] = self.params.block;
        if side != other || side != last {
            return refuse("block", if side == other { last } else { other } as f64, "a cube, with levels");
        }
        if self.params.seeds != Seeds::Complete {
            return refuse("seeds", f64::NAN, "Seeds::Complete, with levels");
        }
        if self.params.reuse != Reuse::Off {
            return refuse("reuse", f64::NAN, "Reuse::Off, with levels");
        }
        Ok(())
    }

    /// Lists the blocks with their levels, and which of them are hidden.
    fn choose(&mut self, axes: Option<&Axes>, visible: Visible<'_>, wish: Wish<'_>) {
        let side = self.params.block[0];
        let (coarsest, spacing) = (self.coarsest_level(), self.params.spacing);
        let rows = &mut self.detail.surface.rows;
        rows.side = side;
        let blocks = &self.blocks;
        rows.levels.take(
            blocks.blocks.iter().map(|block| {
                let corners = corners(axes, block.at, [side; 3], spacing);
                (block.at, blocks.around(block), wish(&Region::around(&corners)), !visible(&corners))
            }),
            coarsest,
        );
    }

    /// The surface of the blocks that were chosen, each at its level.
    fn march_levels(
        &mut self,
        axes: Option<Axes>,
        blend: &impl Blend,
        sink: &mut impl Sink<K::Vertex>,
    ) -> Result<Frame, Error> {
        let mut lap = Lap::new(self.clock);
        let side = self.params.block[0];
        let (shading, origin) = (self.shading(), self.origin([side as i32; 3]));
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
            clock: None,
        };
        let sight = self.sight(axes.as_ref());
        let mut frame = Frame {
            particles: self.placed.len(),
            particle_bytes: self.placed.len() * size_of::<Placed>() + self.blocks.bytes(),
            times: self.times,
            ..Frame::default()
        };
        sink.begin(from_axes(axes.as_ref(), origin.map(|n| f64::from(n) * scene.spacing)));
        let Detail { surface, pool, positions, normals, data, triangles } = &mut self.detail;
        fit_pool(pool);
        let source = Columned { unit: self.unit, scene: &scene, blocks: &self.blocks };
        surface.count(&source, scene.iso, pool)?;
        let place = Place { iso: scene.iso, origin, spacing: scene.spacing, axes };
        let all = surface.blocks();
        let batch = 8 * rayon::current_num_threads();
        let batches = || (0..all).step_by(batch).map(|first| first..all.min(first + batch));
        for blocks in batches() {
            let range = surface.vertices(&blocks);
            let (n, shaded) = (range.len(), |asked| if asked { range.len() } else { 0 });
            positions.resize(n, [0.0; 3]);
            normals.resize(shaded(shading.normals()), [0.0; 3]);
            data.resize(shaded(shading.data()), K::Vertex::default());
            let to = Vertices {
                positions: &mut positions[..],
                normals: shading.normals().then_some(&mut normals[..]),
                data: shading.data().then_some(&mut data[..]),
            };
            surface.write_vertices(blocks, &source, place, pool, to);
            let first_vertex = range.start;
            sink.append(Part { first_vertex, first_triangle: 0, positions, normals, data, triangles: &[] });
        }
        frame.vertices = surface.vertices(&(0..all)).len();
        for blocks in batches() {
            let range = surface.triangles(&blocks);
            triangles.resize(range.len(), [0; 3]);
            surface.write_triangles(blocks, sight, triangles);
            let (first_vertex, first_triangle) = (frame.vertices, range.start);
            sink.append(Part {
                first_vertex,
                first_triangle,
                positions: &[],
                normals: &[],
                data: &[],
                triangles: &triangles[..],
            });
        }
        frame.triangles = surface.triangles(&(0..all)).len();
        let levels = &surface.rows.levels;
        for (&level, _) in levels.level.iter().zip(&levels.hidden).filter(|&(_, &hidden)| !hidden) {
            frame.levels[usize::from(level)] += 1;
        }
        frame.blocks = frame.levels.iter().sum();
        let works = || pool.iter().map(|work| work.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
        let room = works().fold(Room::default(), |room, work| room.join(&work.scratch.room()));
        for mut work in works() {
            frame.counts.add(&std::mem::take(&mut work.scratch.counts));
            work.provide(side);
            work.scratch.provide(&room, side);
        }
        frame.seam_bytes = surface.bytes();
        sink.end()?;
        frame.times.surface = lap.next();
        Ok(frame)
    }
}

const _: () = assert!(ABSENT == crate::bricks::blocks::NOBODY, "neighbours are taken from blocks as they are");
