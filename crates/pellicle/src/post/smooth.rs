//! Weighted Laplacian smoothing: bumps of the particles out, drops and thin features kept.
//!
//! Every vertex moves towards the mean of its neighbors, by a share that is 0 where particles are few (spray, thin films,
//! which would shrink away) and 1 within a body of fluid:
//!
//! ```text
//! n_i   = Σ_{j≠i} (1 − |x_i − x_j|²/h²)₊         how crowded particle i is      crowding()
//! n(v)  = Σ V_i n_i W / Σ V_i W                  carried to the vertices as any attribute is
//! u     = min(n(v)/13, 1),  w = 6u⁵ − 15u⁴ + 10u³                               weights()
//! v    ← v + β w (mean of neighbors − v)         all at once, from the old positions   smooth()
//! ```
//!
//! Without weights that would shrink all bodies alike. [`Filter::Taubin`] follows every step by one back, a little longer:
//!
//! ```text
//! v ← v + β w (mean − v),  v ← v − β/(1 − 0.1 β) w (mean − v)
//! ```
//!
//! Positions are offsets from the mesh's origin, in `f32`, as the mesh holds them. Indices do not change, so a closed
//! manifold stays one. Slivers become spikes: remove them first ([`snap`](super::snap)).
//!
//! Source: Löschner, Böttcher, Jeske, Bender, Weighted Laplacian Smoothing for Surface Reconstruction of Particle-based
//! Fluids, 2023; there and back is Taubin, A Signal Processing Approach to Fair Surface Design, 1995.

use rayon::prelude::*;

use super::check;
use crate::{
    Control, Error, Mesh,
    math::simd::Quad,
    mesh::rings::{Rings, Step, Values},
    mesh::stars::Stars,
};

/// How much is smoothed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// How often every vertex moves, there and back if it does so. Default 25.
    pub iterations: usize,
    /// β: the share of the way to the mean of the neighbors where the weight is 1. 0 to 1, default 1; with
    /// [`Filter::Taubin`] 0 to [`Filter::MOST_TAUBIN`], of which half is a good value.
    pub strength: f32,
    /// What becomes of the volume. Default: Laplacian.
    pub filter: Filter,
}

/// What is smoothed away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// Everything, each step: bumps go fastest and the body shrinks slowly. Right where weights spare what is thin.
    #[default]
    Laplacian,
    /// Bumps alone: every step is followed by one back, away from the mean, by β/(1 − 0.1 β). What is as wide as a few dozen
    /// triangles stays, volume included. Right where there are no weights.
    Taubin,
}

impl Filter {
    /// Strength up to which no wave of the mesh grows.
    pub const MOST_TAUBIN: f32 = 0.65;

    /// Shares of the steps of one iteration.
    fn steps(self, strength: f32) -> [f32; 2] {
        /// Waves of which the umbrella operator takes less than this share stay: k_PB of Taubin 1995.
        const PASS: f32 = 0.1;
        match self {
            Self::Laplacian => [strength, 0.0],
            Self::Taubin => [strength, -strength / (1.0 - PASS * strength)],
        }
    }
}

impl Default for Smoothing {
    fn default() -> Self {
        Self { iterations: 25, strength: 1.0, filter: Filter::Laplacian }
    }
}

impl Smoothing {
    /// 25 steps there and back by half: for surfaces of volumes, which have no particles and so no weights.
    pub fn keeping_volume() -> Self {
        Self { strength: 0.5, filter: Filter::Taubin, ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let (most, must) = match self.filter {
            Filter::Laplacian => (1.0, "between 0 and 1"),
            Filter::Taubin => (Filter::MOST_TAUBIN, "between 0 and 0.65, for Taubin's filter to be stable"),
        };
        if (0.0..=most).contains(&self.strength) {
            return Ok(());
        }
        Err(Error::Parameter { name: "strength", value: self.strength.into(), must })
    }
}

/// Feature weights from the crowding of the particles as it was carried to the vertices: 0 for a lone particle's, 1 from
/// 13 on, smooth in between. What is not a number counts as 0.
///
/// ```
/// assert_eq!(pellicle::post::smooth::weights(&[0.0, 6.5, 13.0, 40.0]), [0.0, 0.5, 1.0, 1.0]);
/// ```
pub fn weights(crowding: &[f32]) -> Vec<f32> {
    /// Crowding of a full neighborhood. Löschner et al. 2023, section 4.
    const FULL: f32 = 13.0;
    let weight = |&n: &f32| {
        let u = (n / FULL).clamp(0.0, 1.0);
        if u.is_nan() { 0.0 } else { u * u * u * (u * (6.0 * u - 15.0) + 10.0) }
    };
    crowding.par_iter().map(weight).collect()
}

/// Moves the vertices; one weight each, or none for 1 everywhere. Normals are left as they are: they no longer fit, see
/// [`normals`](super::normals).
///
/// ```
/// # use pellicle::{Control, Params, post::smooth::{Smoothing, smooth}};
/// let mut mesh = pellicle::reconstruct(&[[0.0f32; 3], [0.05, 0.0, 0.0]], &Params::new(0.025))?;
/// let before = pellicle::mesh::Report::of(&mesh).area;
/// smooth(&mut mesh, None, &Smoothing { iterations: 3, ..Smoothing::default() }, &Control::default())?;
/// assert!(pellicle::mesh::Report::of(&mesh).area < before);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a strength out of range, [`Error::Length`] when there is not one weight a vertex,
/// [`Error::Count`] for an index that names no vertex, [`Error::Cancelled`]; the mesh is then as it was.
pub fn smooth(
    mesh: &mut Mesh,
    weights: Option<&[f32]>,
    smoothing: &Smoothing,
    control: &Control<'_>,
) -> Result<(), Error> {
    smoothing.check()?;
    check(mesh)?;
    let n = mesh.vertices.len();
    if let Some(weights) = weights.filter(|weights| weights.len() != n) {
        return Err(Error::Length { what: "weights".into(), found: weights.len(), expected: n });
    }
    if smoothing.iterations == 0 {
        return Ok(());
    }
    let stars = Stars::of(&mesh.triangles, n);
    // A vertex without triangles has no neighbors to go to.
    let closed = stars.closed(|_| false);
    let weight = |v: usize| if closed[v] { weights.map_or(1.0, |weights| weights[v]) } else { 0.0 };
    with_rings(mesh, &Rings::of(&stars), &mut Values::default(), weight, smoothing, control)
}

/// The same for a mesh whose rings are known, with memory for its vertices. The weight is 0 at a border.
pub(super) fn with_rings(
    mesh: &mut Mesh,
    rings: &Rings,
    values: &mut Values,
    weight: impl Fn(usize) -> f32 + Sync,
    smoothing: &Smoothing,
    control: &Control<'_>,
) -> Result<(), Error> {
    // The weight of each vertex travels with it, in the fourth place.
    let vertices = &mesh.vertices;
    values.set(rings, |v| {
        let [x, y, z] = vertices[v];
        [x, y, z, weight(v)]
    });
    let shares = smoothing.filter.steps(smoothing.strength).into_iter().filter(|share| *share != 0.0);
    let cycle: Vec<Relax> = shares.map(|share| Relax { share }).collect();
    values.steps(rings, &cycle, smoothing.iterations, control)?;
    values.take_back(rings, &mut mesh.vertices);
    Ok(())
}

/// One step of a vertex, by a share of its weight. The fourth place, the weight, stays.
struct Relax {
    share: f32,
}

impl Step for Relax {
    #[inline(always)]
    fn of(&self, here: Quad, sum: Quad, per: f32) -> Quad {
        let weight = here.last();
        let to = here + Quad::splat(self.share) * weight * (sum * Quad::splat(per) - here);
        // What stays does so even beside what is not finite.
        to.first_where(weight, here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, mesh::Report, reconstruct};

    fn bumpy() -> Mesh {
        let positions: Vec<[f32; 3]> = (0..216)
            .map(|i| {
                let jitter = (i * 37 % 11) as f32 * 0.002;
                [i % 6, i / 6 % 6, i / 36].map(|v| v as f32 * 0.05 + jitter)
            })
            .collect();
        reconstruct(&positions, &Params::new(0.025)).unwrap()
    }

    #[test]
    fn keeps_a_closed_manifold_and_flattens_it() {
        let mut mesh = bumpy();
        let before = Report::of(&mesh);
        smooth(&mut mesh, None, &Smoothing::default(), &Control::default()).unwrap();
        let after = Report::of(&mesh);
        assert!(after.closed_manifold() && after.euler_characteristic == before.euler_characteristic);
        assert!(after.area < 0.95 * before.area && after.signed_volume > 0.8 * before.signed_volume);
    }

    #[test]
    fn there_and_back_flattens_and_keeps_the_volume() {
        // Noise of a fifth of a cell.
        let mut noisy = bumpy();
        for (i, v) in noisy.vertices.iter_mut().enumerate() {
            let noise = |a: usize| ((i * 7919 + a * 104_729) % 101) as f32 / 50.0 - 1.0;
            *v = [0, 1, 2].map(|a| v[a] + 0.0025 * noise(a));
        }
        let run = |smoothing| {
            let mut mesh = noisy.clone();
            smooth(&mut mesh, None, &smoothing, &Control::default()).unwrap();
            Report::of(&mesh)
        };
        let before = Report::of(&noisy);
        let (kept, shrunk) = (run(Smoothing::keeping_volume()), run(Smoothing::default()));
        let lost = |report: &Report| 1.0 - report.signed_volume / before.signed_volume;
        assert!(lost(&kept).abs() < 0.01 && lost(&shrunk) > 0.03, "{} {}", lost(&kept), lost(&shrunk));
        assert!(kept.area < 0.97 * before.area && kept.closed_manifold(), "{} {}", kept.area, before.area);
        let unstable = Smoothing { strength: 0.7, ..Smoothing::keeping_volume() };
        assert!(smooth(&mut bumpy(), None, &unstable, &Control::default()).is_err());
    }

    #[test]
    fn vertices_of_weight_zero_and_of_a_border_stay() {
        let mut mesh = bumpy();
        mesh.triangles.pop();
        let border = mesh.triangles.clone();
        let before = mesh.clone();
        let weights: Vec<f32> = (0..mesh.vertices.len()).map(|v| (v % 2) as f32).collect();
        smooth(
            &mut mesh,
            Some(&weights),
            &Smoothing { iterations: 2, strength: 0.5, ..Smoothing::default() },
            &Control::default(),
        )
        .unwrap();
        let stars = Stars::of(&border, mesh.vertices.len());
        let mut moved = 0;
        for v in 0..mesh.vertices.len() {
            if v % 2 == 0 || !stars.is_closed(v) {
                assert_eq!(mesh.vertices[v], before.vertices[v], "{v}");
            }
            moved += usize::from(mesh.vertices[v] != before.vertices[v]);
        }
        assert!(moved > mesh.vertices.len() / 3);
        assert_eq!((0..mesh.vertices.len()).filter(|&v| !stars.is_closed(v)).count(), 3);
    }

    #[test]
    fn one_step_is_the_formula_and_threads_do_not_show() {
        let mesh = bumpy();
        let stars = Stars::of(&mesh.triangles, mesh.vertices.len());
        let mut one = mesh.clone();
        smooth(
            &mut one,
            None,
            &Smoothing { iterations: 1, strength: 0.25, ..Smoothing::default() },
            &Control::default(),
        )
        .unwrap();
        for (v, (new, old)) in one.vertices.iter().zip(&mesh.vertices).enumerate() {
            for a in 0..3 {
                let near = stars.corners(v).iter().map(|c| f64::from(mesh.vertices[c[0] as usize][a]));
                let mean = near.clone().sum::<f64>() / near.count() as f64;
                let want = f64::from(old[a]) + 0.25 * (mean - f64::from(old[a]));
                assert!((f64::from(new[a]) - want).abs() < 1e-6);
            }
        }
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut mesh = mesh.clone();
            pool.install(|| smooth(&mut mesh, None, &Smoothing::default(), &Control::default())).unwrap();
            mesh
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn wrong_input_is_refused() {
        let mut mesh = bumpy();
        let go = |mesh: &mut Mesh, weights: Option<&[f32]>, strength| {
            let smoothing = Smoothing { iterations: 1, strength, ..Smoothing::default() };
            smooth(mesh, weights, &smoothing, &Control::default()).unwrap_err()
        };
        assert!(matches!(go(&mut mesh, None, f32::NAN), Error::Parameter { name: "strength", .. }));
        assert!(matches!(go(&mut mesh, Some(&[1.0]), 1.0), Error::Length { found: 1, .. }));
        mesh.triangles[0][1] = u32::MAX;
        assert!(matches!(go(&mut mesh, None, 1.0), Error::Count { .. }));
    }
}
