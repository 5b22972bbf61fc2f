//! Values of all vertices, and steps that give each one what its neighbors have.
//!
//! Source: see [rings](super).

use rayon::prelude::*;

use super::{FEW, Near, OWN, Patch, Rings};
use crate::{
    Control, Error,
    math::memory::filled,
    math::simd::{Kernel, Quad, Simd, Unit},
    params::Lanes,
};

/// What a vertex gets from its neighbors.
pub(crate) trait Step: Sync {
    /// From the value of a vertex, the sum over its neighbors, and one over their number.
    fn of(&self, here: Quad, sum: Quad, per: f32) -> Quad;
}

/// Four numbers for each vertex, in the order of places. Reusable: [`set`](Self::set) keeps the memory.
#[derive(Default)]
pub(crate) struct Values {
    now: Vec<[f32; 4]>,
    /// What the next steps write.
    next: Vec<[f32; 4]>,
}

impl Values {
    /// Sets what the vertices have.
    pub(crate) fn set(&mut self, rings: &Rings, of_vertex: impl Fn(usize) -> [f32; 4] + Sync) {
        let vertices = rings.vertices();
        if self.now.len() != vertices {
            *self = Self { now: filled([0.0; 4], vertices), next: filled([0.0; 4], vertices) };
        }
        self.now.par_chunks_mut(OWN).zip(&rings.patches).for_each(|(to, patch)| {
            to.iter_mut().zip(&patch.own).for_each(|(to, &v)| *to = of_vertex(v as usize));
        });
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
            let patches = rings.patches.par_iter().zip(now.par_chunks(OWN)).zip(next.par_chunks_mut(OWN));
            let copies = || [filled([0.0; 4], FEW), filled([0.0; 4], FEW)];
            patches.for_each_init(copies, |copies, ((patch, own), to)| {
                unit.run(OfPatch { patch, steps: &steps, own, from: now, copies, to });
            });
            std::mem::swap(now, next);
        }
        Ok(())
    }

    /// Takes what the vertices have to where it belongs.
    pub(crate) fn take_back(&self, rings: &Rings, to: &mut [[f32; 3]]) {
        let patches = rings.patches.par_iter().zip(self.now.par_chunks(OWN)).zip(to.par_chunks_mut(OWN)).enumerate();
        patches.for_each(|(number, ((patch, now), to))| {
            patch.own.iter().zip(now).for_each(|(&v, &[x, y, z, _])| to[v as usize - number * OWN] = [x, y, z]);
        });
    }
}

/// A place among the members of a patch.
trait Place: Copy {
    /// What is there in a copy.
    fn load(self, from: &[[f32; 4]]) -> Quad;
}

impl Place for u16 {
    #[inline(always)]
    fn load(self, from: &[[f32; 4]]) -> Quad {
        Quad::load(&from[..FEW][usize::from(self)])
    }
}

impl Place for u32 {
    #[inline(always)]
    fn load(self, from: &[[f32; 4]]) -> Quad {
        Quad::load(&from[self as usize])
    }
}

/// Steps of a patch, on two copies of what its members have.
struct OfPatch<'a, T> {
    patch: &'a Patch,
    steps: &'a [&'a T],
    own: &'a [[f32; 4]],
    from: &'a [[f32; 4]],
    copies: &'a mut [Vec<[f32; 4]>; 2],
    to: &'a mut [[f32; 4]],
}

impl<T: Step> Kernel for OfPatch<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { patch, steps, own, from, copies: [now, next], to } = self;
        let members = patch.layers[steps.len()];
        if now.len() < members {
            now.resize(members, [0.0; 4]);
            next.resize(members, [0.0; 4]);
        }
        let (own_now, around_now) = now[..members].split_at_mut(own.len());
        own_now.copy_from_slice(own);
        around_now.iter_mut().zip(&patch.around).for_each(|(to, &place)| *to = from[place as usize]);
        for (step, end) in steps.iter().zip(patch.run_ends[..steps.len()].iter().rev()) {
            match &patch.near {
                Near::Few(near) => step_of(*step, &patch.runs[..*end], near, now, next),
                Near::Many(near) => step_of(*step, &patch.runs[..*end], near, now, next),
            }
            std::mem::swap(now, next);
        }
        to.copy_from_slice(&now[..own.len()]);
    }
}

/// A step of the first places, which the runs are of.
#[inline(always)]
fn step_of(step: &impl Step, runs: &[[u32; 2]], mut near: &[impl Place], from: &[[f32; 4]], mut to: &mut [[f32; 4]]) {
    let mut here = from;
    for &[valence, count] in runs {
        let (run_here, here_later) = here.split_at(count as usize);
        let (run_to, to_later) = to.split_at_mut(count as usize);
        let (run_near, near_later) = near.split_at(valence as usize * count as usize);
        match valence {
            0 => run_to.copy_from_slice(run_here),
            3 => run(3, step, run_near, from, run_here, run_to),
            4 => run(4, step, run_near, from, run_here, run_to),
            5 => run(5, step, run_near, from, run_here, run_to),
            6 => run(6, step, run_near, from, run_here, run_to),
            7 => run(7, step, run_near, from, run_here, run_to),
            8 => run(8, step, run_near, from, run_here, run_to),
            9 => run(9, step, run_near, from, run_here, run_to),
            n => run(n as usize, step, run_near, from, run_here, run_to),
        }
        (here, to, near) = (here_later, to_later, near_later);
    }
}

/// Places of one valence; where that is known beforehand the loops have no end to be foreseen.
#[inline(always)]
fn run(
    valence: usize,
    step: &impl Step,
    near: &[impl Place],
    from: &[[f32; 4]],
    here: &[[f32; 4]],
    to: &mut [[f32; 4]],
) {
    let per = 1.0 / valence as f32;
    for ((near, here), to) in near.chunks_exact(valence).zip(here).zip(to) {
        let mut sum = near[0].load(from);
        for place in &near[1..] {
            sum = sum + place.load(from);
        }
        *to = step.of(Quad::load(here), sum, per).array();
    }
}
