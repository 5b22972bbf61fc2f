//! Scenes made to defeat the narrow band: holes in bulk, thin parts, lone groups, uneven density.

use crate::{
    Random, Scene,
    scenes::{RADIUS, SPACING},
};

/// What is taken from the bulk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hole {
    /// Nothing.
    Nothing,
    /// The particle in the middle.
    One,
    /// The particle in the middle and one beside it: by a step along 1, 2 or 3 axes.
    Pair(usize),
    /// A hollow of radius 1.3 spacings around a middle that stays.
    Shell,
    /// A layer one spacing thick, but for a rim.
    Slit,
    /// A ball of this radius, in spacings, around a place between the particles.
    Ball(f64),
    /// Each particle with this chance.
    Random(f64),
}

/// All holes.
pub const HOLES: [Hole; 13] = [
    Hole::Nothing,
    Hole::One,
    Hole::Pair(1),
    Hole::Pair(2),
    Hole::Pair(3),
    Hole::Shell,
    Hole::Slit,
    Hole::Ball(1.0),
    Hole::Ball(1.5),
    Hole::Ball(2.0),
    Hole::Random(0.05),
    Hole::Random(0.1),
    Hole::Random(0.2),
];

/// A cube of `side`³ particles, each moved by up to `jitter` spacings along each axis, the whole placed anywhere on the
/// lattice, with a hole.
pub fn bulk(side: i32, jitter: f64, hole: Hole, random: &mut Random) -> Scene {
    let middle = side / 2;
    let shift = random.in_cube(4.0 * SPACING);
    let centre = random.in_cube(0.5);
    let mut positions = Vec::new();
    for i in 0..side * side * side {
        let at = [i % side, i / side % side, i / (side * side)];
        let offset = random.in_cube(jitter * SPACING);
        let chance = random.between(0.0, 1.0);
        let inside_ball = |radius: f64| {
            let from_centre = |a: usize| f64::from(at[a] - middle) + offset[a] / SPACING - centre[a];
            (0..3).map(|a| from_centre(a).powi(2)).sum::<f64>() < radius * radius
        };
        let missing = match hole {
            Hole::Ball(radius) => inside_ball(radius),
            Hole::Random(share) => chance < share,
            _ => in_hole(hole, at.map(|v| v - middle), middle),
        };
        if !missing {
            positions.push(std::array::from_fn(|a| f64::from(at[a]) * SPACING + offset[a] + shift[a]));
        }
    }
    Scene::new(format!("bulk of {side}³, jitter {jitter:.3}, {hole:?}"), positions)
}

fn in_hole(hole: Hole, at: [i32; 3], half: i32) -> bool {
    let square = at.iter().map(|v| v * v).sum::<i32>();
    match hole {
        Hole::One => square == 0,
        Hole::Pair(axes) => square == 0 || (0..3).all(|a| at[a] == i32::from(a < axes)),
        Hole::Shell => square == 1,
        Hole::Slit => at[2] == 0 && at[0].abs().max(at[1].abs()) < half - 2,
        Hole::Nothing | Hole::Ball(_) | Hole::Random(_) => false,
    }
}

/// Groups of one to three particles, too far apart to touch.
pub fn isolated_groups(random: &mut Random) -> Scene {
    let mut positions = Vec::new();
    for i in 0..125 {
        let corner = [i % 5, i / 5 % 5, i / 25].map(|v| f64::from(v) * 6.0 * SPACING);
        let first = random.in_cube(SPACING);
        for _ in 0..1 + i % 3 {
            let near = random.in_cube(0.7 * SPACING);
            positions.push(std::array::from_fn(|a| corner[a] + first[a] + near[a]));
        }
    }
    Scene::new("isolated groups", positions)
}

/// Particles anywhere in a cube, `per_spacing` of them a rest volume.
pub fn spray(count: usize, per_spacing: f64, random: &mut Random) -> Scene {
    let half = 0.5 * SPACING * (count as f64 / per_spacing).cbrt();
    let positions = (0..count).map(|_| random.in_cube(half)).collect();
    Scene::new(format!("spray of {count}, {per_spacing:.3} a rest volume"), positions)
}

/// A rippled sheet of particles, one thick, each moved by up to `jitter` spacings.
pub fn thin_sheet(jitter: f64, random: &mut Random) -> Scene {
    let positions = (0..24 * 24)
        .map(|i| {
            let (u, v) = (f64::from(i % 24) * SPACING, f64::from(i / 24) * SPACING);
            let offset = random.in_cube(jitter * SPACING);
            [u + offset[0], v + offset[1], 0.5 * (1.3 * u).sin() * (0.9 * v).cos() + offset[2]]
        })
        .collect();
    Scene::new(format!("sheet, jitter {jitter:.3}"), positions)
}

/// Bulk in which some places hold many particles, close together.
pub fn clusters(random: &mut Random) -> Scene {
    let mut scene = bulk(9, 0.2, Hole::Random(0.3), random);
    for _ in 0..12 {
        let at = scene.positions[random.below(scene.positions.len())];
        let (count, size) = (random.choose(&[3, 10, 40]), random.choose(&[0.0, 0.05, 0.4]));
        for _ in 0..count {
            let near = random.in_cube(size * SPACING);
            scene.positions.push(std::array::from_fn(|a| at[a] + near[a]));
        }
    }
    Scene { name: "clusters in bulk".into(), ..scene }
}

/// A ball of particles at random places, `per_spacing` of them a rest volume, around an empty ball in the middle of a
/// coarse cell. Radius in support radii, of a kernel of four particle radii.
pub fn hollow(radius: f64, per_spacing: f64, random: &mut Random) -> Scene {
    let support = 4.0 * RADIUS;
    let half = support * (radius + 1.1);
    let count = (per_spacing * (2.0 * half / SPACING).powi(3)) as usize;
    let square = |p: &[f64; 3]| p.iter().map(|v| v * v).sum::<f64>();
    let kept = (support * radius).powi(2)..half * half;
    let around = (0..count).map(|_| random.in_cube(half)).filter(|p| kept.contains(&square(p)));
    let positions = around.map(|p| p.map(|v| v + 0.25 * support)).collect();
    Scene::new(format!("hollow of {radius:.3}, {per_spacing:.3} a rest volume"), positions)
}

/// One particle in the middle of a coarse cell, and many at one point at 0.9 support radii: they halve the weight of the
/// lone one, so that its drop is smaller, but as blunt, as any other.
pub fn weakened_drop(crowd: usize) -> Scene {
    let support = 4.0 * RADIUS;
    let lone = [0.25 * support; 3];
    let mut positions = vec![lone];
    positions.extend(vec![[lone[0] + 0.9 * support, lone[1], lone[2]]; crowd]);
    Scene::new(format!("drop weakened by a crowd of {crowd}"), positions)
}

/// A hollow at the middle of a coarse cell: particles at a point, given from there in support radii, and at all points that
/// the symmetries of the cube make of it (up to 48). At the right points all corners of the coarse cell are well inside,
/// and its middle is not.
pub fn caged_hollow(point: [f64; 3], iso: f64) -> Scene {
    let support = 4.0 * RADIUS;
    let mut positions: Vec<[f64; 3]> = Vec::new();
    for [a, b, c] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for signs in 0..8 {
            let turned = [point[a], point[b], point[c]];
            let at =
                std::array::from_fn(|a| support * (0.25 + if signs >> a & 1 == 0 { turned[a] } else { -turned[a] }));
            if !positions.contains(&at) {
                positions.push(at);
            }
        }
    }
    let mut scene = Scene::new(format!("hollow caged from {point:.3?}, iso {iso:.3}"), positions);
    scene.params.iso = iso;
    scene
}
