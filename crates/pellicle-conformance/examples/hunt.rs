//! Searches at random for a scene on which the narrow band loses a piece of the surface: `hunt SECONDS [SEED [FIELD]]`.
//!
//! Without a name the field is SPH's, with any isovalue and support. Another has its own, and bulk is larger, as its support is.
//!
//! Prints each scene that does, with all that is needed to make it again. For when the band or a field's bounds change.

use std::time::{Duration, Instant};

use pellicle::{Band, Params, ScalarField};
use pellicle_conformance::{Random, Scene, Subject, cavities, same_bytes};

fn main() {
    let mut args = std::env::args().skip(1);
    let seconds = args.next().and_then(|v| v.parse().ok()).unwrap_or(60);
    let first: u64 = args.next().and_then(|v| v.parse().ok()).unwrap_or(1);
    let field = args.next().map(|name| ScalarField::from_name(&name).expect("a field's name"));
    let end = Instant::now() + Duration::from_secs(seconds);
    let (mut seed, mut lost) = (first, 0);
    while Instant::now() < end {
        let random = &mut Random::new(seed);
        // Deep enough for the wide supports of other fields.
        let mut scene = draw(if field.is_some() { 15 } else { 8 }, random);
        if let Some(field) = field {
            let own = Params::with_field(scene.params.particle_radius, field);
            scene.params = Params { cell_size: random.choose(&[0.4, 0.5, 0.75, 1.0, 1.5, 2.0]), ..own };
        }
        let mesh = |band| Subject { band, threads: 1, ..Subject::default() }.mesh(&scene);
        match (mesh(Band::Auto), mesh(Band::Full)) {
            (Ok(auto), Ok(full)) => {
                if let Err(defect) = same_bytes(&auto, &full) {
                    lost += 1;
                    println!("seed {seed}: {}, {:?}: {defect}", scene.name, scene.params);
                }
            }
            (auto, full) => println!("seed {seed}: {:?} {:?}", auto.err(), full.err()),
        }
        seed += 1;
    }
    println!("{} scenes, {lost} lost", seed - first);
}

fn draw(side: i32, random: &mut Random) -> Scene {
    let jitter = random.between(0.0, 0.6);
    let mut scene = match random.below(9) {
        0..4 => {
            let radius = random.between(0.5, 2.5);
            let listed = random.choose(&cavities::HOLES);
            let hole = random.choose(&[cavities::Hole::Ball(radius), listed]);
            cavities::bulk(side, jitter, hole, random)
        }
        4 => cavities::thin_sheet(jitter, random),
        5 => cavities::isolated_groups(random),
        6 => {
            let (radius, density) = (random.between(0.35, 0.9), 2f64.powf(random.between(-1.0, 3.5)));
            // In the middle of a coarse cell only with these.
            let mut scene = cavities::hollow(radius, density, random);
            scene.params.iso = random.between(0.1, 0.95);
            return scene;
        }
        7 => {
            let density = 2f64.powf(random.between(-5.0, 2.0));
            cavities::spray(600, density, random)
        }
        _ => cavities::clusters(random),
    };
    scene.params.iso = random.between(0.1, 0.95);
    scene.params.smoothing_length = random.choose(&[1.5, 1.75, 2.0, 2.0, 2.0, 2.5, 3.0]);
    scene.params.cell_size = random.choose(&[0.3, 0.4, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0]);
    scene
}
