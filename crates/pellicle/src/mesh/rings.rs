//! Neighbors of all vertices, laid out for steps that go over them again and again.
//!
//! ```text
//! patch     8192 vertices in a row, its own, and around these some layers of neighbors
//! members   place in the patch ──► vertex: own ones, then layer after layer
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
//! makes. Within a run it is the same for all.
//!
//! Source: this project; trapezoids of space and time are Frigo & Strumpen, Cache Oblivious Stencil Computations, 2005.

use rayon::prelude::*;

use super::stars::Stars;
use crate::{
    Control, Error,
    math::memory::filled,
    math::simd::{Kernel, Quad, Simd, Unit},
    params::Lanes,
};

/// Own vertices of a patch: with what it holds of them half a megabyte, for a cache of the second level.
const OWN: usize = 1 << 13;

/// Own vertices that are sorted by valence together, so that neighbors stay near.
const BLOCK: usize = 1 << 11;

/// Most steps that a patch takes at once.
const DEEPEST: usize = 5;

/// What may be computed besides, as a share of what must be.
const TWICE: f64 = 0.3;

/// Valences from here on are sorted as one; their runs hold one place each.
const MANY: usize = 16;

/// No place.
const NONE: u32 = u32::MAX;

/// See the module.
#[derive(Default)]
pub(crate) struct Rings {
    patches: Vec<Patch>,
    /// Steps that patches take at once.
    depth: usize,
}

#[derive(Default)]
struct Patch {
    members: Vec<u32>,
    /// Where each layer ends among the members; own vertices are layer 0.
    layers: Vec<usize>,
    runs: Vec<[u32; 2]>,
    /// Where each layer's runs end. The outermost is only read and has none.
    run_ends: Vec<usize>,
    near: Vec<u32>,
}

/// What a vertex gets from its neighbors.
pub(crate) trait Step: Sync {
    /// From the value of a vertex, the sum over its neighbors, and one over their number.
    fn of(&self, here: Quad, sum: Quad, per: f32) -> Quad;
}

/// Four numbers for each vertex. Reusable: [`set`](Self::set) keeps the memory.
#[derive(Default)]
pub(crate) struct Values {
    now: Vec<[f32; 4]>,
    /// What the next steps write.
    next: Vec<[f32; 4]>,
}

impl Values {
    /// Sets what the vertices have.
    pub(crate) fn set(&mut self, vertices: usize, of_vertex: impl Fn(usize) -> [f32; 4] + Sync) {
        if self.now.len() != vertices {
            *self = Self { now: filled([0.0; 4], vertices), next: filled([0.0; 4], vertices) };
        }
        self.now.par_iter_mut().enumerate().with_min_len(OWN).for_each(|(v, to)| *to = of_vertex(v));
    }

    /// Steps of all vertices, one after the other, `cycle` so many times; those without neighbors stay.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn steps(
        &mut self,
        rings: &Rings,
        cycle: &[impl Step],
        times: usize,
        control: &Control<'_>,
    ) -> Result<(), Error> {
        let unit = Unit::new(Lanes::Auto).expect("every machine has one");
        let depth = rings.depth.max(1);
        let all = cycle.len().saturating_mul(times);
        for first in (0..all).step_by(depth) {
            control.check()?;
            let steps: Vec<_> = (first..all.min(first + depth)).map(|i| &cycle[i % cycle.len()]).collect();
            let Self { now, next } = self;
            let patches = rings.patches.par_iter().zip(next.par_chunks_mut(OWN)).enumerate();
            patches.for_each_init(Default::default, |copies, (number, (patch, to))| {
                unit.run(OfPatch { patch, steps: &steps, from: now, first: number * OWN, copies, to });
            });
            std::mem::swap(now, next);
        }
        Ok(())
    }

    /// Takes what the vertices have to where it belongs.
    pub(crate) fn take_back(&self, to: &mut [[f32; 3]]) {
        let pairs = to.par_iter_mut().zip(&self.now).with_min_len(OWN);
        pairs.for_each(|(to, &[x, y, z, _])| *to = [x, y, z]);
    }
}

impl Rings {
    /// The neighbors that follow a vertex in its triangles: all of them, unless it is at a border.
    pub(crate) fn of(stars: &Stars) -> Self {
        // Some patches tell how many steps pay; if others are worse, none do.
        let some = Self::deep(stars, DEEPEST, 16);
        let depth = (2..=DEEPEST).rev().find(|&depth| some.pays(depth)).unwrap_or(1);
        let rings = Self::deep(stars, depth, 1);
        if depth == 1 || rings.pays(depth) { rings } else { Self::deep(stars, 1, 1) }
    }

    /// For so many steps at once, of every so many patches.
    fn deep(stars: &Stars, depth: usize, every: usize) -> Self {
        let n = stars.len();
        let patch = |place: &mut Vec<u32>, p: usize| {
            let mut patch = Patch::around(stars, p * every * OWN, depth, place);
            patch.link(stars, depth, place);
            patch.members.iter().for_each(|&v| place[v as usize] = NONE);
            patch
        };
        let patches = (0..n.div_ceil(every * OWN)).into_par_iter().map_init(|| filled(NONE, n), patch).collect();
        Self { patches, depth }
    }

    /// Whether not too much is computed twice with so many steps at once.
    fn pays(&self, depth: usize) -> bool {
        // The first of so many steps is taken up to the layer before the outermost, the last by own vertices alone.
        let computed: usize = self.patches.iter().map(|patch| patch.layers.iter().take(depth).sum::<usize>()).sum();
        let own: usize = self.patches.iter().map(|patch| patch.layers[0]).sum();
        let is_deep = self.patches.iter().all(|patch| patch.layers.len() > depth);
        is_deep && computed as f64 <= (1.0 + TWICE) * (depth * own) as f64
    }
}

impl Patch {
    /// Vertices from `first` on and so many layers around them. `place` is [`NONE`] everywhere, and not so for members after.
    fn around(stars: &Stars, first: usize, depth: usize, place: &mut [u32]) -> Self {
        let own = first..stars.len().min(first + OWN);
        let is_own = |v: u32| own.contains(&(v as usize));
        let mut members = Vec::with_capacity(2 * OWN);
        members.extend(own.clone().map(|v| v as u32));
        let mut layers = vec![members.len()];
        let mut start = 0;
        // Where numbers jump about the second layer is never wanted, and larger than memory.
        while layers.len() <= depth && (layers.len() == 1 || members.len() < 2 * OWN) {
            let end = members.len();
            for i in start..end {
                for &[next, _] in stars.corners(members[i] as usize) {
                    if !is_own(next) && place[next as usize] == NONE {
                        place[next as usize] = 0;
                        members.push(next);
                    }
                }
            }
            members[end..].sort_unstable();
            layers.push(members.len());
            start = end;
        }
        Self { members, layers, ..Self::default() }
    }

    /// Sorts the members and links them to their neighbors, unless layers are missing.
    fn link(&mut self, stars: &Stars, depth: usize, place: &mut [u32]) {
        let Self { members, layers, runs, run_ends, near } = self;
        let mut start = 0;
        for &end in layers.iter().take(depth) {
            let block = if start == 0 { BLOCK } else { OWN };
            members[start..end].chunks_mut(block).for_each(|block| sort(stars, block, runs));
            run_ends.push(runs.len());
            start = end;
        }
        if layers.len() <= depth {
            return;
        }
        members.iter().zip(0..).for_each(|(&v, i)| place[v as usize] = i);
        let linked = &members[..start];
        near.reserve_exact(linked.iter().map(|&v| stars.valence(v) as usize).sum());
        for &v in linked {
            near.extend(stars.corners(v as usize).iter().map(|corner| place[corner[0] as usize]));
        }
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

/// Steps of a patch, on two copies of what its members have.
struct OfPatch<'a, T> {
    patch: &'a Patch,
    steps: &'a [&'a T],
    from: &'a [[f32; 4]],
    first: usize,
    copies: &'a mut [Vec<[f32; 4]>; 2],
    to: &'a mut [[f32; 4]],
}

impl<T: Step> Kernel for OfPatch<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { patch, steps, from, first, copies: [now, next], to } = self;
        now.clear();
        now.extend(patch.members[..patch.layers[steps.len()]].iter().map(|&v| from[v as usize]));
        next.resize(now.len(), [0.0; 4]);
        for (step, end) in steps.iter().zip(patch.run_ends[..steps.len()].iter().rev()) {
            patch.step(*step, &patch.runs[..*end], now, next);
            std::mem::swap(now, next);
        }
        for (&v, value) in patch.members[..patch.layers[0]].iter().zip(now) {
            to[v as usize - first] = *value;
        }
    }
}

impl Patch {
    #[inline(always)]
    fn step(&self, step: &impl Step, runs: &[[u32; 2]], from: &[[f32; 4]], mut to: &mut [[f32; 4]]) {
        let (mut near, mut here) = (&self.near[..], from);
        for &[valence, count] in runs {
            let (run_here, here_later) = here.split_at(count as usize);
            let (run_to, to_later) = to.split_at_mut(count as usize);
            let (run_near, near_later) = near.split_at(valence as usize * count as usize);
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
        for spokes in (3..40).cycle().take(900) {
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
        values.set(n, value);
        values.take_back(&mut same);
        values.steps(&rings, &[Sum], 1, &Control::default()).unwrap();
        values.take_back(&mut found);
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
        let (rows, columns) = (240, 120);
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
        let jump = |v: u32| (u64::from(v) * 7919 % 28_800) as u32;
        for (mesh, depths) in [(torus(|v| v), 2..=DEEPEST), (torus(jump), 1..=1)] {
            let (triangles, n) = mesh;
            let stars = Stars::of(&triangles, n);
            let rings = Rings::of(&stars);
            assert!(n > 3 * OWN && depths.contains(&rings.depth), "{}", rings.depth);
            let value = |v: usize| [(v * 37 % 101) as f32, 1.0, 0.0, 0.5];
            let mut values = Values::default();
            values.set(n, value);
            values.steps(&rings, &[Sum, Sum, Sum], 4, &Control::default()).unwrap();
            let mut want: Vec<f32> = (0..n).map(|v| value(v)[0]).collect();
            for _ in 0..12 {
                let of_vertex = |v: usize| {
                    let near = stars.corners(v).iter().map(|corner| want[corner[0] as usize]);
                    near.clone().sum::<f32>() * (1.0 / near.count() as f32)
                };
                want = (0..n).map(of_vertex).collect();
            }
            assert!(values.now.iter().zip(&want).all(|(found, want)| found[0] == *want));
        }
    }
}
