//! What lies beyond a plane cut away, and the cut closed: flat caps, shared by index with what they close.
//!
//! Every edge that crosses the plane gets one vertex in it, between its ends; triangles are cut along these. In a closed manifold
//! the sides that are left open link up to loops, which `cap` fills. So a closed manifold stays one. The
//! borders of an open mesh stay open where they end in the plane, and so does what hangs together at an edge of more than
//! two triangles.
//!
//! Vertices in the plane count as being on the side that stays, so that a second cut changes nothing. Where a coordinate
//! is cut (the plane is parallel to two axes) that of new vertices is the plane's, to the last bit that the offset from the
//! mesh's origin has.
//!
//! Attributes are interpolated along the edges, or the nearer end's. Normals of the mesh, where it has any, are those of
//! the plane on the caps and along their rims: caps shade flat.
//!
//! Source: this project.

use rayon::prelude::*;

use super::{
    cap::{Point, fill},
    check,
    rebuild::NONE,
};
use crate::{
    Carry, Control, Error, Mesh,
    math::vector::{dot, length},
};

/// Vertices or triangles handled by one task, at least.
const CHUNK: usize = 1 << 12;

/// A plane: where `normal · x = offset`, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Points to the side that is cut away. Of any length but 0.
    pub normal: [f64; 3],
    /// `normal · x` of all points in the plane.
    pub offset: f64,
}

/// Cuts away what lies on the side that the plane's normal points to, and closes the cut.
///
/// ```
/// # use pellicle::{Control, Params, mesh::Report, post::cut::{Plane, cut}};
/// let mut mesh = pellicle::reconstruct(&[[0.0f32; 3]], &Params::new(0.025))?;
/// let whole = Report::of(&mesh).signed_volume;
/// cut(&mut mesh, &Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 }, &Control::default())?;
/// let report = Report::of(&mesh);
/// assert!(report.closed_manifold() && (report.signed_volume / whole - 0.5).abs() < 1e-6);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a plane that is none, [`Error::Count`] for an index that names no vertex or more vertices than
/// `u32` counts, [`Error::Length`] for an attribute of the wrong length, [`Error::Cancelled`]; the mesh is then as it was.
pub fn cut(mesh: &mut Mesh, plane: &Plane, control: &Control<'_>) -> Result<(), Error> {
    let size = length(plane.normal);
    if !(size.is_normal() && plane.offset.is_finite()) {
        return Err(Error::Parameter { name: "normal", value: size, must: "a direction, and the offset finite" });
    }
    check(mesh)?;
    let across = Across::new(mesh, plane, size);
    let beyond: Vec<f64> = mesh.vertices.par_iter().with_min_len(CHUNK).map(|v| across.height(v)).collect();
    control.check()?;
    if !beyond.par_iter().any(|d| *d > 0.0) {
        return Ok(());
    }
    let section = Section::of(mesh, &beyond);
    let needed = mesh.vertices.len() as u64 + 2 * section.edges.len() as u64;
    if needed > u64::from(NONE) {
        return Err(Error::Count { what: "vertices of the cut", needed, available: u64::from(NONE) });
    }
    control.check()?;
    *mesh = section.apply(mesh, &beyond, &across);
    Ok(())
}

/// Bytes that a cut takes besides the mesh, at the most: heights, pieces of triangles, and the mesh that is left.
pub fn memory(mesh: &Mesh) -> u64 {
    2 * mesh.bytes() + 12 * mesh.vertices.len() as u64 + 40 * mesh.triangles.len() as u64
}

/// Heights above a plane, in the mesh's own offsets.
struct Across {
    normal: [f64; 3],
    offset: f64,
    /// The axis that is cut, the sign of its direction and where, if the plane is parallel to the others.
    axis: Option<(usize, f64, f32)>,
}

impl Across {
    fn new(mesh: &Mesh, plane: &Plane, size: f64) -> Self {
        let normal = plane.normal.map(|n| n / size);
        let offset = plane.offset / size - dot(normal, mesh.origin);
        let along = (0..3).find(|&a| normal[a].abs() == 1.0);
        Self { normal, offset, axis: along.map(|a| (a, normal[a], (normal[a] * offset) as f32)) }
    }

    #[inline(always)]
    fn height(&self, v: &[f32; 3]) -> f64 {
        match self.axis {
            Some((a, sign, at)) => sign * (f64::from(v[a]) - f64::from(at)),
            None => dot(self.normal, v.map(f64::from)) - self.offset,
        }
    }

    /// The place where an edge from the side that stays to the one that goes passes the plane, and its share of the way.
    fn crossing(&self, [from, to]: [[f32; 3]; 2], [low, high]: [f64; 2]) -> ([f32; 3], f32) {
        let share = low / (low - high);
        let between = |a: usize| (f64::from(from[a]) + share * (f64::from(to[a]) - f64::from(from[a]))) as f32;
        let mut place = [between(0), between(1), between(2)];
        if let Some((a, _, at)) = self.axis {
            place[a] = at;
        }
        (place, share as f32)
    }

    /// Coordinates in the plane, counter-clockwise as seen from the side that goes.
    fn flat(&self, v: [f32; 3]) -> Point {
        let largest = (1..3).fold(0, |best, a| if self.normal[a].abs() > self.normal[best].abs() { a } else { best });
        let [x, y] = [v[(largest + 1) % 3], v[(largest + 2) % 3]].map(f64::from);
        if self.normal[largest] > 0.0 { [x, y] } else { [y, x] }
    }
}

/// The edges that cross the plane, from the end that stays to the one that goes, in ascending order. Each is a vertex.
struct Section {
    edges: Vec<[u32; 2]>,
}

/// What a triangle is cut to: triangles of vertices that stay (below `vertices`) and of edges of the section (from there on),
/// and the side along the plane.
#[derive(Default, Clone, Copy)]
struct Pieces {
    triangles: [[u32; 3]; 2],
    count: usize,
    side: Option<[u32; 2]>,
}

impl Section {
    fn of(mesh: &Mesh, beyond: &[f64]) -> Self {
        let goes = |v: u32| beyond[v as usize] > 0.0;
        let crossings = |t: &[u32; 3]| {
            let [a, b, c] = *t;
            [[a, b], [b, c], [c, a]].into_iter().filter_map(move |[v, w]| match (goes(v), goes(w)) {
                (false, true) => Some([v, w]),
                (true, false) => Some([w, v]),
                _ => None,
            })
        };
        let mut edges: Vec<[u32; 2]> = mesh.triangles.par_iter().with_min_len(CHUNK).flat_map_iter(crossings).collect();
        edges.par_sort_unstable();
        edges.dedup();
        Self { edges }
    }

    /// Number of the vertex on an edge, counted on from the mesh's.
    fn vertex(&self, mesh: &Mesh, stays: u32, goes: u32) -> u32 {
        let place = self.edges.binary_search(&[stays, goes]).unwrap_or(0);
        (mesh.vertices.len() + place) as u32
    }

    fn cut_triangle(&self, mesh: &Mesh, beyond: &[f64], t: [u32; 3]) -> Pieces {
        let goes = t.map(|v| beyond[v as usize] > 0.0);
        let on = |stays: u32, goes: u32| self.vertex(mesh, stays, goes);
        match goes.iter().filter(|goes| **goes).count() {
            0 => Pieces { triangles: [t; 2], count: 1, side: None },
            1 => {
                // Turned so that the last corner goes.
                let last = goes.iter().position(|goes| *goes).unwrap_or(0);
                let [a, b, c] = [t[(last + 1) % 3], t[(last + 2) % 3], t[last]];
                let (p, q) = (on(b, c), on(a, c));
                Pieces { triangles: [[a, b, p], [a, p, q]], count: 2, side: Some([p, q]) }
            }
            2 => {
                let first = goes.iter().position(|goes| !*goes).unwrap_or(0);
                let [a, b, c] = [t[first], t[(first + 1) % 3], t[(first + 2) % 3]];
                let (p, q) = (on(a, b), on(a, c));
                Pieces { triangles: [[a, p, q]; 2], count: 1, side: Some([p, q]) }
            }
            _ => Pieces::default(),
        }
    }

    /// The mesh that is left, closed.
    fn apply(&self, mesh: &Mesh, beyond: &[f64], across: &Across) -> Mesh {
        let n = mesh.vertices.len();
        let whole = mesh.triangles.par_iter().with_min_len(CHUNK);
        let pieces: Vec<Pieces> = whole.map(|&t| self.cut_triangle(mesh, beyond, t)).collect();
        let mut triangles: Vec<[u32; 3]> =
            pieces.par_iter().with_min_len(CHUNK).flat_map_iter(|p| p.triangles.into_iter().take(p.count)).collect();
        let sides = pieces.iter().filter_map(|p| p.side).map(|side| side.map(|v| v - n as u32));
        let loops = loops(self.edges.len(), sides);
        drop(pieces);

        let crossing = |&[a, b]: &[u32; 2]| {
            let [a, b] = [a as usize, b as usize];
            across.crossing([mesh.vertices[a], mesh.vertices[b]], [beyond[a], beyond[b]])
        };
        let crossings: Vec<([f32; 3], f32)> = self.edges.par_iter().with_min_len(CHUNK).map(crossing).collect();
        let points: Vec<Point> = crossings.iter().map(|(place, _)| across.flat(*place)).collect();
        let (caps, failed) = fill(&points, &loops);
        triangles.extend(caps.into_iter().map(|t| t.map(|v| v + n as u32)));
        // What could not be filled gets a vertex in its middle, so that it is closed all the same.
        let first_middle = (n + self.edges.len()) as u32;
        for (middle, &failed) in failed.iter().enumerate() {
            let ring = &loops[failed];
            let around = ring.iter().zip(ring.iter().cycle().skip(1));
            triangles.extend(around.map(|(a, b)| [a + n as u32, b + n as u32, first_middle + middle as u32]));
        }
        let middles: Vec<&[u32]> = failed.iter().map(|&failed| &loops[failed][..]).collect();
        self.rebuild(mesh, &crossings, &middles, across.normal, triangles)
    }

    /// Vertices that stay and are used, then those of the section, then middles; each with what it carries.
    fn rebuild(
        &self,
        mesh: &Mesh,
        crossings: &[([f32; 3], f32)],
        middles: &[&[u32]],
        normal: [f64; 3],
        mut triangles: Vec<[u32; 3]>,
    ) -> Mesh {
        let n = mesh.vertices.len();
        let mut number = vec![NONE; n + self.edges.len() + middles.len()];
        triangles.as_flattened().iter().for_each(|&v| number[v as usize] = 0);
        let used: Vec<u32> = (0..number.len() as u32).filter(|&v| number[v as usize] == 0).collect();
        for (new, &old) in (0..).zip(&used) {
            number[old as usize] = new;
        }
        triangles.par_iter_mut().for_each(|t| *t = t.map(|v| number[v as usize]));
        // All values of one channel: the old ones, those between, and means.
        let carry = |values: &[f32], width: usize, rule: Carry| -> Vec<f32> {
            let between = |edge: usize, c: usize| {
                let [x, y] = self.edges[edge].map(|v| values[v as usize * width + c]);
                let share = crossings[edge].1;
                match rule {
                    Carry::Mean | Carry::NormalSpeed => x + share * (y - x),
                    Carry::Nearest if share > 0.5 => y,
                    Carry::Nearest => x,
                }
            };
            let mut to = Vec::with_capacity(used.len() * width);
            for &v in &used {
                let v = v as usize;
                if v < n {
                    to.extend_from_slice(&values[v * width..(v + 1) * width]);
                    continue;
                }
                to.extend((0..width).map(|c| match middles.get((v - n).wrapping_sub(self.edges.len())) {
                    None => between(v - n, c),
                    Some(ring) if rule == Carry::Nearest => between(ring[0] as usize, c),
                    Some(ring) => {
                        let sum: f64 = ring.iter().map(|&e| f64::from(between(e as usize, c))).sum();
                        (sum / ring.len() as f64) as f32
                    }
                }));
            }
            to
        };
        let place = |v: u32| match (v as usize).checked_sub(n) {
            None => mesh.vertices[v as usize],
            Some(edge) if edge < crossings.len() => crossings[edge].0,
            Some(middle) => {
                let ring = middles[middle - crossings.len()];
                let mean = |a: usize| ring.iter().map(|&e| f64::from(crossings[e as usize].0[a])).sum::<f64>();
                [0, 1, 2].map(|a| (mean(a) / ring.len() as f64) as f32)
            }
        };
        let flat = normal.map(|x| x as f32);
        let normal_of = |&v: &u32| mesh.normals.get(v as usize).copied().unwrap_or(flat);
        Mesh {
            origin: mesh.origin,
            vertices: used.par_iter().map(|&v| place(v)).collect(),
            normals: if mesh.normals.is_empty() { Vec::new() } else { used.par_iter().map(normal_of).collect() },
            attributes: mesh
                .attributes
                .iter()
                .map(|of| crate::VertexAttribute {
                    values: carry(&of.values, of.components, of.carry),
                    name: of.name.clone(),
                    ..*of
                })
                .collect(),
            triangles,
        }
    }
}

/// The rings that the sides link up to, against their direction: those of the caps. Sides that end, or part, are in none; of
/// two that run there and back nothing is open.
fn loops(vertices: usize, sides: impl Iterator<Item = [u32; 2]>) -> Vec<Vec<u32>> {
    let (mut next, mut arrivals) = (vec![NONE; vertices], vec![0u32; vertices]);
    for [p, q] in sides {
        // A second way out is as good as none.
        next[q as usize] = if next[q as usize] == NONE { p } else { q };
        arrivals[p as usize] += 1;
    }
    let is_plain = |v: u32| arrivals[v as usize] == 1 && next[v as usize] != NONE && next[v as usize] != v;
    let mut is_seen = vec![false; vertices];
    let mut loops = Vec::new();
    for first in 0..vertices as u32 {
        let (mut ring, mut at) = (Vec::new(), first);
        while !is_seen[at as usize] && is_plain(at) {
            is_seen[at as usize] = true;
            ring.push(at);
            at = next[at as usize];
        }
        if ring.len() > 2 && at == first {
            loops.push(ring);
        }
    }
    loops
}

#[cfg(test)]
mod tests;
