//! Slivers out: vertices that lie nearest to the same lattice node become one.
//!
//! Marching cubes makes thin and tiny triangles where the surface passes close to a node: the crossings on the node's
//! edges then lie close together. Neighboring vertices whose nearest node is the same are merged into one in their
//! middle; the triangles between them vanish. No vertex moves farther than a cell's diagonal, and about 40 % of the
//! vertices go.
//!
//! Merging must not change what the surface is. Where the triangles around a merged vertex would not close up to one fan
//! (a thin neck that would be pinched, a droplet that would vanish), the merges that take part are undone, and the rest is
//! looked at again until all is well. So a closed manifold stays one, with the same components and genus.
//!
//! Last, edges are turned where that brings the numbers of neighbors closer to six, and the surface is nearly flat.
//!
//! Source: Moore & Warren, Mesh Displacement: An Improved Contouring Method for Trivariate Data, 1991; undoing what would
//! break the surface is this project's.

use rayon::prelude::*;

use super::{
    check,
    flip::even_valences,
    links::Links,
    node::{middle_of, packed},
    rebuild::{Groups, merge_groups},
    undo::undo_broken,
    zigzag::Squares,
};
use crate::{
    Control, Error, Mesh,
    math::{
        union_find::join,
        vector::{cross, dot, length, subtract},
    },
    mesh::stars::Stars,
};

/// Vertices or triangles looked at by one task.
const CHUNK: usize = 1 << 12;

/// Where the nodes of a lattice are: at `origin` plus whole numbers of each of the `steps`, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nodes {
    /// World position of one of them.
    pub origin: [f64; 3],
    /// From a node to the next along each axis. They may be oblique, but must span space.
    pub steps: [[f64; 3]; 3],
    /// Whether there is one in the middle of every cell, too: the body-centred lattice.
    pub has_middles: bool,
}

impl Nodes {
    /// The lattice of particles: cubes, anchored in the world's origin; `spacing` is the edge of a cell.
    pub fn cubic(spacing: f64) -> Self {
        let steps = [[spacing, 0.0, 0.0], [0.0, spacing, 0.0], [0.0, 0.0, spacing]];
        Self { origin: [0.0; 3], steps, has_middles: false }
    }

    /// Rows that turn an offset in world units into one in steps.
    pub(super) fn per_unit(&self) -> Result<[[f64; 3]; 3], Error> {
        let [x, y, z] = self.steps;
        let volume = dot(x, cross(y, z));
        let lengths: f64 = self.steps.iter().map(|s| length(*s)).product();
        let is_finite = self.origin.iter().all(|o| o.is_finite());
        if !(lengths.is_finite() && volume.abs() > 1e-9 * lengths && is_finite) {
            return Err(Error::Parameter {
                name: "spacing",
                value: length(x),
                must: "greater than 0, and steps that span space",
            });
        }
        Ok([cross(y, z), cross(z, x), cross(x, y)].map(|row| row.map(|v| v / volume)))
    }
}

/// Merges neighboring vertices with the same nearest lattice node.
///
/// # Errors
/// [`Error::Parameter`] for a lattice whose steps do not span space, [`Error::Count`] for an index that names no vertex,
/// [`Error::Length`] for an attribute of the wrong length, [`Error::Cancelled`]; the mesh is then as it was.
pub fn snap(mesh: &mut Mesh, nodes: &Nodes, control: &Control<'_>) -> Result<(), Error> {
    nodes.per_unit()?;
    check(mesh)?;
    with_stars(mesh, &mut Stars::default(), nodes, false, control)?;
    Ok(())
}

/// The same with memory for stars, which are those of the mesh after. With `zigzag` the diagonals of level parts alternate. Tells of each vertex that is left
/// whether triangles go all round it.
pub(super) fn with_stars(
    mesh: &mut Mesh,
    stars: &mut Stars,
    nodes: &Nodes,
    zigzag: bool,
    control: &Control<'_>,
) -> Result<Vec<bool>, Error> {
    let nearest = nearest_nodes(mesh, nodes)?;
    let mut target = groups(&mesh.triangles, &nearest);
    control.check()?;
    let mut links = Links::of(&mesh.triangles, &nearest, &target);
    let is_suspect = |v: &u32| target[*v as usize] == *v && !links.is_sure(*v);
    let suspects = (0..target.len() as u32).filter(is_suspect).collect();
    let undone = undo_broken(&mesh.triangles, &mut target, suspects, control)?;
    undone.iter().for_each(|&v| links.doubt(target[v as usize]));
    let groups = Groups::of(&target);
    merge_groups(mesh, &groups);
    let mut links = links.numbered(groups.lowest());
    // The body-centred lattice has no squares of neighbors.
    if zigzag && !nodes.has_middles {
        let nodes: Vec<u64> = groups.lowest().map(|v| nearest[v as usize]).collect();
        let squares = Squares { vertices: &mesh.vertices, nodes: &nodes };
        squares.alternate(&mut mesh.triangles, &mut links);
    }
    stars.rebuild(&mesh.triangles, mesh.vertices.len());
    let closed = stars.closed(|v| links.is_sure(v as u32));
    even_valences(mesh, stars, &closed);
    Ok(closed)
}

/// The lattice node nearest to each vertex, relative to the one nearest to the mesh's origin. Nearest in steps of the lattice,
/// along which the crossings lie, not in world units.
pub(super) fn nearest_nodes(mesh: &Mesh, nodes: &Nodes) -> Result<Vec<u64>, Error> {
    let per = nodes.per_unit()?;
    let to_origin = subtract(mesh.origin, nodes.origin);
    let shift = per.map(|row| dot(row, to_origin)).map(|o| o - o.round());
    let nearest = |v: &[f32; 3]| {
        let v = v.map(f64::from);
        let place = [0, 1, 2].map(|a| dot(per[a], v) + shift[a]);
        let (node, off) = rounded(place);
        if nodes.has_middles {
            let (middle, nearer) = rounded(place.map(|x| x - 0.5));
            if nearer < off {
                return middle_of(middle);
            }
        }
        node
    };
    Ok(mesh.vertices.par_iter().with_min_len(CHUNK).map(nearest).collect())
}

/// The whole numbers nearest to a place, packed, and the square of how far they are.
#[inline(always)]
fn rounded(place: [f64; 3]) -> (u64, f64) {
    let node = place.map(|x| {
        let cut = (x + 0.5) as i64;
        cut.wrapping_sub(i64::from(cut as f64 > x + 0.5))
    });
    let off = [0, 1, 2].map(|a| place[a] - node[a] as f64);
    (packed(node), dot(off, off))
}

/// The lowest vertex that each can reach through neighbors of the same node.
pub(super) fn groups(triangles: &[[u32; 3]], nodes: &[u64]) -> Vec<u32> {
    let within = |chunk: &[[u32; 3]]| {
        let mut edges = Vec::new();
        for triangle in chunk {
            let at = triangle.map(|v| nodes[v as usize]);
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                // One of the two ways that an edge is run through is enough: vertices of a border stay apart in the end.
                if at[i] == at[j] && triangle[i] > triangle[j] {
                    edges.push([triangle[j], triangle[i]]);
                }
            }
        }
        edges
    };
    let edges: Vec<Vec<[u32; 2]>> = triangles.par_chunks(CHUNK).map(within).collect();
    let mut lowest: Vec<u32> = (0..nodes.len() as u32).collect();
    for &[a, b] in edges.iter().flatten() {
        join(&mut lowest, a, b);
    }
    for v in 0..lowest.len() {
        lowest[v] = lowest[lowest[v] as usize];
    }
    lowest
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::rebuild::merge;
    use super::*;
    use crate::{Carry, Params, VertexAttribute, mesh::Report, reconstruct};

    /// The number of each vertex, to be carried as ids are.
    fn ids(mesh: &Mesh) -> VertexAttribute {
        let values = (0..mesh.vertices.len()).map(|v| v as f32).collect();
        VertexAttribute { carry: Carry::Nearest, ..VertexAttribute::new("id", 1, values) }
    }

    #[test]
    fn an_id_is_that_of_the_vertex_nearest_to_the_middle() {
        // Three vertices of one node around a fourth corner: their mean is nearest to the second.
        let mesh = Mesh { vertices: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.1, 0.0], [5.0; 3]], ..Mesh::default() };
        let mut mesh = Mesh { attributes: vec![ids(&mesh)], ..mesh };
        merge(&mut mesh, &[0, 0, 0, 3]);
        assert_eq!(mesh.attributes[0].values, [1.0, 3.0]);
    }

    /// Random particles with necks, droplets and cavities.
    pub(in super::super) fn tangled(seed: usize) -> (Mesh, Params) {
        let positions: Vec<[f32; 3]> = (0..400)
            .map(|i| [i * 37 + seed, i * i * 53 + 7 * seed, i * 101 + i / 7 * seed].map(|v| (v % 97) as f32 * 0.006))
            .collect();
        let params = Params { cell_size: 1.2, ..Params::new(0.025) };
        (reconstruct(&positions, &params).unwrap(), params)
    }

    #[test]
    fn a_closed_manifold_keeps_its_topology() {
        for seed in 0..20 {
            let (mut mesh, params) = tangled(seed);
            let before = Report::of(&mesh);
            snap(&mut mesh, &Nodes::cubic(params.spacing()), &Control::default()).unwrap();
            let after = Report::of(&mesh);
            assert!(after.closed_manifold(), "{after:?}");
            assert_eq!(after.components, before.components);
            assert_eq!(after.euler_characteristic, before.euler_characteristic);
            assert!(after.vertices < before.vertices * 4 / 5, "{} {}", after.vertices, before.vertices);
        }
    }

    #[test]
    fn what_would_pinch_or_vanish_is_undone() {
        // A single particle on coarse cells is an octahedron around one node: all six would merge.
        let params = Params { cell_size: 3.0, ..Params::new(0.025) };
        let mut mesh = reconstruct(&[[0.0f32; 3]], &params).unwrap();
        let before = mesh.clone();
        assert_eq!(mesh.vertices.len(), 6);
        snap(&mut mesh, &Nodes::cubic(params.spacing()), &Control::default()).unwrap();
        assert_eq!(mesh, before);
    }

    #[test]
    fn vertices_stay_near_and_carry_the_mean() {
        let (mut mesh, params) = tangled(3);
        let values = mesh.vertices.iter().flat_map(|v| [v[0], 2.0 * v[1]]).collect();
        mesh.attributes = vec![VertexAttribute::new("a", 2, values)];
        mesh.attributes.push(ids(&mesh));
        mesh.normals = vec![[0.0, 0.0, 1.0]; mesh.vertices.len()];
        let before = mesh.clone();
        snap(&mut mesh, &Nodes::cubic(params.spacing()), &Control::default()).unwrap();
        let mut moved = 0;
        for (v, &id) in mesh.vertices.iter().zip(&mesh.attributes[1].values) {
            // A mean of ids is hardly ever one of them.
            let whose = before.vertices[id as usize];
            assert!(id.fract() == 0.0 && (0..3).all(|a| (whose[a] - v[a]).abs() < 0.9 * params.spacing() as f32));
            moved += usize::from(whose != *v);
        }
        assert!(moved > mesh.vertices.len() / 10);
        for (v, value) in mesh.vertices.iter().zip(mesh.attributes[0].values.chunks(2)) {
            assert!((v[0] - value[0]).abs() < 1e-6 && (2.0 * v[1] - value[1]).abs() < 1e-6);
            let near = before.vertices.iter().map(|o| (0..3).map(|a| (o[a] - v[a]).powi(2)).sum::<f32>());
            assert!(near.fold(f32::MAX, f32::min).sqrt() < 0.9 * params.spacing() as f32);
        }
        assert!(mesh.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    }

    /// An open square of n × n quads bent along its middle, all cut along the same diagonal but for the one at `other`.
    fn square(n: u32, other: u32, slope: f32) -> Mesh {
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let height = |j: u32| slope * j.saturating_sub(n / 2) as f32;
        let vertices = (0..=n).flat_map(|i| (0..=n).map(move |j| [i as f32, j as f32, height(j)]));
        let triangles = (0..n * n).flat_map(|q| {
            let (i, j) = (q / n, q % n);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if q == other { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
        });
        Mesh { vertices: vertices.collect(), triangles: triangles.collect(), ..Mesh::default() }
    }

    #[test]
    fn an_edge_whose_ends_have_too_many_neighbors_is_turned_where_it_is_flat() {
        let sorted = |mesh: &Mesh| {
            let mut triangles = mesh.triangles.clone();
            triangles.iter_mut().for_each(|t| {
                let lowest = (0..3).min_by_key(|&i| t[i]).unwrap();
                t.rotate_left(lowest);
            });
            triangles.sort_unstable();
            triangles
        };
        let n = 8;
        for (other, slope) in [(27, 0.0), (27, 0.2), (35, 0.0), (27, 9.0)] {
            let mut mesh = square(n, other, slope);
            let before = mesh.clone();
            // Nodes so close that nothing merges.
            snap(&mut mesh, &Nodes::cubic(0.25), &Control::default()).unwrap();
            assert_eq!(mesh.vertices, before.vertices);
            // The quad at 27 ends at the bend and is flat itself.
            assert_eq!(sorted(&mesh), sorted(&square(n, n * n, slope)), "{other} {slope}");
        }
        // Bent along the diagonal itself, by far: it stays.
        let mut mesh = square(n, 27, 0.0);
        mesh.vertices[30][2] = 3.0;
        let before = mesh.clone();
        snap(&mut mesh, &Nodes::cubic(0.25), &Control::default()).unwrap();
        assert_eq!(mesh, before);
    }

    #[test]
    fn valences_come_closer_to_six_and_threads_do_not_show() {
        let off_six = |mesh: &Mesh| {
            let valence = crate::mesh::Quality::of(mesh).valence;
            let squares = valence.iter().enumerate().map(|(n, &count)| (n as f64 - 6.0).powi(2) * count as f64);
            squares.sum::<f64>() / mesh.vertices.len() as f64
        };
        let (mesh, params) = tangled(2);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut mesh = mesh.clone();
            pool.install(|| snap(&mut mesh, &Nodes::cubic(params.spacing()), &Control::default())).unwrap();
            mesh
        };
        let turned = run(1);
        let only_merged = {
            let nearest = nearest_nodes(&mesh, &Nodes::cubic(params.spacing())).unwrap();
            let target = groups(&mesh.triangles, &nearest);
            let mut mesh = mesh.clone();
            merge(&mut mesh, &target);
            mesh
        };
        assert!(off_six(&turned) < 0.8 * off_six(&only_merged), "{} {}", off_six(&turned), off_six(&only_merged));
        assert_eq!(run(3), turned);
    }

    #[test]
    fn a_border_stays() {
        let (mut mesh, params) = tangled(5);
        mesh.triangles.truncate(mesh.triangles.len() / 2);
        let before = Report::of(&mesh);
        snap(&mut mesh, &Nodes::cubic(params.spacing()), &Control::default()).unwrap();
        let after = Report::of(&mesh);
        assert_eq!(after.boundary_half_edges, before.boundary_half_edges);
        assert_eq!(after.non_manifold_vertices, before.non_manifold_vertices);
        assert_eq!(after.duplicate_half_edges + after.non_manifold_edges, 0);
    }
}
