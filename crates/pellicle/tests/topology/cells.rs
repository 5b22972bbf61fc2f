//! Single cells: all 256 cases of signs, and within each all that the trilinear interpolant can be.
//!
//! Names are Chernyaev's (Marching Cubes 33, 1995).

use std::collections::BTreeMap;

use pellicle::{Border, ContourParams, Level, Mesh, Volume, contour, mesh::Report};

use crate::Random;
use crate::judge::{CellTopology, judge_cell};

/// A case of signs up to symmetry and exchange of the sides, by its inside corners, and what the surface can be in it:
/// components, Euler number, loops on the cell's faces.
type Case = (&'static str, &'static [usize], &'static [(&'static str, [i64; 3])]);

const DISC: &[(&str, [i64; 3])] = &[("one disc", [1, 1, 1])];

const CASES: [Case; 14] = [
    ("0", &[], &[("nothing", [0, 0, 0])]),
    ("1", &[0], DISC),
    ("2", &[0, 1], DISC),
    ("3", &[0, 3], &[("3.1", [2, 2, 2]), ("3.2", [1, 1, 1])]),
    ("4", &[0, 7], &[("4.1", [2, 2, 2]), ("4.2, a tunnel", [1, 0, 2])]),
    ("5", &[0, 1, 2], DISC),
    ("6", &[0, 1, 7], &[("6.1.1", [2, 2, 2]), ("6.1.2, a tunnel", [1, 0, 2]), ("6.2", [1, 1, 1])]),
    (
        "7",
        &[0, 3, 5],
        &[("7.1", [3, 3, 3]), ("7.2, 7.4.1", [2, 2, 2]), ("7.3", [1, 1, 1]), ("7.4.2, a tunnel", [1, 0, 2])],
    ),
    ("8", &[0, 1, 2, 3], DISC),
    ("9", &[0, 1, 2, 4], DISC),
    ("10", &[0, 1, 6, 7], &[("10.1.1", [2, 2, 2]), ("10.1.2, a tunnel", [1, 0, 2]), ("10.2", [1, 1, 1])]),
    ("11, 14", &[0, 1, 3, 7], DISC),
    ("12", &[0, 1, 2, 7], &[("12.1.1", [2, 2, 2]), ("12.1.2, a tunnel", [1, 0, 2]), ("12.2", [1, 1, 1])]),
    (
        "13",
        &[0, 3, 5, 6],
        &[
            ("13.1", [4, 4, 4]),
            ("13.2, 13.5.1", [3, 3, 3]),
            ("13.3", [2, 2, 2]),
            ("13.4", [1, 1, 1]),
            ("13.5.2, a tunnel and a disc", [2, 1, 3]),
        ],
    ),
];

/// The least of all cases that symmetries and the exchange of the sides make of one.
fn canonical(case: u8) -> u8 {
    let mut least = u8::MAX;
    for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
        for flip in 0..8 {
            let moved = |c: usize| (0..3).fold(0, |to, a| to | (c >> a & 1) << order[a]) ^ flip;
            let turned = (0..8).fold(0u8, |set, c| set | (case >> c & 1) << moved(c));
            least = least.min(turned).min(!turned);
        }
    }
    least
}

/// The surface of one cell, open at its faces.
fn surface(values: [i128; 8], level: Level) -> Mesh {
    let samples = values.map(|v| v as i16);
    let volume = Volume::new(&samples, [2; 3]).expect("fits").with_border(Border::Open);
    contour(&volume, 0.0, &ContourParams { level, ..ContourParams::default() }).expect("good")
}

/// What a mesh is; closed curves of sides without a neighbour.
fn topology(mesh: &Mesh) -> CellTopology {
    let report = Report::of(mesh);
    let faults = report.duplicate_half_edges + report.non_manifold_edges + report.non_manifold_vertices;
    assert_eq!((faults, report.unused_vertices), (0, 0), "{mesh:?}");
    let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let next: BTreeMap<u32, u32> = sides().filter(|&(a, b)| !sides().any(|side| side == (b, a))).collect();
    let (mut left, mut loops) = (next.clone(), 0);
    while let Some((&first, _)) = left.first_key_value() {
        loops += 1;
        let mut at = first;
        while let Some(to) = left.remove(&at) {
            at = to;
        }
        assert_eq!(at, first, "{mesh:?}");
    }
    CellTopology { components: report.components, euler: report.euler_characteristic, loops }
}

#[test]
fn every_single_cell_case_has_each_of_its_topologies_and_no_other() {
    let mut random = Random(33);
    // Which topologies of each row of the table came.
    let mut seen: BTreeMap<u8, BTreeMap<CellTopology, usize>> = BTreeMap::new();
    let (mut compared, mut classic) = (0, 0);
    for case in 0..=255u8 {
        // The last of the table has one with a probability of a few in a thousand.
        let draws = if canonical(case) == canonical(0b0110_1001) { 1000 } else { 120 };
        for draw in 0..draws {
            // Every other cell has values of very different sizes: rare topologies want them.
            let values: [i128; 8] = std::array::from_fn(|c| {
                let size = if draw % 2 == 0 { 1000 } else { 4 << random.below(9) };
                (1 + random.below(size)) * if case >> c & 1 == 1 { 1 } else { -1 }
            });
            let Some(want) = judge_cell(values) else { continue };
            assert_eq!(topology(&surface(values, Level::Topological)), want, "case {case}: {values:?}");
            classic += usize::from(topology(&surface(values, Level::Classic)) == want);
            compared += 1;
            *seen.entry(canonical(case)).or_default().entry(want).or_default() += 1;
        }
    }
    assert_eq!(seen.len(), CASES.len());
    for (name, inside, expected) in CASES {
        let seen = &seen[&canonical(inside.iter().fold(0, |case, c| case | 1 << c))];
        for (topology, n) in seen {
            let is = |want: &[i64; 3]| *want == [topology.components as i64, topology.euler, topology.loops as i64];
            let Some((name, _)) = expected.iter().find(|(_, want)| is(want)) else {
                panic!("case {name} has {topology:?}, which no table names");
            };
            println!("{name}: {topology:?} in {n} cells");
        }
        assert_eq!(seen.len(), expected.len(), "case {name}: some did not come: {seen:?}");
    }
    assert!(classic < compared, "the cells are too easy");
    println!("{compared} cells equal; the classic level has {classic} of them");
}
