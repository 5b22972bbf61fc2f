//! The bulk road and the real-time road make the same surface of the same field on the same lattice: every vertex of one is
//! one of the other, but where a node's value is so close to the isovalue that rounding decides its side.

use pellicle::{
    Mesh, MetaballParams, Params, ScalarField,
    realtime::{self, Engine, Seeds},
    reconstruct,
};
use pellicle_conformance::{Random, lonely, raw_particles};

const ISO: f64 = 0.2;
/// As close to the isovalue, relatively, a node's side may be decided by rounding.
const DOUBT: f64 = 1e-5;
/// As far apart, in cells, the same vertex of both roads may be. Where the field is flat along an edge, rounding of its
/// values moves the crossing.
const APART: f64 = 2e-3;

/// Triquet's metaballs in 64-bit arithmetic.
fn value(positions: &[[f32; 3]], reach: f64, at: [f64; 3]) -> f64 {
    let rest = |p: &[f32; 3]| 1.0 - (0..3).map(|a| (at[a] - f64::from(p[a])).powi(2)).sum::<f64>() / (reach * reach);
    positions.iter().map(|p| rest(p).max(0.0).powi(2) / 4.0).sum()
}

/// Compares both roads; gives how many vertices they do not share, all of them beside doubtful nodes.
fn judge(positions: &[[f32; 3]], reach: f64, spacing: f64, seeds: Seeds) -> usize {
    let radius = reach / 4.0;
    let bulk = Params {
        smoothing_length: 2.0,
        cell_size: spacing / radius,
        iso: ISO,
        ..Params::with_field(radius, ScalarField::Metaball(MetaballParams::default()))
    };
    let bulk = reconstruct(positions, &bulk).expect("a surface");
    let mut here = Mesh::default();
    let params = realtime::Params { iso: ISO, seeds, block: [16; 3], ..realtime::Params::new(reach, spacing) };
    Engine::new(params).expect("parameters").update(positions, &mut here).expect("a surface");
    assert!(bulk.vertices.len() > 500, "{}", bulk.vertices.len());
    let mut differ = 0;
    for (mesh, other, name) in [(&bulk, &here, "bulk"), (&here, &bulk, "real time")] {
        for at in lonely(mesh, other, spacing, APART) {
            // One end of the vertex's edge has another side on the other road.
            let doubtful = [0, 1].iter().any(|&up| {
                let node = at.map(|x| {
                    let whole = x.round();
                    let node = if (x - whole).abs() < 1e-3 { whole } else { x.floor() + f64::from(up) };
                    node * spacing
                });
                (value(positions, reach, node) - ISO).abs() < DOUBT * ISO
            });
            assert!(
                doubtful,
                "{name}: a vertex at {at:?} cells that the other road lacks, and no node there is in doubt"
            );
            differ += 1;
        }
    }
    differ
}

#[test]
fn scenes_of_the_paper() {
    for (name, spacing) in [("fountain_f0.xyz", 1.0), ("blob.xyz", 0.3), ("explosion_t1.xyz", 0.6)] {
        let Some(positions) = raw_particles(name) else { return };
        let differ = judge(&positions, 3.0, spacing, Seeds::Complete);
        println!("{name} at {spacing}: {differ} vertices differ");
        assert!(differ < 20, "{name}: {differ}");
    }
}

#[test]
fn strewn_particles() {
    let mut random = Random::new(9);
    for (count, spacing, size) in [(60, 0.5, 5.0), (300, 1.0, 9.0), (900, 1.5, 12.0)] {
        let positions: Vec<[f32; 3]> = (0..count).map(|_| [0; 3].map(|_| random.between(-size, size) as f32)).collect();
        for seeds in [Seeds::Complete, Seeds::Particles] {
            if seeds == Seeds::Particles && count > 60 {
                // It may miss what no particle stands above.
                continue;
            }
            let differ = judge(&positions, 3.0, spacing, seeds);
            assert!(differ < 20, "{count} particles, {seeds:?}: {differ}");
        }
    }
}
