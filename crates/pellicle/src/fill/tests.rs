//! What runs equals the specification, bit for bit, on every vector unit.

use super::{Scratch, scalar::node_value, simd::FillOctet};
use crate::{
    Control, Lanes,
    field::{Field, density, sph::Sph},
    lattice::Lattice,
    lookup::cells::Cells,
    math::simd::Unit,
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

#[test]
fn every_unit_equals_the_scalar_specification_bit_for_bit() {
    let positions = cloud();
    // A fine lattice, and a coarse one whose bricks are wider than the support, which is another branch.
    for spacing in [0.05, 0.21] {
        let lattice = Lattice { spacing, support: 0.4 };
        let mut cells = Cells::default();
        cells.build((&positions).into(), lattice).unwrap();
        let mut weights = Vec::new();
        density::weights(Unit::new(Lanes::Auto).unwrap(), &cells, &Control::default(), &mut weights);
        let field = Sph { iso: 0.6, particles_per_support: 2.0 };
        for octet in [[0, 0, 0], [-1, 0, -1], [0, -1, 0]] {
            let want: Vec<Vec<u32>> = (0..8)
                .map(|brick| {
                    let node = |n: i32| {
                        let first = super::brick_origin(brick);
                        [first[0] + (n & 3), first[1] + (n >> 2 & 3), first[2] + (n >> 4)]
                    };
                    (0..64).map(|n| node_value(&cells, &weights, lattice.step(), octet, node(n)).to_bits()).collect()
                })
                .collect();
            for lanes in [Lanes::Avx512, Lanes::Avx2, Lanes::Portable] {
                let Some(unit) = Unit::new(lanes) else { continue };
                let (mut values, mut above) = ([[0.0; 64]; 8], [[0; 1]; 8]);
                unit.run(FillOctet {
                    field: &field,
                    cells: &cells,
                    columns: &[&weights],
                    step: lattice.step(),
                    octet,
                    bricks: 0xff,
                    scratch: &mut Scratch::default(),
                    values: &mut values,
                    thresholds: &[field.iso()],
                    crowd: 0,
                    above: &mut above,
                });
                for brick in 0..8 {
                    assert_eq!(values[brick].map(f32::to_bits).to_vec(), want[brick], "{lanes:?} {octet:?} {brick}");
                    for n in 0..64 {
                        assert_eq!(above[brick][0] >> n & 1 == 1, values[brick][n] > 0.6);
                    }
                }
            }
        }
    }
}
