//! The mesh that is left when vertices are merged or dropped.
//!
//! Source: this project.

use rayon::prelude::*;

use crate::{Carry, Mesh, VertexAttribute, math::memory::filled};

/// No vertex: what it was is dropped.
pub(super) const NONE: u32 = u32::MAX;

/// Groups or triangles handled by one task, at least.
const CHUNK: usize = 1 << 12;

/// Merges vertices: those with the same `target`, which is the lowest of them, become one in their middle, and what they
/// carry becomes its mean, or is the one's that lies nearest to the middle; those with [`NONE`] vanish, with their triangles. Triangles of which corners merged vanish, too.
/// What is left keeps its order.
pub(super) fn merge(mesh: &mut Mesh, target: &[u32]) {
    merge_groups(mesh, &Groups::of(target));
}

/// The same for groups that are known.
pub(super) fn merge_groups(mesh: &mut Mesh, groups: &Groups) {
    let mean = |values: &[f32], components: usize| groups.mean(values, components);
    let mut normals = if mesh.normals.is_empty() { Vec::new() } else { groups.mean_of_triples(&mesh.normals) };
    normals.par_iter_mut().for_each(|n| {
        let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
        if length > 0.0 {
            *n = n.map(|x| x / length);
        }
    });
    let vertices = groups.mean_of_triples(&mesh.vertices);
    let is_nearest = |attribute: &VertexAttribute| attribute.carry == Carry::Nearest;
    let nearest = if mesh.attributes.iter().any(is_nearest) { groups.nearest(mesh, &vertices) } else { Vec::new() };
    let carried = |attribute: &VertexAttribute| {
        let VertexAttribute { name, components, values, carry } = attribute;
        let values = match carry {
            Carry::Mean | Carry::NormalSpeed => mean(values, *components),
            Carry::Nearest => {
                nearest.iter().flat_map(|&v| &values[v as usize * components..][..*components]).copied().collect()
            }
        };
        VertexAttribute { name: name.clone(), components: *components, values, carry: *carry }
    };
    mesh.attributes = mesh.attributes.iter().map(carried).collect();
    (mesh.vertices, mesh.normals) = (vertices, normals);
    groups.leave(&mut mesh.triangles);
}

/// Vertices that belong together, group after group, each in ascending order.
pub(super) struct Groups {
    /// Vertex ──► its group.
    number: Vec<u32>,
    start: Vec<u32>,
    members: Vec<u32>,
}

impl Groups {
    /// `target` names the lowest member of each vertex's group, or is [`NONE`].
    pub(super) fn of(target: &[u32]) -> Self {
        let mut number = filled(NONE, target.len());
        // Counts go two places ahead, so that the scatter turns `start[g + 1]` from g's beginning into its end.
        let mut start = vec![0; 2];
        for (v, &t) in target.iter().enumerate() {
            if t == v as u32 {
                number[v] = start.len() as u32 - 2;
                start.push(1);
            } else if t != NONE {
                number[v] = number[t as usize];
                start[number[v] as usize + 2] += 1;
            }
        }
        for g in 2..start.len() {
            start[g] += start[g - 1];
        }
        let mut members = filled(0, start[start.len() - 1] as usize);
        for (&group, v) in number.iter().zip(0..).filter(|(group, _)| **group != NONE) {
            let place = &mut start[group as usize + 1];
            members[*place as usize] = v;
            *place += 1;
        }
        start.pop();
        Self { number, start, members }
    }

    /// Number of groups.
    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// The members of one group.
    #[inline(always)]
    pub(super) fn members(&self, group: usize) -> &[u32] {
        &self.members[self.start[group] as usize..self.start[group + 1] as usize]
    }

    /// The members of the group of a vertex, which must not be dropped.
    #[inline(always)]
    pub(super) fn members_with(&self, vertex: u32) -> &[u32] {
        self.members(self.number[vertex as usize] as usize)
    }

    /// The lowest members of all groups, in order.
    pub(super) fn lowest(&self) -> impl Iterator<Item = u32> {
        self.start[..self.len()].iter().map(|&first| self.members[first as usize])
    }

    fn mean_of_triples(&self, values: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let of_group = |g| {
            let members = self.members(g);
            let mut sum = values[members[0] as usize].map(f64::from);
            if members.len() == 1 {
                return values[members[0] as usize];
            }
            for &v in &members[1..] {
                for a in 0..3 {
                    sum[a] += f64::from(values[v as usize][a]);
                }
            }
            sum.map(|x| (x / members.len() as f64) as f32)
        };
        (0..self.len()).into_par_iter().with_min_len(CHUNK).map(of_group).collect()
    }

    fn mean(&self, values: &[f32], components: usize) -> Vec<f32> {
        let mut to = vec![0.0; self.len() * components];
        to.par_chunks_mut(components.max(1)).with_min_len(CHUNK).enumerate().for_each(|(g, to)| {
            let members = self.members(g);
            if let [one] = members {
                to.copy_from_slice(&values[*one as usize * components..][..components]);
                return;
            }
            for (c, to) in to.iter_mut().enumerate() {
                let sum: f64 = members.iter().map(|&v| f64::from(values[v as usize * components + c])).sum();
                *to = (sum / members.len() as f64) as f32;
            }
        });
        to
    }

    /// The member of each group that is nearest to where the group went; of equally near ones the first.
    fn nearest(&self, mesh: &Mesh, places: &[[f32; 3]]) -> Vec<u32> {
        let of_group = |(g, place): (usize, &[f32; 3])| {
            let (mut best, mut least) = (self.members(g)[0], f64::INFINITY);
            for &v in self.members(g) {
                let at = mesh.vertices[v as usize];
                let dist_sq: f64 = (0..3).map(|a| (f64::from(at[a]) - f64::from(place[a])).powi(2)).sum();
                if dist_sq < least {
                    (best, least) = (v, dist_sq);
                }
            }
            best
        };
        places.par_iter().enumerate().map(of_group).collect()
    }

    /// Leaves the triangles with three groups, in their order, and names these.
    fn leave(&self, triangles: &mut Vec<[u32; 3]>) {
        let within = |chunk: &mut [[u32; 3]]| {
            let mut count = 0;
            for i in 0..chunk.len() {
                let [a, b, c] = chunk[i].map(|v| self.number[v as usize]);
                chunk[count] = [a, b, c];
                // No branch: nobody could foresee it.
                let is_left = (a != b) & (b != c) & (c != a) & (a != NONE) & (b != NONE) & (c != NONE);
                count += usize::from(is_left);
            }
            count
        };
        let counts: Vec<usize> = triangles.par_chunks_mut(CHUNK).map(within).collect();
        let mut left = 0;
        for (chunk, count) in counts.into_iter().enumerate() {
            triangles.copy_within(chunk * CHUNK..chunk * CHUNK + count, left);
            left += count;
        }
        triangles.truncate(left);
    }
}
