//! Marching cubes straight from a volume's samples, row by row, by bit masks and ranks.
//!
//! ```text
//! lattice    the volume's nodes, and one layer of absent nodes around them where the border is closed
//! axes       the one with the least stride runs along the rows; the others follow by stride
//! row        nodes (0.., j, k); its signs are bits in `u64` words: bit b of word w is node 64·w + b
//! cells      of a row: bit n of corner set c is the sign of corner c of cell n, from 4 rows and 4 shifted rows
//! crossings  along x, y, z: a row's signs xor the shifted row, row j + 1, row k + 1
//! vertices   row after row (k, then j); in a row those of x edges, y edges, z edges, cells; each by node
//! number     where the row's list begins + crossings in earlier words + rank among the bits before it
//! triangles  row after row, cell after cell
//! ```
//!
//! Where there is no crossing a sample is read once, compared in its own type, and forgotten. The order of vertices and
//! triangles is one of rows, not of bricks in Morton order as on the road from particles: a volume that comes slab by slab
//! from a file gives the same bytes without being held, and rows are how the samples lie in memory. Corner
//! sets, crossed cells, ranks and tables are those of [`super::cubes`]; one word of 64 nodes is a piece of a row here, a brick
//! there. A case number is bit n of the eight corner sets at once ([`Simd::bits_at`](crate::math::simd::Simd::bits_at)): a
//! row has few crossed cells, so transposing all 64, as bricks do, would not pay.
//!
//! Where samples come from is behind [`Rows`]: a [`Grid`] that the caller holds, or a [`function`] that is asked.
//!
//! Source: Lorensen & Cline 1987, Marching Cubes; counting before writing row by row is Schroeder, Maynard, Geveci, Flying
//! Edges: A High-Performance Scalable Isocontouring Algorithm, 2015; words of bits and ranks by population count in place
//! of its rows of bytes and running numbers are this project's.

pub(crate) mod classify;
pub(crate) mod count;
pub(crate) mod function;
pub(crate) mod normals;
pub(crate) mod places;
pub(crate) mod runs;
pub(crate) mod soup;
pub(crate) mod triangles;
pub(crate) mod vertices;

use super::resolve::{HARD, Level, Resolved, resolve};
use crate::field::volume::{Border, Cut, Scalar, Volume, determinant};

/// A relative value below every other: what an absent node has. Its fourth power is still a number.
pub(crate) const ABSENT: f64 = -1e75;

/// One surface: its isovalue, the isovalue's number, and how cells are resolved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Iso {
    pub(crate) number: usize,
    pub(crate) value: f64,
    pub(crate) level: Level,
}

impl Iso {
    /// Whether the table will not do for this case.
    #[inline(always)]
    pub(crate) fn is_hard(&self, case: u8) -> bool {
        HARD[self.level as usize][usize::from(case)]
    }

    /// Resolves the cell of a row at node `i`.
    #[inline(never)]
    pub(crate) fn resolve(&self, grid: &dyn Rows, row: usize, i: usize, case: u8) -> Resolved {
        let ny = grid.shape().nodes[1];
        resolve(case, &grid.corners([i, row % ny, row / ny], self.value), self.level)
    }
}

/// The lattice that is marched, whatever the type of its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shape {
    /// Nodes along each axis, those of the closed border included.
    pub(crate) nodes: [usize; 3],
    /// Absent layers before the first sample along each axis: 0 or 1.
    pub(crate) pad: [usize; 3],
    /// Step in the world along each axis.
    pub(crate) directions: [[f64; 3]; 3],
    /// Slabs of the whole volume before this window's first: of samples, or, where `pad` counts them along, of nodes.
    pub(crate) slabs_before: usize,
    /// Whether triangles of the tables must be turned round.
    pub(crate) is_left_handed: bool,
}

impl Shape {
    /// Words of a row.
    pub(crate) fn words(&self) -> usize {
        self.nodes[0].div_ceil(64)
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.nodes[1] * self.nodes[2]
    }

    /// Bits of word `w` whose node has a next one in the row: the places of x edges and cells.
    #[inline(always)]
    pub(crate) fn with_next(&self, w: usize) -> u64 {
        let n = (self.nodes[0] - 1).saturating_sub(64 * w);
        if n >= 64 { u64::MAX } else { (1 << n) - 1 }
    }

    /// Place of row (j, k), relative to the volume's origin: of its node 0.
    #[inline(always)]
    pub(crate) fn row_start(&self, row: usize) -> [f64; 3] {
        let (j, k) = (row % self.nodes[1], row / self.nodes[1] + self.slabs_before);
        let d = &self.directions;
        let [x, y, z] = [-(self.pad[0] as f64), j as f64 - self.pad[1] as f64, k as f64 - self.pad[2] as f64];
        std::array::from_fn(|a| x * d[0][a] + (y * d[1][a] + z * d[2][a]))
    }
}

impl Shape {
    /// A place within the cell at node `i` of a row that begins at `start`.
    pub(crate) fn in_cell(&self, start: &[f64; 3], i: usize, [x, y, z]: [f64; 3]) -> [f32; 3] {
        let (d, x) = (&self.directions, i as f64 + x);
        std::array::from_fn(|a| (start[a] + (x * d[0][a] + y * d[1][a] + z * d[2][a])) as f32)
    }
}

/// A volume with its axes sorted by stride.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'a, T> {
    pub(crate) shape: Shape,
    samples: &'a [T],
    mask: Option<&'a [bool]>,
    first: usize,
    strides: [isize; 3],
    /// Nodes with samples along each axis.
    dims: [usize; 3],
}

impl<'a, T: Scalar> Grid<'a, T> {
    /// The lattice of a whole volume, whose samples must be those given.
    pub(crate) fn new(volume: &Volume<'a>, samples: &'a [T]) -> Self {
        let mut axes = [0, 1, 2];
        // Stable: equal strides keep the caller's order.
        axes.sort_by_key(|&a| volume.strides()[a].unsigned_abs());
        let dims = axes.map(|a| volume.dims()[a]);
        let pad = usize::from(volume.border() == Border::Closed);
        let directions = axes.map(|a| volume.directions()[a]);
        Self {
            shape: Shape {
                nodes: dims.map(|d| d + 2 * pad),
                pad: [pad; 3],
                directions,
                slabs_before: 0,
                is_left_handed: determinant(directions) < 0.0,
            },
            samples,
            mask: volume.mask(),
            first: volume.element([0; 3]),
            strides: axes.map(|a| volume.strides()[a]),
            dims,
        }
    }

    /// Packed slabs that follow each other in a volume of this shape, of which the first is number `before`, as a window.
    pub(crate) fn window(samples: &'a [T], dims: [usize; 3], whole: &Shape, before: usize, last: bool) -> Self {
        let slabs = samples.len() / (dims[0] * dims[1]);
        let low = if before == 0 { whole.pad[2] } else { 0 };
        let high = if last { whole.pad[2] } else { 0 };
        Self {
            shape: Shape {
                nodes: [whole.nodes[0], whole.nodes[1], low + slabs + high],
                pad: [whole.pad[0], whole.pad[1], low],
                slabs_before: before,
                ..*whole
            },
            samples,
            mask: None,
            first: 0,
            strides: [1, dims[0] as isize, (dims[0] * dims[1]) as isize],
            dims: [dims[0], dims[1], slabs],
        }
    }

    /// The samples of row (j, k) of the lattice.
    #[inline(always)]
    pub(crate) fn row(&self, j: usize, k: usize, iso: f64) -> Row<'a, T> {
        let (y, z) = (j.wrapping_sub(self.shape.pad[1]), k.wrapping_sub(self.shape.pad[2]));
        let present = y < self.dims[1] && z < self.dims[2];
        let at = if present { y as isize * self.strides[1] + z as isize * self.strides[2] } else { 0 };
        Row {
            samples: self.samples,
            mask: self.mask,
            first: (self.first as isize + at) as usize,
            stride: self.strides[0],
            len: if present { self.dims[0] } else { 0 },
            pad: self.shape.pad[0],
            iso,
        }
    }
}

/// The samples of one row; none where the row belongs to the border.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a, T> {
    samples: &'a [T],
    mask: Option<&'a [bool]>,
    first: usize,
    stride: isize,
    len: usize,
    pad: usize,
    iso: f64,
}

impl<T: Scalar> Row<'_, T> {
    /// Element of sample `x`, which must be below the row's length.
    #[inline(always)]
    fn element(&self, x: usize) -> usize {
        (self.first as isize + x as isize * self.stride) as usize
    }

    /// Sample of lattice node `i`, if it has one.
    #[inline(always)]
    pub(crate) fn sample(&self, i: usize) -> Option<&T> {
        let x = i.wrapping_sub(self.pad);
        if x < self.len { self.samples.get(self.element(x)) } else { None }
    }

    /// The same, unless the mask says that it is absent.
    #[inline(always)]
    pub(crate) fn present(&self, i: usize) -> Option<T> {
        let x = i.wrapping_sub(self.pad);
        if x >= self.len {
            return None;
        }
        let element = self.element(x);
        if self.mask.is_some_and(|present| !present[element]) { None } else { Some(self.samples[element]) }
    }

    /// Value of lattice node `i` minus the isovalue: [`ABSENT`] where it is absent, and never further from 0 than that.
    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> f64 {
        relative(self.value(i), self.iso)
    }

    /// The same row, if its samples lie side by side and all are present.
    #[inline(always)]
    pub(crate) fn packed(&self) -> Option<Packed<'_, T>> {
        if self.len == 0 {
            return Some(Packed { samples: &[], pad: self.pad });
        }
        if self.stride != 1 || self.mask.is_some() {
            return None;
        }
        Some(Packed { samples: &self.samples[self.first..self.first + self.len], pad: self.pad })
    }
}

/// Samples of a row, side by side.
#[derive(Clone, Copy)]
pub(crate) struct Packed<'a, T> {
    samples: &'a [T],
    pad: usize,
}

/// Values at the nodes of a row.
pub(crate) trait Values {
    /// Value of lattice node `i`; NaN where it is absent.
    fn value(&self, i: usize) -> f64;
}

impl<T: Scalar> Values for Row<'_, T> {
    #[inline(always)]
    fn value(&self, i: usize) -> f64 {
        match self.present(i) {
            Some(sample) => sample.to_f64(),
            None => f64::NAN,
        }
    }
}

impl<T: Scalar> Values for Packed<'_, T> {
    #[inline(always)]
    fn value(&self, i: usize) -> f64 {
        match self.samples.get(i.wrapping_sub(self.pad)) {
            Some(sample) => sample.to_f64(),
            None => f64::NAN,
        }
    }
}

/// A value minus the isovalue: [`ABSENT`] for NaN, and never further from 0 than that.
#[inline(always)]
pub(crate) fn relative(value: f64, iso: f64) -> f64 {
    let relative = value - iso;
    if relative.is_nan() { ABSENT } else { relative.clamp(ABSENT, -ABSENT) }
}

/// What the stages ask of a grid whose type of samples they do not know.
pub(crate) trait Rows: Send + Sync {
    fn shape(&self) -> &Shape;

    /// Relative values of the eight corners of the cell whose lowest node is given.
    fn corners(&self, node: [usize; 3], iso: f64) -> [f64; 8];

    /// Place of a vertex at part `t` of the edge from a node along an axis; `start` is that of the node's row.
    fn on_edge(&self, start: &[f64; 3], [i, ..]: [usize; 3], axis: usize, t: f64) -> [f32; 3] {
        let d = &self.shape().directions;
        vertices::place(start, i as i32, &d[0], t, &d[axis])
    }

    /// Place of a vertex within the cell whose lowest node is given; `start` is that of the node's row.
    fn in_cell(&self, start: &[f64; 3], [i, ..]: [usize; 3], at: [f64; 3]) -> [f32; 3] {
        self.shape().in_cell(start, i, at)
    }

    /// See [`classify::Classify`].
    fn classify(&self, task: classify::Classify<'_>);

    /// See [`vertices::Vertices`].
    fn vertices(&self, task: vertices::Vertices<'_>);

    /// See [`vertices::Fresh`]; no vertices where the surface is dense, or where they cannot be had.
    fn fresh(&self, _task: vertices::Fresh<'_>) -> Vec<[f32; 3]> {
        Vec::new()
    }

    /// See [`normals::Normals`].
    fn normals(&self, task: normals::Normals<'_>);
}

impl<T: Scalar> Rows for Grid<'_, T> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn corners(&self, [i, j, k]: [usize; 3], iso: f64) -> [f64; 8] {
        let rows: [Row<'_, T>; 4] = std::array::from_fn(|r| self.row(j + (r & 1), k + (r >> 1), iso));
        std::array::from_fn(|c| rows[c >> 1].get(i + (c & 1)))
    }

    fn classify(&self, task: classify::Classify<'_>) {
        let cuts = task.isos.iter().map(|&iso| T::cut(iso)).collect::<Vec<Cut<T>>>();
        task.unit.run(classify::Typed { grid: self, cuts: &cuts, task });
    }

    fn vertices(&self, task: vertices::Vertices<'_>) {
        task.unit.run(vertices::Typed { grid: self, task });
    }

    fn fresh(&self, task: vertices::Fresh<'_>) -> Vec<[f32; 3]> {
        task.unit.run(vertices::TypedFresh { grid: self, task })
    }

    fn normals(&self, task: normals::Normals<'_>) {
        task.run(self);
    }
}
