//! The particle radius, where nobody says it.
//!
//! The rest spacing follows from how many particles a volume holds. Around some particles, spread evenly over the caller's
//! order, the sphere up to the 32nd neighbour is measured. Near a surface it is half empty, so not
//! the middle but the upper quarter of the densities counts. Where all nearest neighbours are equally far, as on a lattice,
//! that distance is the spacing.
//!
//! Source: this project; the estimate of a density by the k-th neighbour is Loftsgaarden & Quesenberry 1965.

use rayon::prelude::*;

use super::Positions;

/// Particles around which is measured.
const SAMPLES: usize = 48;
/// Particles that a sphere holds, its centre included: on a cubic lattice whole shells, up to twice the spacing.
const NEIGHBOURS: usize = 33;

/// Squared distances to the nearest neighbours of one particle, ascending.
#[derive(Clone)]
struct Nearest {
    len: usize,
    dist_sq: [f64; NEIGHBOURS],
}

impl Nearest {
    const NONE: Self = Self { len: 0, dist_sq: [f64::INFINITY; NEIGHBOURS] };

    /// Distance of the nearest neighbour at another place.
    fn first(&self) -> Option<f64> {
        self.dist_sq[..self.len].iter().find(|&&d| d > 0.0).map(|d| d.sqrt())
    }

    #[inline(always)]
    fn add(&mut self, dist_sq: f64) {
        if dist_sq < self.dist_sq[NEIGHBOURS - 1] {
            self.insert(dist_sq);
        }
    }

    #[cold]
    fn insert(&mut self, dist_sq: f64) {
        let at = self.dist_sq[..self.len].partition_point(|&d| d <= dist_sq);
        self.len = (self.len + 1).min(NEIGHBOURS);
        self.dist_sq[at..self.len].rotate_right(1);
        self.dist_sq[at] = dist_sq;
    }
}

/// An estimate of the particle radius, half of the rest spacing, in world units. Runs in the current rayon pool.
///
/// Exact on a cubic lattice, within 3 % on the simulated frames that it was tried on; the same for every number of threads. `None` when there
/// are fewer than two distinct finite positions.
pub fn infer_radius(positions: Positions<'_>) -> Option<f64> {
    let step = positions.len().div_ceil(SAMPLES).max(1);
    let samples: Vec<usize> = (0..positions.len()).step_by(step).collect();
    let centres: Vec<[f64; 3]> = samples.iter().map(|&i| positions.get(i)).collect();
    let nearest = (0..positions.len())
        .into_par_iter()
        .fold(
            || vec![Nearest::NONE; samples.len()],
            |mut nearest, i| {
                let p = positions.get(i);
                for (nearest, c) in nearest.iter_mut().zip(&centres) {
                    let d = [p[0] - c[0], p[1] - c[1], p[2] - c[2]];
                    nearest.add(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                }
                nearest
            },
        )
        .reduce(
            || vec![Nearest::NONE; samples.len()],
            |mut a, b| {
                for (a, b) in a.iter_mut().zip(b) {
                    b.dist_sq[..b.len].iter().for_each(|&d| a.add(d));
                }
                a
            },
        );
    // Particles that have hardly moved from a lattice say their spacing themselves, however few they are.
    let steps = sorted(nearest.iter().filter_map(Nearest::first));
    let (low, high) = (*steps.get(steps.len() / 10)?, *steps.get(steps.len() * 9 / 10)?);
    if high <= 1.01 * low {
        return Some(0.5 * low);
    }
    let spacings = sorted(nearest.iter().filter_map(spacing));
    Some(0.5 * spacings.get(spacings.len() / 4)?)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The spacing of a cubic lattice as dense as the particles around one.
fn spacing(nearest: &Nearest) -> Option<f64> {
    // The particle itself is among them, at distance 0, and so are copies of it, which say nothing.
    let distinct = nearest.dist_sq[..nearest.len].iter().filter(|&&d| d > 0.0);
    let dist = distinct.clone().next_back()?.sqrt();
    let held = distinct.count() as f64 + 1.0;
    if held < 0.75 * NEIGHBOURS as f64 {
        // Too few for a density: the nearest neighbour is all there is to go by.
        return nearest.first();
    }
    Some((4.0 / 3.0 * std::f64::consts::PI * dist.powi(3) / held).cbrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(n: usize, spacing: f32) -> Vec<[f32; 3]> {
        (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n].map(|v| v as f32 * spacing)).collect()
    }

    #[test]
    fn a_lattice_has_half_its_spacing_however_small() {
        for n in [2, 5, 20] {
            let radius = infer_radius((&lattice(n, 0.05)).into()).unwrap();
            assert!((radius / 0.025 - 1.0).abs() < 1e-5, "{n}: {radius}");
        }
    }

    #[test]
    fn particles_in_disorder_go_by_their_density() {
        let mut state = 7u32;
        let mut jitter = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.025 * ((state >> 8) as f32 / (1 << 24) as f32 - 0.5)
        };
        let positions: Vec<_> = lattice(20, 0.05).into_iter().map(|p| p.map(|v| v + jitter())).collect();
        let radius = infer_radius((&positions).into()).unwrap();
        assert!((radius / 0.025 - 1.0).abs() < 0.05, "{radius}");
    }

    #[test]
    fn few_particles_go_by_their_nearest_neighbour() {
        assert_eq!(infer_radius((&[[0.0f32; 3], [0.0, 0.5, 0.0]]).into()), Some(0.25));
        assert_eq!(infer_radius((&[[1.0f32; 3]; 40]).into()), None);
        assert_eq!(infer_radius((&[[1.0f32; 3]]).into()), None);
        assert_eq!(infer_radius((&Vec::<[f32; 3]>::new()).into()), None);
    }

    #[test]
    fn stray_and_invalid_particles_do_not_move_it() {
        let mut positions = lattice(20, 0.05);
        positions.insert(4000, [1e6, 0.0, 0.0]);
        positions.insert(777, [f32::NAN; 3]);
        positions.insert(100, [f32::INFINITY; 3]);
        let radius = infer_radius((&positions).into()).unwrap();
        assert!((radius / 0.025 - 1.0).abs() < 0.02, "{radius}");
    }
}
