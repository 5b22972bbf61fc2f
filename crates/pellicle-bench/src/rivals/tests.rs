use pellicle::Lanes;
use pellicle::internals::{CASES, Unit};
use pellicle_scenes::{ISO, Play, SUPPORT, Show};

use super::{Approach, Output, Task, blocks::Blocks, hashed::Hashed};

/// Cubes and triangles by evaluating every node in double precision.
fn every_node(positions: &[[f32; 3]], task: &Task) -> (usize, usize) {
    let bound = |axis: usize| {
        let values = positions.iter().map(|p| f64::from(p[axis]));
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
        [((low - task.support) / task.spacing).floor() as i64, ((high + task.support) / task.spacing).ceil() as i64 + 1]
    };
    let bounds = [bound(0), bound(1), bound(2)];
    let nodes = bounds.map(|[low, high]| (high - low + 1) as usize);
    let mut values = vec![0.0f64; nodes.iter().product()];
    for p in positions.iter().map(|p| p.map(f64::from)) {
        let range = |axis: usize| {
            let [low, high] = [-1.0, 1.0].map(|side| (p[axis] + side * task.support) / task.spacing);
            low.ceil() as i64..=high.floor() as i64
        };
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    let d: f64 = (0..3).map(|a| ([i, j, k][a] as f64 * task.spacing - p[a]).powi(2)).sum();
                    let at = [i, j, k].map(|v| v as usize);
                    let low: [usize; 3] = std::array::from_fn(|a| at[a].wrapping_sub(bounds[a][0] as usize));
                    let u = (1.0 - d / task.support.powi(2)).max(0.0);
                    values[low[0] + nodes[0] * (low[1] + nodes[1] * low[2])] += u * u / 4.0;
                }
            }
        }
    }
    let (mut cubes, mut triangles) = (0, 0);
    for k in 0..nodes[2] - 1 {
        for j in 0..nodes[1] - 1 {
            for i in 0..nodes[0] - 1 {
                let corner = |c: usize| (i + (c & 1)) + nodes[0] * ((j + (c >> 1 & 1)) + nodes[1] * (k + (c >> 2)));
                let case = (0..8).fold(0, |case, c| case | usize::from(values[corner(c)] > f64::from(task.iso)) << c);
                cubes += usize::from(CASES[case].len > 0);
                triangles += usize::from(CASES[case].len);
            }
        }
    }
    (cubes, triangles)
}

fn surface(approach: &mut dyn Approach, positions: &[[f32; 3]]) -> Output {
    let mut out = Output::default();
    approach.update(positions, &mut out);
    out
}

fn unit() -> Unit {
    Unit::new(Lanes::Auto).expect("the portable one is always there")
}

#[test]
fn rivals_find_what_evaluating_every_node_finds() {
    for (show, frame, spacing) in
        [(Show::Blob, 0, 0.6), (Show::Explosion, 60, 0.75), (Show::Monster, 85, 0.5), (Show::Explosion, 200, 0.8)]
    {
        let mut play = Play::new(show, 1);
        (0..frame).for_each(|_| play.step());
        let positions = &play.balls().positions;
        let task = Task { spacing, support: SUPPORT.into(), iso: ISO };
        let want = every_node(positions, &task);
        let context = format!("{} frame {frame}", show.name());
        for block in [8, 20, 64] {
            for cell in [0.5, 1.0, 1.3] {
                let out = surface(&mut Blocks::new(task, unit(), block, cell), positions);
                assert_eq!((out.cubes, out.indices.len() / 3), want, "{context}, blocks of {block}, cells of {cell}");
            }
        }
        for cell in [0.4, 1.0] {
            let out = surface(&mut Hashed::new(task, unit(), cell), positions);
            assert_eq!((out.cubes, out.indices.len() / 3), want, "{context}, cells of {cell}");
        }
    }
}

#[test]
fn a_hashed_surface_is_closed_and_faces_outward() {
    let mut play = Play::new(Show::Blob, 1);
    (0..40).for_each(|_| play.step());
    let task = Task { spacing: 0.5, support: SUPPORT.into(), iso: ISO };
    let out = surface(&mut Hashed::new(task, unit(), 1.0), &play.balls().positions);
    let mesh = pellicle::Mesh {
        vertices: out.vertices.iter().map(|v| [v[0], v[1], v[2]]).collect(),
        triangles: out.indices.as_chunks::<3>().0.to_vec(),
        ..pellicle::Mesh::default()
    };
    let report = pellicle::mesh::Report::of(&mesh);
    assert!(report.closed_manifold() && report.signed_volume > 0.0, "{report:?}");
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].map(f64::from));
        let n = out.vertices[t[0] as usize];
        let (u, v): (Vec<f64>, Vec<f64>) = (0..3).map(|k| (b[k] - a[k], c[k] - a[k])).unzip();
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let along: f64 = (0..3).map(|k| cross[k] * f64::from(n[3 + k])).sum();
        let size = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(along > -0.5 * size, "normals and winding disagree: {along} {size}");
    }
}
