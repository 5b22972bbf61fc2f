//! What a scene promises, and what makes it a splash rather than any other heap of particles.

use super::*;

/// Squared distance from each particle to its nearest neighbour, by sorting along x. Test code: simple before fast.
fn nearest_sq(positions: &[[f32; 3]]) -> Vec<f64> {
    let mut sorted = positions.to_vec();
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut nearest = vec![f64::INFINITY; sorted.len()];
    for i in 0..sorted.len() {
        for j in i + 1..sorted.len() {
            let d: [f64; 3] = std::array::from_fn(|k| f64::from(sorted[j][k]) - f64::from(sorted[i][k]));
            if d[0] * d[0] >= nearest[i].min(0.01) && d[0] > 0.1 {
                break;
            }
            let sq = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            nearest[i] = nearest[i].min(sq);
            nearest[j] = nearest[j].min(sq);
        }
    }
    nearest
}

#[test]
fn same_seed_gives_the_same_bytes() {
    let bytes = |scene: &Scene| -> Vec<u32> {
        let numbers = scene.positions.iter().chain(&scene.velocities).flatten();
        numbers.chain([&scene.radius]).map(|x| x.to_bits()).collect()
    };
    assert_eq!(bytes(&splash(10_000, 3)), bytes(&splash(10_000, 3)));
}

#[test]
fn bytes_are_those_of_every_other_platform() {
    let scene = splash(5_000, 1);
    let numbers = scene.positions.iter().chain(&scene.velocities).flatten();
    // FNV-1a over the bits. A new value is right only when the scene was changed on purpose.
    let digest = numbers
        .flat_map(|x| x.to_bits().to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    assert_eq!((scene.positions.len(), format!("{digest:016x}").as_str()), (5003, "f327d55adee801dd"));
}

#[test]
fn seeds_differ() {
    assert_ne!(splash(5_000, 1).positions, splash(5_000, 2).positions);
}

#[test]
fn number_is_within_five_percent_of_the_one_asked_for() {
    for wanted in [2_000, 5_000, 12_345, 30_000, 100_000] {
        for seed in 0..4 {
            let found = splash(wanted, seed).positions.len();
            assert!(found.abs_diff(wanted) * 20 <= wanted, "{found} for {wanted}, seed {seed}");
        }
    }
}

#[test]
fn absurd_numbers_are_taken_as_the_nearest_possible() {
    assert_eq!(splash(0, 1), splash(2_000, 1));
}

#[test]
fn no_two_particles_are_closer_than_promised() {
    for seed in 0..6 {
        let scene = splash(8_000, seed);
        let least = nearest_sq(&scene.positions).into_iter().fold(f64::INFINITY, f64::min).sqrt();
        let promised = 1.4 * f64::from(scene.radius);
        assert!(least >= promised * (1.0 - 1e-6), "{least} < {promised}, seed {seed}");
    }
}

#[test]
fn neighbours_are_about_one_spacing_apart() {
    let scene = splash(20_000, 1);
    let mut nearest = nearest_sq(&scene.positions);
    nearest.sort_unstable_by(f64::total_cmp);
    let median = nearest[nearest.len() / 2].sqrt() / (2.0 * f64::from(scene.radius));
    assert!((0.8..1.1).contains(&median), "median distance to the nearest is {median} spacings");
}

#[test]
fn all_numbers_are_finite_and_near_the_basin() {
    let scene = splash(20_000, 5);
    assert_eq!(scene.positions.len(), scene.velocities.len());
    assert!(scene.velocities.iter().flatten().all(|v| v.abs() < 10.0));
    for &[x, y, z] in &scene.positions {
        assert!((x * x + z * z).sqrt() < BASIN_RADIUS as f32 + 0.1 && (-0.2..1.2).contains(&y), "{x} {y} {z}");
    }
}

#[test]
fn crown_sheet_is_two_particles_thick_at_least() {
    // Halfway up the crown, every direction around the axis must meet a particle at two distances.
    let scene = splash(30_000, 1);
    let spacing = 2.0 * scene.radius;
    let mut layers = [[false; 2]; 48];
    for &[x, y, z] in &scene.positions {
        let away = (x * x + z * z).sqrt();
        if (y - 0.2).abs() < spacing && (0.3..0.75).contains(&away) {
            let sector = ((z.atan2(x) / std::f32::consts::TAU + 0.5) * 48.0) as usize % 48;
            // The sheet's middle here is found from its own mean below; inner and outer are told apart by it.
            let middle = middle_of_sheet(&scene, spacing);
            layers[sector][usize::from(away > middle)] = true;
        }
    }
    assert!(layers.iter().flatten().all(|&met| met), "{layers:?}");
}

fn middle_of_sheet(scene: &Scene, spacing: f32) -> f32 {
    let ring = scene.positions.iter().filter(|p| (p[1] - 0.2).abs() < spacing);
    let away: Vec<f32> = ring.map(|&[x, _, z]| (x * x + z * z).sqrt()).filter(|a| (0.3..0.75).contains(a)).collect();
    away.iter().sum::<f32>() / away.len() as f32
}

#[test]
fn crown_jet_and_droplets_rise_from_the_pool() {
    let scene = splash(30_000, 1);
    let share = |inside: &dyn Fn(f32, f32) -> bool| {
        let met = scene.positions.iter().filter(|p| inside((p[0] * p[0] + p[2] * p[2]).sqrt(), p[1]));
        met.count() as f64 / scene.positions.len() as f64
    };
    assert!(share(&|_, y| y < 0.1) > 0.6, "most of the water is in the basin");
    assert!(share(&|away, y| y > 0.15 && (0.4..0.8).contains(&away)) > 0.05, "crown");
    assert!(share(&|away, y| y > 0.3 && away < 0.15) > 0.005, "jet");
    assert!(share(&|_, y| y > 0.45) < 0.1, "little of it flies high");
}
