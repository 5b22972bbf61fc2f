//! Merges that would change what the surface is, undone.
//!
//! Where the triangles around a merged vertex would not close up to one fan (a thin neck that would be pinched, a droplet that
//! would vanish), the merges that take part are undone, and what that touches is looked at again until all is well. Few vertices
//! of a mesh are concerned: a piece around them is cut out, with its own numbers, and only there stars are made.
//!
//! Source: this project.

use rayon::prelude::*;

use super::rebuild::Groups;
use crate::{
    Control, Error,
    math::memory::filled,
    mesh::stars::{Stars, followers},
};

/// Triangles looked at by one task.
const CHUNK: usize = 1 << 13;

/// Looks at the groups named by `suspects`, their lowest vertices, and undoes merges until none is broken. `target` is the
/// lowest vertex of each one's group. Returns the vertices around all that was undone.
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn undo_broken(
    triangles: &[[u32; 3]],
    target: &mut [u32],
    mut suspects: Vec<u32>,
    control: &Control<'_>,
) -> Result<Vec<u32>, Error> {
    let mut around = Vec::new();
    // From round to round only what an undone merge touches can break.
    while !suspects.is_empty() {
        control.check()?;
        let mut piece = Piece::around(triangles, target, &suspects);
        suspects = piece.undo(&suspects);
        if piece.is_changed {
            around.extend_from_slice(&piece.vertices);
            piece
                .vertices
                .iter()
                .zip(&piece.target)
                .for_each(|(&v, &t)| target[v as usize] = piece.vertices[t as usize]);
        }
    }
    Ok(around)
}

/// Groups around some, with numbers of their own in the same order.
struct Piece {
    /// The vertex of the mesh that each is.
    vertices: Vec<u32>,
    target: Vec<u32>,
    groups: Groups,
    /// Complete for groups up to two edges away.
    stars: Stars,
    is_changed: bool,
}

impl Piece {
    /// All groups up to three edges away from those named.
    fn around(triangles: &[[u32; 3]], target: &[u32], named: &[u32]) -> Self {
        let mut is_near = vec![false; target.len()];
        named.iter().for_each(|&v| is_near[v as usize] = true);
        let mut touched: Vec<[u32; 3]> = Vec::new();
        let spread = |is_near: &mut [bool]| (0..target.len()).for_each(|v| is_near[v] = is_near[target[v] as usize]);
        for _ in 0..3 {
            spread(&mut is_near);
            let touches = |t: &&[u32; 3]| t.iter().any(|&v| is_near[v as usize]);
            touched = triangles.par_iter().with_min_len(CHUNK).filter(touches).copied().collect();
            touched.as_flattened().iter().for_each(|&v| is_near[target[v as usize] as usize] = true);
        }
        spread(&mut is_near);
        let vertices: Vec<u32> = (0..target.len() as u32).filter(|&v| is_near[v as usize]).collect();
        let mut number = filled(0u32, target.len());
        vertices.iter().zip(0..).for_each(|(&v, i)| number[v as usize] = i);
        let touched: Vec<[u32; 3]> = touched.iter().map(|t| t.map(|v| number[v as usize])).collect();
        let target: Vec<u32> = vertices.iter().map(|&v| number[target[v as usize] as usize]).collect();
        let stars = Stars::of(&touched, vertices.len());
        Self { groups: Groups::of(&target), vertices, target, stars, is_changed: false }
    }

    /// Undoes the merges to blame for those of the named groups that are broken, and returns the groups that are broken then.
    fn undo(&mut self, named: &[u32]) -> Vec<u32> {
        let mut fan = Vec::new();
        let numbers = named.iter().filter_map(|v| self.vertices.binary_search(v).ok());
        // Its own merge, and where there is none those of its neighbors.
        let mut undone: Vec<u32> = Vec::new();
        for lowest in numbers.map(|i| i as u32).filter(|&lowest| self.is_broken(lowest, &mut fan)) {
            if self.is_merged(lowest) {
                undone.push(lowest);
            } else {
                let near = self.stars.corners(lowest as usize).iter().map(|corner| self.target[corner[0] as usize]);
                undone.extend(near.filter(|&near| self.is_merged(near)));
            }
        }
        undone.sort_unstable();
        undone.dedup();
        self.is_changed = !undone.is_empty();
        let mut touched = Vec::new();
        for &v in undone.iter().flat_map(|&lowest| self.groups.members_with(lowest)) {
            self.target[v as usize] = v;
            touched.push(v);
            touched.extend(self.stars.corners(v as usize).iter().map(|corner| corner[0]));
        }
        touched.iter_mut().for_each(|v| *v = self.target[*v as usize]);
        touched.sort_unstable();
        touched.dedup();
        touched.retain(|&lowest| self.is_broken(lowest, &mut fan));
        touched.iter().map(|&v| self.vertices[v as usize]).collect()
    }

    /// The members of the group that a vertex leads: all that it had at first, or itself alone once they were undone.
    fn members(&self, lowest: u32) -> &[u32] {
        match self.groups.members_with(lowest) {
            first @ [head, second, ..] if *head == lowest && self.target[*second as usize] == lowest => first,
            _ => std::slice::from_ref(&self.target[lowest as usize]),
        }
    }

    fn is_merged(&self, lowest: u32) -> bool {
        self.members(lowest).len() > 1
    }

    /// Whether the fan of a merged vertex does not close, or more than a disc vanishes in it. A vertex of a border never has a
    /// closed fan: it is broken as long as it or a neighbor merges. A hole that would vanish counts as more than a disc.
    fn is_broken(&self, lowest: u32, fan: &mut Vec<[u32; 2]>) -> bool {
        if self.collect_fan(lowest, fan) && is_one_fan(fan) {
            return false;
        }
        let near = self.stars.corners(lowest as usize).as_flattened();
        self.is_merged(lowest) || near.iter().any(|&v| self.is_merged(self.target[v as usize]))
    }

    /// Collects the (next, previous) pairs around a merged vertex, of the triangles that are left, and tells whether what
    /// vanishes within is a disc or a tree: vertices − edges + triangles = 1. Otherwise a handle would vanish, too.
    fn collect_fan(&self, here: u32, fan: &mut Vec<[u32; 2]>) -> bool {
        let (mut half_edges, mut corners) = (0, 0);
        let members = self.members(here);
        fan.clear();
        for &v in members {
            for corner in self.stars.corners(v as usize) {
                let [next, previous] = corner.map(|n| self.target[n as usize]);
                half_edges += usize::from(next == here);
                corners += usize::from(next == here && previous == here);
                if next != previous && next != here && previous != here {
                    fan.push([next, previous]);
                }
            }
        }
        members.len() + corners / 3 == 1 + half_edges / 2
    }
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
    use super::super::{
        links::Links,
        snap::{Nodes, groups, nearest_nodes, tests::tangled},
    };
    use super::*;

    #[test]
    fn what_links_are_sure_of_is_not_broken_and_little_else_is_in_doubt() {
        let (mut doubtful, mut broken, mut of_border) = (0, 0, 0);
        for seed in 0..20 {
            let (mut mesh, params) = tangled(seed);
            // Every other mesh has holes.
            if seed % 2 == 1 {
                mesh.triangles.retain(|t| t[0] % 97 != 0);
            }
            let nodes = nearest_nodes(&mesh, &Nodes::cubic(params.spacing())).unwrap();
            let target = groups(&mesh.triangles, &nodes);
            let links = Links::of(&mesh.triangles, &nodes, &target);
            let all: Vec<u32> = (0..target.len() as u32).filter(|&v| target[v as usize] == v).collect();
            let piece = Piece::around(&mesh.triangles, &target, &all);
            let mut fan = Vec::new();
            for &lowest in &all {
                let number = piece.vertices.binary_search(&lowest).unwrap() as u32;
                let is_whole = piece.collect_fan(number, &mut fan) && is_one_fan(&fan);
                assert!(is_whole || !links.is_sure(lowest), "{seed} {lowest}");
                if links.is_sure(lowest) {
                    assert_eq!(links.valence(lowest) as usize, fan.len());
                } else if seed % 2 == 0 {
                    doubtful += 1;
                    broken += usize::from(!is_whole);
                } else {
                    of_border += usize::from(!is_whole);
                }
            }
        }
        assert!(broken > 20 && of_border > 20 && doubtful < 3 * broken, "{doubtful} {broken} {of_border}");
    }
}
