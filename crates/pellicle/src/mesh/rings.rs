//! Neighbors of all vertices, laid out for loops that go over them again and again.
//!
//! ```text
//! block   2048 vertices in a row; within one, vertices come by valence, then by number: their places
//! order   place ──► vertex
//! runs    (valence, how many places), block after block
//! near    places of the neighbors of each place, as many as its valence, in the order of the vertex's star
//! ```
//!
//! Valences of a mesh are 4 to 8 in no order, and a loop whose length nobody can foresee costs more than the sum that it
//! makes. Within a run it is the same for all. Places are gone through one after the other, so memory is asked for ahead of its
//! use, and blocks keep near what is near.

use rayon::prelude::*;

use super::stars::Stars;
use crate::{
    math::memory::filled,
    math::simd::{Kernel, Quad, Simd, Unit},
    params::Lanes,
};

/// Places of a block.
const BLOCK: usize = 1 << 11;

/// Valences from here on are sorted as one; their runs hold one place each.
const MANY: usize = 16;

/// See the module.
#[derive(Default)]
pub(crate) struct Rings {
    order: Vec<u32>,
    blocks: Vec<Block>,
}

struct Block {
    /// Valence and number of places.
    runs: Vec<[u32; 2]>,
    near: Vec<u32>,
}

/// What a vertex gets from its neighbors.
pub(crate) trait Step: Sync {
    /// From the value of a vertex, the sum over its neighbors, and one over their number.
    fn of(&self, here: Quad, sum: Quad, per: f32) -> Quad;
}

/// Four numbers for each place. Reusable: [`set`](Self::set) keeps the memory.
#[derive(Default)]
pub(crate) struct Values {
    now: Vec<[f32; 4]>,
    /// What the next step writes.
    next: Vec<[f32; 4]>,
}

impl Values {
    /// Sets what the places have, by vertex.
    pub(crate) fn set(&mut self, rings: &Rings, of_vertex: impl Fn(usize) -> [f32; 4] + Sync) {
        let n = rings.order.len();
        if self.now.len() != n {
            *self = Self { now: filled([0.0; 4], n), next: filled([0.0; 4], n) };
        }
        let places = self.now.par_iter_mut().zip(&rings.order).with_min_len(BLOCK);
        places.for_each(|(to, &v)| *to = of_vertex(v as usize));
    }

    /// One step of all places; those without neighbors stay.
    pub(crate) fn step(&mut self, rings: &Rings, step: &impl Step) {
        let Self { now, next } = self;
        let blocks = rings.blocks.par_iter().zip(next.par_chunks_mut(BLOCK)).zip(now.par_chunks(BLOCK));
        let unit = Unit::new(Lanes::Auto).expect("every machine has one");
        blocks.for_each(|((block, to), here)| unit.run(OfBlock { block, step, from: now, here, to }));
        std::mem::swap(now, next);
    }

    /// Takes what the places have back to the vertices.
    pub(crate) fn take_back(&self, rings: &Rings, to: &mut [[f32; 3]]) {
        let blocks = to.par_chunks_mut(BLOCK).zip(rings.order.par_chunks(BLOCK)).zip(self.now.par_chunks(BLOCK));
        blocks.enumerate().for_each(|(block, ((to, order), values))| {
            for (&v, &[x, y, z, _]) in order.iter().zip(values) {
                to[v as usize - block * BLOCK] = [x, y, z];
            }
        });
    }
}

impl Rings {
    /// The neighbors that follow a vertex in its triangles: all of them, unless it is at a border.
    pub(crate) fn of(stars: &Stars) -> Self {
        let n = stars.len();
        let (mut order, mut place) = (filled(0, n), filled(0, n));
        let blocks = order.par_chunks_mut(BLOCK).zip(place.par_chunks_mut(BLOCK)).enumerate();
        let runs = blocks.map(|(block, (order, place))| sort(stars, block * BLOCK, order, place)).collect::<Vec<_>>();
        let near = |order: &[u32]| {
            let mut near = Vec::with_capacity(order.iter().map(|&v| stars.corners(v as usize).len()).sum());
            for &v in order {
                near.extend(stars.corners(v as usize).iter().map(|corner| place[corner[0] as usize]));
            }
            near
        };
        let blocks = order.par_chunks(BLOCK).zip(runs).map(|(order, runs)| Block { runs, near: near(order) });
        Self { blocks: blocks.collect(), order }
    }
}

/// Puts the vertices of a block, from `first` on, in order, and tells the runs. Those without a neighbor come first.
fn sort(stars: &Stars, first: usize, order: &mut [u32], place: &mut [u32]) -> Vec<[u32; 2]> {
    let mut start = [0u32; MANY + 2];
    for i in 0..order.len() {
        start[stars.corners(first + i).len().min(MANY) + 1] += 1;
    }
    for n in 1..start.len() {
        start[n] += start[n - 1];
    }
    let runs = (0..MANY).map(|n| [n as u32, start[n + 1] - start[n]]).filter(|run| run[1] > 0);
    let mut runs: Vec<[u32; 2]> = runs.collect();
    for i in 0..order.len() {
        let next = &mut start[stars.corners(first + i).len().min(MANY)];
        order[*next as usize] = (first + i) as u32;
        place[i] = first as u32 + *next;
        *next += 1;
    }
    let many = start[MANY - 1] as usize;
    runs.extend(order[many..].iter().map(|&v| [stars.corners(v as usize).len() as u32, 1]));
    runs
}

/// One step of the places of a block.
struct OfBlock<'a, T> {
    block: &'a Block,
    step: &'a T,
    from: &'a [[f32; 4]],
    here: &'a [[f32; 4]],
    to: &'a mut [[f32; 4]],
}

impl<T: Step> Kernel for OfBlock<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.block.step(self.step, self.from, self.here, self.to);
    }
}

impl Block {
    #[inline(always)]
    fn step(&self, step: &impl Step, from: &[[f32; 4]], mut here: &[[f32; 4]], mut to: &mut [[f32; 4]]) {
        let mut near = &self.near[..];
        for &[valence, count] in &self.runs {
            let (run_here, here_later) = here.split_at(count as usize);
            let (run_to, to_later) = to.split_at_mut(count as usize);
            let (run_near, near_later) = near.split_at((valence * count) as usize);
            match valence {
                0 => run_to.copy_from_slice(run_here),
                3 => run::<3>(step, run_near, from, run_here, run_to),
                4 => run::<4>(step, run_near, from, run_here, run_to),
                5 => run::<5>(step, run_near, from, run_here, run_to),
                6 => run::<6>(step, run_near, from, run_here, run_to),
                7 => run::<7>(step, run_near, from, run_here, run_to),
                8 => run::<8>(step, run_near, from, run_here, run_to),
                9 => run::<9>(step, run_near, from, run_here, run_to),
                n => run_of(n as usize, step, run_near, from, run_here, run_to),
            }
            (here, to, near) = (here_later, to_later, near_later);
        }
    }
}

/// Places of valence `N`.
#[inline(always)]
fn run<const N: usize>(step: &impl Step, near: &[u32], from: &[[f32; 4]], here: &[[f32; 4]], to: &mut [[f32; 4]]) {
    let per = 1.0 / N as f32;
    for ((near, here), to) in near.as_chunks::<N>().0.iter().zip(here).zip(to) {
        let mut sum = Quad::load(&from[near[0] as usize]);
        for n in &near[1..] {
            sum = sum + Quad::load(&from[*n as usize]);
        }
        *to = step.of(Quad::load(here), sum, per).array();
    }
}

/// Places of any valence.
#[inline(always)]
fn run_of(valence: usize, step: &impl Step, near: &[u32], from: &[[f32; 4]], here: &[[f32; 4]], to: &mut [[f32; 4]]) {
    let per = 1.0 / valence as f32;
    for ((near, here), to) in near.chunks_exact(valence).zip(here).zip(to) {
        let mut sum = Quad::load(&from[near[0] as usize]);
        for n in &near[1..] {
            sum = sum + Quad::load(&from[*n as usize]);
        }
        *to = step.of(Quad::load(here), sum, per).array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for spokes in (3..40).cycle().take(200) {
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
        values.step(&rings, &Sum);
        values.take_back(&rings, &mut found);
        assert!(n > 2 * BLOCK);
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
}
