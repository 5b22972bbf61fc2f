//! Cells whose signs alone do not say how the surface runs: resolved from the values of their eight corners.
//!
//! Three levels of truth. *Classic* leaves it to the table. *Consistent* asks the asymptotic decider on every face whose
//! inside corners lie diagonally: they are joined where the bilinear interpolant's saddle is inside. *Topological* asks
//! inside the cell, too, so that every cell's surface has the topology of the trilinear interpolant's.
//!
//! The rule inside a cell. Faces decide for themselves which corners are joined on the cell's surface, and the curves
//! between inside and outside link up to loops. Let A, B, C, D be the values of a slice at height t, around the square; each
//! is linear in t. Where A, C are on one side and B, D on the other, A and C are joined in that slice if A·C > B·D. This
//! says something new only at the extremum of the quadratic A·C − B·D, if that lies within the cell: everywhere else what
//! a slice joins is joined on the cell's surface as well. So one test tells which corners are joined in space. Loops
//! between the same two regions of space bound one piece of the surface, a disc or (two loops) a tunnel. More than two never
//! meet: a cell has one such extremum, so at most two regions are joined by it.
//!
//! No edge of a triangle joins two vertices of one face of the cell, except along a curve of that face; where a loop cannot
//! be triangulated so, it gets a vertex inside the cell, and a tunnel a ring of three. So meshes are closed 2-manifolds at every level.
//!
//! Values are relative to the isovalue. One that equals it counts as just below it. Arithmetic is in doubles: exact for
//! differences that are whole numbers up to about 1000, else rounded, which can only matter where two alternatives are equal
//! to 15 digits.
//!
//! Source: the decider on faces is Nielson & Hamann, The Asymptotic Decider, 1991; that tunnels matter is Chernyaev, Marching
//! Cubes 33, 1995; loops, the test by one extremum and the triangulation by search are this project's.

use crate::march::tables::{edge_between, edge_corner, face_corners, faces_of, segments};

/// How true the surface is to the samples where a cell's signs are ambiguous.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// By signs alone, from one table: inside corners that meet only across a face's diagonal are kept apart. The fastest.
    #[default]
    Classic,
    /// Faces are those of the bilinear interpolant (asymptotic decider).
    Consistent,
    /// Faces and the inside of cells are those of the trilinear interpolant: with its tunnels.
    Topological,
}

/// Most triangles of a resolved cell: one for each crossed edge, and six around a ring inside a tunnel.
pub(crate) const MOST_RESOLVED: usize = 18;

/// Most vertices inside a cell: a ring of three, or one for a loop.
pub(crate) const MOST_INNER: usize = 4;

/// Triangles of one cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resolved {
    /// Edges, or 12 + i for inner vertex i; counter-clockwise seen from outside the surface.
    pub(crate) triangles: [[u8; 3]; MOST_RESOLVED],
    pub(crate) len: usize,
    /// For each inner vertex the edges of its loop.
    pub(crate) inner: [u16; MOST_INNER],
    pub(crate) inner_len: usize,
}

/// For each case whether the table will do at a level.
pub(crate) static HARD: [[bool; 256]; 3] = {
    let mut hard = [[false; 256]; 3];
    let mut case = 0;
    while case < 256 {
        let ambiguous = has_ambiguous_face(case as u8);
        hard[Level::Consistent as usize][case] = ambiguous;
        hard[Level::Topological as usize][case] = ambiguous || loops_of_signs(case as u8) > 1;
        case += 1;
    }
    hard
};

const fn is_ambiguous(case: u8, face: usize) -> bool {
    let [a, b, c, d] = face_corners(face);
    let (a, b, c, d) = (case >> a & 1, case >> b & 1, case >> c & 1, case >> d & 1);
    a == c && b == d && a != b
}

const fn has_ambiguous_face(case: u8) -> bool {
    let mut face = 0;
    while face < 6 {
        if is_ambiguous(case, face) {
            return true;
        }
        face += 1;
    }
    false
}

/// Loops when every face keeps its inside corners apart.
const fn loops_of_signs(case: u8) -> usize {
    let next = segments(case);
    let (mut seen, mut loops, mut first) = (0u16, 0, 0);
    while first < 12 {
        if next[first] != u8::MAX && seen >> first & 1 == 0 {
            loops += 1;
            let mut edge = first;
            while seen >> edge & 1 == 0 {
                seen |= 1 << edge;
                edge = next[edge] as usize;
            }
        }
        first += 1;
    }
    loops
}

/// Which of eight corners are joined.
#[derive(Clone, Copy)]
struct Joined([u8; 8]);

impl Joined {
    fn join(&mut self, a: usize, b: usize) {
        let (from, to) = (self.0[a].max(self.0[b]), self.0[a].min(self.0[b]));
        for label in &mut self.0 {
            if *label == from {
                *label = to;
            }
        }
    }
}

/// A closed curve on the surface of the cell: the edges that it crosses, in order.
#[derive(Clone, Copy)]
pub(crate) struct Loop {
    pub(crate) edges: [u8; 12],
    pub(crate) len: usize,
}

/// The triangles of a cell with these signs and relative values, at a level above the classic.
pub(crate) fn resolve(case: u8, values: &[f64; 8], level: Level) -> Resolved {
    let mut values = *values;
    for (corner, v) in values.iter_mut().enumerate() {
        // Signs are exact; a value may equal the isovalue, or be rounded to it.
        *v = if case >> corner & 1 == 1 { v.max(1e-75) } else { v.min(-1e-75) };
    }
    let mut joined = Joined([0, 1, 2, 3, 4, 5, 6, 7]);
    for edge in 0..12 {
        let low = edge_corner(edge);
        let high = low | 1 << (edge / 4);
        if case >> low & 1 == case >> high & 1 {
            joined.join(low, high);
        }
    }
    let mut next = segments(case);
    for face in (0..6).filter(|&face| is_ambiguous(case, face)) {
        decide_face(case, face, &values, &mut next, &mut joined);
    }
    if level == Level::Topological {
        join_inside(case, &values, &mut joined);
    }
    let (loops, len) = trace(&next);
    let mut out = Resolved { triangles: [[0; 3]; MOST_RESOLVED], len: 0, inner: [0; MOST_INNER], inner_len: 0 };
    let mut done = [false; 4];
    for l in 0..len {
        if done[l] {
            continue;
        }
        let regions = |l: usize| regions(case, &loops[l], &joined);
        let partner = (l + 1..len).find(|&m| level == Level::Topological && !done[m] && regions(m) == regions(l));
        match partner {
            Some(m) => {
                done[m] = true;
                tunnel(&loops[l], &loops[m], &mut out);
            }
            None => disc(&loops[l], &mut out),
        }
    }
    out
}

/// Joins the corners of an ambiguous face, and links its two curves accordingly.
fn decide_face(case: u8, face: usize, values: &[f64; 8], next: &mut [u8; 12], joined: &mut Joined) {
    let mut corners = face_corners(face);
    if case >> corners[0] & 1 == 0 {
        corners.rotate_left(1);
    }
    let [a, b, c, d] = corners;
    if values[a] * values[c] > values[b] * values[d] {
        joined.join(a, c);
        // The curves go around the outside corners: from where the walk enters to where it left before.
        next[edge_between(d, a)] = edge_between(c, d) as u8;
        next[edge_between(b, c)] = edge_between(a, b) as u8;
    } else {
        joined.join(b, d);
    }
}

/// Joins corners that are joined inside the cell only.
fn join_inside(case: u8, values: &[f64; 8], joined: &mut Joined) {
    // Around the square of a slice, from the lower face to the upper.
    let corners = [0usize, 1, 3, 2];
    let low = corners.map(|c| values[c]);
    let rise = corners.map(|c| values[c + 4] - values[c]);
    // A·C − B·D = square·t² + linear·t + constant.
    let square = rise[0] * rise[2] - rise[1] * rise[3];
    let linear = (low[0] * rise[2] + low[2] * rise[0]) - (low[1] * rise[3] + low[3] * rise[1]);
    let constant = low[0] * low[2] - low[1] * low[3];
    let t = -linear / (2.0 * square);
    if !(t > 0.0 && t < 1.0) {
        return;
    }
    // Times 2·|square|, so that nothing is divided before its sign is taken.
    let inside: [bool; 4] = std::array::from_fn(|i| (2.0 * square * low[i] - linear * rise[i]) * square.signum() > 0.0);
    if inside[0] != inside[2] || inside[1] != inside[3] || inside[0] == inside[1] {
        return;
    }
    let extremum = (4.0 * square * constant - linear * linear) * square.signum();
    // Each has the sign of one of its ends.
    let node = |i: usize| if (case >> corners[i] & 1 == 1) == inside[i] { corners[i] } else { corners[i] + 4 };
    let first_pair = if extremum == 0.0 { !inside[0] } else { extremum > 0.0 };
    if first_pair { joined.join(node(0), node(2)) } else { joined.join(node(1), node(3)) }
}

/// Follows the curves round.
fn trace(next: &[u8; 12]) -> ([Loop; 4], usize) {
    let mut loops = [Loop { edges: [0; 12], len: 0 }; 4];
    let (mut count, mut seen) = (0, 0u16);
    for first in 0..12u8 {
        if next[usize::from(first)] == u8::MAX || seen >> first & 1 == 1 {
            continue;
        }
        let mut edge = first;
        while seen >> edge & 1 == 0 {
            seen |= 1 << edge;
            loops[count].edges[loops[count].len] = edge;
            loops[count].len += 1;
            edge = next[usize::from(edge)];
        }
        count += 1;
    }
    (loops, count)
}

/// The regions of space that a loop divides: of the inside corner and of the outside corner of any of its edges.
fn regions(case: u8, of: &Loop, joined: &Joined) -> [u8; 2] {
    let edge = usize::from(of.edges[0]);
    let low = edge_corner(edge);
    let high = low | 1 << (edge / 4);
    let [inside, outside] = if case >> low & 1 == 1 { [low, high] } else { [high, low] };
    [joined.0[inside], joined.0[outside]]
}

/// Whether an edge of a triangle may join the vertices on two edges of the cell: not within a face.
fn may_join(a: u8, b: u8) -> bool {
    faces_of(a.into()) & faces_of(b.into()) == 0
}

impl Resolved {
    fn push(&mut self, triangle: [u8; 3]) {
        self.triangles[self.len] = triangle;
        self.len += 1;
    }
}

/// A disc within a loop: without a vertex inside where that can be.
pub(crate) fn disc(ring: &Loop, out: &mut Resolved) {
    let n = ring.len;
    // apex[i][span]: third corner of the triangle on the diagonal from i to i + span, 0 where there is none.
    let mut apex = [[0usize; 12]; 12];
    let closed = |i: usize, span: usize, apex: &[[usize; 12]; 12]| span == 1 || apex[i][span] != 0;
    for span in 2..n {
        for i in 0..n - span {
            if span == n - 1 || may_join(ring.edges[i], ring.edges[i + span]) {
                let fits = |&m: &usize| closed(i, m, &apex) && closed(i + m, span - m, &apex);
                apex[i][span] = (1..span).find(fits).unwrap_or(0);
            }
        }
    }
    if apex[0][n - 1] == 0 {
        let inner = 12 + out.inner_len as u8;
        out.inner[out.inner_len] = ring.edges[..n].iter().fold(0, |set, &e| set | 1 << e);
        out.inner_len += 1;
        for i in 0..n {
            out.push([ring.edges[i], ring.edges[(i + 1) % n], inner]);
        }
        return;
    }
    let mut todo = [(0, n - 1); 12];
    let mut left = 1;
    while left > 0 {
        left -= 1;
        let (i, span) = todo[left];
        if span == 1 {
            continue;
        }
        let m = apex[i][span];
        out.push([ring.edges[i], ring.edges[i + m], ring.edges[i + span]]);
        todo[left] = (i + m, span - m);
        todo[left + 1] = (i, m);
        left += 2;
    }
}

/// A tunnel between two loops: without vertices inside where that can be.
fn tunnel(a: &Loop, b: &Loop, out: &mut Resolved) {
    if (0..b.len).any(|start| tunnel_from(a, b, start, out)) {
        return;
    }
    // Every way has an edge within a face, or an edge twice (Chernyaev's case 13.5.2): a ring of three vertices between.
    let start = (0..b.len).find(|&j| may_join(a.edges[0], b.edges[j])).unwrap_or(0);
    let mut ring = Loop { edges: [0; 12], len: 3 };
    let mut onward = *b;
    for j in 0..b.len {
        // The second loop in the direction of the first.
        onward.edges[j] = b.edges[(start + b.len - j) % b.len];
    }
    for k in 0..3 {
        let between = [a.edges[k * a.len / 3], onward.edges[k * b.len / 3]];
        ring.edges[k] = 12 + out.inner_len as u8;
        out.inner[out.inner_len] = 1 << between[0] | 1 << between[1];
        out.inner_len += 1;
    }
    band(a, &ring, out);
    band(&ring, &onward, out);
}

/// A band of triangles between two loops that run the same way; the surface lies to the left of the first.
fn band(a: &Loop, b: &Loop, out: &mut Resolved) {
    let (n, m) = (a.len, b.len);
    let (mut i, mut j) = (0, 0);
    while i < n || j < m {
        let (from_a, from_b) = (a.edges[i % n], b.edges[j % m]);
        if (2 * i + 1) * m <= (2 * j + 1) * n {
            i += 1;
            out.push([from_a, a.edges[i % n], from_b]);
        } else {
            j += 1;
            out.push([b.edges[j % m], from_b, from_a]);
        }
    }
}

/// A tunnel whose first edge leads from vertex 0 of `a` to vertex `start` of `b`.
fn tunnel_from(a: &Loop, b: &Loop, start: usize, out: &mut Resolved) -> bool {
    let walk = Walk { a, b, start };
    let mut along_a = [false; 12];
    if !walk.onward(0, 0, &mut along_a) {
        return false;
    }
    let (mut i, mut j) = (0, 0);
    for &along_a in &along_a[..a.len + b.len] {
        let [from_a, from_b] = walk.edge(i, j);
        if along_a {
            i += 1;
            out.push([from_a, walk.edge(i, j)[0], from_b]);
        } else {
            j += 1;
            out.push([walk.edge(i, j)[1], from_b, from_a]);
        }
    }
    true
}

/// A way round between two loops: steps along one or the other, each making a triangle.
struct Walk<'a> {
    a: &'a Loop,
    b: &'a Loop,
    start: usize,
}

impl Walk<'_> {
    /// The vertices that the edge after `i` steps along a and `j` along b joins. Steps go forward along a, backward along b:
    /// both loops run with the surface on the same side.
    fn edge(&self, i: usize, j: usize) -> [u8; 2] {
        let (n, m) = (self.a.len, self.b.len);
        [self.a.edges[i % n], self.b.edges[(self.start + 2 * m - j) % m]]
    }

    /// Finds the steps from (i, j) to the end, those before being given. The loop that lags behind goes first.
    fn onward(&self, i: usize, j: usize, along_a: &mut [bool; 12]) -> bool {
        let (n, m) = (self.a.len, self.b.len);
        let [from_a, from_b] = self.edge(i, j);
        if i > n || j > m || !may_join(from_a, from_b) {
            return false;
        }
        if i == n && j == m {
            // All steps along one loop in a row would make an edge twice.
            let steps = &along_a[..n + m];
            return (0..n + m).filter(|&s| steps[s] != steps[(s + 1) % (n + m)]).count() >= 4;
        }
        let first = i * m <= j * n;
        [first, !first].into_iter().any(|step| {
            along_a[i + j] = step;
            if step { self.onward(i + 1, j, along_a) } else { self.onward(i, j + 1, along_a) }
        })
    }
}

/// Place within the unit cell of an inner vertex: the mean of its loop.
pub(crate) fn inner_place(edges: u16, values: &[f64; 8]) -> [f64; 3] {
    let (mut sum, mut n) = ([0.0; 3], 0.0);
    for edge in (0..12usize).filter(|&e| edges >> e & 1 == 1) {
        let low = edge_corner(edge);
        let (a, b) = (values[low], values[low | 1 << (edge / 4)]);
        for axis in 0..3 {
            sum[axis] += if axis == edge / 4 { crossing(a, b) } else { (low >> axis & 1) as f64 };
        }
        n += 1.0;
    }
    sum.map(|s| s / n)
}

/// Where on an edge between relative values `a` and `b`, of which one is above 0 and one is not, the surface crosses it.
#[inline(always)]
pub(crate) fn crossing(a: f64, b: f64) -> f64 {
    // 64-bit integers may round to the isovalue at both ends.
    if a == b { 0.5 } else { (a / (a - b)).clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests;
