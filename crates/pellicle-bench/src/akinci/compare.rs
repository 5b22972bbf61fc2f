//! How far two meshes of the same surface lie apart.

use pellicle::Mesh;
use rustc_hash::FxHashMap;

/// The difference of two meshes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Farthest that a vertex of either lies from the nearest one of the other, in cells, those of `astray` left out.
    pub farthest: f64,
    /// Vertices farther than a hundredth of a cell from all of the other's: the sign of some node differs.
    pub astray: usize,
}

/// Compares vertices; `spacing` is the edge of a cell.
pub fn compare(a: &Mesh, b: &Mesh, spacing: f64) -> Difference {
    let (there, back) = (one_way(a, b, spacing), one_way(b, a, spacing));
    Difference { farthest: there.farthest.max(back.farthest), astray: there.astray + back.astray }
}

fn one_way(from: &Mesh, to: &Mesh, spacing: f64) -> Difference {
    let in_cells = |mesh: &Mesh, v: usize| mesh.position(v).map(|x| x / spacing);
    let cell = |p: [f64; 3]| p.map(|x| x.floor() as i64);
    let mut places: FxHashMap<[i64; 3], Vec<[f64; 3]>> = FxHashMap::default();
    for v in 0..to.vertices.len() {
        let p = in_cells(to, v);
        places.entry(cell(p)).or_default().push(p);
    }
    let mut difference = Difference { farthest: 0.0, astray: 0 };
    for v in 0..from.vertices.len() {
        let p = in_cells(from, v);
        let at = cell(p);
        let mut least = f64::MAX;
        for i in 0..27 {
            let near = [i % 3, i / 3 % 3, i / 9].map(|v| v - 1);
            for q in places.get(&std::array::from_fn::<i64, 3, _>(|a| at[a] + near[a])).into_iter().flatten() {
                least = least.min((0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>());
            }
        }
        if least.sqrt() > 0.01 {
            difference.astray += 1;
        } else {
            difference.farthest = difference.farthest.max(least.sqrt());
        }
    }
    difference
}
