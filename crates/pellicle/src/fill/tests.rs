//! What runs equals the specification, bit for bit, on every vector unit.

use super::{Scratch, any::AnyField, eighths::Known, scalar::node_terms, simd::FillOctet};
use crate::{
    Control, Lanes,
    field::{
        anisotropic::{Anisotropic, COLUMNS, RECORD, Shapes},
        density,
        falloff::Triquet,
        metaball::Metaballs,
        onderik::{self, Onderik},
        scalar::{self, Term},
        solenthaler::Solenthaler,
        sph::{Sph, SphOfRadii},
        zhu_bridson::ZhuBridson,
    },
    lattice::Lattice,
    lookup::cells::Cells,
    math::simd::{LANES, Unit},
};

/// A loose, irregular cloud around the origin, negative coordinates included.
fn cloud() -> Vec<[f32; 3]> {
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    (0..900).map(|_| [next() * 1.2 - 0.6, next() * 1.2 - 0.6, next() * 1.2 - 0.6]).collect()
}

fn sorted(lattice: Lattice) -> Cells {
    let mut cells = Cells::default();
    cells.build((&cloud()).into(), lattice).unwrap();
    cells
}

/// A fine lattice, and a coarse one whose bricks are wider than the support, which is another branch.
const LATTICES: [Lattice; 2] = [Lattice { spacing: 0.05, support: 0.4 }, Lattice { spacing: 0.21, support: 0.4 }];

/// Fills three octets of the cloud by every vector unit and by the specification.
#[track_caller]
fn compare(lattice: Lattice, cells: &Cells, field: &dyn AnyField, columns: &[&[f32]], value: impl Fn(&[Term]) -> f32) {
    let (mut inside, mut outside) = (0, 0);
    for octet in [[0, 0, 0], [-1, 0, -1], [2, 1, 1]] {
        let want: Vec<Vec<u32>> = (0..8)
            .map(|brick| {
                let node = |n: i32| {
                    let first = super::brick_origin(brick);
                    [first[0] + (n & 3), first[1] + (n >> 2 & 3), first[2] + (n >> 4)]
                };
                (0..64).map(|n| value(&node_terms(cells, lattice.step(), octet, node(n))).to_bits()).collect()
            })
            .collect();
        for lanes in [Lanes::Avx512, Lanes::Avx2, Lanes::Portable] {
            let Some(unit) = Unit::new(lanes) else { continue };
            let (mut values, mut above) = ([[0.0; 8]; 64], [0; 8]);
            let job = FillOctet {
                cells,
                columns,
                step: lattice.step(),
                octet,
                eighths: u64::MAX,
                whole: false,
                proves: false,
                scratch: &mut Scratch::default(),
                values: &mut values,
                thresholds: &[field.iso()],
                sampling: None,
                above: &mut above,
            };
            assert_eq!(field.fill(unit, job).eighths, u64::MAX);
            for brick in 0..8 {
                let values = Known { eighths: u8::MAX, values: &values[8 * brick..][..8] }.all();
                assert_eq!(values.map(f32::to_bits).to_vec(), want[brick], "{lanes:?} {octet:?} {brick}");
                for n in 0..64 {
                    assert_eq!(above[brick] >> n & 1 == 1, values[n] > field.iso());
                }
                inside += above[brick].count_ones();
                outside += above[brick].count_zeros();
            }
        }
    }
    assert!(inside > 0 && outside > 0, "{inside} inside, {outside} outside: the scene tests nothing");
}

#[test]
fn the_sph_field_equals_its_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let mut weights = Vec::new();
        density::weights(Unit::new(Lanes::Auto).unwrap(), &cells, &Control::default(), &mut weights);
        let field = Sph { iso: 0.6, particles_per_support: 2.0 };
        compare(lattice, &cells, &field, &[&weights], |terms| scalar::sph(terms, &weights));
    }
}

/// Different radii, in support units.
fn radii(cells: &Cells) -> Vec<f32> {
    (0..cells.len() + LANES).map(|i| 0.1 + 0.01 * (i * 7 % 11) as f32).collect()
}

#[test]
fn onderiks_field_equals_its_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let own = radii(&cells);
        let mut volumes = Vec::new();
        onderik::volumes(Unit::new(Lanes::Auto).unwrap(), &cells, &Control::default(), &mut volumes);
        let (w_min, w_max) = (0.0, 1.05);
        let field = Onderik::<false> { iso: 0.0, radius: 0.25, w_min, w_max, particles_per_support: 4.0 };
        compare(lattice, &cells, &field, &[&volumes], |terms| scalar::onderik(&field, terms, &volumes, None));
        let field = Onderik::<true> { iso: 0.0, radius: 0.25, w_min, w_max, particles_per_support: 4.0 };
        let value = |terms: &[Term]| scalar::onderik(&field, terms, &volumes, Some(&own));
        compare(lattice, &cells, &field, &[&volumes, &own], value);
    }
}

#[test]
fn the_sph_field_of_radii_equals_its_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let support = |i: usize| 0.4 + 0.05 * (i * 7 % 13) as f32;
        let per_support_sq: Vec<f32> = (0..cells.len() + LANES).map(|i| support(i).powi(-2)).collect();
        let masses: Vec<f32> = (0..cells.len() + LANES).map(|i| support(i).powi(3)).collect();
        let reach: Vec<f32> = per_support_sq.iter().map(|v| 1.000_01 / v).collect();
        let mut weights = Vec::new();
        let own = density::Own { masses: &masses, per_support_sq: &per_support_sq };
        own.weights(Unit::new(Lanes::Auto).unwrap(), &cells, &Control::default(), &mut weights);
        let field = SphOfRadii { iso: 0.6, particles_per_support: 2.0, smallest: 0.4 };
        let value = |terms: &[Term]| scalar::sph_of_radii(terms, &weights, &per_support_sq);
        compare(lattice, &cells, &field, &[&weights, &per_support_sq, &reach], value);
    }
}

/// Ellipsoids of any shape, none of which reaches beyond the support.
fn ellipsoids(count: usize) -> Vec<Vec<f32>> {
    let shapes = Shapes { smoothing: 0.9, max_stretch: 4.0, isolated_scale: 0.5, min_neighbors: 25.0 };
    let row = |i: usize| {
        let mut record = [0.0; RECORD];
        let v = |k: usize| 0.1 + 0.03 * ((i * 7 + k * 5) % 11) as f32;
        (record[0], record[1], record[11]) = (0.4, 10.0, if i.is_multiple_of(5) { 3.0 } else { 60.0 });
        record[5..11].copy_from_slice(&[v(0), 0.03, -0.02, v(1), 0.04, v(2)]);
        shapes.columns(&record, 1.0 / shapes.longest())
    };
    let rows: Vec<_> = (0..count).map(row).collect();
    (0..COLUMNS).map(|c| rows.iter().map(|row| row[c]).chain([0.0; LANES]).collect()).collect()
}

#[test]
fn the_anisotropic_field_equals_its_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let columns = ellipsoids(cells.len());
        let slices: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
        let field = Anisotropic { iso: 0.5, particles_per_support: 5.0, smallest: 1.0 };
        compare(lattice, &cells, &field, &slices, |terms| scalar::anisotropic(terms, &columns));
    }
}

#[test]
fn metaballs_equal_their_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let field =
            Metaballs::<_, false> { falloff: Triquet, iso: 0.2, particles_per_support: 1.5, smallest: 1.0, bulk: 1.0 };
        compare(lattice, &cells, &field, &[], scalar::metaball);
    }
}

#[test]
fn zhu_bridsons_field_equals_its_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let own = radii(&cells);
        let field = ZhuBridson::<false> { iso: 0.1, radius: 0.22, particles_per_support: 4.0 };
        compare(lattice, &cells, &field, &[], |terms| scalar::zhu_bridson(&field, terms, None));
        let field = ZhuBridson::<true> { iso: 0.0, radius: 0.25, particles_per_support: 4.0 };
        compare(lattice, &cells, &field, &[&own], |terms| scalar::zhu_bridson(&field, terms, Some(&own)));
    }
}

#[test]
fn solenthalers_field_equals_its_specification_on_every_unit() {
    for lattice in LATTICES {
        let cells = sorted(lattice);
        let own = radii(&cells);
        let (t_low, t_high) = (0.4, 3.5);
        let field = Solenthaler::<false> { iso: 0.0, radius: 0.25, t_low, t_high, particles_per_support: 4.0 };
        compare(lattice, &cells, &field, &[], |terms| scalar::solenthaler(&field, terms, None));
        let field = Solenthaler::<true> { iso: 0.0, radius: 0.25, t_low, t_high, particles_per_support: 4.0 };
        compare(lattice, &cells, &field, &[&own], |terms| scalar::solenthaler(&field, terms, Some(&own)));
    }
}
