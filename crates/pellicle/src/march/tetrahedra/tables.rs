//! The sixteen cases of a tetrahedron, generated from their rule when the crate is compiled.
//!
//! Corners 0, 1, 2, 3 are numbered so that (p1 − p0, p2 − p0, p3 − p0) is a right-handed frame. Slots 0–5 are the edges
//! 01, 02, 03, 12, 13, 23, slots 6–9 the corners.
//!
//! The rule: one inside corner is cut off by a triangle on its three edges, and so is one outside corner; two inside
//! corners i, j are parted from k, l by the quadrangle ik, il, jl, jk, cut along ik–jl. (i, j, k, l) is taken as an even
//! permutation of the corners, which turns every triangle outward.
//!
//! The crossing of an edge may belong to the *cluster* of one of its ends: then that corner's slot stands for it, and
//! triangles that thereby name a slot twice vanish.
//!
//! Source: the cases are those of Uralsky 2006 (after Payne & Toga, Surface mapping brain function on 3D models, 1990);
//! clustering is Treece, Prager, Gee, Regularised marching tetrahedra, 1999.

/// How one case is triangulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Case {
    /// Number of triangles.
    pub(crate) len: u8,
    /// Slots of the corners of the triangles, counter-clockwise seen from outside the surface.
    pub(crate) triangles: [[u8; 3]; 2],
}

/// The ends of each edge.
pub(crate) const ENDS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// First slot of a corner.
pub(crate) const CORNER_SLOT: usize = 6;

/// By signs (bit c: corner c is inside).
pub(crate) static CASES: [Case; 16] = {
    let mut cases = [Case { len: 0, triangles: [[0; 3]; 2] }; 16];
    let mut i = 0;
    while i < 16 {
        cases[i] = plain(i);
        i += 1;
    }
    cases
};

impl Case {
    /// With what each edge's slot has become; triangles that name a slot twice are left out.
    #[inline(always)]
    pub(crate) fn merged(&self, slots: &[u8; 6]) -> Self {
        let mut out = Self { len: 0, triangles: [[0; 3]; 2] };
        for triangle in &self.triangles[..self.len.into()] {
            let [a, b, c] = triangle.map(|edge| slots[usize::from(edge)]);
            if a != b && b != c && c != a {
                out.triangles[usize::from(out.len)] = [a, b, c];
                out.len += 1;
            }
        }
        out
    }
}

/// The slot of the edge between two corners.
const fn edge(a: usize, b: usize) -> u8 {
    let mut e = 0;
    while e < 6 {
        if (ENDS[e][0] == a && ENDS[e][1] == b) || (ENDS[e][0] == b && ENDS[e][1] == a) {
            return e as u8;
        }
        e += 1;
    }
    panic!("two corners of a tetrahedron have an edge")
}

/// Corners i, j, k, l with those inside first, or, where three are inside, the one outside; an even permutation.
const fn sorted(signs: usize) -> [usize; 4] {
    let first_sign = if signs.count_ones() == 3 { 0 } else { 1 };
    let (mut order, mut len) = ([0; 4], 0);
    let mut round = 0;
    while round < 2 {
        let mut c = 0;
        while c < 4 {
            if (signs >> c & 1 == first_sign) == (round == 0) {
                order[len] = c;
                len += 1;
            }
            c += 1;
        }
        round += 1;
    }
    let (mut inversions, mut a) = (0, 0);
    while a < 4 {
        let mut b = a + 1;
        while b < 4 {
            inversions += (order[a] > order[b]) as usize;
            b += 1;
        }
        a += 1;
    }
    if inversions % 2 == 1 {
        let [i, j, k, l] = order;
        order = [i, j, l, k];
    }
    order
}

const fn plain(signs: usize) -> Case {
    let [i, j, k, l] = sorted(signs);
    let first = [edge(i, j), edge(i, k), edge(i, l)];
    match signs.count_ones() {
        1 => Case { len: 1, triangles: [first, [0; 3]] },
        3 => Case { len: 1, triangles: [[first[0], first[2], first[1]], [0; 3]] },
        2 => {
            let quad = [edge(i, k), edge(i, l), edge(j, l), edge(j, k)];
            Case { len: 2, triangles: [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]] }
        }
        _ => Case { len: 0, triangles: [[0; 3]; 2] },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn slot(s: u8) -> [f64; 3] {
        let s = usize::from(s);
        if s >= CORNER_SLOT {
            return CORNERS[s - CORNER_SLOT];
        }
        let [a, b] = ENDS[s].map(|c| CORNERS[c]);
        std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
    }

    #[test]
    fn every_triangle_faces_from_the_inside_to_the_outside() {
        for signs in 1..15usize {
            let middle = |sign| {
                let of: Vec<usize> = (0..4).filter(|&c| signs >> c & 1 == sign).collect();
                [0, 1, 2].map(|a| of.iter().map(|&c| CORNERS[c][a]).sum::<f64>() / of.len() as f64)
            };
            let (inside, outside) = (middle(1), middle(0));
            let case = CASES[signs];
            assert_eq!(case.len, if signs.count_ones() == 2 { 2 } else { 1 });
            for t in &case.triangles[..case.len.into()] {
                let [a, b, c] = t.map(slot);
                let normal = crate::math::vector::cross(
                    crate::math::vector::subtract(b, a),
                    crate::math::vector::subtract(c, a),
                );
                let out = crate::math::vector::subtract(outside, inside);
                assert!(crate::math::vector::dot(normal, out) > 0.0, "signs {signs:04b}");
            }
        }
    }

    #[test]
    fn exactly_the_crossed_edges_are_used_and_a_quadrangle_shares_its_diagonal() {
        for signs in 0..16usize {
            let case = CASES[signs];
            let used = case.triangles[..case.len.into()].iter().flatten().fold(0u32, |set, &s| set | 1 << s);
            let crossed = (0..6).filter(|&e| ENDS[e].map(|c| signs >> c & 1).iter().sum::<usize>() == 1);
            assert_eq!(used, crossed.fold(0, |set, e| set | 1 << e));
            if case.len == 2 {
                let [a, b] = case.triangles;
                assert_eq!((a[0], a[2]), (b[0], b[1]));
            }
        }
    }

    #[test]
    fn merging_drops_triangles_that_shrink_and_keeps_the_others() {
        let none = [0, 1, 2, 3, 4, 5];
        for case in &CASES {
            assert_eq!(case.merged(&none), *case);
        }
        // Corner 0 is inside and claims all: its triangle shrinks to a point; or to an edge.
        assert_eq!(CASES[1].merged(&[6, 6, 6, 3, 4, 5]).len, 0);
        assert_eq!(CASES[1].merged(&[6, 6, 2, 3, 4, 5]).len, 0);
        // Its outside corner 1 claims the edge between: a triangle stays, one of its corners at corner 1.
        let case = CASES[1].merged(&[7, 1, 2, 3, 4, 5]);
        assert_eq!((case.len, case.triangles[0]), (1, [7, 1, 2]));
        // Corners 0 and 1 are inside, and each claims its two: the quadrangle is an edge.
        assert_eq!(CASES[3].merged(&[0, 6, 6, 7, 7, 5]).len, 0);
        // One does: a triangle.
        assert_eq!(CASES[3].merged(&[0, 6, 6, 3, 4, 5]).len, 1);
        // Every corner claims one: the quadrangle stays, between four clusters.
        assert_eq!(CASES[3].merged(&[0, 6, 9, 8, 7, 5]).len, 2);
    }
}
