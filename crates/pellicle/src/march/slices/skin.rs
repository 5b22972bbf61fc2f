//! User data on the surface: what a caller computes at lattice corners, and what becomes of it at a vertex.
//!
//! Source: Rosenberg & Birdwell, Real-time particle isosurface extraction, 2008, sections 4 and 7: a user-defined
//! structure at each corner, a custom field routine that fills it, a custom vertex routine that uses it.

use crate::lookup::columns::{Near, Placed};

/// What a surface carries besides positions and normals: colours, texture coordinates, whatever particles know.
///
/// The engine calls [`corner`](Self::corner) once for each lattice corner next to a vertex, with the particles that reach
/// it, and [`vertex`](Self::vertex) once for each vertex, with the data of the corners at its edge's ends.
///
/// ```
/// use pellicle::realtime::{Neighbours, Skin};
///
/// /// Colours of particles, blended by what each particle brings to the field.
/// struct Colors(Vec<[f32; 3]>);
///
/// impl Skin for Colors {
///     type Corner = [f32; 3];
///     type Vertex = [f32; 3];
///
///     fn corner(&self, near: Neighbours<'_>) -> [f32; 3] {
///         let (mut sum, mut total) = ([0.0; 3], 0.0);
///         for neighbour in near {
///             let weight = neighbour.rest * neighbour.rest;
///             let color = self.0[neighbour.particle];
///             (0..3).for_each(|c| sum[c] += weight * color[c]);
///             total += weight;
///         }
///         sum.map(|v| v / total.max(f32::MIN_POSITIVE))
///     }
///
///     fn vertex(&self, ends: [[f32; 3]; 2], t: f32) -> [f32; 3] {
///         std::array::from_fn(|c| ends[0][c] + t * (ends[1][c] - ends[0][c]))
///     }
/// }
/// ```
pub trait Skin: Sync {
    /// Data of a lattice corner.
    type Corner: Copy + Default + Send + Sync;
    /// Data of a vertex.
    type Vertex: Copy + Default + Send + Sync;

    /// Data of the corner that these particles reach; there may be none.
    fn corner(&self, near: Neighbours<'_>) -> Self::Corner;

    /// Data of the vertex at `t` (0..=1) of the way between two corners.
    fn vertex(&self, ends: [Self::Corner; 2], t: f32) -> Self::Vertex;
}

/// Nothing besides positions and normals.
#[derive(Debug, Clone, Copy, Default)]
pub struct Plain;

impl Skin for Plain {
    type Corner = ();
    type Vertex = ();

    fn corner(&self, _: Neighbours<'_>) {}

    fn vertex(&self, _: [(); 2], _: f32) {}
}

/// One particle within reach of a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Its index in the caller's order.
    pub particle: usize,
    /// 1 − (d/R)², where d is its distance from the corner and R its reach: greater than 0, at most 1.
    pub rest: f32,
    /// The corner minus the particle, in cells.
    pub away: [f32; 3],
}

/// The particles within reach of a corner, in canonical order: by nearest node along z, then by index.
#[derive(Clone)]
pub struct Neighbours<'a> {
    pub(super) near: &'a Near,
    pub(super) particles: &'a [Placed],
    pub(super) node: [i32; 3],
    pub(super) next: usize,
}

impl<'a> Neighbours<'a> {
    /// What a look-up at `node` found, with the block's particles.
    pub(crate) fn new(near: &'a Near, particles: &'a [Placed], node: [i32; 3]) -> Self {
        Self { near, particles, node, next: 0 }
    }
}

impl Iterator for Neighbours<'_> {
    type Item = Neighbour;

    fn next(&mut self) -> Option<Neighbour> {
        let rest = *self.near.rests().get(self.next)?;
        let particle = &self.particles[self.near.who().nth(self.next)?];
        self.next += 1;
        let away = std::array::from_fn(|a| (self.node[a] - particle.node[a]) as f32 - particle.offset[a]);
        Some(Neighbour { particle: particle.index as usize, rest, away })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.near.len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Neighbours<'_> {}
