use super::*;
use crate::{Mesh, bricks::levels::Blocks, mesh::Report};

/// Any function of a node.
struct Nodes<F>(F);

impl<F: Fn(Coord) -> f32 + Sync> Source for Nodes<F> {
    type Scratch = ();

    fn values(&self, _: &mut (), _: usize, grid: Grid, to: &mut [f32]) {
        for k in 0..=grid.n {
            for j in 0..=grid.n {
                for i in 0..=grid.n {
                    let at = [i, j, k];
                    to[grid.place(at)] = self.0(std::array::from_fn(|a| grid.first[a] + grid.stride * at[a] as i32));
                }
            }
        }
    }

    fn gradients(&self, scratch: &mut (), block: usize, grid: Grid, _: &RowSet, to: &mut Samples) {
        self.values(scratch, block, grid, &mut to.values);
        for k in 0..=grid.n {
            for j in 0..=grid.n {
                for i in 0..=grid.n {
                    let at = [i, j, k];
                    let node: Coord = std::array::from_fn(|a| grid.first[a] + grid.stride * at[a] as i32);
                    for axis in 0..3 {
                        let (mut low, mut high) = (node, node);
                        low[axis] -= 1;
                        high[axis] += 1;
                        to.gradients[axis][grid.place(at)] = self.0(high) - self.0(low);
                    }
                }
            }
        }
    }
}

fn mesh(
    side: usize,
    blocks: impl IntoIterator<Item = Coord>,
    coarsest: u8,
    wish: impl FnMut(Coord) -> u8,
    field: impl Fn(Coord) -> f32 + Sync,
) -> Mesh {
    let mut surface = Surface { rows: Rows { side, ..Rows::default() }, ..Surface::default() };
    let mut listed = Blocks::default();
    listed.list(blocks, coarsest, wish);
    surface.rows.blocks = listed;
    let mut pool = Vec::new();
    fit_pool(&mut pool);
    surface.count(&Nodes(&field), 0.0, &pool).expect("few vertices");
    let mut mesh = Mesh {
        vertices: vec![[f32::NAN; 3]; surface.vertex_count()],
        normals: vec![[f32::NAN; 3]; surface.vertex_count()],
        triangles: vec![[u32::MAX; 3]; surface.triangle_count()],
        ..Mesh::default()
    };
    let place = Place { iso: 0.0, origin: [0; 3], spacing: 1.0 };
    let to = Vertices { positions: &mut mesh.vertices, normals: Some(&mut mesh.normals) };
    surface.write_vertices(&Nodes(&field), place, &pool, to);
    surface.write_triangles(&mut mesh.triangles);
    mesh
}

#[track_caller]
fn assert_closed(mesh: &Mesh, what: impl std::fmt::Debug) -> Report {
    let report = Report::of(mesh);
    assert!(report.closed_manifold(), "{what:?}: {report:?}");
    assert_eq!((report.nan_vertices, report.unused_vertices), (0, 0), "{what:?}");
    assert!(report.signed_volume >= 0.0, "{what:?}: {report:?}");
    report
}

/// A random number in −1..1 for each node, the same at every level.
fn noise(seed: u32) -> impl Fn(Coord) -> f32 + Sync {
    move |node| {
        let mut h = seed ^ 0x9e37_79b9;
        for v in node {
            h = (h ^ v as u32).wrapping_mul(0x85eb_ca6b);
            h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
            h ^= h >> 16;
        }
        h as f32 / (1u32 << 31) as f32 - 1.0
    }
}

fn cube(side: i32) -> impl Iterator<Item = Coord> + Clone {
    (0..side.pow(3)).map(move |i| [i % side, i / side % side, i / side / side])
}

#[test]
fn all_patterns_of_two_levels_around_a_corner_are_closed_whatever_the_signs() {
    for pattern in 0..256u32 {
        for seed in 0..4 {
            let wish = |b: Coord| (pattern >> (b[0] + 2 * b[1] + 4 * b[2]) & 1) as u8;
            // One coarse cell a block is the hardest: all its nodes are on the border.
            let side = [2, 4, 8][seed as usize % 3];
            assert_closed(&mesh(side, cube(2), 1, wish, noise(seed + 4 * pattern)), (pattern, seed));
        }
    }
}
