//! Triangles paired to quads.
//!
//! Two triangles that share an edge make a quad if it is flat and convex enough. Each pair has a cost, 0 for a rectangle; pairs
//! are taken from the cheapest on, each triangle once (a greedy matching, at least half as many pairs as there could be, in
//! practice about nine of ten). Then a triangle that is left over next to a pair of which the other half could go with
//! another left over one takes its part of the pair: as many pairs more as there are such chains.
//!
//! Costs are compared as numbers, ties broken by the triangles' numbers, so the quads are the same for any number of threads.
//! No vertex is moved, added or left out. A vertex keeps three edges: two quads never share two sides in a row. Triangulated
//! along the diagonal from its first corner, as most programs do it, a quad gives back the two triangles that it was made of;
//! so a closed manifold stays one.
//!
//! Source: the cost is of the kind of Remacle et al., Blossom-Quad: a non-uniform quadrilateral mesh generator using a
//! minimum-cost perfect-matching algorithm, 2012; the matching is this project's.

use rayon::prelude::*;

use super::check;
use crate::{
    Control, Error, Mesh, QuadMesh,
    math::vector::{cross, dot, length, subtract},
};

/// Edges or triangles handled by one task, at least.
const CHUNK: usize = 1 << 12;

/// No triangle.
const NONE: u32 = u32::MAX;

/// Which pairs of triangles may become quads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairing {
    /// Smallest cosine of the angle between the two triangles' normals. Default 0.9, 26 degrees.
    pub least_flat: f64,
    /// Largest cosine, either way, of a corner's angle. Default 0.9: from 26 to 154 degrees.
    pub most_skewed: f64,
}

impl Default for Pairing {
    fn default() -> Self {
        Self { least_flat: 0.9, most_skewed: 0.9 }
    }
}

impl Pairing {
    fn check(&self) -> Result<(), Error> {
        for (name, value) in [("least_flat", self.least_flat), ("most_skewed", self.most_skewed)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::Parameter { name, value, must: "between 0 and 1" });
            }
        }
        Ok(())
    }
}

/// Pairs triangles to quads; those that find no partner stay triangles.
///
/// ```
/// # use pellicle::{Control, Params, mesh::Report, post::quads::{Pairing, pair}};
/// let mesh = pellicle::reconstruct(&[[0.0f32; 3], [0.05, 0.0, 0.0]], &Params::new(0.025))?;
/// let quads = pair(mesh.clone(), &Pairing::default(), &Control::default())?;
/// assert!(4 * quads.quads.len() > mesh.triangles.len());
/// assert_eq!(2 * quads.quads.len() + quads.mesh.triangles.len(), mesh.triangles.len());
/// assert!(Report::of(&quads.triangulated()).closed_manifold());
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a cosine out of range, [`Error::Count`] for an index that names no vertex, [`Error::Length`] for
/// an attribute of the wrong length, [`Error::Cancelled`].
pub fn pair(mesh: Mesh, pairing: &Pairing, control: &Control<'_>) -> Result<QuadMesh, Error> {
    pairing.check()?;
    check(&mesh)?;
    let sides = sides(&mesh);
    let mut edges = vec![0u32; mesh.vertices.len()];
    for run in sides.chunk_by(|a, b| a.ends == b.ends) {
        // At a border two edges are enough, so its own count twice.
        let count = if run.len() == 1 { 2 } else { 1 };
        run[0].ends.iter().for_each(|&v| edges[v as usize] += count);
    }
    control.check()?;
    let mut pairs: Vec<Pair> = sides
        .par_chunk_by(|a, b| a.ends == b.ends)
        .filter_map(|run| match run {
            [one, two] if one.is_up != two.is_up => Pair::of(&mesh, pairing, one, two),
            _ => None,
        })
        .collect();
    drop(sides);
    pairs.par_sort_unstable();
    control.check()?;
    let mut matching = Matching { partner: vec![NONE; mesh.triangles.len()], edges };
    pairs.iter().for_each(|pair| matching.take(pair));
    matching.augment(&pairs);
    Ok(matching.quads(mesh))
}

/// A triangle's side.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Lower vertex first.
    ends: [u32; 2],
    triangle: u32,
    /// Whether the triangle runs from the lower to the higher.
    is_up: bool,
}

/// All sides, those of an edge together.
fn sides(mesh: &Mesh) -> Vec<Side> {
    let of_triangle = |(triangle, &[a, b, c]): (usize, &[u32; 3])| {
        [[a, b], [b, c], [c, a]].map(|[v, w]| Side {
            ends: [v.min(w), v.max(w)],
            triangle: triangle as u32,
            is_up: v < w,
        })
    };
    let mut sides: Vec<Side> =
        mesh.triangles.par_iter().with_min_len(CHUNK).enumerate().flat_map_iter(of_triangle).collect();
    sides.par_sort_unstable();
    sides
}

/// Two triangles that may become a quad, in the order in which they do.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    /// Bits of a cost that is 0 or greater: they sort as the numbers do.
    cost: u64,
    triangles: [u32; 2],
    /// The edge that goes.
    ends: [u32; 2],
}

impl Pair {
    fn of(mesh: &Mesh, pairing: &Pairing, one: &Side, two: &Side) -> Option<Self> {
        let triangles = [one.triangle.min(two.triangle), one.triangle.max(two.triangle)];
        let quad = quad(mesh, triangles, one.ends);
        let corners = quad.map(|v| mesh.vertices[v as usize].map(f64::from));
        let [a, b, c, d] = corners;
        let normals = [cross(subtract(b, a), subtract(c, a)), cross(subtract(c, a), subtract(d, a))];
        let sizes = normals.map(length);
        let flat = dot(normals[0], normals[1]) / (sizes[0] * sizes[1]);
        let up = [0, 1, 2].map(|i| normals[0][i] / sizes[0] + normals[1][i] / sizes[1]);
        let mut worst = 0.0f64;
        for i in 0..4 {
            let [here, next, before] = [corners[i], corners[(i + 1) % 4], corners[(i + 3) % 4]];
            let (u, v) = (subtract(next, here), subtract(before, here));
            if dot(cross(u, v), up) <= 0.0 {
                return None;
            }
            worst = worst.max((dot(u, v) / (length(u) * length(v))).abs());
        }
        let is_good = flat >= pairing.least_flat && worst <= pairing.most_skewed && quad[1] != quad[3];
        // Both terms are 0 or greater but for rounding.
        is_good.then(|| Self { cost: (worst + (1.0 - flat).max(0.0)).to_bits(), triangles, ends: one.ends })
    }
}

/// The quad of two triangles that share an edge: from one end of the edge around to the other and back.
fn quad(mesh: &Mesh, triangles: [u32; 2], ends: [u32; 2]) -> [u32; 4] {
    let [t, u] = triangles.map(|t| mesh.triangles[t as usize]);
    let apex = |t: [u32; 3]| t.into_iter().find(|v| !ends.contains(v)).unwrap_or(ends[0]);
    // The lower triangle runs along the edge from `from` to `to`, then to its apex.
    let at = t.iter().position(|&v| v == apex(t)).unwrap_or(0);
    let (from, to) = (t[(at + 1) % 3], t[(at + 2) % 3]);
    [from, apex(u), to, apex(t)]
}

/// Who is whose half.
struct Matching {
    /// Triangle ──► number of its pair, or [`NONE`].
    partner: Vec<u32>,
    /// Vertex ──► edges that are left.
    edges: Vec<u32>,
}

impl Matching {
    /// Whether an edge may go: none of its ends would be left with two edges.
    fn may_go(&self, ends: [u32; 2]) -> bool {
        ends.iter().all(|&v| self.edges[v as usize] > 3)
    }

    fn take(&mut self, pair: &Pair) {
        let is_free = pair.triangles.iter().all(|&t| self.partner[t as usize] == NONE);
        if is_free && self.may_go(pair.ends) {
            self.set(pair);
        }
    }

    fn set(&mut self, pair: &Pair) {
        let [t, u] = pair.triangles;
        (self.partner[t as usize], self.partner[u as usize]) = (u, t);
        pair.ends.iter().for_each(|&v| self.edges[v as usize] -= 1);
    }

    fn unset(&mut self, pair: &Pair) {
        pair.triangles.iter().for_each(|&t| self.partner[t as usize] = NONE);
        pair.ends.iter().for_each(|&v| self.edges[v as usize] += 1);
    }

    /// Makes two pairs of one where its halves have a left over neighbour each.
    fn augment(&mut self, pairs: &[Pair]) {
        // Each triangle's possible pairs, at most three, cheapest first.
        let mut of_triangle = vec![[NONE; 3]; self.partner.len()];
        for (number, pair) in (0u32..).zip(pairs) {
            for t in pair.triangles {
                if let Some(slot) = of_triangle[t as usize].iter_mut().find(|slot| **slot == NONE) {
                    *slot = number;
                }
            }
        }
        let known = |t: u32| of_triangle[t as usize].into_iter().filter(|&n| n != NONE).map(|n| &pairs[n as usize]);
        let other = |pair: &Pair, t: u32| if pair.triangles[0] == t { pair.triangles[1] } else { pair.triangles[0] };
        for left in 0..self.partner.len() as u32 {
            if self.partner[left as usize] != NONE {
                continue;
            }
            'found: for first in known(left) {
                let near = other(first, left);
                let far = self.partner[near as usize];
                if far == NONE {
                    continue;
                }
                let Some(between) = known(near).find(|pair| other(pair, near) == far) else { continue };
                for last in known(far) {
                    let end = other(last, far);
                    if end == left || self.partner[end as usize] != NONE {
                        continue;
                    }
                    self.unset(between);
                    if self.may_go(first.ends) {
                        self.set(first);
                        if self.may_go(last.ends) {
                            self.set(last);
                            break 'found;
                        }
                        self.unset(first);
                    }
                    self.set(between);
                }
            }
        }
    }

    /// Quads and the triangles that are left, each in the order of the triangles.
    fn quads(&self, mut mesh: Mesh) -> QuadMesh {
        let of_triangle = |t: usize| {
            let partner = self.partner[t];
            (partner != NONE && partner as usize > t).then(|| {
                let [one, two] = [t, partner as usize].map(|t| mesh.triangles[t]);
                let shared: Vec<u32> = one.into_iter().filter(|v| two.contains(v)).collect();
                quad(&mesh, [t as u32, partner], [shared[0], shared[1]])
            })
        };
        let quads = (0..mesh.triangles.len()).into_par_iter().with_min_len(CHUNK).filter_map(of_triangle).collect();
        let mut partner = self.partner.iter();
        mesh.triangles.retain(|_| partner.next() == Some(&NONE));
        QuadMesh { mesh, quads }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, mesh::Report, reconstruct};

    fn tangled(seed: usize) -> Mesh {
        let positions: Vec<[f32; 3]> = (0..400)
            .map(|i| [i * 37 + seed, i * i * 53 + 7 * seed, i * 101 + i / 7 * seed].map(|v| (v % 97) as f32 * 0.006))
            .collect();
        reconstruct(&positions, &Params::new(0.025)).unwrap()
    }

    fn run(mesh: &Mesh) -> QuadMesh {
        pair(mesh.clone(), &Pairing::default(), &Control::default()).unwrap()
    }

    #[test]
    fn the_triangles_are_those_of_before_and_most_are_in_quads() {
        for seed in 0..5 {
            let mesh = tangled(seed);
            let found = run(&mesh);
            assert!(found.mesh.triangles.len() < mesh.triangles.len() / 4, "{}", found.mesh.triangles.len());
            let sorted = |mesh: &Mesh| {
                // Turned so that the lowest corner comes first.
                let turn = |t: &[u32; 3]| {
                    let first = (0..3).min_by_key(|&i| t[i]).unwrap();
                    [t[first], t[(first + 1) % 3], t[(first + 2) % 3]]
                };
                let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(turn).collect();
                triangles.sort_unstable();
                triangles
            };
            let again = found.triangulated();
            assert_eq!(sorted(&again), sorted(&mesh));
            assert!(Report::of(&again).closed_manifold());
            // No vertex is left with two edges, where quads would fold.
            let mut edges: Vec<[u32; 2]> =
                found.mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
            edges.extend(found.quads.iter().flat_map(|&[a, b, c, d]| [[a, b], [b, c], [c, d], [d, a]]));
            let mut count = vec![0; mesh.vertices.len()];
            edges.iter().for_each(|&[a, _]| count[a as usize] += 1);
            assert!(count.iter().all(|&n| n >= 3));
        }
    }

    #[test]
    fn threads_do_not_show() {
        let mesh = tangled(3);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run(&mesh))
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn a_grid_of_squares_becomes_squares_and_folds_stay() {
        let n = 8u32;
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let triangles = squares.flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        });
        let flat = |i: u32, j: u32| [i as f32, j as f32, 0.0];
        let vertices = (0..=n).flat_map(|i| (0..=n).map(move |j| flat(i, j))).collect();
        let mut mesh = Mesh { vertices, triangles: triangles.collect(), ..Mesh::default() };
        let found = run(&mesh);
        assert_eq!((found.quads.len(), found.mesh.triangles.len()), (64, 0));
        assert!(found.quads.iter().all(|q| {
            let corner = |i: usize| mesh.vertices[q[i] as usize];
            (0..4).all(|i| (0..2).map(|a| (corner(i)[a] - corner((i + 1) % 4)[a]).abs()).sum::<f32>() == 1.0)
        }));
        // Folded along every diagonal by more than 26 degrees nothing may pair that way.
        mesh.vertices.iter_mut().for_each(|v| v[2] = 2.0 * ((v[0] + v[1]) % 2.0));
        let none = Pairing { least_flat: 0.999, ..Pairing::default() };
        assert_eq!(pair(mesh, &none, &Control::default()).unwrap().quads.len(), 0);
        let wrong = Pairing { most_skewed: 2.0, ..Pairing::default() };
        assert!(pair(Mesh::default(), &wrong, &Control::default()).is_err());
        assert_eq!(run(&Mesh::default()), QuadMesh::default());
    }
}
