//! Neighbors of all vertices, laid out for steps that go over them again and again.
//!
//! ```text
//! patch     16384 vertices in a row, its own, and around these some layers of neighbors
//! own       place ──► vertex, those of the same valence together
//! around    the others, layer after layer, each by the place that it has where it is own, counted through all patches
//! runs      (valence, how many places), in the order of the places
//! near      places of the neighbors of each, as many as its valence, in the order of the vertex's star
//! ```
//!
//! A step reads and writes every vertex once, and memory is slower than sums. So a patch takes several steps at once, on a
//! copy that fits the cache: with each of them one layer fewer is right, and after the last its own vertices still are. The price is
//! what neighboring patches compute twice. How many steps pay is told by the layers' sizes: one, where vertices in a row do not
//! lie together. The values do not depend on it.
//!
//! Valences of a mesh are 4 to 8 in no order, and a loop whose length nobody can foresee costs more than the sum that it
//! makes. Within a run it is the same for all. Places fit 16 bits, and copies have as many, so that no place is compared with a
//! bound; only around a vertex of tens of thousands of neighbors they do not.
//!
//! Source: this project; trapezoids of space and time are Frigo & Strumpen, Cache Oblivious Stencil Computations, 2005.

use rayon::prelude::*;

use super::stars::Stars;
use crate::math::memory::filled;

mod steps;

pub(crate) use steps::{Step, Values};

/// Own vertices of a patch: with what it holds of them and around them a megabyte, for a cache of the second level.
const OWN: usize = 1 << 14;

/// Own vertices that are sorted by valence together, so that neighbors stay near.
const BLOCK: usize = 1 << 11;

/// Most steps that a patch takes at once.
const DEEPEST: usize = 5;

/// What may be computed besides, as a share of what must be.
const TWICE: f64 = 0.3;

/// Valences from here on are sorted as one; their runs hold one place each.
const MANY: usize = 16;

/// Places that 16 bits tell apart, for which copies always have room.
const FEW: usize = 1 << 16;

/// No place.
const NONE: u32 = u32::MAX;

/// See the module.
#[derive(Default)]
pub(crate) struct Rings {
    patches: Vec<Patch>,
    /// Steps that patches take at once.
    depth: usize,
}

#[derive(Default, Clone)]
struct Patch {
    own: Vec<u32>,
    around: Vec<u32>,
    /// How many members there are up to the end of each layer; own vertices are layer 0.
    layers: Vec<usize>,
    runs: Vec<[u32; 2]>,
    /// Where each layer's runs end. The outermost is only read and has none.
    run_ends: Vec<usize>,
    near: Near,
}

#[derive(Clone)]
enum Near {
    Few(Vec<u16>),
    Many(Vec<u32>),
}

impl Rings {
    /// The neighbors that follow a vertex in its triangles: all of them, unless it is at a border.
    pub(crate) fn of(stars: &Stars) -> Self {
        let order = Order::of(stars);
        // Some patches tell how many steps pay; if others are worse, none do.
        let some = order.deep(DEEPEST, 16);
        let depth = (2..=DEEPEST).rev().find(|&depth| some.pays(depth)).unwrap_or(1);
        let rings = order.deep(depth, 1);
        if depth == 1 || rings.pays(depth) { rings } else { order.deep(1, 1) }
    }

    fn vertices(&self) -> usize {
        self.patches.iter().map(|patch| patch.own.len()).sum()
    }

    /// Whether not too much is computed twice with so many steps at once.
    fn pays(&self, depth: usize) -> bool {
        // The first of so many steps is taken up to the layer before the outermost, the last by own vertices alone.
        let computed: usize = self.patches.iter().map(|patch| patch.layers.iter().take(depth).sum::<usize>()).sum();
        let own: usize = self.patches.iter().map(|patch| patch.own.len()).sum();
        let is_deep = self.patches.iter().all(|patch| patch.layers.len() > depth);
        is_deep && computed as f64 <= (1.0 + TWICE) * (depth * own) as f64
    }
}

/// Where all vertices are own.
struct Order<'a> {
    stars: &'a Stars,
    /// Patches without what is around them.
    patches: Vec<Patch>,
    /// Vertex ──► its place, counted through all patches.
    places: Vec<u32>,
}

impl<'a> Order<'a> {
    fn of(stars: &'a Stars) -> Self {
        let mut places = filled(0, stars.len());
        let chunks = places.par_chunks_mut(OWN).enumerate();
        let patches = chunks.map(|(number, places)| {
            let first = (number * OWN) as u32;
            let (mut own, mut runs): (Vec<u32>, _) = ((first..first + places.len() as u32).collect(), Vec::new());
            own.chunks_mut(BLOCK).for_each(|block| sort(stars, block, &mut runs));
            own.iter().zip(first..).for_each(|(&v, place)| places[(v - first) as usize] = place);
            Patch { layers: vec![own.len()], run_ends: vec![runs.len()], own, runs, ..Patch::default() }
        });
        Self { stars, patches: patches.collect(), places }
    }

    /// For so many steps at once, of every so many patches.
    fn deep(&self, depth: usize, every: usize) -> Rings {
        let patch = |(place, links): &mut (Vec<u32>, Vec<u32>), p: usize| {
            let mut patch = self.patches[p * every].clone();
            self.surround(&mut patch, (p * every * OWN) as u32, depth, place, links);
            patch
        };
        let numbers = (0..self.patches.len().div_ceil(every)).into_par_iter();
        let patches = numbers.map_init(|| (filled(NONE, self.places.len()), Vec::new()), patch).collect();
        Rings { patches, depth }
    }

    /// Adds so many layers around a patch, if they are wanted. `place` is [`NONE`] everywhere, before and after; `links` is
    /// for its use.
    fn surround(&self, patch: &mut Patch, first: u32, depth: usize, place: &mut [u32], links: &mut Vec<u32>) {
        let (stars, Patch { own, around, layers, runs, run_ends, near }) = (self.stars, patch);
        let own_count = own.len() as u32;
        links.clear();
        let mut start = 0;
        // Where numbers jump about the second layer is never wanted, and larger than memory.
        while layers.len() <= depth && (layers.len() == 1 || around.len() < OWN) {
            let (end, linked) = (around.len(), links.len());
            let mut link = |v: u32, around: &mut Vec<u32>| {
                links.extend(stars.corners(v as usize).iter().map(|&[next, _]| {
                    if next.wrapping_sub(first) < own_count {
                        return self.places[next as usize] - first;
                    }
                    let place = &mut place[next as usize];
                    if *place == NONE {
                        *place = own_count + around.len() as u32;
                        around.push(next);
                    }
                    *place
                }));
            };
            match layers.len() {
                1 => own.iter().for_each(|&v| link(v, around)),
                _ => (start..end).for_each(|i| link(around[i], around)),
            }
            // The new layer in its order, and its places with it.
            let (new, before) = (own_count + end as u32, around[end..].to_vec());
            around[end..].sort_unstable();
            if layers.len() < depth {
                sort(stars, &mut around[end..], runs);
                run_ends.push(runs.len());
            }
            around[end..].iter().zip(new..).for_each(|(&v, i)| place[v as usize] = i);
            let is_new = |link: &&mut u32| **link >= new;
            links[linked..]
                .iter_mut()
                .filter(is_new)
                .for_each(|link| *link = place[before[(*link - new) as usize] as usize]);
            layers.push(own.len() + around.len());
            start = end;
        }
        if layers.len() > depth {
            *near = Near::of(links, own.len() + around.len());
        }
        around.iter_mut().for_each(|v| {
            place[*v as usize] = NONE;
            *v = self.places[*v as usize];
        });
    }
}

/// Puts vertices in the order of their valences and tells the runs. Those without a neighbor come first.
fn sort(stars: &Stars, vertices: &mut [u32], runs: &mut Vec<[u32; 2]>) {
    let class = |v: u32| (stars.valence(v) as usize).min(MANY);
    let mut start = [0u32; MANY + 2];
    vertices.iter().for_each(|&v| start[class(v) + 1] += 1);
    runs.extend((0..MANY).map(|n| [n as u32, start[n + 1]]).filter(|run| run[1] > 0));
    for n in 1..start.len() {
        start[n] += start[n - 1];
    }
    let many = start[MANY] as usize;
    let before = vertices.to_vec();
    for v in before {
        let next = &mut start[class(v)];
        vertices[*next as usize] = v;
        *next += 1;
    }
    runs.extend(vertices[many..].iter().map(|&v| [stars.valence(v), 1]));
}

impl Default for Near {
    fn default() -> Self {
        Self::Few(Vec::new())
    }
}

impl Near {
    /// Places among so many members.
    fn of(places: &[u32], members: usize) -> Self {
        match members <= FEW {
            true => Self::Few(places.iter().map(|&place| place as u16).collect()),
            false => Self::Many(places.to_vec()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Control, math::simd::Quad};

    /// Sums, as they are.
    struct Sum;

    impl Step for Sum {
        fn of(&self, here: Quad, sum: Quad, per: f32) -> Quad {
            let ([mean, ..], [_, count, ..], [_, _, z, w]) =
                ((sum * Quad::splat(per)).array(), sum.array(), here.array());
            Quad::load(&[mean, count, z, w])
        }
    }

    /// Wheels of many sizes, and lone vertices between them: the hub is that with most spokes.
    fn wheels() -> (Vec<[u32; 3]>, usize) {
        let (mut triangles, mut n) = (Vec::new(), 0);
        // One hub has more neighbors than 16 bits tell apart.
        for spokes in (3..40).cycle().take(1500).chain([70_000]) {
            triangles.extend((0..spokes).map(|i| [n, n + 1 + i, n + 1 + (i + 1) % spokes]));
            // A lid from below, so that all is closed.
            triangles.extend((0..spokes).map(|i| [n + spokes + 1, n + 1 + (i + 1) % spokes, n + 1 + i]));
            n += spokes + 3;
        }
        (triangles, n as usize)
    }

    #[test]
    fn every_vertex_gets_the_sum_of_its_neighbors_whatever_its_valence() {
        let (triangles, n) = wheels();
        let stars = Stars::of(&triangles, n);
        let rings = Rings::of(&stars);
        let value = |v: usize| [(v * 37 % 101) as f32, 1.0, v as f32, 0.5];
        let (mut found, mut same) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        let mut values = Values::default();
        values.set(&rings, value);
        values.take_back(&rings, &mut same);
        values.steps(&rings, &[Sum], 1, &Control::default()).unwrap();
        values.take_back(&rings, &mut found);
        assert!(n > 2 * OWN);
        for v in 0..n {
            let [x, y, z, _] = value(v);
            assert_eq!(same[v], [x, y, z]);
            let near: Vec<usize> = stars.corners(v).iter().map(|corner| corner[0] as usize).collect();
            let want = match near.len() {
                0 => [x, y, z],
                count => {
                    let sum: f32 = near.iter().map(|&n| value(n)[0]).sum();
                    [sum * (1.0 / count as f32), count as f32, z]
                }
            };
            assert_eq!(found[v], want, "{v}");
        }
    }

    /// A torus of squares, its vertices numbered by `number`.
    fn torus(number: impl Fn(u32) -> u32) -> (Vec<[u32; 3]>, usize) {
        let (rows, columns) = (480, 120);
        let at = |i: u32, j: u32| number(i % rows * columns + j % columns);
        let squares = (0..rows * columns).flat_map(|q| {
            let (i, j) = (q / columns, q % columns);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if q % 7 == 0 { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
        });
        (squares.collect(), (rows * columns) as usize)
    }

    #[test]
    fn steps_at_once_give_what_steps_one_by_one_do_and_numbers_that_jump_take_one() {
        // 7919 is prime to the number of vertices.
        let jump = |v: u32| (u64::from(v) * 7919 % 57_600) as u32;
        for (mesh, depths) in [(torus(|v| v), 2..=DEEPEST), (torus(jump), 1..=1)] {
            let (triangles, n) = mesh;
            let stars = Stars::of(&triangles, n);
            let rings = Rings::of(&stars);
            assert!(n > 3 * OWN && depths.contains(&rings.depth), "{}", rings.depth);
            let value = |v: usize| [(v * 37 % 101) as f32, 1.0, 0.0, 0.5];
            let mut values = Values::default();
            values.set(&rings, value);
            values.steps(&rings, &[Sum, Sum, Sum], 4, &Control::default()).unwrap();
            let mut want: Vec<f32> = (0..n).map(|v| value(v)[0]).collect();
            for _ in 0..12 {
                let of_vertex = |v: usize| {
                    let near = stars.corners(v).iter().map(|corner| want[corner[0] as usize]);
                    near.clone().sum::<f32>() * (1.0 / near.count() as f32)
                };
                want = (0..n).map(of_vertex).collect();
            }
            let mut found = vec![[0.0; 3]; n];
            values.take_back(&rings, &mut found);
            assert!(found.iter().zip(&want).all(|(found, want)| found[0] == *want));
        }
    }
}
