//! Rows of a function's values: asked for where they are wanted, kept nowhere.
//!
//! Every node is asked once for its sign, in tiles of 8 × 8 nodes of a slab, so that a function that looks for what is near
//! looks once a tile. What lies at a crossing is asked again when it is written: two nodes a vertex, eight an ambiguous cell.
//! On the same lattice, vertices are bit for bit those of a volume that holds the values in double precision.
//!
//! Normals are the function's own gradient's; on a cap, where an edge leads to an absent node, that of the border.
//!
//! Source: this project.

use super::{
    ABSENT, Rows, Shape,
    classify::Classify,
    count::{Cases, corner_words, four_rows},
    normals::Normals,
    vertices::{Vertices, place, write_inner},
};
use crate::{
    Border, Domain, Function,
    field::function::outward,
    march::{
        cubes::count::crossed_cells,
        resolve::{Level, crossing, inner_place},
    },
    math::{bits::ones, simd::Portable, vector::cross},
};

/// Nodes along each side of a tile.
const TILE: usize = 8;
/// Places that the function is asked for at once.
const RUN: usize = TILE * TILE;

/// A function on slabs of a domain's lattice.
#[derive(Clone, Copy)]
pub(crate) struct FunctionRows<'a> {
    shape: Shape,
    function: &'a dyn Function,
    domain: Domain<'a>,
    /// World position that vertices count from.
    origin: [f64; 3],
}

impl<'a> FunctionRows<'a> {
    /// All slabs.
    pub(crate) fn new(function: &'a dyn Function, domain: &Domain<'a>) -> Self {
        let pad = usize::from(domain.border == Border::Closed);
        let along = |a: usize| std::array::from_fn(|b| if a == b { domain.spacing[a] } else { 0.0 });
        let shape = Shape {
            nodes: domain.cells.map(|n| n + 1 + 2 * pad),
            pad: [pad; 3],
            directions: [along(0), along(1), along(2)],
            slabs_before: 0,
            is_left_handed: domain.is_left_handed(),
        };
        Self { shape, function, domain: *domain, origin: domain.mesh_origin() }
    }

    /// `slabs` of them, from number `first` on.
    pub(crate) fn window(&self, first: usize, slabs: usize) -> Self {
        let nodes = [self.shape.nodes[0], self.shape.nodes[1], slabs];
        Self { shape: Shape { nodes, slabs_before: first, ..self.shape }, ..*self }
    }

    /// World position that vertices count from.
    pub(crate) fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// A node in units of the domain's cells.
    fn in_domain(&self, [i, j, k]: [usize; 3]) -> [f64; 3] {
        let [x, y, z] = self.shape.pad;
        [i as f64 - x as f64, j as f64 - y as f64, (k + self.shape.slabs_before) as f64 - z as f64]
    }

    /// Whether the function is asked at a node: it is no node of the closed border.
    fn is_asked(&self, [i, j, k]: [usize; 3]) -> bool {
        let at = [i, j, k + self.shape.slabs_before];
        (0..3).all(|a| at[a].wrapping_sub(self.shape.pad[a]) <= self.domain.cells[a])
    }

    /// Values at nodes, no more than [`RUN`]; NaN where the function is not asked.
    fn values(&self, nodes: &[[usize; 3]], to: &mut [f64]) {
        let (mut world, mut found, mut len) = ([[0.0; 3]; RUN], [0.0; RUN], 0);
        for &node in nodes {
            if self.is_asked(node) {
                world[len] = self.domain.to_world(self.in_domain(node));
                len += 1;
            }
        }
        if len > 0 {
            self.function.values(&world[..len], &mut found[..len]);
        }
        let mut found = found[..len].iter();
        for (&node, to) in nodes.iter().zip(to) {
            *to = if self.is_asked(node) { found.next().copied().unwrap_or(f64::NAN) } else { f64::NAN };
        }
    }

    /// The same, relative to the isovalue, as rows of samples have them.
    fn relative(&self, nodes: &[[usize; 3]], iso: f64, to: &mut [f64]) {
        self.values(nodes, to);
        for to in to {
            let relative = *to - iso;
            *to = if relative.is_nan() { ABSENT } else { relative.clamp(ABSENT, -ABSENT) };
        }
    }

    /// Calls `each` with the crossed edges of a row from its nodes on along all axes, in order: their lower nodes, and
    /// the relative values of both ends.
    fn for_edges(&self, rows: &[Option<&[u64]>; 4], row: usize, iso: f64, each: &mut dyn FnMut(usize, Edge)) {
        let [Some(own), ..] = *rows else { return };
        let [_, ny, _] = self.shape.nodes;
        let (mut nodes, mut ends) = ([[0; 3]; RUN], [0.0; RUN]);
        for axis in 0..3 {
            // A row that is missing is replaced by the row itself: no crossing leads there.
            let beyond = if axis == 0 { own } else { rows[axis].unwrap_or(own) };
            let mut len = 0;
            let mut hand_out = |nodes: &[[usize; 3]]| {
                self.relative(nodes, iso, &mut ends[..nodes.len()]);
                for (pair, ends) in nodes.as_chunks::<2>().0.iter().zip(ends.as_chunks::<2>().0) {
                    each(axis, Edge { node: pair[0], ends: *ends });
                }
            };
            for w in 0..own.len() {
                let next = if axis == 0 { own[w] >> 1 | own.get(w + 1).unwrap_or(&0) << 63 } else { beyond[w] };
                let among = if axis == 0 { self.shape.with_next(w) } else { u64::MAX };
                for bit in ones((own[w] ^ next) & among) {
                    let node = [64 * w + bit, row % ny, row / ny];
                    let mut end = node;
                    end[axis] += 1;
                    (nodes[len], nodes[len + 1]) = (node, end);
                    len += 2;
                    if len == RUN {
                        hand_out(&nodes);
                        len = 0;
                    }
                }
            }
            hand_out(&nodes[..len]);
        }
    }

    /// Normal of the surface where it crosses an edge.
    fn edge_normal(&self, axis: usize, Edge { node, ends }: &Edge) -> [f32; 3] {
        let step = self.domain.small_step();
        let mut at = self.in_domain(*node);
        at[axis] += crossing(ends[0], ends[1]);
        let world = self.domain.to_world(at);
        if ends[0] != ABSENT && ends[1] != ABSENT {
            return outward(self.function.gradient(world, step));
        }
        // A cap: along the border's plane, away from the end that is present.
        let moved = |a: usize, by: f64| {
            let to = self.domain.to_world(std::array::from_fn(|b| at[b] + if a == b { by } else { 0.0 }));
            std::array::from_fn::<f64, 3, _>(|i| to[i] - world[i])
        };
        let (u, v) = (moved((axis + 1) % 3, 1e-3), moved((axis + 2) % 3, 1e-3));
        let (normal, away) = (cross(u, v), moved(axis, if ends[1] == ABSENT { 1e-3 } else { -1e-3 }));
        let along: f64 = (0..3).map(|a| normal[a] * away[a]).sum();
        outward(normal.map(|n| if along > 0.0 { -n } else { n }))
    }
}

/// A crossed edge: its lower node, and the relative values of both ends.
struct Edge {
    node: [usize; 3],
    ends: [f64; 2],
}

impl Rows for FunctionRows<'_> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn corners(&self, [i, j, k]: [usize; 3], iso: f64) -> [f64; 8] {
        let nodes: [[usize; 3]; 8] = std::array::from_fn(|c| [i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]);
        let mut values = [0.0; 8];
        self.relative(&nodes, iso, &mut values);
        values
    }

    fn on_edge(&self, start: &[f64; 3], node: [usize; 3], axis: usize, t: f64) -> [f32; 3] {
        if self.domain.warp.is_none() {
            let d = &self.shape.directions;
            return place(start, node[0] as i32, &d[0], t, &d[axis]);
        }
        let mut at = self.in_domain(node);
        at[axis] += t;
        self.warped(at)
    }

    fn in_cell(&self, start: &[f64; 3], node: [usize; 3], at: [f64; 3]) -> [f32; 3] {
        if self.domain.warp.is_none() {
            return self.shape.in_cell(start, node[0], at);
        }
        let node = self.in_domain(node);
        self.warped(std::array::from_fn(|a| node[a] + at[a]))
    }

    fn classify(&self, task: Classify<'_>) {
        let ([nx, ny, _], words) = (self.shape.nodes, self.shape.words());
        let per_row = words * task.isos.len();
        let mut first = task.rows.start;
        task.to.fill(0);
        while first < task.rows.end {
            // Tiles do not reach from slab to slab.
            let rows = TILE.min(ny - first % ny).min(task.rows.end - first);
            for x in (0..nx).step_by(TILE) {
                let (wide, mut nodes, mut values) = (TILE.min(nx - x), [[0; 3]; RUN], [0.0; RUN]);
                for n in 0..wide * rows {
                    let row = first + n / wide;
                    nodes[n] = [x + n % wide, row % ny, row / ny];
                }
                self.values(&nodes[..wide * rows], &mut values[..wide * rows]);
                for (row, values) in values[..wide * rows].chunks_exact(wide).enumerate() {
                    let to = &mut task.to[(first + row - task.rows.start) * per_row..][..per_row];
                    for (&iso, to) in task.isos.iter().zip(to.chunks_exact_mut(words)) {
                        // A tile's nodes share a word: 64 is a multiple of its side.
                        for (i, &value) in values.iter().enumerate() {
                            to[x / 64] |= u64::from(value > iso) << (x % 64 + i);
                        }
                    }
                }
            }
            first += rows;
        }
    }

    fn vertices(&self, task: Vertices<'_>) {
        let Vertices { signs, counted, iso, rows, mut to, .. } = task;
        for row in rows {
            if counted.place(row).vertices[0] == counted.place(row + 1).vertices[0] {
                continue;
            }
            let four = four_rows(&self.shape, signs, iso.number, row);
            let start = self.shape.row_start(row);
            self.for_edges(&four, row, iso.value, &mut |axis, Edge { node, ends }| {
                if let Some(to) = to.split_off_first_mut() {
                    *to = self.on_edge(&start, node, axis, crossing(ends[0], ends[1]));
                }
            });
            if let (true, [Some(own), Some(y), Some(z), Some(yz)]) = (iso.level != Level::Classic, four) {
                write_inner(self, iso, row, &[own, y, z, yz], &mut to);
            }
        }
    }

    fn normals(&self, task: Normals<'_>) {
        let (step, ny) = (self.domain.small_step(), self.shape.nodes[1]);
        let iso = task.iso;
        let mut to = task.to.iter_mut();
        for row in task.rows {
            let four = four_rows(&self.shape, task.signs, iso.number, row);
            self.for_edges(&four, row, iso.value, &mut |axis, edge| {
                if let Some(to) = to.next() {
                    *to = self.edge_normal(axis, &edge);
                }
            });
            let (true, [Some(own), Some(y), Some(z), Some(yz)]) = (iso.level != Level::Classic, four) else { continue };
            for w in 0..own.len() {
                let corners = corner_words(&[own, y, z, yz], w);
                let mut cells = Cases::new(Portable, &corners, crossed_cells(&corners) & self.shape.with_next(w));
                while let Some((cell, case)) = cells.next() {
                    if !iso.is_hard(case) {
                        continue;
                    }
                    let node = [64 * w + cell, row % ny, row / ny];
                    let (resolved, values) = (iso.resolve(self, row, node[0], case), self.corners(node, iso.value));
                    for (&edges, to) in resolved.inner[..resolved.inner_len].iter().zip(&mut to) {
                        let (low, inner) = (self.in_domain(node), inner_place(edges, &values));
                        let world = self.domain.to_world(std::array::from_fn(|a| low[a] + inner[a]));
                        *to = outward(self.function.gradient(world, step));
                    }
                }
            }
        }
    }
}

impl FunctionRows<'_> {
    /// A place in units of cells, from the mesh's origin.
    fn warped(&self, at: [f64; 3]) -> [f32; 3] {
        let world = self.domain.to_world(at);
        std::array::from_fn(|a| (world[a] - self.origin[a]) as f32)
    }
}
