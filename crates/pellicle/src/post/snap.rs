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
    flip::Merged,
    rebuild::{Groups, merge_and_turn},
};
use crate::{
    Control, Error, Mesh,
    math::{
        union_find::join,
        vector::{cross, dot, length, subtract},
    },
    mesh::stars::{Stars, followers},
};

/// Vertices looked at by one task.
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
    with_stars(mesh, &Stars::of(&mesh.triangles, mesh.vertices.len()), nodes, false, control)
}

/// The same for a mesh whose stars are known. With `zigzag` the diagonals of level parts alternate.
pub(super) fn with_stars(
    mesh: &mut Mesh,
    stars: &Stars,
    nodes: &Nodes,
    zigzag: bool,
    control: &Control<'_>,
) -> Result<(), Error> {
    let nearest = nearest_nodes(mesh, nodes)?;
    let mut target = groups(stars, &nearest);
    control.check()?;
    let all = Groups::of(&target);
    let mut broken = find_broken(stars, &target, &all);
    // From round to round only what an undone merge touches can break, so the later ones are short.
    while !broken.is_empty() {
        control.check()?;
        broken = undo(stars, &mut target, &all, &broken);
    }
    let groups = Groups::of(&target);
    // The body-centred lattice has no squares of neighbors.
    let rows = (zigzag && !nodes.has_middles).then_some(&nearest[..]);
    let flips = Merged { mesh, stars, target: &target, groups: &groups, rows }.flips();
    *mesh = merge_and_turn(mesh, &target, &groups, &flips);
    Ok(())
}

/// The lattice node nearest to each vertex, relative to the one nearest to the mesh's origin: the low 21 bits of each
/// coordinate, which tell those of neighbors apart, and whether it is the middle of a cell. Nearest in steps of the lattice,
/// along which the crossings lie, not in world units.
fn nearest_nodes(mesh: &Mesh, nodes: &Nodes) -> Result<Vec<u64>, Error> {
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
                return middle << 1 | 1;
            }
        }
        node << 1
    };
    Ok(mesh.vertices.par_iter().with_min_len(CHUNK).map(nearest).collect())
}

/// The whole numbers nearest to a place, packed, and the square of how far they are.
fn rounded(place: [f64; 3]) -> (u64, f64) {
    let (mut key, mut off) = (0, 0.0);
    for x in place {
        let cut = (x + 0.5) as i64;
        let node = cut.wrapping_sub(i64::from(cut as f64 > x + 0.5));
        key = key << 21 | (node as u64 & 0x1f_ffff);
        off += (x - node as f64).powi(2);
    }
    (key, off)
}

/// The lowest vertex that each can reach through neighbors of the same node.
fn groups(stars: &Stars, nodes: &[u64]) -> Vec<u32> {
    let n = stars.len();
    let lower = |v: usize| {
        let mut lowest = v as u32;
        for &[n, _] in stars.corners(v) {
            lowest = lowest.min(if nodes[n as usize] == nodes[v] { n } else { u32::MAX });
        }
        lowest
    };
    // The lowest of the neighbors; its own lowest neighbor may be lower still, and a group may have several such ends.
    let mut lowest: Vec<u32> = (0..n).into_par_iter().with_min_len(CHUNK).map(lower).collect();
    for v in 0..n {
        lowest[v] = lowest[lowest[v] as usize];
    }
    let lowest_of = &lowest;
    let split = |v: usize| {
        let near = stars.corners(v).iter().map(|corner| corner[0] as usize);
        near.filter(move |&n| n < v && nodes[n] == nodes[v] && lowest_of[n] != lowest_of[v])
            .map(move |n| [n as u32, v as u32])
    };
    let merged = (0..n).into_par_iter().with_min_len(CHUNK).filter(|&v| lowest_of[v] != v as u32);
    let splits: Vec<[u32; 2]> = merged.flat_map_iter(split).collect();
    for [a, b] in splits {
        join(&mut lowest, a, b);
    }
    for v in 0..n {
        lowest[v] = lowest[lowest[v] as usize];
    }
    lowest
}

/// The groups, single vertices among them, whose fan would not close.
fn find_broken(stars: &Stars, target: &[u32], all: &Groups) -> Vec<u32> {
    let chunks = (0..all.len().div_ceil(CHUNK)).into_par_iter();
    let broken = chunks.map_init(Vec::new, |fan, chunk| {
        let groups = chunk * CHUNK..all.len().min((chunk + 1) * CHUNK);
        let is_broken = |&g: &usize| is_broken(stars, target, all.members(g), fan);
        groups.filter(is_broken).map(|g| all.members(g)[0]).collect::<Vec<u32>>()
    });
    broken.flatten_iter().collect()
}

/// Undoes the merges to blame for the broken groups, named by their lowest members, and returns those that are broken now.
fn undo(stars: &Stars, target: &mut [u32], all: &Groups, broken: &[u32]) -> Vec<u32> {
    // Its own merge, and where there is none those of its neighbors.
    let mut undone: Vec<u32> = Vec::new();
    for &lowest in broken {
        if members(target, all, lowest).len() > 1 {
            undone.push(lowest);
        } else {
            let near = stars.corners(lowest as usize).iter().map(|corner| target[corner[0] as usize]);
            undone.extend(near.filter(|&near| members(target, all, near).len() > 1));
        }
    }
    undone.sort_unstable();
    undone.dedup();
    let mut touched = Vec::new();
    for &v in undone.iter().filter_map(|&lowest| all.members_with(lowest)).flatten() {
        target[v as usize] = v;
        touched.push(v);
        touched.extend(stars.corners(v as usize).iter().map(|corner| corner[0]));
    }
    touched.iter_mut().for_each(|v| *v = target[*v as usize]);
    touched.sort_unstable();
    touched.dedup();
    let mut fan = Vec::new();
    touched.retain(|&lowest| is_broken(stars, target, members(target, all, lowest), &mut fan));
    touched
}

/// The members of the group that a vertex leads: all that it had at first, or itself alone once they were undone.
fn members<'a>(target: &'a [u32], all: &'a Groups, lowest: u32) -> &'a [u32] {
    match all.members_with(lowest) {
        Some(first @ [_, second, ..]) if target[*second as usize] == lowest => first,
        _ => std::slice::from_ref(&target[lowest as usize]),
    }
}

/// Whether the fan of a merged vertex does not close, or more than a disc vanishes in it. A vertex of a border never has a
/// closed fan: it is broken as long as it or a neighbor merges. A hole that would vanish counts as more than a disc.
fn is_broken(stars: &Stars, target: &[u32], group: &[u32], fan: &mut Vec<[u32; 2]>) -> bool {
    let is_disc = collect_fan(stars, target, group, fan);
    if is_disc && is_one_fan(fan) {
        return false;
    }
    let merges =
        |&v: &u32| target[v as usize] != v || stars.corners(v as usize).iter().any(|c| target[c[0] as usize] == v);
    group.len() > 1 || stars.corners(group[0] as usize).iter().flatten().any(merges)
}

/// Collects the (next, previous) pairs around a merged vertex, of the triangles that are left, and tells whether what
/// vanishes within is a disc or a tree: vertices − edges + triangles = 1. Otherwise a handle would vanish, too.
fn collect_fan(stars: &Stars, target: &[u32], group: &[u32], fan: &mut Vec<[u32; 2]>) -> bool {
    let here = target[group[0] as usize];
    let (mut half_edges, mut corners) = (0, 0);
    fan.clear();
    for &v in group {
        for corner in stars.corners(v as usize) {
            let [next, previous] = corner.map(|n| target[n as usize]);
            half_edges += usize::from(next == here);
            corners += usize::from(next == here && previous == here);
            if next != previous && next != here && previous != here {
                fan.push([next, previous]);
            }
        }
    }
    group.len() + corners / 3 == 1 + half_edges / 2
}

/// Whether the pairs link up to a single ring of at least three.
fn is_one_fan(fan: &[[u32; 2]]) -> bool {
    const MOST: usize = 256;
    let n = fan.len();
    let mut next = [0u8; MOST];
    if !(3..=MOST).contains(&n) || !followers(fan, |i, j| next[i] = j as u8) {
        return false;
    }
    let mut at = next[0];
    let mut steps = 1;
    while at != 0 {
        at = next[usize::from(at)];
        steps += 1;
    }
    steps == n
}

#[cfg(test)]
mod tests {
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
        let mesh = Mesh { attributes: vec![ids(&mesh)], ..mesh };
        assert_eq!(merge(&mesh, &[0, 0, 0, 3]).attributes[0].values, [1.0, 3.0]);
    }

    /// Random particles with necks, droplets and cavities.
    fn tangled(seed: usize) -> (Mesh, Params) {
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
        let stars = Stars::of(&mesh.triangles, mesh.vertices.len());
        let only_merged = {
            let target = groups(&stars, &nearest_nodes(&mesh, &Nodes::cubic(params.spacing())).unwrap());
            merge(&mesh, &target)
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
