//! How space is cut into tetrahedra: three periodic splits, each written as its rule, with all tables derived at compile time.
//!
//! A *site* is a kind of lattice point: site 0 is the corner of a cell, site 1 its middle. A *node* is a site of a cell. An
//! edge belongs to the cell that its kind says, a vertex to its edge. All that a cell's tetrahedra need lies in the cell
//! and in the seven above it.
//!
//! ```text
//! six    site 0            7 edges: 3 axes, 3 face diagonals, 1 body diagonal   6 tetrahedra a cell, all alike
//! five   site 0            6 edges: 3 axes, 3 face diagonals                    5 a cell; cells alternate, so that faces agree
//! bcc    sites 0 and 1    14 edges: 3 + 3 axes, 8 half body diagonals          12 a cell, four across each of three faces
//! ```
//!
//! The simplex lattice is `six` on a sheared lattice, see [`super::simplex`].
//!
//! Source: the splits are those of Uralsky 2006, MT5, MT6, CCL; six is Kuhn's or Freudenthal's triangulation (Freudenthal
//! 1942), bcc the tetragonal disphenoids (Sommerville 1923; Patera & Skala, Centered cubic lattice method comparison, 2005).

use super::tables::ENDS;

/// A site of a cell at an offset, both as seen from another cell: bit 0, 1, 2 of the offset are x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Node {
    pub(crate) site: u8,
    pub(crate) offset: u8,
}

/// An edge seen from a cell: which kind it is, and the offset of the cell that owns it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EdgeOf {
    pub(crate) kind: u8,
    pub(crate) owner: u8,
    /// Whether it runs from the tetrahedron's later corner to the earlier one.
    pub(crate) is_reversed: bool,
}

/// One tetrahedron of a cell, its corners in right-handed order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tetrahedron {
    pub(crate) corners: [Node; 4],
    /// In the order of [`ENDS`].
    pub(crate) edges: [EdgeOf; 6],
}

/// A split; `[p]` is for cells whose coordinates sum to an even (0) or odd (1) number.
#[derive(Debug)]
pub(crate) struct Split<const SITES: usize, const EDGES: usize, const TETS: usize> {
    /// Ends of each kind of edge, as seen from the owner.
    pub(crate) edges: [[[Node; 2]; EDGES]; 2],
    pub(crate) tetrahedra: [[Tetrahedron; TETS]; 2],
}

/// Six tetrahedra around the body diagonal.
pub(crate) static SIX: Split<1, 7, 6> = {
    let edges = six_edges();
    let corners = six_corners();
    Split { edges: [edges; 2], tetrahedra: complete([edges; 2], [corners; 2]) }
};

/// A tetrahedron in the middle and one at each of four corners, mirrored from cell to cell.
pub(crate) static FIVE: Split<1, 6, 5> = {
    let edges = [five_edges(0), five_edges(1)];
    Split { edges, tetrahedra: complete(edges, [five_corners(0), five_corners(1)]) }
};

/// Tetrahedra between the middles of two cells and an edge of the face between them.
pub(crate) static BCC: Split<2, 14, 12> = {
    let edges = bcc_edges();
    Split { edges: [edges; 2], tetrahedra: complete([edges; 2], [bcc_corners(); 2]) }
};

const fn corner(offset: usize) -> Node {
    Node { site: 0, offset: offset as u8 }
}

const fn middle(offset: usize) -> Node {
    Node { site: 1, offset: offset as u8 }
}

/// Offset 0 to each other offset.
const fn six_edges() -> [[Node; 2]; 7] {
    let mut edges = [[corner(0); 2]; 7];
    // Axes first: 1, 2, 4, then 3, 5, 6, then 7.
    let order = [1, 2, 4, 3, 5, 6, 7];
    let mut e = 0;
    while e < 7 {
        edges[e][1] = corner(order[e]);
        e += 1;
    }
    edges
}

/// For each order of the axes a path from offset 0 to offset 7.
const fn six_corners() -> [[Node; 4]; 6] {
    let mut all = [[corner(0); 4]; 6];
    let (mut t, mut a) = (0, 0);
    while a < 3 {
        let mut b = 0;
        while b < 3 {
            if a != b {
                all[t] = [corner(0), corner(1 << a), corner(1 << a | 1 << b), corner(7)];
                t += 1;
            }
            b += 1;
        }
        a += 1;
    }
    all
}

/// Whether the number of set bits is odd.
const fn is_odd(offset: usize) -> bool {
    offset.count_ones() % 2 == 1
}

/// Axes, and in each face that touches offset 0 the diagonal between even nodes.
const fn five_edges(parity: usize) -> [[Node; 2]; 6] {
    let mut edges = [[corner(0); 2]; 6];
    let mut a = 0;
    while a < 3 {
        edges[a] = [corner(0), corner(1 << a)];
        let (u, v) = (1 << ((a + 1) % 3), 1 << ((a + 2) % 3));
        edges[3 + a] = if parity == 0 { [corner(0), corner(u | v)] } else { [corner(u), corner(v)] };
        a += 1;
    }
    edges
}

/// The four nodes of even parity, then each odd one with its neighbours. Parity is that of coordinates in the lattice, so
/// that neighbouring cells agree on the diagonals of the face between them.
const fn five_corners(parity: usize) -> [[Node; 4]; 5] {
    let mut all = [[corner(0); 4]; 5];
    let (mut even, mut t, mut offset) = (0, 1, 0);
    while offset < 8 {
        if is_odd(offset) == (parity == 1) {
            all[0][even] = corner(offset);
            even += 1;
        } else {
            all[t] = [corner(offset), corner(offset ^ 1), corner(offset ^ 2), corner(offset ^ 4)];
            t += 1;
        }
        offset += 1;
    }
    all
}

/// Axes from corner to corner, axes from middle to middle, and from the middle to each corner.
const fn bcc_edges() -> [[Node; 2]; 14] {
    let mut edges = [[corner(0); 2]; 14];
    let mut a = 0;
    while a < 3 {
        edges[a] = [corner(0), corner(1 << a)];
        edges[3 + a] = [middle(0), middle(1 << a)];
        a += 1;
    }
    let mut offset = 0;
    while offset < 8 {
        edges[6 + offset] = [middle(0), corner(offset)];
        offset += 1;
    }
    edges
}

/// Across the upper face along each axis, for each side of that face.
const fn bcc_corners() -> [[Node; 4]; 12] {
    let mut all = [[corner(0); 4]; 12];
    let (mut t, mut a) = (0, 0);
    while a < 3 {
        let (n, u, v) = (1 << a, 1 << ((a + 1) % 3), 1 << ((a + 2) % 3));
        let ring = [n, n | u, n | u | v, n | v];
        let mut i = 0;
        while i < 4 {
            all[t] = [middle(0), middle(n), corner(ring[i]), corner(ring[(i + 1) % 4])];
            t += 1;
            i += 1;
        }
        a += 1;
    }
    all
}

/// Twice the place of a node in units of cells.
pub(super) const fn doubled(node: Node) -> [i32; 3] {
    let (o, s) = (node.offset as i32, node.site as i32);
    [2 * (o & 1) + s, 2 * (o >> 1 & 1) + s, 2 * (o >> 2) + s]
}

/// Turns the corners right-handed and finds the edges.
const fn complete<const EDGES: usize, const TETS: usize>(
    edges: [[[Node; 2]; EDGES]; 2],
    corners: [[[Node; 4]; TETS]; 2],
) -> [[Tetrahedron; TETS]; 2] {
    let none = Tetrahedron { corners: [corner(0); 4], edges: [EdgeOf { kind: 0, owner: 0, is_reversed: false }; 6] };
    let mut all = [[none; TETS]; 2];
    let mut parity = 0;
    while parity < 2 {
        let mut t = 0;
        while t < TETS {
            let [a, b, c, d] = corners[parity][t];
            let corners = if is_right_handed([a, b, c, d]) { [a, b, c, d] } else { [a, b, d, c] };
            all[parity][t].corners = corners;
            let mut e = 0;
            while e < 6 {
                let [from, to] = ENDS[e];
                all[parity][t].edges[e] = find_edge(&edges, parity, [corners[from], corners[to]]);
                e += 1;
            }
            t += 1;
        }
        parity += 1;
    }
    all
}

const fn is_right_handed(corners: [Node; 4]) -> bool {
    let (o, a, b, c) = (doubled(corners[0]), doubled(corners[1]), doubled(corners[2]), doubled(corners[3]));
    let (a, b, c) = (minus(a, o), minus(b, o), minus(c, o));
    let det =
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    assert!(det != 0, "no tetrahedron is flat");
    det > 0
}

const fn minus(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The kind and the owner of the edge between two nodes of a cell of this parity.
const fn find_edge<const EDGES: usize>(edges: &[[[Node; 2]; EDGES]; 2], parity: usize, ends: [Node; 2]) -> EdgeOf {
    let mut owner = 0;
    while owner < 8 {
        let of_owner = (parity + is_odd(owner) as usize) % 2;
        let mut kind = 0;
        while kind < EDGES {
            let [a, b] = edges[of_owner][kind];
            let is_reversed = is_at(a, owner, ends[1]) && is_at(b, owner, ends[0]);
            if is_reversed || (is_at(a, owner, ends[0]) && is_at(b, owner, ends[1])) {
                return EdgeOf { kind: kind as u8, owner: owner as u8, is_reversed };
            }
            kind += 1;
        }
        owner += 1;
    }
    panic!("every edge of a tetrahedron has a kind and an owner")
}

/// Whether `of_owner`, moved by the owner's offset, is `node`.
const fn is_at(of_owner: Node, owner: usize, node: Node) -> bool {
    let (sum, want) = (of_owner.offset as usize, node.offset as usize);
    // Offsets add without carry, or the node lies beyond the cells above.
    of_owner.site == node.site && sum & owner == 0 && sum | owner == want
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume of a tetrahedron, in units of an eighth of a cell.
    fn volume(t: &Tetrahedron) -> i32 {
        let [o, a, b, c] = t.corners.map(doubled);
        let [a, b, c] = [a, b, c].map(|p| minus(p, o));
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    }

    fn fills<const S: usize, const E: usize, const T: usize>(split: &Split<S, E, T>) {
        for parity in 0..2 {
            assert!(split.tetrahedra[parity].iter().all(|t| volume(t) > 0));
            assert_eq!(split.tetrahedra[parity].iter().map(volume).sum::<i32>(), 6 * 8);
        }
    }

    #[test]
    fn tetrahedra_are_right_handed_and_fill_their_cell() {
        fills(&SIX);
        fills(&FIVE);
        fills(&BCC);
    }

    /// Every face of every tetrahedron, in a block of cells, is one of exactly two, or lies on the rim of the block.
    fn faces_agree<const S: usize, const E: usize, const T: usize>(split: &Split<S, E, T>) {
        let mut faces = std::collections::BTreeMap::new();
        const N: i32 = 4;
        for cell in 0..N * N * N {
            let at = [cell % N, cell / N % N, cell / (N * N)];
            for t in &split.tetrahedra[(at.iter().sum::<i32>() % 2) as usize] {
                let corners = t.corners.map(|node| {
                    let d = doubled(node);
                    [0, 1, 2].map(|a| d[a] + 2 * at[a])
                });
                for skip in 0..4 {
                    let mut face: Vec<_> = (0..4).filter(|&c| c != skip).map(|c| corners[c]).collect();
                    face.sort_unstable();
                    *faces.entry(face).or_insert(0) += 1;
                }
            }
        }
        for (face, count) in faces {
            let inner = face.iter().all(|p| p.iter().all(|&v| v > 1 && v < 2 * N - 1));
            assert!(if inner { count == 2 } else { count <= 2 }, "{face:?}: {count}");
        }
    }

    #[test]
    fn neighbours_agree_on_their_faces() {
        faces_agree(&SIX);
        faces_agree(&FIVE);
        faces_agree(&BCC);
    }
}
