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
//! Flips are found in parallel and chosen one after the other, the best first, no two with a vertex in common: so they do not
//! depend on each other, and the same are chosen for any number of threads. An edge that is there already is not made a second
//! time: a closed manifold stays one.
//!
//! Source: Botsch & Kobbelt, A Remeshing Approach to Multiresolution Modeling, 2004, section 4, for valences as the goal.

use rayon::prelude::*;

use crate::{
    Mesh,
    math::memory::filled,
    math::vector::{cross, dot, subtract},
    mesh::stars::{Stars, followers},
};

/// Vertices or triangles looked at by one task.
const CHUNK: usize = 1 << 12;

/// An edge is worth turning from this valence of an end on.
const HIGH: u32 = 7;

/// Least gain: what the ends have more neighbors than the wings. From 3 on the squares of what is off six sum to less.
const GAIN: i32 = 3;

/// Smallest cosine between the normals of two triangles before, and to their mean after.
const FLAT: f64 = 0.8;

/// Smallest height of a new triangle in its longest edges.
const FLATTEST: f64 = 0.2;

/// An edge and the vertices opposite to it: a and b, c and d, of the triangles (a, b, c) and (a, d, b).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Flip {
    pub ends: [u32; 2],
    pub wings: [u32; 2],
}

impl Flip {
    /// The edge that two triangles share, if they do and it runs either way.
    #[inline(always)]
    pub(super) fn between(first: [u32; 3], second: [u32; 3]) -> Option<Self> {
        const NOWHERE: usize = 9;
        let mut place = NOWHERE;
        // No branch on what is compared: nobody could foresee it.
        for i in 0..3 {
            for j in 0..3 {
                let is_shared = (first[i] == second[(j + 1) % 3]) & (first[(i + 1) % 3] == second[j]);
                place = if is_shared { 3 * i + j } else { place };
            }
        }
        let (i, j) = (place / 3, place % 3);
        let flip = || Self { ends: [first[i], first[(i + 1) % 3]], wings: [first[(i + 2) % 3], second[(j + 2) % 3]] };
        (place != NOWHERE).then(flip)
    }

    /// Its vertices, the ends first.
    #[inline(always)]
    pub(super) fn four(&self) -> [u32; 4] {
        let ([a, b], [c, d]) = (self.ends, self.wings);
        [a, b, c, d]
    }

    /// What becomes of the triangles (a, b, c) and (a, d, b).
    pub(super) fn turned(&self) -> [[u32; 3]; 2] {
        let [a, b, c, d] = self.four();
        [[a, d, c], [d, b, c]]
    }

    /// Whether the surface stays nearly where it was.
    pub(super) fn is_flat(&self, vertices: &[[f32; 3]]) -> bool {
        let [a, b, c, d] = self.four().map(|v| vertices[v as usize].map(f64::from));
        let normal = |[p, q, r]: [[f64; 3]; 3]| {
            let sides = [subtract(q, p), subtract(r, q), subtract(p, r)];
            (cross(sides[0], sides[1]), sides.into_iter().map(|s| dot(s, s)).fold(0.0, f64::max))
        };
        let [(first, _), (second, _)] = [[a, b, c], [a, d, b]].map(normal);
        let mean = [0, 1, 2].map(|i| first[i] + second[i]);
        let is_along = |x: [f64; 3], y: [f64; 3]| {
            let along = dot(x, y);
            along > 0.0 && along * along > FLAT * FLAT * dot(x, x) * dot(y, y)
        };
        let is_good = |triangle| {
            let (after, longest) = normal(triangle);
            is_along(after, mean) && dot(after, after) > (FLATTEST * longest).powi(2)
        };
        is_along(first, second) && is_good([a, d, c]) && is_good([d, b, c])
    }
}

/// A flip and what it is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Rated {
    /// Negative gain: the best come first.
    loss: i32,
    /// Breaks ties, so that equal flips do not queue up.
    mixed: u32,
    flip: Flip,
}

/// Turns the edges of a mesh that gain by it. `stars` are its own before and after; `closed` tells around which vertices triangles go.
pub(super) fn even_valences(mesh: &mut Mesh, stars: &mut Stars, closed: &[bool]) {
    let n = stars.len();
    let before = &*stars;
    let chunks = (0..n.div_ceil(CHUNK)).into_par_iter();
    let found = chunks.map(|chunk| {
        let mut found = Vec::new();
        for v in chunk * CHUNK..n.min((chunk + 1) * CHUNK) {
            if before.valence(v as u32) >= HIGH && closed[v] {
                find(&mesh.vertices, before, closed, v, &mut found);
            }
        }
        found
    });
    let mut found: Vec<Rated> = found.flatten_iter().collect();
    found.par_sort_unstable();
    // The flip, counted from one, that each vertex takes part in.
    let (mut part, mut chosen) = (filled(0u32, n), Vec::new());
    for Rated { flip, .. } in found {
        if flip.four().iter().all(|&v| part[v as usize] == 0) {
            chosen.push(flip);
            flip.four().iter().for_each(|&v| part[v as usize] = chosen.len() as u32);
        }
    }
    // In the order of the vertices, as they lie in memory.
    for (v, number) in part.iter().enumerate().filter(|(_, number)| **number != 0) {
        let flip = chosen[*number as usize - 1];
        if flip.ends[0] as usize == v {
            stars.turn(flip.four());
        }
    }
    let turn = |triangle: &mut [u32; 3]| {
        let [x, y, z] = triangle.map(|v| part[v as usize]);
        if x != 0 && x == y && y == z {
            let flip = &chosen[x as usize - 1];
            *triangle = flip.turned()[usize::from(triangle.contains(&flip.wings[1]))];
        }
    };
    mesh.triangles.par_iter_mut().with_min_len(CHUNK).for_each(turn);
}

/// Edges at one end whose turning gains enough.
fn find(vertices: &[[f32; 3]], stars: &Stars, closed: &[bool], end: usize, found: &mut Vec<Rated>) {
    let (a, fan, first) = (end as u32, stars.corners(end), found.len());
    let valence = |v: u32| stars.valence(v) as i32;
    let of_a = fan.len() as i32;
    // Most have no such edge, and its greatest gain tells that before anybody's place in the fan is known.
    let (mut most, mut least) = (0, [i32::MAX / 2; 2]);
    for &[next, _] in fan {
        let of_next = valence(next);
        most = most.max(of_next);
        least = [least[0].min(of_next), least[1].min(of_next.max(least[0]))];
    }
    if of_a + most - least[0] - least[1] < GAIN {
        return;
    }
    followers(fan, |i, j| {
        let ([d, b], c) = (fan[i], fan[j][1]);
        let of_b = valence(b);
        let gain = of_a + of_b - valence(c) - valence(d);
        // Each edge has two ends: the one with more neighbors finds it, of equal ones the lower.
        if gain >= GAIN && of_b > 3 && c != d && (of_a > of_b || of_a == of_b && a < b) {
            let mixed = (a.wrapping_mul(0x9e37_79b1) ^ b).wrapping_mul(0x85eb_ca6b);
            found.push(Rated { loss: -gain, mixed: mixed ^ mixed >> 15, flip: Flip { ends: [a, b], wings: [c, d] } });
        }
    });
    let mut kept = first;
    for i in first..found.len() {
        if may_turn(vertices, stars, closed, &found[i].flip) {
            found[kept] = found[i];
            kept += 1;
        }
    }
    found.truncate(kept);
}

/// Whether the surface stays a manifold and nearly where it was.
fn may_turn(vertices: &[[f32; 3]], stars: &Stars, closed: &[bool], flip: &Flip) -> bool {
    let ([_, b], [c, d]) = (flip.ends, flip.wings);
    // At a border there are six neighbors nowhere, and its triangles stay.
    let is_inner = [b, c, d].iter().all(|&v| closed[v as usize]);
    is_inner && stars.corners(c as usize).iter().all(|corner| corner[0] != d) && flip.is_flat(vertices)
}
