//! Surfaces of random grids against a judge that knows geometry and signs only.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    Kind, Surface,
    boxed::{Boxed, Cubic},
    sheared::Sheared,
    source::{ABSENT, Source},
};
use crate::{Control, Mesh, mesh::Report};

/// A small grid of values.
#[derive(Clone)]
struct Grid {
    nodes: [usize; 3],
    values: Vec<f64>,
    is_open: bool,
}

impl Cubic for Grid {
    fn nodes(&self) -> [usize; 3] {
        self.nodes
    }

    fn is_open(&self) -> bool {
        self.is_open
    }

    fn row(&self, [i, j, k]: [usize; 3], to: &mut [f64]) {
        let start = i + self.nodes[0] * (j + self.nodes[1] * k);
        to.copy_from_slice(&self.values[start..start + to.len()]);
    }

    fn place(&self, at: [f64; 3]) -> [f64; 3] {
        at
    }

    fn is_left_handed(&self) -> bool {
        false
    }
}

struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % n
    }
}

/// Values of several kinds: few levels with plateaus on the isovalue, many levels, absent nodes among them.
fn random_grid(nodes: [usize; 3], seed: u64) -> Grid {
    let mut random = Random((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let kind = seed % 4;
    let values = (0..nodes.iter().product::<usize>()).map(|_| match kind {
        0 => random.below(3) as f64 - 1.0,
        1 => random.below(2) as f64 - 0.5,
        2 => random.below(2001) as f64 / 1000.0 - 1.0,
        _ => [ABSENT, -1.0, 0.0, 0.5, 1.0, 3.0][random.below(6) as usize],
    });
    Grid { nodes, values: values.collect(), is_open: false }
}

/// A smooth bump field, so that merging has something to do.
fn smooth_grid(n: usize, seed: u64) -> Grid {
    let mut random = Random((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let waves: Vec<[f64; 5]> = (0..6)
        .map(|_| std::array::from_fn(|i| random.below(1000) as f64 / 1000.0 * if i < 3 { 0.7 } else { 6.0 }))
        .collect();
    let at = |n: usize, i: usize| [i % n, i / n % n, i / (n * n)].map(|v| v as f64);
    let values = (0..n * n * n).map(|i| {
        let p = at(n, i);
        waves.iter().map(|w| (w[0] * p[0] + w[1] * p[1] - w[2] * p[2] + w[3]).sin()).sum::<f64>() + waves[0][4] / 6.0
            - 0.5
    });
    Grid { nodes: [n; 3], values: values.collect(), is_open: false }
}

fn mesh_of(source: &dyn Source, kind: Kind) -> Mesh {
    let surface = Surface::new(source, kind, &Control::default()).expect("small");
    let mut mesh = Mesh {
        vertices: vec![[f32::NAN; 3]; surface.vertices()],
        triangles: vec![[u32::MAX; 3]; surface.triangles()],
        ..Mesh::default()
    };
    surface.write_vertices(source, &mut mesh.vertices);
    surface.write_triangles(source, &mut mesh.triangles);
    mesh
}

/// Places in half cells.
type Point = [i32; 3];

/// Tetrahedra of a box, by rules that share nothing with the tables.
fn tetrahedra(kind: Kind, nodes: [usize; 3]) -> Vec<[Point; 4]> {
    let mut all = Vec::new();
    let n = nodes.map(|n| n as i32);
    for cell in (0..(n[0] + 1) * (n[1] + 1) * (n[2] + 1))
        .map(|c| [c % (n[0] + 1) - 1, c / (n[0] + 1) % (n[1] + 1) - 1, c / ((n[0] + 1) * (n[1] + 1)) - 1])
    {
        let p = cell.map(|v| 2 * v);
        let plus = |d: [i32; 3]| [p[0] + d[0], p[1] + d[1], p[2] + d[2]];
        match kind {
            Kind::Six => {
                for [a, b, c] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                    let mut path = [p; 4];
                    for (i, axis) in [a, b, c].into_iter().enumerate() {
                        path[i + 1] = path[i];
                        path[i + 1][axis] += 2;
                    }
                    all.push(path);
                }
            }
            Kind::Five => {
                // Even corners make the middle one; an odd corner goes with its three neighbours, which are even.
                let corners: Vec<Point> = (0..8).map(|c| plus([0, 1, 2].map(|a| 2 * (c >> a & 1)))).collect();
                let is_even = |q: &Point| q.iter().map(|v| v / 2).sum::<i32>().rem_euclid(2) == 0;
                let even: Vec<Point> = corners.iter().copied().filter(is_even).collect();
                all.push([even[0], even[1], even[2], even[3]]);
                for q in corners.iter().filter(|q| !is_even(q)) {
                    let near = |r: &&Point| (0..3).map(|a| (q[a] - r[a]).abs()).sum::<i32>() == 2;
                    let near: Vec<Point> = even.iter().filter(near).copied().collect();
                    all.push([*q, near[0], near[1], near[2]]);
                }
            }
            Kind::Bcc | Kind::Regularised => {
                // Both ends of an edge along an axis, and two neighbouring middles of the four around it.
                for axis in 0..3 {
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let mut end = p;
                    end[axis] += 2;
                    let ring = [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(|[du, dv]| {
                        let mut m = p;
                        m[axis] += 1;
                        m[u] += du;
                        m[v] += dv;
                        m
                    });
                    all.extend((0..4).map(|i| [p, end, ring[i], ring[(i + 1) % 4]]));
                }
            }
        }
    }
    all
}

/// Whether a point is inside.
fn is_inside(grid: &Grid, p: Point) -> bool {
    let value = |p: Point| {
        let at = p.map(|v| v.div_euclid(2));
        if (0..3).any(|a| !(0..grid.nodes[a] as i32).contains(&at[a])) {
            return ABSENT;
        }
        let [i, j, k] = at.map(|v| v as usize);
        grid.values[i + grid.nodes[0] * (j + grid.nodes[1] * k)]
    };
    if p[0].rem_euclid(2) == 0 {
        return value(p) > 0.0;
    }
    let c: Vec<f64> = (0..8).map(|c| value([0, 1, 2].map(|a| p[a] - 1 + 2 * (c >> a & 1)))).collect();
    (c[0] + c[7]) + (c[1] + c[6]) + ((c[2] + c[5]) + (c[3] + c[4])) > 0.0
}

/// Euler characteristic and components of the surface in these tetrahedra: crossed edges − crossed faces + crossed
/// tetrahedra, and tetrahedra that meet in crossed faces.
fn judge(grid: &Grid, tetrahedra: &[[Point; 4]]) -> (i64, usize) {
    let mut cells = Vec::new();
    let (mut edges, mut faces) = (BTreeSet::new(), BTreeMap::<Vec<Point>, Vec<usize>>::new());
    for t in tetrahedra {
        let mut t = *t;
        t.sort_unstable();
        let inside = t.map(|p| is_inside(grid, p));
        if inside.iter().all(|&i| i == inside[0]) {
            continue;
        }
        cells.push(t);
        for a in 0..4 {
            for b in a + 1..4 {
                if inside[a] != inside[b] {
                    edges.insert([t[a], t[b]]);
                }
            }
            let face: Vec<usize> = (0..4).filter(|&c| c != a).collect();
            if face.iter().any(|&c| inside[c] != inside[face[0]]) {
                faces.entry(face.iter().map(|&c| t[c]).collect()).or_default().push(cells.len() - 1);
            }
        }
    }
    let mut piece: Vec<usize> = (0..cells.len()).collect();
    fn root(piece: &mut [usize], mut i: usize) -> usize {
        while piece[i] != i {
            piece[i] = piece[piece[i]];
            i = piece[i];
        }
        i
    }
    let mut components = cells.len();
    for pair in faces.values().filter(|of| of.len() == 2) {
        let (a, b) = (root(&mut piece, pair[0]), root(&mut piece, pair[1]));
        components -= usize::from(a != b);
        piece[a] = b;
    }
    (edges.len() as i64 - faces.len() as i64 + cells.len() as i64, components)
}

/// Closed, manifold, and of the topology that the judge finds.
fn check(grid: &Grid, kind: Kind, source: &dyn Source, of: &[[Point; 4]]) -> Mesh {
    let mesh = mesh_of(source, kind);
    let report = Report::of(&mesh);
    assert!(report.closed_manifold(), "{kind:?} {report:?}");
    assert_eq!((report.nan_vertices, report.unused_vertices), (0, 0));
    assert_eq!((report.euler_characteristic, report.components), judge(grid, of), "{kind:?}");
    mesh
}

const KINDS: [Kind; 4] = [Kind::Five, Kind::Six, Kind::Bcc, Kind::Regularised];

#[test]
fn random_grids_are_closed_manifold_and_of_the_linear_interpolants_topology() {
    for nodes in [[5, 5, 5], [2, 3, 7], [6, 4, 5]] {
        let lists = KINDS.map(|kind| tetrahedra(kind, nodes));
        for seed in 0..60 {
            let grid = random_grid(nodes, seed);
            for (kind, list) in KINDS.into_iter().zip(&lists) {
                check(&grid, kind, &Boxed::new(grid.clone()), list);
            }
            check(&grid, Kind::Six, &Sheared::new(grid.clone()), &lists[2]);
        }
    }
}

#[test]
fn merging_leaves_few_vertices_and_keeps_the_topology() {
    let list = tetrahedra(Kind::Bcc, [9; 3]);
    let mut triangles = [0; 2];
    for seed in 0..40 {
        let grid = smooth_grid(9, seed);
        let source = Boxed::new(grid.clone());
        let plain = check(&grid, Kind::Bcc, &source, &list);
        let regular = check(&grid, Kind::Regularised, &source, &list);
        triangles[0] += plain.triangles.len();
        triangles[1] += regular.triangles.len();
    }
    // Caps on the border of the box are a good part of these surfaces.
    assert!(triangles[1] < triangles[0] * 6 / 10, "{triangles:?}");
}

#[test]
fn volumes_are_outward_and_simplex_is_body_centred() {
    for seed in 0..20 {
        let grid = smooth_grid(8, seed);
        let volumes: Vec<f64> =
            KINDS.iter().map(|&kind| Report::of(&mesh_of(&Boxed::new(grid.clone()), kind)).signed_volume).collect();
        for volume in &volumes {
            assert!(*volume > 0.0 && (volume / volumes[0] - 1.0).abs() < 0.1, "{volumes:?}");
        }
        let sheared = Report::of(&mesh_of(&Sheared::new(grid), Kind::Six));
        assert!((sheared.signed_volume / volumes[2] - 1.0).abs() < 1e-3, "{} {volumes:?}", sheared.signed_volume);
    }
}

#[test]
fn an_open_border_is_the_only_rim() {
    for seed in 0..40 {
        let nodes = [5, 6, 7];
        for grid in [random_grid(nodes, seed), Grid { nodes, ..smooth_grid(8, seed) }] {
            let grid =
                Grid { is_open: true, values: grid.values[..210].iter().map(|&v| v.max(-2.0)).collect(), ..grid };
            for kind in KINDS {
                let mesh = mesh_of(&Boxed::new(grid.clone()), kind);
                let report = Report::of(&mesh);
                let defects = report.duplicate_half_edges + report.non_manifold_edges + report.repeated_index_triangles;
                assert_eq!((defects, report.unused_vertices, report.nan_vertices), (0, 0, 0), "{kind:?}");
                let sides: BTreeSet<[u32; 2]> =
                    mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
                for [a, b] in sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a])) {
                    let [a, b] = [a, b].map(|v| mesh.vertices[*v as usize]);
                    let on_rim = (0..3).any(|i| a[i] == b[i] && (a[i] == 0.0 || a[i] == (nodes[i] - 1) as f32));
                    assert!(on_rim, "{kind:?}: {a:?} {b:?}");
                }
            }
        }
    }
}

#[test]
fn a_full_box_closes_in_the_planes_of_its_border() {
    let grid = Grid { nodes: [4, 5, 6], values: vec![1.0; 120], is_open: false };
    for kind in KINDS {
        let report = Report::of(&mesh_of(&Boxed::new(grid.clone()), kind));
        assert!((report.signed_volume - 60.0).abs() < 1e-4 && (report.area - 94.0).abs() < 1e-4, "{kind:?} {report:?}");
        assert!(report.closed_manifold());
    }
}

#[test]
fn same_mesh_for_any_number_of_threads() {
    let grid = smooth_grid(24, 3);
    for kind in KINDS {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| mesh_of(&Boxed::new(grid.clone()), kind))
        };
        assert_eq!(run(1), run(4));
    }
}
