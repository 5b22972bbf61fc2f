//! The topological level against an exact judge of the trilinear interpolant: single cells of every case, and random grids.

mod cells;
mod judge;

use judge::{Topology, judge};
use pellicle::{ContourParams, Level, Volume, contour, mesh::Report};

struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> i128 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        i128::from((self.0 >> 33) % n)
    }
}

/// A random grid of 5³ samples within a layer of samples outside, of sizes up to `size`, none of them 0.
fn random_grid(random: &mut Random, size: u64) -> Vec<i128> {
    let mut sample = || (1 + random.below(size)) * (2 * random.below(2) - 1);
    (0..343)
        .map(|n| {
            let border = [n % 7, n / 7 % 7, n / 49].iter().any(|&i| i == 0 || i == 6);
            let value = sample();
            if border { -value.abs() } else { value }
        })
        .collect()
}

fn report(samples: &[i128], n: usize, level: Level) -> Report {
    let samples: Vec<i16> = samples.iter().map(|&v| v as i16).collect();
    let volume = Volume::new(&samples, [n; 3]).expect("fits");
    Report::of(&contour(&volume, 0.0, &ContourParams { level, ..ContourParams::default() }).expect("good"))
}

/// Grids compared, those skipped as singular, and how many the other levels got right.
fn compare(grids: usize, size: u64, seed: u64) -> (usize, usize, [usize; 2]) {
    let mut random = Random(seed);
    let (mut compared, mut singular, mut others) = (0, 0, [0; 2]);
    while compared < grids {
        let samples = random_grid(&mut random, size);
        let verdicts = [0, 1, 2].map(|axis| judge(&samples, 7, axis));
        let [Some(want), Some(y), Some(z)] = verdicts else {
            singular += 1;
            continue;
        };
        assert_eq!((want, want), (y, z), "the judge disagrees with itself on {samples:?}");
        let got = report(&samples, 7, Level::Topological);
        assert!(got.closed_manifold(), "{got:?}");
        let found = Topology { components: got.components, euler: got.euler_characteristic };
        assert_eq!(found, want, "grid {compared}: {samples:?}");
        for (level, right) in [Level::Classic, Level::Consistent].into_iter().zip(&mut others) {
            let got = report(&samples, 7, level);
            assert!(got.closed_manifold(), "{level:?}: {got:?}");
            *right += usize::from((got.components, got.euler_characteristic) == (want.components, want.euler));
        }
        compared += 1;
    }
    (compared, singular, others)
}

#[test]
fn ten_thousand_random_grids_have_the_topology_of_the_trilinear_interpolant() {
    let (compared, singular, [classic, consistent]) = compare(10_000, 1000, 5);
    println!(
        "{compared} grids equal, {singular} singular ones left out; classic {classic}, consistent {consistent} equal"
    );
    assert!(classic < compared / 10, "the grids are too easy");
    assert!(singular < compared);
}

#[test]
fn smooth_grids_near_singular_have_it_too() {
    // Few values: the same products come again and again, so many grids are near singular ones.
    let (compared, singular, _) = compare(200, 60, 11);
    println!("{compared} grids equal, {singular} singular ones left out");
}
