//! One cell whose eight corners have labels: the faces between them, by rule.
//!
//! ```text
//! vertices   0..12 the cell's edges, where the ends differ; 12..18 its faces, where three labels or more meet; 18.. inside
//! segments   on each face, each between two labels, directed so that the greater is inside
//! ```
//!
//! A face decides for itself, from its four labels alone, so that neighbours agree. Walking round it, runs of equal corners
//! follow each other. Two runs are parted by one segment. Where a label has two runs, on a diagonal, it is joined across the
//! face and the others are cut off one by one; if both diagonals are of one label each, the lesser is joined: what marching
//! cubes does, for which the inside is greater. Else three runs or four meet in a vertex of the face.
//!
//! The segments of all faces make a graph on the cell's surface. A part of it without vertices of faces is a loop between two
//! labels and gets a disc, as in marching cubes. Any other becomes a cone over a vertex inside. So around every edge of a
//! triangle each label has two triangles or none, and what bounds a label is closed; only in the vertex inside may
//! several of its sheets touch.
//!
//! Source: that cells of several materials have such vertices on faces and inside is Hege, Seebaß, Stalling, Zöckler, A
//! generalized marching cubes algorithm based on non-binary classifications, 1997, and Wu & Sullivan, Multiple material marching
//! cubes algorithm, 2003; the rule by runs of corners, and cones by code in place of their tables, are this project's.

use crate::march::{
    resolve::{Loop, MOST_INNER, MOST_RESOLVED, Resolved, disc},
    tables::{CASES, edge_between, edge_corner, face_corners},
};

/// First number of the vertices of faces: face 2·axis + side is the next but so many.
pub(crate) const FACES: u8 = 12;
/// First number of the vertices inside.
pub(crate) const INSIDE: u8 = 18;
/// Most triangles of a cell: as many as segments, four a face.
pub(crate) const MOST: usize = 24;

/// Triangles of one cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    /// Counter-clockwise seen from the side of the lesser label.
    pub(crate) triangles: [[u8; 3]; MOST],
    /// The greater label, which is behind, and the lesser, before it.
    pub(crate) sides: [[u32; 2]; MOST],
    pub(crate) len: usize,
    /// For each vertex inside those that it is the mean of, bit by bit.
    pub(crate) inner: [u32; MOST_INNER],
    pub(crate) inner_len: usize,
}

/// Whether four labels around a face, in order, meet in a vertex.
#[inline(always)]
pub(crate) fn meets(l: [u32; 4]) -> bool {
    let crossed =
        usize::from(l[0] != l[1]) + usize::from(l[1] != l[2]) + usize::from(l[2] != l[3]) + usize::from(l[3] != l[0]);
    crossed == 3 || (crossed == 4 && l[0] != l[2] && l[1] != l[3])
}

/// A directed piece of the graph, with the label inside and the one outside.
#[derive(Clone, Copy, Default)]
struct Segment {
    from: u8,
    to: u8,
    sides: [u32; 2],
}

/// Segments of all faces.
struct Segments {
    all: [Segment; MOST],
    len: usize,
}

impl Segments {
    /// Adds the one from `enter` to `leave` that has `label` inside and `other` outside, or the same turned round.
    fn push(&mut self, [enter, leave]: [u8; 2], label: u32, other: u32) {
        self.all[self.len] = if label > other {
            Segment { from: enter, to: leave, sides: [label, other] }
        } else {
            Segment { from: leave, to: enter, sides: [other, label] }
        };
        self.len += 1;
    }

    /// Adds those of one face.
    fn push_face(&mut self, face: usize, labels: &[u32; 8]) {
        let corners = face_corners(face);
        let l = corners.map(|corner| labels[corner]);
        // Edge i leads from corner i to the next.
        let edge = |i: usize| edge_between(corners[i & 3], corners[(i + 1) & 3]) as u8;
        let crossed: [bool; 4] = std::array::from_fn(|i| l[i] != l[(i + 1) & 3]);
        if meets(l) {
            let middle = FACES + face as u8;
            for i in (0..4).filter(|&i| crossed[i]) {
                // The run behind leaves here: its boundary comes from the middle.
                self.push([middle, edge(i)], l[i], l[(i + 1) & 3]);
            }
            return;
        }
        if crossed == [true; 4] {
            let is_first = if l[0] == l[2] && l[1] == l[3] { l[0] < l[1] } else { l[0] == l[2] };
            let (joined, apart) = if is_first { (l[0], [1, 3]) } else { (l[1], [2, 4]) };
            for i in apart {
                self.push([edge(i - 1), edge(i)], l[i & 3], joined);
            }
            return;
        }
        let mut at = (0..4).filter(|&i| crossed[i]);
        if let (Some(first), Some(second)) = (at.next(), at.next()) {
            let label = l[(first + 1) & 3];
            self.push([edge(first), edge(second)], label, l[first]);
        }
    }
}

/// The faces between the labels of a cell.
pub(crate) fn polygonize(labels: &[u32; 8]) -> Cell {
    let mut cell = Cell { triangles: [[0; 3]; MOST], sides: [[0; 2]; MOST], len: 0, inner: [0; 4], inner_len: 0 };
    if let Some((case, sides)) = two_labels(labels) {
        let entry = &CASES[usize::from(case)];
        cell.len = entry.len.into();
        cell.triangles[..cell.len].copy_from_slice(&entry.triangles[..cell.len]);
        cell.sides[..cell.len].fill(sides);
        return cell;
    }
    let mut segments = Segments { all: [Segment::default(); MOST], len: 0 };
    for face in 0..6 {
        segments.push_face(face, labels);
    }
    let segments = &segments.all[..segments.len];
    let part = parts(segments);
    for first in 0..INSIDE {
        if part[usize::from(first)] != first {
            continue;
        }
        let mut of_part = segments.iter().filter(|segment| part[usize::from(segment.from)] == first);
        let middles = (FACES..INSIDE).filter(|&v| part[usize::from(v)] == first).fold(0u32, |set, v| set | 1 << v);
        if middles != 0 {
            let apex = cell.push_inner(middles);
            of_part.for_each(|segment| cell.push([segment.from, segment.to, apex], segment.sides));
        } else if let Some(segment) = of_part.next() {
            cell.push_disc(segment, segments);
        }
    }
    cell
}

/// The case of marching cubes of a cell with two labels, and its sides.
fn two_labels(labels: &[u32; 8]) -> Option<(u8, [u32; 2])> {
    let (mut low, mut high) = (labels[0], labels[0]);
    for &label in labels {
        low = low.min(label);
        high = high.max(label);
    }
    let mut case = 0;
    for (corner, &label) in labels.iter().enumerate() {
        if label != low && label != high {
            return None;
        }
        case |= u8::from(label == high) << corner;
    }
    Some((if low == high { 0 } else { case }, [high, low]))
}

/// For each vertex that segments have the lowest of its part of the graph; no vertex for the others.
fn parts(segments: &[Segment]) -> [u8; INSIDE as usize] {
    let mut part = [u8::MAX; INSIDE as usize];
    for segment in segments {
        for v in [segment.from, segment.to] {
            part[usize::from(v)] = v;
        }
    }
    for segment in segments {
        let (a, b) = (part[usize::from(segment.from)], part[usize::from(segment.to)]);
        for v in &mut part {
            if *v == a.max(b) {
                *v = a.min(b);
            }
        }
    }
    part
}

impl Cell {
    fn push(&mut self, triangle: [u8; 3], sides: [u32; 2]) {
        (self.triangles[self.len], self.sides[self.len]) = (triangle, sides);
        self.len += 1;
    }

    fn push_inner(&mut self, of: u32) -> u8 {
        self.inner[self.inner_len] = of;
        self.inner_len += 1;
        INSIDE + self.inner_len as u8 - 1
    }

    /// A disc within the loop that a segment belongs to.
    fn push_disc(&mut self, first: &Segment, segments: &[Segment]) {
        let mut ring = Loop { edges: [0; 12], len: 0 };
        let mut at = first;
        loop {
            ring.edges[ring.len] = at.from;
            ring.len += 1;
            let Some(next) = segments.iter().find(|next| next.from == at.to) else { return };
            if next.from == first.from || ring.len == 12 {
                break;
            }
            at = next;
        }
        let mut out = Resolved { triangles: [[0; 3]; MOST_RESOLVED], len: 0, inner: [0; MOST_INNER], inner_len: 0 };
        disc(&ring, &mut out);
        let first_inner = INSIDE + self.inner_len as u8;
        for &of in &out.inner[..out.inner_len] {
            self.push_inner(of.into());
        }
        for triangle in &out.triangles[..out.len] {
            self.push(triangle.map(|v| if v < FACES { v } else { first_inner + v - FACES }), first.sides);
        }
    }

    /// Place within the unit cell of vertex `n` inside.
    pub(crate) fn inner_place(&self, n: usize) -> [f64; 3] {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for v in (0..INSIDE).filter(|&v| self.inner[n] >> v & 1 == 1) {
            let at = if v < FACES { edge_middle(v.into()) } else { face_middle((v - FACES).into()) };
            (0..3).for_each(|a| sum[a] += at[a]);
            count += 1.0;
        }
        sum.map(|s| s / count)
    }
}

/// Middle of an edge of the unit cell.
fn edge_middle(edge: usize) -> [f64; 3] {
    let low = edge_corner(edge);
    std::array::from_fn(|a| if a == edge / 4 { 0.5 } else { (low >> a & 1) as f64 })
}

/// Middle of a face of the unit cell.
fn face_middle(face: usize) -> [f64; 3] {
    std::array::from_fn(|a| if a == face / 2 { (face % 2) as f64 } else { 0.5 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::march::tables::faces_of;
    use std::collections::BTreeMap;

    /// Labels 1 to `most`, as digits of `n`.
    fn digits(mut n: u64, most: u64) -> [u32; 8] {
        std::array::from_fn(|_| {
            let digit = n % most;
            n /= most;
            1 + digit as u32
        })
    }

    /// Whether an edge of a triangle lies within a face of the cell.
    fn in_face(a: u8, b: u8) -> bool {
        let faces = |v: u8| match v {
            0..FACES => faces_of(v.into()),
            FACES..INSIDE => 1 << (v - FACES),
            _ => 0,
        };
        faces(a) & faces(b) != 0
    }

    /// Every label's triangles: each edge once each way inside of the cell, and once, one way, on its faces.
    fn check(labels: [u32; 8]) {
        let cell = polygonize(&labels);
        for label in 1..=8 {
            let mut halves = BTreeMap::new();
            for (triangle, sides) in cell.triangles[..cell.len].iter().zip(&cell.sides) {
                assert!(sides[0] > sides[1], "{labels:?}");
                let Some(side) = sides.iter().position(|&s| s == label) else { continue };
                let mut triangle = *triangle;
                if side == 1 {
                    triangle.swap(1, 2);
                }
                for i in 0..3 {
                    *halves.entry((triangle[i], triangle[(i + 1) % 3])).or_insert(0) += 1;
                }
            }
            for (&(a, b), &count) in &halves {
                assert_eq!(count, 1, "{labels:?} label {label}: edge {a} {b} is doubled");
                assert_eq!(halves.contains_key(&(b, a)), !in_face(a, b), "{labels:?} label {label}: edge {a} {b}");
            }
        }
        let used = cell.triangles[..cell.len].iter().flatten().fold(0u32, |set, &v| set | 1 << v);
        for edge in 0..12 {
            let low = edge_corner(edge);
            let is_crossed = labels[low] != labels[low | 1 << (edge / 4)];
            assert_eq!(used >> edge & 1 == 1, is_crossed, "{labels:?}");
        }
        for face in 0..6 {
            let is_met = meets(face_corners(face).map(|corner| labels[corner]));
            assert_eq!(used >> (12 + face) & 1 == 1, is_met, "{labels:?}");
        }
        assert_eq!(used >> INSIDE, (1 << cell.inner_len) - 1);
    }

    #[test]
    fn every_label_is_bounded_in_every_cell_of_three_labels_and_in_many_of_eight() {
        (0..3u64.pow(8)).for_each(|n| check(digits(n, 3)));
        (0..8u64.pow(8)).step_by(997).for_each(|n| check(digits(n, 8)));
    }

    #[test]
    fn segments_on_a_face_are_those_of_the_neighbour_turned_round() {
        // The face x = 1 of one cell is x = 0 of the next.
        for n in 0..4u64.pow(4) {
            let face = digits(n, 4);
            let mut sets = [Vec::new(), Vec::new()];
            for (side, set) in [1usize, 0].into_iter().zip(&mut sets) {
                let mut labels = [0; 8];
                for (i, corner) in (0..8usize).filter(|c| c & 1 == side).enumerate() {
                    labels[corner] = face[i];
                }
                let mut segments = Segments { all: [Segment::default(); MOST], len: 0 };
                segments.push_face(side, &labels);
                // Named by place: x edges have none, the others what is left without x.
                let name = |v: u8| if v < FACES { (v & !1) as i32 } else { -1 };
                for s in &segments.all[..segments.len] {
                    let ends = if side == 1 { [name(s.from), name(s.to)] } else { [name(s.to), name(s.from)] };
                    set.push((ends, s.sides));
                }
                set.sort_unstable();
            }
            assert_eq!(sets[0], sets[1], "{face:?}");
        }
    }

    #[test]
    fn where_three_labels_meet_along_a_line_the_cell_is_parted_straight() {
        // 1 below, 2 and 3 side by side above.
        let cell = polygonize(&[1, 1, 1, 1, 2, 3, 2, 3]);
        assert_eq!(cell.inner_len, 1);
        assert_eq!(cell.inner_place(0), [0.5, 0.5, 0.5]);
    }
}
