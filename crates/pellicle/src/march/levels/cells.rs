//! Triangles of a block: those of its cells, then those of the transition cells on its faces to finer blocks.
//!
//! Source: this project; transition cells are Lengyel 2010, see [`super`].

use super::rows::{Rows, case};
use crate::{
    bricks::levels::offset_index,
    march::tables::{
        CASES, COUNTS, edge_corner,
        transition::{EDGES, TRANSITIONS, Transition, edge_ends},
    },
    math::bits::ones,
};

/// A face of a coarse block beyond which a block is finer.
pub(super) struct Face {
    coarse: usize,
    fine: usize,
    /// The two axes in it and its own: u, v, w are right-handed.
    pub(super) axes: [usize; 3],
    /// Where the face lies along w, in each block's nodes.
    plane: [usize; 2],
    /// Whether the fine block lies below: then w, from coarse to fine, points against its axis, and triangles turn round.
    pub(super) below: bool,
}

impl Face {
    /// Face `face` = 2·axis + side of a block.
    pub(super) fn new(rows: &Rows, coarse: usize, face: usize) -> Option<Self> {
        let (axis, below) = (face / 2, face & 1 == 0);
        let mut d = [0; 3];
        d[axis] = if below { -1 } else { 1 };
        let fine = rows.levels.neighbour(coarse, offset_index(d))?;
        let plane = if below { [0, rows.cells(fine)] } else { [rows.cells(coarse), 0] };
        Some(Self { coarse, fine, axes: [(axis + 1) % 3, (axis + 2) % 3, axis], plane, below })
    }

    /// The fine node at (u, v) on the face, in the fine block; or, with `level` 0, the coarse one in the coarse block.
    #[inline(always)]
    fn node(&self, level: usize, u: usize, v: usize) -> [usize; 3] {
        let mut at = [0; 3];
        at[self.axes[0]] = u;
        at[self.axes[1]] = v;
        at[self.axes[2]] = self.plane[level];
        at
    }

    /// The case of the transition cell on coarse face cell (u, v).
    #[inline(always)]
    pub(super) fn case(&self, rows: &Rows, u: usize, v: usize) -> usize {
        let view = rows.view(self.fine);
        (0..9).fold(0, |set, n| set | usize::from(view.inside(self.node(1, 2 * u + n % 3, 2 * v + n / 3))) << n)
    }

    /// Number of the vertex on an edge of that cell.
    #[inline(always)]
    fn vertex(&self, rows: &Rows, u: usize, v: usize, edge: usize) -> u32 {
        let (along_v, low) = edge_ends(edge);
        let axis = self.axes[usize::from(along_v)];
        match low {
            0..9 => rows.vertex(self.fine, axis, self.node(1, 2 * u + low % 3, 2 * v + low / 3)),
            _ => rows.vertex(self.coarse, axis, self.node(0, u + (low - 9) % 2, v + (low - 9) / 2)),
        }
    }

    /// Numbers of the vertices on all crossed edges of that cell, whose case is given.
    #[inline(always)]
    pub(super) fn vertices(&self, rows: &Rows, u: usize, v: usize, case: &Transition) -> [u32; EDGES] {
        let mut vertices = [0; EDGES];
        for edge in ones(case.edges.into()) {
            vertices[edge] = self.vertex(rows, u, v, edge);
        }
        vertices
    }

    /// A triangle of a transition cell, by its edges, as it winds in the world.
    #[inline(always)]
    pub(super) fn wound(&self, [a, b, c]: [u8; 3]) -> [u8; 3] {
        if self.below { [a, c, b] } else { [a, b, c] }
    }
}

/// Numbers of the vertices on all crossed edges of a cell, whose case is given.
#[inline(always)]
pub(super) fn vertices(rows: &Rows, block: usize, at: [usize; 3], case: usize) -> [u32; 12] {
    let mut vertices = [0; 12];
    for edge in ones(CASES[case].edges.into()) {
        let corner = edge_corner(edge);
        let node = std::array::from_fn(|a| at[a] + (corner >> a & 1));
        vertices[edge] = rows.vertex(block, edge / 4, node);
    }
    vertices
}

/// Number of triangles of a block.
pub(crate) fn count(rows: &Rows, block: usize) -> u32 {
    let view = rows.view(block);
    let mut count = 0;
    for k in 0..view.n {
        for j in 0..view.n {
            let (signs, crossed) = view.cells(j, k);
            count += ones(crossed).map(|i| u32::from(COUNTS[case(&signs, i)])).sum::<u32>();
        }
    }
    for_each_transition(rows, block, |_, _, _, case| count += u32::from(TRANSITIONS[case].len));
    count
}

/// Calls `work` for every transition cell of a block that holds triangles.
#[inline(always)]
fn for_each_transition(rows: &Rows, block: usize, mut work: impl FnMut(&Face, usize, usize, usize)) {
    let view = rows.view(block);
    for face in ones(view.around.finer.into()) {
        let Some(face) = Face::new(rows, block, face) else { continue };
        for v in 0..view.n {
            for u in 0..view.n {
                let case = face.case(rows, u, v);
                if TRANSITIONS[case].len > 0 {
                    work(&face, u, v, case);
                }
            }
        }
    }
}

/// Writes the triangles of a block, as many as [`count`] says.
pub(crate) fn write(rows: &Rows, block: usize, to: &mut [[u32; 3]]) {
    let view = rows.view(block);
    let mut to = to.iter_mut();
    for k in 0..view.n {
        for j in 0..view.n {
            let (signs, crossed) = view.cells(j, k);
            for i in ones(crossed) {
                let case = case(&signs, i);
                let vertices = vertices(rows, block, [i, j, k], case);
                for (triangle, to) in CASES[case].triangles[..CASES[case].len.into()].iter().zip(&mut to) {
                    *to = triangle.map(|edge| vertices[usize::from(edge)]);
                }
            }
        }
    }
    for_each_transition(rows, block, |face, u, v, case| {
        let case = &TRANSITIONS[case];
        let vertices = face.vertices(rows, u, v, case);
        for (&triangle, to) in case.triangles[..case.len.into()].iter().zip(&mut to) {
            *to = face.wound(triangle).map(|edge| vertices[usize::from(edge)]);
        }
    });
}
