//! Edges turned, so that vertices have closer to six neighbors: smoothing makes triangles around such vertices even.
//!
//! ```text
//!       c               c
//!     /   \           / | \
//!    b --- a   ──►   b  |  a       where a and b have at least three neighbors more than c and d,
//!     \   /           \ | /        and the four lie nearly in a plane
//!       d               d
//! ```
//!
//! Flips are found in parallel and chosen one after the other, the
//! best first, no two with a vertex in common: so they do not depend on each other, and the same are chosen for any number of
//! threads. Diagonals of squares ([`zigzag`](super::zigzag)) come before them and may share vertices, but no triangle. An edge that is there already is not made a second time: a closed manifold stays one.
//!
//! Source: Botsch & Kobbelt, A Remeshing Approach to Multiresolution Modeling, 2004, section 4, for valences as the goal.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::rebuild::Groups;
use crate::{
    Mesh,
    math::vector::{cross, dot, length, subtract},
    mesh::stars::{Stars, followers},
};

/// Groups looked at by one task.
pub(super) const CHUNK: usize = 1 << 12;

/// An edge is worth turning from this valence of an end on.
const HIGH: u8 = 7;

/// Least gain: what the ends have more neighbors than the wings. From 3 on the squares of what is off six sum to less.
const GAIN: i32 = 3;

/// Smallest cosine between the normals of two triangles before, and to their mean after.
const FLAT: f64 = 0.8;

/// Smallest height of a new triangle in its longest edges.
const FLATTEST: f64 = 0.2;

/// Merged vertices: what flips are sought among.
pub(super) struct Merged<'a> {
    pub mesh: &'a Mesh,
    pub stars: &'a Stars,
    /// The lowest vertex of each one's group.
    pub target: &'a [u32],
    pub groups: &'a Groups,
    /// The lattice node of each vertex, packed, if diagonals are to alternate from row to row.
    pub rows: Option<&'a [u64]>,
}

/// An edge, and the vertices opposite to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Flip {
    /// Negative gain: the best come first.
    pub loss: i32,
    /// Breaks ties, so that equal flips do not queue up.
    pub mixed: u32,
    pub ends: [u32; 2],
    pub wings: [u32; 2],
}

impl Flip {
    /// Its vertices, the ends first.
    pub(super) fn four(&self) -> [u32; 4] {
        let ([a, b], [c, d]) = (self.ends, self.wings);
        [a, b, c, d]
    }
}

/// Chosen flips. Vertices are named by the lowest of their group.
#[derive(Default)]
pub(super) struct Flips {
    /// Vertices that take part.
    marked: Vec<bool>,
    /// Edge ──► (a, c, d), where the edge is (a, b) and the triangles are (a, b, c) and (a, d, b).
    turned: FxHashMap<u64, [u32; 3]>,
    /// The edges that flips make.
    made: FxHashSet<u64>,
}

/// An edge whichever way it runs, as one number: the hash of a pair takes twice as long.
#[inline(always)]
fn edge(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

impl Flips {
    /// Adds one, unless its triangles are those of another already, or another makes the same edge. Whether it did.
    pub(super) fn add(&mut self, flip: &Flip) -> bool {
        let [a, b, c, d] = flip.four();
        let sides = [edge(a, b), edge(b, c), edge(c, a), edge(b, d), edge(d, a)];
        let is_marked = |v: u32| self.marked[v as usize];
        if is_marked(a) && is_marked(b) && sides.iter().any(|side| self.turned.contains_key(side)) {
            return false;
        }
        if !self.made.insert(edge(c, d)) {
            return false;
        }
        [a, b, c, d].iter().for_each(|&v| self.marked[v as usize] = true);
        self.turned.insert(edge(a, b), [a, c, d]);
        true
    }

    /// What a triangle, its corners named by the lowest of their groups, becomes.
    #[inline(always)]
    pub(super) fn turned(&self, triangle: [u32; 3]) -> [u32; 3] {
        if self.marked.is_empty() || !triangle.iter().all(|&v| self.marked[v as usize]) {
            return triangle;
        }
        self.look_up(triangle)
    }

    fn look_up(&self, triangle: [u32; 3]) -> [u32; 3] {
        for i in 0..3 {
            let [x, y, z] = [triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]];
            let Some(&[a, c, d]) = self.turned.get(&edge(x, y)) else { continue };
            if x == a && z == c {
                return [a, d, c];
            }
            if y == a && z == d {
                return [d, x, c];
            }
        }
        triangle
    }
}

impl Merged<'_> {
    /// Chooses the edges to turn.
    pub(super) fn flips(&self) -> Flips {
        let n = self.groups.len();
        let mut valences: Vec<u8> = (0..n).into_par_iter().with_min_len(CHUNK).map(|g| self.valence(g)).collect();
        let mut flips = Flips { marked: vec![false; self.target.len()], ..Flips::default() };
        if let Some(nodes) = self.rows {
            self.alternate(nodes, &mut valences, &mut flips);
        }
        let chunks = (0..n.div_ceil(CHUNK)).into_par_iter();
        let found = chunks.map_init(Vec::new, |fan, chunk| {
            let mut found = Vec::new();
            for g in chunk * CHUNK..n.min((chunk + 1) * CHUNK) {
                if valences[g] >= HIGH {
                    self.find(g, &valences, fan, &mut found);
                }
            }
            found
        });
        let mut found: Vec<Flip> = found.flatten_iter().collect();
        found.par_sort_unstable();
        let mut is_part = vec![false; self.target.len()];
        for flip in found {
            let four = flip.four();
            if !four.iter().any(|&v| is_part[v as usize]) && flips.add(&flip) {
                four.iter().for_each(|&v| is_part[v as usize] = true);
            }
        }
        flips
    }

    /// Triangles around a group.
    fn valence(&self, group: usize) -> u8 {
        let members = self.groups.members(group);
        let here = members[0];
        let mut count = 0u8;
        for &v in members {
            for corner in self.stars.corners(v as usize) {
                let [next, previous] = corner.map(|n| self.target[n as usize]);
                count = count.saturating_add(u8::from(next != previous && next != here && previous != here));
            }
        }
        count
    }

    /// The (next, previous) pairs around a group, named by `here`.
    pub(super) fn fan(&self, here: u32, to: &mut Vec<[u32; 2]>) {
        to.clear();
        for &v in self.groups.members_with(here).unwrap_or_default() {
            for corner in self.stars.corners(v as usize) {
                let [next, previous] = corner.map(|n| self.target[n as usize]);
                if next != previous && next != here && previous != here {
                    to.push([next, previous]);
                }
            }
        }
    }

    /// Edges of a group that are worth turning and may be.
    fn find(&self, group: usize, valences: &[u8], fan: &mut Vec<[u32; 2]>, found: &mut Vec<Flip>) {
        let a = self.groups.members(group)[0];
        self.fan(a, fan);
        let first = found.len();
        let valence = |v: u32| i32::from(valences[self.groups.number_of(v)]);
        let is_ring = followers(fan, |i, j| {
            let ([d, b], c) = (fan[i], fan[j][1]);
            let (of_a, of_b) = (valence(a), valence(b));
            let gain = of_a + of_b - valence(c) - valence(d);
            // An edge is looked at from one of its ends.
            if gain >= GAIN && of_b > 3 && c != d && (of_a > of_b || of_a == of_b && a < b) {
                let mixed = (a.wrapping_mul(0x9e37_79b1) ^ b).wrapping_mul(0x85eb_ca6b);
                found.push(Flip { loss: -gain, mixed: mixed ^ mixed >> 15, ends: [a, b], wings: [c, d] });
            }
        });
        if !is_ring {
            found.truncate(first);
        }
        self.keep_allowed(first, fan, found);
    }

    /// Drops those from number `first` on that would break the surface.
    pub(super) fn keep_allowed(&self, first: usize, fan: &mut Vec<[u32; 2]>, found: &mut Vec<Flip>) {
        let mut kept = first;
        for i in first..found.len() {
            if self.may_flip(&found[i], fan) {
                found[kept] = found[i];
                kept += 1;
            }
        }
        found.truncate(kept);
    }

    /// Whether the surface stays a manifold and nearly where it was.
    fn may_flip(&self, &Flip { ends: [a, b], wings: [c, d], .. }: &Flip, fan: &mut Vec<[u32; 2]>) -> bool {
        // At a border there are six neighbors nowhere, and its triangles stay.
        for v in [b, d, c] {
            self.fan(v, fan);
            if !followers(fan, |_, _| {}) {
                return false;
            }
        }
        if fan.as_flattened().contains(&d) {
            return false;
        }
        let [a, b, c, d] = [a, b, c, d].map(|v| self.place(v));
        let normal = |[p, q, r]: [[f64; 3]; 3]| {
            let sides = [subtract(q, p), subtract(r, q), subtract(p, r)];
            (cross(sides[0], sides[1]), sides.into_iter().map(|s| dot(s, s)).fold(0.0, f64::max))
        };
        let [(first, _), (second, _)] = [[a, b, c], [a, d, b]].map(normal);
        let mean = [0, 1, 2].map(|i| first[i] + second[i]);
        let is_along = |x: [f64; 3], y: [f64; 3]| dot(x, y) > FLAT * length(x) * length(y);
        let is_good = |triangle| {
            let (after, longest) = normal(triangle);
            is_along(after, mean) && length(after) > FLATTEST * longest
        };
        is_along(first, second) && is_good([a, d, c]) && is_good([d, b, c])
    }

    /// Where a merged vertex will be.
    fn place(&self, lowest: u32) -> [f64; 3] {
        let members = self.groups.members_with(lowest).unwrap_or_default();
        let mut sum = [0.0; 3];
        for &v in members {
            for (sum, x) in sum.iter_mut().zip(self.mesh.vertices[v as usize]) {
                *sum += f64::from(x);
            }
        }
        sum.map(|x| x / members.len() as f64)
    }
}
