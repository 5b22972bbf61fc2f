//! Marching tetrahedra on bricks of 4×4×4 cells, by bit masks and ranks, for any of three splits of space.
//!
//! ```text
//! source     bricks of samples: a volume, a function, a sheared lattice            source, boxed, sheared
//! signs      one u64 a brick and site                                              count
//! clusters   (regularised only) crossings near a node that share one vertex        choose, regular, clusters
//! crossings  for each kind of edge: sets of its two ends, exclusive-or             count, splits
//! number     first of the brick + crossings of lower kinds + rank among the bits   emit
//! case       four bits of signs                                                    tables
//! ```
//!
//! As in marching cubes a vertex *is* a crossed edge and its number comes from counting, so that vertices are shared without a
//! search; there are only more kinds of edges: 7, 6 or 14 in place of 3. A tetrahedron has no ambiguous case, so the
//! surface is exactly that of the interpolant that is linear in each tetrahedron, closed and manifold whatever the samples.
//!
//! Bricks come in Morton order, vertices by kind of edge and cell, triangles by cell and tetrahedron.
//!
//! Source: Uralsky, Practical metaballs and implicit surfaces, 2006; counting before writing is this project's, see
//! [`crate::march::cubes`].

pub(crate) mod boxed;
mod choose;
mod clusters;
pub(crate) mod count;
mod crossing;
mod emit;
pub(crate) mod filled;
mod regular;
pub(crate) mod samples;
pub(crate) mod sheared;
pub(crate) mod source;
mod splits;
mod star;
mod tables;
#[cfg(test)]
mod tests;

use clusters::Clusters;
use count::{Counted, Signs};
use regular::regularise;
use source::Source;
use splits::{BCC, FIVE, SIX};

use crate::{Control, Error, Stage};

/// Which split, and whether it is regularised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Five,
    Six,
    Bcc,
    Regularised,
}

/// A counted surface of any split.
pub(crate) enum Surface {
    Five(Counted<1, 6, 5>),
    Six(Counted<1, 7, 6>),
    Bcc(Counted<2, 14, 12>),
}

/// Evaluates an expression with the counted surface, whatever its split.
macro_rules! with_counted {
    ($surface:expr, $counted:ident => $body:expr) => {
        match $surface {
            Surface::Five($counted) => $body,
            Surface::Six($counted) => $body,
            Surface::Bcc($counted) => $body,
        }
    };
}

impl Surface {
    /// Reads and counts.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`, [`Error::Cancelled`].
    pub(crate) fn new(source: &dyn Source, kind: Kind, control: &Control<'_>) -> Result<Self, Error> {
        control.begin(Stage::Fill)?;
        Ok(match kind {
            Kind::Five => {
                let signs = Signs::of(source, control);
                control.begin(Stage::Count)?;
                Self::Five(Counted::new(source, &FIVE, signs, Clusters::default(), control)?)
            }
            Kind::Six => {
                let signs = Signs::of(source, control);
                control.begin(Stage::Count)?;
                Self::Six(Counted::new(source, &SIX, signs, Clusters::default(), control)?)
            }
            Kind::Bcc | Kind::Regularised => {
                let signs = Signs::of(source, control);
                control.begin(Stage::Count)?;
                let clusters = match kind {
                    Kind::Regularised => regularise(source, &signs, control),
                    _ => Clusters::default(),
                };
                Self::Bcc(Counted::new(source, &BCC, signs, clusters, control)?)
            }
        })
    }

    /// Number of bricks that own a vertex.
    pub(crate) fn crossed_bricks(&self) -> usize {
        let mut bricks = 0;
        self.for_each_brick(|_, vertices| bricks += usize::from(vertices > 0));
        bricks
    }

    /// Number of vertices.
    pub(crate) fn vertices(&self) -> usize {
        with_counted!(self, counted => counted.vertices())
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        with_counted!(self, counted => counted.triangles())
    }

    /// Calls `work` with each brick that has vertices or triangles, in the order of the vertices, and how many it has.
    pub(crate) fn for_each_brick(&self, mut work: impl FnMut(usize, u32)) {
        with_counted!(self, counted => {
            for pair in counted.parts.windows(2) {
                work(pair[0].brick as usize, pair[1].first_vertex - pair[0].first_vertex);
            }
        });
    }

    /// Writes all vertices, as offsets from the source's origin.
    pub(crate) fn write_vertices(&self, source: &dyn Source, to: &mut [[f32; 3]]) {
        with_counted!(self, counted => counted.write_vertices(source, to));
    }

    /// Writes all triangles.
    pub(crate) fn write_triangles(&self, source: &dyn Source, to: &mut [[u32; 3]]) {
        with_counted!(self, counted => counted.write_triangles(source, to));
    }
}
