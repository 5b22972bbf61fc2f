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
//! Source: Moore & Warren, Mesh Displacement: An Improved Contouring Method for Trivariate Data, 1991; undoing what would
//! break the surface is this project's.

use rayon::prelude::*;

use super::{
    check,
    rebuild::{Groups, merge},
};
use crate::{Control, Error, Mesh, mesh::stars::Stars};

/// Vertices looked at by one task.
const CHUNK: usize = 1 << 12;

/// Merges neighboring vertices with the same nearest lattice node; `spacing` is the lattice's, in world units.
///
/// # Errors
/// [`Error::Parameter`] for a spacing that is not positive, [`Error::Count`] for an index that names no vertex,
/// [`Error::Length`] for an attribute of the wrong length, [`Error::Cancelled`]; the mesh is then as it was.
pub fn snap(mesh: &mut Mesh, spacing: f64, control: &Control<'_>) -> Result<(), Error> {
    if !(spacing.is_finite() && spacing > 0.0) {
        return Err(Error::Parameter { name: "spacing", value: spacing, must: "greater than 0" });
    }
    check(mesh)?;
    let stars = Stars::of(&mesh.triangles, mesh.vertices.len());
    control.check()?;
    let nodes = nearest_nodes(mesh, spacing);
    let mut target = groups(&stars, &nodes);
    while undo_broken(&stars, &mut target) {
        control.check()?;
    }
    *mesh = merge(mesh, &target);
    Ok(())
}

/// The lattice node nearest to each vertex, relative to the one nearest to the mesh's origin.
fn nearest_nodes(mesh: &Mesh, spacing: f64) -> Vec<[i32; 3]> {
    let shift = mesh.origin.map(|o| o / spacing - (o / spacing).round());
    let nearest = |v: &[f32; 3]| std::array::from_fn(|a| (f64::from(v[a]) / spacing + shift[a]).round() as i32);
    mesh.vertices.par_iter().map(nearest).collect()
}

/// The lowest vertex that each can reach through neighbors of the same node. Vertices of a border stay alone.
fn groups(stars: &Stars, nodes: &[[i32; 3]]) -> Vec<u32> {
    let closed: Vec<bool> = (0..stars.len()).into_par_iter().map(|v| stars.is_closed(v)).collect();
    // What is next to a border stays, too, so that the border's triangles do.
    let is_within = |v: usize| closed[v] && stars.corners(v).iter().all(|corner| closed[corner[0] as usize]);
    let may_merge: Vec<bool> = (0..stars.len()).into_par_iter().map(is_within).collect();
    let mut lowest: Vec<u32> = (0..stars.len() as u32).collect();
    // A group is a few vertices around a node, so the lowest number is everywhere after a few rounds.
    loop {
        let step = |v: usize| {
            if !may_merge[v] {
                return v as u32;
            }
            let near = stars.corners(v).iter().map(|corner| corner[0] as usize);
            let same = near.filter(|&n| may_merge[n] && nodes[n] == nodes[v]).map(|n| lowest[n]);
            same.fold(lowest[v], u32::min)
        };
        let next: Vec<u32> = (0..stars.len()).into_par_iter().map(step).collect();
        if next == lowest {
            return lowest;
        }
        lowest = next;
    }
}

/// Undoes the merges around every vertex whose fan would not close; whether there was one.
fn undo_broken(stars: &Stars, target: &mut [u32]) -> bool {
    let groups = Groups::of(target);
    let broken: Vec<u32> = (0..groups.len().div_ceil(CHUNK))
        .into_par_iter()
        .map_init(Vec::new, |fan, chunk| {
            let mut broken = Vec::new();
            for g in chunk * CHUNK..groups.len().min((chunk + 1) * CHUNK) {
                let group = groups.members(g);
                if is_touched(stars, target, &groups, group) {
                    let is_disc = collect_fan(stars, target, group, fan);
                    if !is_disc || !is_one_fan(fan) {
                        broken.push(g as u32);
                    }
                }
            }
            broken
        })
        .flatten_iter()
        .collect();
    // The merges to blame: its own, and where it has none those of its neighbors.
    let mut undone: Vec<u32> = Vec::new();
    for &g in &broken {
        let group = groups.members(g as usize);
        if group.len() > 1 {
            undone.push(group[0]);
        } else {
            undone.extend(stars.corners(group[0] as usize).iter().map(|corner| target[corner[0] as usize]));
        }
    }
    undone.sort_unstable();
    undone.dedup();
    let mut changed = false;
    for &lowest in &undone {
        for &v in groups.members_with(lowest) {
            changed |= target[v as usize] != v;
            target[v as usize] = v;
        }
    }
    changed
}

/// Whether a group, or anything next to it, merges.
fn is_touched(stars: &Stars, target: &[u32], groups: &Groups, group: &[u32]) -> bool {
    let merges = |&n: &u32| groups.members_with(target[n as usize]).len() > 1;
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
    let Some(&[first, _]) = fan.first() else { return false };
    let (mut at, mut steps) = (first, 0);
    loop {
        let mut leaving = fan.iter().filter(|pair| pair[0] == at);
        let (Some(pair), None) = (leaving.next(), leaving.next()) else { return false };
        at = pair[1];
        steps += 1;
        if at == first || steps > fan.len() {
            return at == first && steps == fan.len() && steps >= 3;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, VertexAttribute, mesh::Report, reconstruct};

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
            snap(&mut mesh, params.spacing(), &Control::default()).unwrap();
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
        snap(&mut mesh, params.spacing(), &Control::default()).unwrap();
        assert_eq!(mesh, before);
    }

    #[test]
    fn vertices_stay_near_and_carry_the_mean() {
        let (mut mesh, params) = tangled(3);
        let values = mesh.vertices.iter().flat_map(|v| [v[0], 2.0 * v[1]]).collect();
        mesh.attributes = vec![VertexAttribute { name: "a".into(), components: 2, values }];
        mesh.normals = vec![[0.0, 0.0, 1.0]; mesh.vertices.len()];
        let before = mesh.clone();
        snap(&mut mesh, params.spacing(), &Control::default()).unwrap();
        for (v, value) in mesh.vertices.iter().zip(mesh.attributes[0].values.chunks(2)) {
            assert!((v[0] - value[0]).abs() < 1e-6 && (2.0 * v[1] - value[1]).abs() < 1e-6);
            let near = before.vertices.iter().map(|o| (0..3).map(|a| (o[a] - v[a]).powi(2)).sum::<f32>());
            assert!(near.fold(f32::MAX, f32::min).sqrt() < 0.9 * params.spacing() as f32);
        }
        assert!(mesh.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    }

    #[test]
    fn a_border_stays() {
        let (mut mesh, params) = tangled(5);
        mesh.triangles.truncate(mesh.triangles.len() / 2);
        let before = Report::of(&mesh);
        snap(&mut mesh, params.spacing(), &Control::default()).unwrap();
        let after = Report::of(&mesh);
        assert_eq!(after.boundary_half_edges, before.boundary_half_edges);
        assert_eq!(after.non_manifold_vertices, before.non_manifold_vertices);
        assert_eq!(after.duplicate_half_edges + after.non_manifold_edges, 0);
    }
}
