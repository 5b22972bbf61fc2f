use super::*;

/// The first so many frames.
fn frames(show: Show, seed: u64, count: usize) -> Vec<Balls> {
    let mut play = Play::new(show, seed);
    (0..count)
        .map(|k| {
            assert_eq!(play.frame(), k);
            let balls = play.balls().clone();
            play.step();
            balls
        })
        .collect()
}

/// FNV-1a over all numbers of all frames.
fn digest(frames: &[Balls]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |x: f32| {
        for byte in x.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    };
    for balls in frames {
        balls.positions.iter().flatten().chain(&balls.strengths).for_each(|&x| add(x));
        for limb in &balls.limbs {
            limb.side.iter().chain(&limb.up).for_each(|&x| add(x));
            add(limb.along);
        }
    }
    hash
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_others() {
    for show in Show::ALL {
        let first = frames(show, 1, FRAMES);
        assert_eq!(digest(&first), digest(&frames(show, 1, FRAMES)), "{}", show.name());
        assert_ne!(digest(&first), digest(&frames(show, 2, FRAMES)), "{}", show.name());
    }
}

#[test]
fn every_frame_has_the_particles_that_are_promised() {
    for show in Show::ALL {
        for (k, balls) in frames(show, 3, FRAMES).iter().enumerate() {
            let wanted = match show {
                Show::Fountain => 3000.min(20 * (k + 1)),
                Show::Blob => 100,
                Show::Explosion => 1000,
                Show::Monster => 250,
            };
            assert_eq!(balls.positions.len(), wanted, "{} {k}", show.name());
            assert_eq!(balls.strengths.len(), wanted, "{} {k}", show.name());
            assert_eq!(balls.limbs.len(), if show == Show::Monster { wanted } else { 0 });
            let numbers = balls.positions.iter().flatten().chain(&balls.strengths);
            assert!(numbers.clone().all(|x| x.is_finite()), "{} {k}", show.name());
            assert!(numbers.clone().all(|x| x.abs() < 120.0), "{} {k}", show.name());
            assert!(balls.strengths.iter().all(|&s| (0.15..=1.01).contains(&s)), "{} {k}", show.name());
        }
    }
}

#[test]
fn motion_is_smooth_but_for_what_starts_again() {
    for show in [Show::Blob, Show::Explosion, Show::Monster] {
        let frames = frames(show, 1, FRAMES);
        for (k, pair) in frames.windows(2).enumerate() {
            for (a, b) in pair[0].positions.iter().zip(&pair[1].positions) {
                let moved: f32 = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>().sqrt();
                assert!(moved < 3.0, "{} frame {k}: {moved}", show.name());
            }
        }
    }
}

#[test]
fn bases_of_limbs_are_orthonormal() {
    for (k, balls) in frames(Show::Monster, 1, FRAMES).iter().enumerate() {
        for limb in &balls.limbs {
            let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            assert!((dot(limb.side, limb.side) - 1.0).abs() < 1e-5, "frame {k}");
            assert!((dot(limb.up, limb.up) - 1.0).abs() < 1e-5, "frame {k}");
            assert!(dot(limb.side, limb.up).abs() < 1e-5, "frame {k}");
            assert!(limb.along.is_finite());
        }
    }
}

#[test]
fn the_monster_plays_its_part() {
    let frames = frames(Show::Monster, 1, FRAMES);
    let farthest = |k: usize, from: [f32; 3]| {
        let distance = |p: &[f32; 3]| (0..3).map(|c| (p[c] - from[c]).powi(2)).sum::<f32>().sqrt();
        frames[k].positions.iter().map(distance).fold(0.0, f32::max)
    };
    let home = [0.0, 6.0, 0.0];
    assert!(farthest(0, home) < 5.0, "nothing sticks out at first");
    assert!(farthest(85, home) > 15.0, "tentacles");
    assert!(farthest(124, home) < 7.0, "a ball");
    let from_wall = |k: usize| frames[k].positions.iter().map(|p| (p[0] - 19.0).abs()).fold(0.0, f32::max);
    assert!(from_wall(195) < 1.0, "a coat, {}", from_wall(195));
    assert!(from_wall(220) > 8.0, "pieces fly");
    assert!(farthest(299, home) > 15.0 && farthest(299, home) < 22.0, "tentacles again, {}", farthest(299, home));
}
