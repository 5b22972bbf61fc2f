//! Road B with a cell size for each block: particles → blocks → levels → columns → cells and transition cells → sink.
//!
//! Vertices of a block may be those of blocks that come later, so all vertices go to the sink before all triangles; both in
//! the order of blocks.

use super::{Blend, Engine, Frame, MOST_LEVELS, Part, Scene, Sink, Skin};
use crate::{
    Error,
    bricks::levels::ABSENT,
    lattice::Coord,
    march::{
        levels::{Columned, Place, Pool, Scratch, Surface, Vertices, fit_pool},
        slices::Seeds,
    },
};

/// The part of the world that a block takes, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Its lowest corner.
    pub low: [f64; 3],
    /// Its highest corner.
    pub high: [f64; 3],
}

impl Region {
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

impl<K: Skin> Engine<K> {
    /// The coarsest level that blocks can have: their size must be a multiple of the coarsest cell.
    pub fn coarsest_level(&self) -> u8 {
        let size = self.params.block.iter().map(|n| n.trailing_zeros()).min().unwrap_or(0);
        size.min(MOST_LEVELS as u32 - 1) as u8
    }

    /// Lists the blocks with their levels.
    fn choose(&mut self, wish: Wish<'_>) -> Result<(), Error> {
        let [side, ..] = self.params.block;
        if self.params.block != [side; 3] {
            let value = self.params.block[1] as f64;
            return Err(Error::Parameter { name: "block", value, must: "the same along each axis, with levels" });
        }
        if self.params.seeds != Seeds::Complete {
            let must = "Seeds::Complete, with levels";
            return Err(Error::Parameter { name: "seeds", value: f64::NAN, must });
        }
        let (coarsest, spacing) = (self.coarsest_level(), self.params.spacing);
        let place = |at: Coord| at.map(|v| f64::from(v) * side as f64 * spacing);
        let rows = &mut self.detail.surface.rows;
        rows.side = side;
        let blocks = &self.blocks;
        rows.levels.take(
            blocks.blocks.iter().map(|block| {
                let region = Region { low: place(block.at), high: place(block.at.map(|v| v + 1)) };
                (block.at, blocks.around(block), wish(&region))
            }),
            coarsest,
        );
        Ok(())
    }

    /// The surface of the blocks in `scene`, each at its level.
    pub(super) fn march_levels(
        &mut self,
        blend: &impl Blend,
        wish: Wish<'_>,
        origin: Coord,
        sink: &mut impl Sink<K::Vertex>,
        mut frame: Frame,
    ) -> Result<Frame, Error> {
        self.choose(wish)?;
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
        };
        let Detail { surface, pool, positions, normals, data, triangles } = &mut self.detail;
        fit_pool(pool);
        let source = Columned { unit: self.unit, scene: &scene, blocks: &self.blocks };
        surface.count(&source, scene.iso, pool)?;
        let place = Place { iso: scene.iso, origin, spacing: scene.spacing };
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
            surface.write_triangles(blocks, triangles);
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
        for level in &surface.rows.levels.level {
            frame.levels[usize::from(*level)] += 1;
        }
        for work in pool {
            let work = work.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
            frame.counts.add(&std::mem::take(&mut work.scratch.counts));
        }
        frame.seam_bytes = surface.bytes();
        Ok(frame)
    }
}

const _: () = assert!(ABSENT == crate::bricks::blocks::NOBODY, "neighbours are taken from blocks as they are");
