//! Rounds of collapses.
//!
//! ```text
//! candidate   vertex ──► its cheapest edge that may collapse, kept from round to round where nothing near it changed
//! chosen      candidates cheaper than all others at their ends, at the neighbors of these, and of all that end there: so no
//!             end of one is a neighbor of an end of another
//! ```
//!
//! Source: this project.

use rayon::prelude::*;

use super::fans::Fans;
use super::quadric::{Quadric, unit};
use crate::{
    Carry, Mesh,
    math::vector::{add_scaled, cross, dot, length, subtract},
    mesh::stars::Stars,
};

/// Vertices handled by one task, at least.
const CHUNK: usize = 1 << 11;

/// Weight of the distance to a vertex's line, beside 1 for the planes. Ten times as much shows in the error, a tenth leaves
/// flat regions uneven. Liu et al. take 1e-3.
const LINE: f64 = 1e-3;

/// Smallest cosine between a triangle's normals before and after.
const TURN: f64 = 0.2;

/// Smallest height of a triangle in its longest edges.
const FLATTEST: f64 = 0.02;

/// An edge in the order in which edges collapse: by cost, the rest breaks ties (mixed, so that equal edges do not queue up).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// Bits of a cost that is 0 or greater: they sort as the numbers do.
    cost: u64,
    mixed: u32,
    ends: [u32; 2],
}

impl Edge {
    const NONE: Self = Self { cost: u64::MAX, mixed: u32::MAX, ends: [u32::MAX; 2] };

    fn new(a: u32, b: u32, cost: f64) -> Self {
        let ends = [a.min(b), a.max(b)];
        let mixed = (ends[0].wrapping_mul(0x9e37_79b1) ^ ends[1]).wrapping_mul(0x85eb_ca6b);
        Self { cost: cost.to_bits(), mixed: mixed ^ mixed >> 15, ends }
    }
}

/// What is kept from round to round.
pub(super) struct Shrinking {
    quadrics: Vec<Quadric>,
    /// Vertices that may move.
    free: Vec<bool>,
    fans: Fans,
    candidates: Vec<Edge>,
    stale: Vec<bool>,
    max_error: f64,
    /// What each vertex became: itself, or one of a lower number.
    into: Vec<u32>,
    /// Triangles that are left.
    triangles: usize,
}

impl Shrinking {
    pub(super) fn new(mesh: &Mesh, max_error: f64) -> Self {
        let n = mesh.vertices.len();
        let stars = Stars::of(&mesh.triangles, n);
        let of_vertex = |v: usize| quadric(mesh, &stars, v);
        Self {
            quadrics: (0..n).into_par_iter().with_min_len(CHUNK).map(of_vertex).collect(),
            free: (0..n).into_par_iter().with_min_len(CHUNK).map(|v| stars.is_closed(v)).collect(),
            candidates: vec![Edge::NONE; n],
            stale: vec![true; n],
            fans: Fans::of(stars),
            max_error,
            into: (0..n as u32).collect(),
            triangles: mesh.triangles.len(),
        }
    }

    /// Triangles that are left.
    pub(super) fn triangles(&self) -> usize {
        self.triangles
    }

    /// Collapses what may collapse at once, but leaves so many triangles; `false` when there was nothing to do. The mesh's
    /// vertices move, its triangles wait for [`finish`](Self::finish).
    pub(super) fn round(&mut self, mesh: &mut Mesh, left: usize) -> bool {
        self.refresh(mesh);
        let Some(limit) = self.limit() else { return false };
        let mut chosen = self.choose(limit);
        chosen.par_sort_unstable();
        let most = (self.triangles - left).div_ceil(2);
        chosen.truncate(most);
        self.stale.par_iter_mut().for_each(|stale| *stale = false);
        let judge = |edge: &Edge| {
            let (place, _) = self.place(mesh, edge.ends)?;
            self.may_collapse(mesh, edge.ends, place).then_some(place)
        };
        let places: Vec<Option<[f32; 3]>> = chosen.par_iter().with_min_len(CHUNK / 8).map(judge).collect();
        let mut moved = Vec::with_capacity(chosen.len());
        let mut star = Vec::new();
        for (edge, place) in chosen.iter().zip(places) {
            let [a, b] = edge.ends.map(|v| v as usize);
            if let Some(place) = place {
                carry(mesh, [a, b], place);
                let gone = self.quadrics[b];
                self.quadrics[a].add(&gone);
                self.fans.collapse(a as u32, b as u32, &mut star);
                self.triangles -= 2;
                self.into[b] = a as u32;
                self.candidates[b] = Edge::NONE;
                moved.push(a);
            } else {
                // What was found before its surroundings changed: it is looked for again.
                self.stale[a] = true;
                self.stale[b] = true;
            }
        }
        for a in moved {
            self.stale[a] = true;
            self.fans.corners(a).iter().for_each(|corner| self.stale[corner[0] as usize] = true);
        }
        true
    }

    /// The triangles that are left, in their order.
    pub(super) fn finish(mut self, mesh: &mut Mesh) {
        for v in 0..self.into.len() {
            self.into[v] = self.into[self.into[v] as usize];
        }
        let renamed = mesh.triangles.par_iter().with_min_len(CHUNK).map(|t| t.map(|v| self.into[v as usize]));
        mesh.triangles = renamed.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    }

    /// The cheapest edge of every vertex near which something changed.
    fn refresh(&mut self, mesh: &Mesh) {
        let mut candidates = std::mem::take(&mut self.candidates);
        let this = &*self;
        let stale = candidates.par_iter_mut().with_min_len(CHUNK).enumerate().filter(|(v, _)| this.stale[*v]);
        stale.for_each_init(Vec::new, |edges, (v, candidate)| *candidate = this.cheapest(mesh, v, edges));
        self.candidates = candidates;
    }

    /// The cheapest edge of a vertex that may collapse.
    fn cheapest(&self, mesh: &Mesh, v: usize, edges: &mut Vec<(Edge, [f32; 3])>) -> Edge {
        edges.clear();
        for corner in self.fans.corners(v) {
            let ends = [v.min(corner[0] as usize) as u32, v.max(corner[0] as usize) as u32];
            if let Some((place, cost)) = self.place(mesh, ends) {
                edges.push((Edge::new(ends[0], ends[1], cost), place));
            }
        }
        // The first or second of them will do: no need to sort.
        while let Some(best) = (0..edges.len()).min_by_key(|&i| edges[i].0) {
            let (edge, place) = edges.swap_remove(best);
            if self.may_collapse(mesh, edge.ends, place) {
                return edge;
            }
        }
        Edge::NONE
    }

    /// The cost that half of the vertices' candidates do not exceed; `None` when there are no candidates.
    fn limit(&self) -> Option<u64> {
        let mut costs: Vec<u64> = self.candidates.par_iter().filter(|e| **e != Edge::NONE).map(|e| e.cost).collect();
        let middle = costs.len().checked_sub(1)? / 2;
        Some(*costs.select_nth_unstable(middle).1)
    }

    /// Edges that can collapse at once.
    fn choose(&self, limit: u64) -> Vec<Edge> {
        let is_chosen = |v: &usize| {
            let edge = self.candidates[*v];
            let [a, b] = edge.ends.map(|end| end as usize);
            // Where it is the candidate of both ends, the lower one speaks for it.
            edge != Edge::NONE
                && edge.cost <= limit
                && (a == *v || self.candidates[a] != edge)
                && self.is_least_around(edge, a)
                && self.is_least_around(edge, b)
                && self.is_met_by_none(edge, a)
                && self.is_met_by_none(edge, b)
        };
        let vertices = (0..self.candidates.len()).into_par_iter().with_min_len(CHUNK);
        vertices.filter(is_chosen).map(|v| self.candidates[v]).collect()
    }

    /// Whether no candidate of a vertex and its neighbors is cheaper.
    fn is_least_around(&self, edge: Edge, v: usize) -> bool {
        let around = self.fans.corners(v).iter();
        self.candidates[v] >= edge && around.map(|corner| corner[0] as usize).all(|n| self.candidates[n] >= edge)
    }

    /// Whether no edge that a vertex's neighbors share with theirs is cheaper.
    fn is_met_by_none(&self, edge: Edge, v: usize) -> bool {
        self.fans.corners(v).iter().all(|&[near, _]| {
            let theirs = self.fans.corners(near as usize).iter().map(|corner| self.candidates[corner[0] as usize]);
            theirs.filter(|other| other.ends.contains(&near)).all(|other| other >= edge)
        })
    }

    /// Where an edge, its lower end first, collapses to and what that costs; `None` when an end must stay or the error is
    /// too large.
    fn place(&self, mesh: &Mesh, [a, b]: [u32; 2]) -> Option<([f32; 3], f64)> {
        let [i, j] = [a as usize, b as usize];
        if !self.free[i] || !self.free[j] {
            return None;
        }
        let mut sum = self.quadrics[i];
        sum.add(&self.quadrics[j]);
        let [p, q] = [i, j].map(|v| mesh.vertices[v].map(f64::from));
        let middle = [0, 1, 2].map(|a| 0.5 * (p[a] + q[a]));
        // Far off the edge the quadrics say little of the surface.
        let reach = length(subtract(q, p));
        let lowest = sum.lowest().filter(|x| length(subtract(*x, middle)) <= reach);
        let best = lowest.unwrap_or_else(|| {
            let better = |x, y| if sum.at(y) < sum.at(x) { y } else { x };
            better(better(middle, p), q)
        });
        let place = best.map(|x| x as f32);
        let cost = sum.at(place.map(f64::from));
        (sum.error(cost) <= self.max_error).then_some((place, cost))
    }

    /// Whether the surface stays what it is when these vertices become one at this place.
    pub(super) fn may_collapse(&self, mesh: &Mesh, ends: [u32; 2], place: [f32; 3]) -> bool {
        let [a, b] = ends.map(|v| self.fans.corners(v as usize));
        let common = a.iter().filter(|corner| b.iter().any(|other| other[0] == corner[0])).count();
        // A tetrahedron would fold up to two triangles back to back.
        if common != 2 || a.len() + b.len() < 7 {
            return false;
        }
        let place = place.map(f64::from);
        let keeps_shape = |here: u32, other: u32, &[next, previous]: &[u32; 2]| {
            if next == other || previous == other {
                return true;
            }
            let [p, q, old] = [next, previous, here].map(|v| mesh.vertices[v as usize].map(f64::from));
            let edge = subtract(q, p);
            let before = cross(edge, subtract(old, p));
            let after = cross(edge, subtract(place, p));
            let longest =
                [edge, subtract(place, p), subtract(place, q)].map(|e| dot(e, e)).into_iter().fold(0.0, f64::max);
            let (old_size, size) = (length(before), length(after));
            let is_fat = size > FLATTEST * longest || size > old_size;
            size > 0.0 && is_fat && dot(before, after) >= TURN * old_size * size
        };
        let [x, y] = ends;
        a.iter().all(|corner| keeps_shape(x, y, corner)) && b.iter().all(|corner| keeps_shape(y, x, corner))
    }
}

/// The planes of a vertex's triangles, a third of each one's area, and the line along its normal.
fn quadric(mesh: &Mesh, stars: &Stars, v: usize) -> Quadric {
    let here = mesh.vertices[v].map(f64::from);
    let (mut sum, mut normal, mut area) = (Quadric::default(), [0.0; 3], 0.0);
    for corner in stars.corners(v) {
        let [p, q] = corner.map(|n| subtract(mesh.vertices[n as usize].map(f64::from), here));
        let both = cross(p, q);
        let (n, twice) = unit(both);
        sum.add(&Quadric::plane(here, n, twice / 6.0));
        normal = add_scaled(normal, both, 1.0);
        area += twice / 6.0;
    }
    sum.add(&Quadric::line(here, unit(normal).0, LINE * area));
    sum
}

/// Moves `a` to `place`, and gives it what the edge to `b` carries there.
fn carry(mesh: &mut Mesh, [a, b]: [usize; 2], place: [f32; 3]) {
    let [p, q] = [a, b].map(|v| mesh.vertices[v].map(f64::from));
    let along = subtract(q, p);
    let share = dot(subtract(place.map(f64::from), p), along) / dot(along, along);
    let share = if share.is_nan() { 0.5 } else { share.clamp(0.0, 1.0) } as f32;
    let between = |x: f32, y: f32| x + share * (y - x);
    mesh.vertices[a] = place;
    if !mesh.normals.is_empty() {
        let sum = [0, 1, 2].map(|i| f64::from(between(mesh.normals[a][i], mesh.normals[b][i])));
        let (normal, size) = unit(sum);
        if size > 0.0 {
            mesh.normals[a] = normal.map(|x| x as f32);
        }
    }
    for attribute in &mut mesh.attributes {
        for i in 0..attribute.components {
            let [x, y] = [a, b].map(|v| attribute.values[v * attribute.components + i]);
            attribute.values[a * attribute.components + i] = match attribute.carry {
                Carry::Mean | Carry::NormalSpeed => between(x, y),
                Carry::Nearest if share > 0.5 => y,
                Carry::Nearest => x,
            };
        }
    }
}
