//! A mesh between labels, and the closed surface of each.

use std::ops::Range;

use rustc_hash::FxHashMap;

use super::{Mesh, stars::Stars};

/// The boundaries between the labels of a volume: one mesh, whose vertices neighbours share.
///
/// Triangle t lies between the labels `sides[t]`: the first is behind it, the second before it, where its normal points. The
/// first is the greater; outside, which is no label, is the least. Where three labels or more meet, so do as many sheets.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LabelMesh {
    /// All triangles.
    pub mesh: Mesh,
    /// The labels, ascending.
    pub labels: Vec<i128>,
    /// For each triangle the places in `labels` of the labels behind and before it, or [`OUTSIDE`](Self::OUTSIDE).
    pub sides: Vec<[u32; 2]>,
}

impl LabelMesh {
    /// The side that has no label.
    pub const OUTSIDE: u32 = u32::MAX;

    /// The surface of each label in turn, with the label: those of [`surface`](Self::surface), found in one go.
    pub fn surfaces(&self) -> impl Iterator<Item = (i128, Mesh)> + '_ {
        // Triangles by label, by a counting sort.
        let n = self.labels.len();
        let mut start = vec![0usize; n + 2];
        let labels = |sides: &[u32; 2]| sides.map(|side| side as usize).into_iter().filter(move |&side| side < n);
        self.sides.iter().flat_map(labels).for_each(|label| start[label + 2] += 1);
        (2..n + 2).for_each(|i| start[i] += start[i - 1]);
        let mut of_label = vec![0u32; start[n + 1]];
        for (t, sides) in self.sides.iter().enumerate() {
            for label in labels(sides) {
                of_label[start[label + 1]] = t as u32;
                start[label + 1] += 1;
            }
        }
        let mut numbers = vec![u32::MAX; self.mesh.vertices.len()];
        self.labels.iter().enumerate().map(move |(label, &name)| {
            let range: Range<usize> = start[label]..start[label + 1];
            (name, self.of_triangles(label as u32, of_label[range].iter().map(|&t| t as usize), &mut numbers))
        })
    }

    /// The surface of one label: closed unless the volume's border is open, and oriented outward. Where its sheets touch in a
    /// vertex each has one of its own, so that it is a manifold. Empty where there is no such label.
    pub fn surface(&self, label: i128) -> Mesh {
        let Ok(index) = self.labels.binary_search(&label) else {
            return Mesh { origin: self.mesh.origin, ..Mesh::default() };
        };
        let triangles = (0..self.sides.len()).filter(|&t| self.sides[t].contains(&(index as u32)));
        self.of_triangles(index as u32, triangles, &mut vec![u32::MAX; self.mesh.vertices.len()])
    }

    /// A mesh of triangles that have a label on one side. `numbers` has `MAX` for each vertex, before and after.
    fn of_triangles(&self, label: u32, triangles: impl Iterator<Item = usize>, numbers: &mut [u32]) -> Mesh {
        let mut mesh = Mesh { origin: self.mesh.origin, ..Mesh::default() };
        let mut used = Vec::new();
        for t in triangles {
            let [a, b, c] = self.mesh.triangles[t];
            // A label that is before a triangle sees it from behind.
            let corners = if self.sides[t][0] == label { [a, b, c] } else { [a, c, b] };
            mesh.triangles.push(corners.map(|v| {
                let number = &mut numbers[v as usize];
                if *number == u32::MAX {
                    *number = used.len() as u32;
                    used.push(v);
                }
                *number
            }));
        }
        mesh.vertices = used.iter().map(|&v| self.mesh.vertices[v as usize]).collect();
        used.iter().for_each(|&v| numbers[v as usize] = u32::MAX);
        part_sheets(&mut mesh);
        mesh
    }
}

/// Gives each sheet that touches others in a vertex alone a vertex of its own.
fn part_sheets(mesh: &mut Mesh) {
    let stars = Stars::of(&mesh.triangles, mesh.vertices.len());
    // Half edges (from, to) of the sheets that get a new vertex in place of `from`.
    let mut parted: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for v in 0..stars.len() {
        let corners = stars.corners(v);
        let mut seen = vec![false; corners.len()];
        let mut is_first = true;
        while let Some(start) = seen.iter().position(|seen| !seen) {
            let number = if is_first { v as u32 } else { mesh.vertices.len() as u32 };
            if !is_first {
                mesh.vertices.push(mesh.vertices[v]);
            }
            // Round the vertex both ways, for a sheet that ends at a border.
            let mut at = [Some(start), Some(start)];
            while let Some(corner) = at[0].or(at[1]) {
                let forward = at[0].is_some();
                seen[corner] = true;
                if !is_first {
                    parted.insert((v as u32, corners[corner][0]), number);
                }
                let [next, previous] = corners[corner];
                let follows = |other: &[u32; 2]| if forward { other[0] == previous } else { other[1] == next };
                let found = (0..corners.len()).find(|&n| !seen[n] && follows(&corners[n]));
                if forward {
                    at[0] = found;
                } else {
                    at[1] = found;
                }
            }
            is_first = false;
        }
    }
    if parted.is_empty() {
        return;
    }
    for triangle in &mut mesh.triangles {
        let [a, b, c] = *triangle;
        *triangle = [(a, b), (b, c), (c, a)].map(|half| *parted.get(&half).unwrap_or(&half.0));
    }
}
