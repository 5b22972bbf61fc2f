//! The marching cubes table, generated from its rule when the crate is compiled.
//!
//! Corners are numbered x + 2y + 4z. Edges are numbered 4·axis + u + 2v, where u, v are the corner's other two coordinates
//! in ascending order of axis; an edge's lower node has coordinate 0 along its axis. A case has one bit a corner, set where
//! the corner is inside.
//!
//! The rule: on each face walk the corners counter-clockwise as seen from outside the cube; each run of inside corners
//! gives one segment, from the edge where the walk enters the run to the edge where it leaves. The segments of all faces
//! link up to loops; each loop is triangulated as a fan whose start is chosen so that no diagonal joins two vertices of
//! one face. A face's segments depend on its four corners alone, so neighbouring cubes agree, and with the choice of
//! diagonals no edge of a triangle inside a face is made twice: surfaces are closed 2-manifolds. Inside corners that meet
//! only across a face's diagonal are kept apart. The topology is consistent, but not always that of the trilinear
//! interpolant.
//!
//! Source: the cases are Lorensen & Cline 1987, Marching Cubes; the rule by runs of corners is this project's.

pub(crate) mod transition;

/// How one case is triangulated.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Bit e set where edge e is crossed.
    pub edges: u16,
    /// Number of triangles.
    pub len: u8,
    /// Edges whose vertices make the triangles, counter-clockwise seen from outside the surface.
    pub triangles: [[u8; 3]; MOST],
}

/// Most triangles of a case.
pub const MOST: usize = 5;

/// All 256 cases.
pub static CASES: [Case; 256] = {
    let mut cases = [Case { edges: 0, len: 0, triangles: [[0; 3]; MOST] }; 256];
    let mut case = 0;
    while case < 256 {
        cases[case] = triangulate(case as u8);
        case += 1;
    }
    cases
};

/// Triangles of each case, apart from the rest: what counting reads.
pub(crate) static COUNTS: [u8; 256] = {
    let mut counts = [0; 256];
    let mut case = 0;
    while case < 256 {
        counts[case] = CASES[case].len;
        case += 1;
    }
    counts
};

/// No edge.
const NONE: u8 = 255;

/// Corners of face 2·axis + side, counter-clockwise seen from outside the cube.
pub(crate) const fn face_corners(face: usize) -> [usize; 4] {
    let (axis, side) = (face / 2, face % 2);
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = side << axis;
    // u × v points along the axis: counter-clockwise for side 1, turned round for side 0.
    if side == 1 { [base, base + u, base + u + v, base + v] } else { [base, base + v, base + u + v, base + u] }
}

/// The edge between two neighbouring corners.
pub(crate) const fn edge_between(a: usize, b: usize) -> usize {
    let low = a & b;
    match a ^ b {
        1 => low >> 1,
        2 => 4 + ((low & 1) | (low >> 1 & 2)),
        _ => 8 + low,
    }
}

/// The lower corner of an edge.
pub const fn edge_corner(edge: usize) -> usize {
    let uv = edge % 4;
    match edge / 4 {
        0 => uv << 1,
        1 => (uv & 1) | (uv & 2) << 1,
        _ => uv,
    }
}

/// The faces that hold an edge, bit by bit.
pub(crate) const fn faces_of(edge: usize) -> u8 {
    let mut faces = 0;
    let mut face = 0;
    while face < 6 {
        let corners = face_corners(face);
        let mut i = 0;
        while i < 4 {
            if edge_between(corners[i], corners[(i + 1) % 4]) == edge {
                faces |= 1 << face;
            }
            i += 1;
        }
        face += 1;
    }
    faces
}

/// For each edge where a segment starts, the edge where it ends.
pub(crate) const fn segments(case: u8) -> [u8; 12] {
    let mut next = [NONE; 12];
    let mut face = 0;
    while face < 6 {
        let corners = face_corners(face);
        let mut i = 0;
        while i < 4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            if case >> a & 1 == 0 && case >> b & 1 == 1 {
                // The walk enters a run between a and b; follow it to where it leaves.
                let mut j = i + 1;
                while case >> corners[(j + 1) % 4] & 1 == 1 {
                    j += 1;
                }
                next[edge_between(a, b)] = edge_between(corners[j % 4], corners[(j + 1) % 4]) as u8;
            }
            i += 1;
        }
        face += 1;
    }
    next
}

const fn triangulate(case: u8) -> Case {
    let next = segments(case);
    let mut out = Case { edges: 0, len: 0, triangles: [[0; 3]; MOST] };
    let mut first = 0;
    while first < 12 {
        if next[first] != NONE && out.edges >> first & 1 == 0 {
            let (mut ring, mut len) = ([0u8; 12], 0);
            let mut edge = first as u8;
            while out.edges >> edge & 1 == 0 {
                out.edges |= 1 << edge;
                ring[len] = edge;
                len += 1;
                edge = next[edge as usize];
            }
            let start = fan_start(&ring, len);
            let mut i = 1;
            while i + 1 < len {
                out.triangles[out.len as usize] = [ring[start], ring[(start + i) % len], ring[(start + i + 1) % len]];
                out.len += 1;
                i += 1;
            }
        }
        first += 1;
    }
    out
}

/// The first place of a ring from which a fan has no diagonal within a face.
const fn fan_start(ring: &[u8; 12], len: usize) -> usize {
    let mut start = 0;
    while start < len {
        let (mut free, mut i) = (true, 2);
        while i + 1 < len {
            let end = ring[(start + i) % len] as usize;
            free &= faces_of(ring[start] as usize) & faces_of(end) == 0;
            i += 1;
        }
        if free {
            return start;
        }
        start += 1;
    }
    panic!("every ring of a cube has such a place");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_and_corners_agree() {
        for edge in 0..12 {
            let low = edge_corner(edge);
            assert_eq!(edge_between(low, low | 1 << (edge / 4)), edge);
            assert_eq!(faces_of(edge).count_ones(), 2);
        }
    }

    #[test]
    fn a_single_inside_corner_faces_outward() {
        let at = |edge: u8| {
            let corner = edge_corner(edge.into());
            let mut p = [0, 1, 2].map(|a| (corner >> a & 1) as f32);
            p[usize::from(edge) / 4] = 0.5;
            p
        };
        let case = CASES[1];
        assert_eq!(case.len, 1);
        let [a, b, c] = case.triangles[0].map(at);
        let (u, v): (Vec<f32>, Vec<f32>) = (0..3).map(|i| (b[i] - a[i], c[i] - a[i])).unzip();
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        assert!(normal.iter().all(|&n| n > 0.0), "{normal:?}");
    }

    #[test]
    fn every_case_uses_exactly_its_crossed_edges() {
        for (case, entry) in CASES.iter().enumerate() {
            let mut used = 0u16;
            for t in &entry.triangles[..entry.len.into()] {
                assert!(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
                used |= t.iter().fold(0, |set, &e| set | 1 << e);
            }
            let crossed = (0..12).filter(|&e| {
                let low = edge_corner(e);
                case >> low & 1 != case >> (low | 1 << (e / 4)) & 1
            });
            assert_eq!(used, crossed.fold(0, |set, e| set | 1 << e), "case {case}");
            assert_eq!(used, entry.edges);
        }
    }

    #[test]
    fn inside_a_cube_every_edge_of_a_triangle_is_made_once_each_way() {
        for (case, entry) in CASES.iter().enumerate() {
            let mut halves = std::collections::BTreeSet::new();
            for t in &entry.triangles[..entry.len.into()] {
                for i in 0..3 {
                    assert!(halves.insert((t[i], t[(i + 1) % 3])), "case {case}: doubled");
                }
            }
            for &(a, b) in &halves {
                let in_face = faces_of(a.into()) & faces_of(b.into()) != 0;
                assert_eq!(halves.contains(&(b, a)), !in_face, "case {case}: edge {a} {b}");
            }
        }
    }
}
