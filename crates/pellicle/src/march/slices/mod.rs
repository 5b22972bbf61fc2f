//! Marching slices: the surface of one block, slab by slab, with what is known of a few slices at a time.
//!
//! ```text
//! slice z + 1   ┌──┬──┬──┐   values, signs, vertex numbers of its nodes
//! slab z        │  │  │  │   cubes to do: one bit each
//! slice z       └──┴──┴──┘
//! ```
//!
//! The lowest slab with something to do is done first. A cube is visited once; its eight corners are looked up or
//! evaluated; if it is crossed, its triangles are made, whose vertices are found through the slices' bits. A slice is
//! given back when neither the slab above nor that below can need it any more.
//!
//! From every particle the march steps down to the surface, then follows it from cube to cube, through a margin of cubes
//! around the block of which only signs are evaluated. It misses what no particle stands above: cavities, and surfaces that
//! run where no particle is. What misses nothing is [`layers`](super::layers), to which the shared vocabulary of both
//! belongs, too: the scene, the piece, seams, order, skins and fields.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, section 4, algorithm 1. Slices of
//! bits are this project's.

mod blend;
mod cells;
mod counts;
mod custom;
mod order;
mod seam;
mod seeds;
mod skin;
mod slabs;
mod slice;

pub(crate) use blend::{Blend, Radial};
pub(crate) use counts::Lap;
pub use counts::{Clock, Counts, Times};
pub(crate) use custom::Custom;
pub use custom::CustomField;
pub use order::{DrawOrder, Sorting};
pub(crate) use order::{Sight, next};
pub(crate) use seam::{Owner, Reference, Seam};
pub use skin::{Neighbour, Neighbours, Plain, Skin};
pub(crate) use slice::{Rows, Todo, WIDEST};

use crate::{
    lattice::Coord,
    lookup::columns::{Border, Columns, Extent, Near, Placed, Room},
    math::{
        simd::{Kernel, Simd},
        vector::{Axes, from_axes},
    },
};
use slabs::Slabs;
use slice::{ABOVE, BELOW, Pool};

/// Most cells of a block along an axis, margin included.
pub(crate) const MOST_CELLS: usize = WIDEST - 1;

/// How the march finds what there is to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Seeds {
    /// All of the surface, for certain.
    #[default]
    Complete,
    /// What is connected to the first crossing below a particle: the published method, which can miss parts.
    Particles,
}

/// The surface of one block: its own vertices, and triangles that may refer to vertices of blocks before it.
pub(crate) struct Piece<V> {
    /// Offsets from the mesh's origin in world units.
    pub(crate) positions: Vec<[f32; 3]>,
    /// Unit normals, outward, if asked for.
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) data: Vec<V>,
    /// Own vertices by number; with [`FOREIGN`] set, places in `foreign`.
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) foreign: Vec<Reference>,
    /// Key and number of own vertices that later blocks may refer to, in order of keys.
    pub(crate) shared: Vec<(u32, u32)>,
    /// Own vertices that were taken away already, before those that are here.
    pub(crate) drained: usize,
    pub(crate) counts: Counts,
    pub(crate) times: Times,
}

/// Takes what a piece has so far of vertices and triangles, by [`Piece::drain`].
pub(crate) type Drain<'a, V> = dyn FnMut(&mut Piece<V>) + 'a;

/// Marks a vertex of another block.
pub(crate) const FOREIGN: u32 = 1 << 31;

impl<V> Default for Piece<V> {
    fn default() -> Self {
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            data: Vec::new(),
            triangles: Vec::new(),
            foreign: Vec::new(),
            shared: Vec::new(),
            drained: 0,
            counts: Counts::default(),
            times: Times::default(),
        }
    }
}

impl<V> Piece<V> {
    /// Bytes of vertices, triangles and references.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.data[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.foreign[..])
            + size_of_val(&self.shared[..])
    }

    /// Forgets the vertices and triangles that are here; later ones go on counting.
    pub(crate) fn drain(&mut self) {
        self.drained += self.positions.len();
        self.positions.clear();
        self.normals.clear();
        self.data.clear();
        self.triangles.clear();
    }

    pub(crate) fn clear(&mut self) {
        self.drain();
        self.drained = 0;
        self.foreign.clear();
        self.shared.clear();
        self.counts = Counts::default();
        self.times = Times::default();
    }
}

/// What one thread needs to march: kept between blocks and frames.
pub(crate) struct Work<C> {
    columns: Columns,
    near: Near,
    pool: Pool<C>,
    todo: Vec<Todo>,
    slopes: Vec<f32>,
    slabs: Slabs,
    needs: Needs,
}

impl<C: Copy + Default> Default for Work<C> {
    fn default() -> Self {
        Self {
            columns: Columns::default(),
            near: Near::default(),
            pool: Pool::default(),
            todo: Vec::new(),
            slopes: Vec::new(),
            slabs: Slabs::default(),
            needs: Needs::default(),
        }
    }
}

/// How much room the largest block so far needed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    columns: Room,
    cells: [usize; 3],
    slices: usize,
    slabs: slabs::Room,
    shaded: bool,
}

impl Needs {
    /// Room for both.
    pub(crate) fn join(&self, other: &Self) -> Self {
        Self {
            columns: self.columns.join(&other.columns),
            cells: std::array::from_fn(|a| self.cells[a].max(other.cells[a])),
            slices: self.slices.max(other.slices),
            slabs: self.slabs.join(&other.slabs),
            shaded: self.shaded || other.shaded,
        }
    }
}

impl<C: Copy + Default> Work<C> {
    /// The most that any block needed here.
    pub(crate) fn needs(&self) -> Needs {
        self.needs
    }

    /// Makes room, so that whichever thread gets the largest block allocates nothing.
    pub(crate) fn provide(&mut self, needs: &Needs) {
        if self.needs == *needs {
            return;
        }
        self.needs = *needs;
        self.columns.provide(&needs.columns);
        self.near.provide(needs.columns.longest);
        let nodes = (needs.cells[0] + 1) * (needs.cells[1] + 1);
        self.pool.provide(needs.slices, nodes, if needs.shaded { nodes } else { 0 });
        self.todo.resize_with(needs.cells[2].max(self.todo.len()), Todo::default);
        self.slopes.resize(needs.columns.longest.max(self.slopes.len()), 0.0);
        self.slabs.provide(&needs.slabs);
    }
}

/// What is the same for all blocks.
pub(crate) struct Scene<'a, B, K> {
    pub(crate) blend: &'a B,
    pub(crate) skin: &'a K,
    pub(crate) iso: f32,
    pub(crate) seeds: Seeds,
    pub(crate) shading: Shading,
    pub(crate) particles: &'a [Placed],
    /// Node that positions count from.
    pub(crate) origin: Coord,
    /// Distance of neighbouring nodes in world units.
    pub(crate) spacing: f64,
    /// The lattice's axes in the world, a rotation, where they are not the world's own.
    pub(crate) axes: Option<Axes>,
    pub(crate) clock: Option<Clock>,
}

impl<B, K> Scene<'_, B, K> {
    /// Turns a vector from the lattice's axes to the world's.
    #[inline(always)]
    pub(crate) fn to_world(&self, v: [f64; 3]) -> [f64; 3] {
        from_axes(self.axes.as_ref(), v)
    }

    /// Offset from the mesh's origin in world units of a place in cells from there.
    #[inline(always)]
    pub(crate) fn world_position(&self, at: [f64; 3]) -> [f32; 3] {
        self.to_world(at.map(|v| v * self.spacing)).map(|v| v as f32)
    }

    /// Unit normal at `t` of the way between two corners with these outward vectors.
    #[inline(always)]
    pub(crate) fn normal_between(&self, a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
        let mixed = [0, 1, 2].map(|i| a[i] + t * (b[i] - a[i]));
        let length = (mixed[0] * mixed[0] + mixed[1] * mixed[1] + mixed[2] * mixed[2]).sqrt();
        let per_length = 1.0 / length.max(f32::MIN_POSITIVE);
        let normal = mixed.map(|v| v * per_length);
        if self.axes.is_some() { self.to_world(normal.map(f64::from)).map(|v| v as f32) } else { normal }
    }
}

/// What vertices get besides their position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shading {
    None,
    Normals,
    /// User data alone.
    Data,
    NormalsAndData,
}

impl Shading {
    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self != Self::None
    }

    #[inline(always)]
    pub(crate) fn normals(self) -> bool {
        matches!(self, Self::Normals | Self::NormalsAndData)
    }

    #[inline(always)]
    pub(crate) fn data(self) -> bool {
        matches!(self, Self::Data | Self::NormalsAndData)
    }
}

/// The march through one block, with the work of either way: slices', or [layers'](super::layers).
pub(crate) struct March<'a, B, K: Skin, W> {
    pub(crate) scene: &'a Scene<'a, B, K>,
    /// First node of the block, its margin left out: a multiple of 4 along each axis.
    pub(crate) first: Coord,
    pub(crate) seam: Seam,
    pub(crate) sight: Option<Sight>,
    /// The block's particles.
    pub(crate) members: &'a [u32],
    pub(crate) work: &'a mut W,
    pub(crate) piece: &'a mut Piece<K::Vertex>,
    /// Called again and again while the block is marched, by a complete search, where nobody needs its surface as a whole.
    pub(crate) drain: Option<&'a mut Drain<'a, K::Vertex>>,
}

impl<B: Blend, K: Skin> Kernel for March<'_, B, K, Work<K::Corner>> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        self.piece.clear();
        let mut lap = Lap::new(self.scene.clock);
        let margin = self.seam.margin;
        let extent = Extent {
            first: self.first.map(|n| n - margin as i32),
            nodes: self.seam.cells.map(|cells| cells + 2 * margin + 1),
        };
        self.work.columns.build(extent, Border::Empty, self.scene.particles, self.members, B::WANT.varied);
        self.work.columns.prepare(&mut self.work.near);
        self.piece.times.enter = lap.next();
        let nodes = extent.nodes[0] * extent.nodes[1];
        let shaded = if self.scene.shading == Shading::None { 0 } else { nodes };
        self.work.pool.begin(nodes, shaded);
        let slabs = extent.nodes[2] - 1;
        self.work.todo.resize_with(slabs.max(self.work.todo.len()), Todo::default);
        (self.work.near.seen, self.work.near.kept) = (0, 0);
        self.work.slabs.clear();
        self.seed(s, extent);
        self.piece.times.seed = lap.next();
        while let Some(z) = self.work.todo[..slabs].iter().position(|todo| !todo.is_empty()) {
            self.work.pool.ensure(z);
            self.work.pool.ensure(z + 1);
            self.march_slab(s, extent, z);
            for slice in [z, z + 1] {
                let needed = |slab: usize| slab < slabs && !self.work.todo[slab].is_empty();
                if !(needed(slice) || slice > 0 && needed(slice - 1)) {
                    self.work.pool.release(slice);
                }
            }
        }
        let needs = Needs {
            columns: self.work.columns.room(),
            cells: extent.nodes.map(|n| n - 1),
            slices: self.work.pool.most,
            slabs: self.work.slabs.room(),
            shaded: shaded > 0,
        };
        self.work.needs = self.work.needs.join(&needs);
        self.work.slabs.write(&mut self.piece.triangles);
        self.finish(slabs);
        self.piece.times.march = lap.next();
    }
}

impl<B: Blend, K: Skin> March<'_, B, K, Work<K::Corner>> {
    /// Puts what later blocks look for in order, and counts.
    fn finish(&mut self, slabs: usize) {
        self.piece.shared.sort_unstable();
        let (work, counts) = (&*self.work, &mut self.piece.counts);
        counts.contributions = work.near.kept;
        counts.looked_at = work.near.seen;
        counts.entries = work.columns.entries() as u64;
        counts.live_slices = work.pool.most as u64;
        counts.render_bytes = (work.pool.bytes() + slabs * size_of::<Todo>() + work.slabs.bytes()) as u64;
        counts.cache_bytes = work.columns.bytes() as u64;
    }

    /// Visits all cubes of slab `z` that are to be done, and those that they lead to within the slab.
    #[inline(always)]
    fn march_slab<S: Simd>(&mut self, s: S, extent: Extent, z: usize) {
        while let Some((x, y)) = order::next(&mut self.work.todo[z], self.sight.as_ref()) {
            let [lower, upper] = self.work.pool.pair(z);
            if (lower.done[ABOVE][y] | upper.done[BELOW][y]) >> x & 1 != 0 {
                continue;
            }
            lower.done[ABOVE][y] |= 1 << x;
            upper.done[BELOW][y] |= 1 << x;
            for row in [y, y + 1] {
                lower.touch(row);
                upper.touch(row);
            }
            self.evaluate_corners(s, extent, [x, y, z]);
            self.piece.counts.visited += 1;
            let case = self.case([x, y, z]);
            if case == 0 || case == 255 {
                continue;
            }
            let (low, high) = (self.seam.margin, self.seam.cells);
            if (0..3).all(|a| [x, y, z][a].wrapping_sub(low) < high[a]) {
                self.make_triangles(s, extent, [x, y, z], case);
            }
            self.push_neighbours(extent, [x, y, z], case);
        }
    }
}
