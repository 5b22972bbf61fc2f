//! The particle radius, where nobody says it.
//!
//! The rest spacing follows from how many particles a volume holds. Around some particles, spread evenly over the caller's
//! order, the sphere up to the 32nd neighbour is measured. Near a surface it is half empty, so not
//! the middle but the upper quarter of the densities counts.
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
    let mut spacings: Vec<f64> = nearest.iter().filter_map(spacing).collect();
    spacings.sort_by(f64::total_cmp);
    Some(0.5 * spacings.get(spacings.len() / 4)?)
}

/// The spacing of a cubic lattice as dense as the particles around one.
fn spacing(nearest: &Nearest) -> Option<f64> {
    // The particle itself is among them, at distance 0, and so are copies of it, which say nothing.
    let distinct = nearest.dist_sq[..nearest.len].iter().filter(|&&d| d > 0.0);
    let dist = distinct.clone().next_back()?.sqrt();
    let held = distinct.count() as f64 + 1.0;
    if held < 0.75 * NEIGHBOURS as f64 {
        // Too few for a density: the nearest neighbour is all there is to go by.
        return nearest.dist_sq.iter().find(|&&d| d > 0.0).map(|d| d.sqrt());
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
    fn a_lattice_has_half_its_spacing() {
        let radius = infer_radius((&lattice(20, 0.05)).into()).unwrap();
        assert!((radius / 0.025 - 1.0).abs() < 0.02, "{radius}");
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
