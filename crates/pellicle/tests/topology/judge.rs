//! An exact judge of the trilinear interpolant's zero set.
//!
//! The judge knows nothing of tables, loops or saddles of the cell: it sweeps each cell by planes across one axis. A slice is
//! bilinear, so its zero set is at most two arcs; arcs change only where a corner of the slice changes sign or where
//! A·C = B·D. All that is compared are whole numbers (`i128`), so nothing is rounded. It sweeps along all three axes and
//! insists that they agree.

/// What the zero set of the interpolant is: components and Euler number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topology {
    pub components: usize,
    pub euler: i64,
}

/// A number of the form p/q, q > 0.
type Ratio = (i128, i128);

/// What happens at a height of the sweep.
#[derive(Debug, Clone, Copy)]
enum Event {
    /// This corner of the slice changes sign.
    Corner(usize),
    /// A·C − B·D changes sign: root number 0 or 1 of the quadratic, between events that are ratios.
    Saddle,
}

struct UnionFind(Vec<usize>);

impl UnionFind {
    fn root(&self, mut i: usize) -> usize {
        while self.0[i] != i {
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// Corners of the square around a slice and the cell's corners at both of its ends, for a sweep along `axis`.
fn square(axis: usize) -> [[usize; 2]; 4] {
    let (u, v, up) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3), 1 << axis);
    [0, u, u + v, v].map(|c| [c, c + up])
}

/// Number of arcs of a slice with these signs; the pairs of sides that they join. Side i runs from corner i to i + 1.
fn arcs(inside: [bool; 4], first_pair_joined: bool) -> Vec<[usize; 2]> {
    let crossed: Vec<usize> = (0..4).filter(|&i| inside[i] != inside[(i + 1) % 4]).collect();
    match crossed.len() {
        0 => vec![],
        2 => vec![[crossed[0], crossed[1]]],
        // Corners 0 and 2 joined: arcs go around corners 1 and 3.
        _ if first_pair_joined => vec![[0, 1], [2, 3]],
        _ => vec![[3, 0], [1, 2]],
    }
}

/// Sweeps one cell. `crossing(edge as [low corner, high corner])` names the lattice's crossing point; joins those that the
/// surface connects, and returns the Euler number of the surface within the closed cell. `None` where the surface is
/// singular: two things happen at one height, or a saddle lies on it.
fn sweep(f: [i128; 8], axis: usize, joins: &mut Vec<[[usize; 2]; 2]>) -> Option<i64> {
    let corners = square(axis);
    let low = corners.map(|c| f[c[0]]);
    let rise = corners.map(|c| f[c[1]] - f[c[0]]);
    // Sign of a corner of the slice, and of A·C − B·D, at p/q.
    let value = |i: usize, (p, q): Ratio| low[i] * q + rise[i] * p;
    let product = |r: Ratio| value(0, r) * value(2, r) - value(1, r) * value(3, r);
    let mut corner_events: Vec<(Ratio, usize)> = Vec::new();
    for i in 0..4 {
        if (low[i] > 0) != (low[i] + rise[i] > 0) {
            let sign = -rise[i].signum();
            corner_events.push(((low[i] * sign, -rise[i] * sign), i));
        }
    }
    corner_events.sort_by(|(a, _), (b, _)| (a.0 * b.1).cmp(&(b.0 * a.1)));
    if corner_events.windows(2).any(|w| w[0].0.0 * w[1].0.1 == w[1].0.0 * w[0].0.1) {
        return None;
    }
    let mut heights: Vec<Ratio> = vec![(0, 1)];
    heights.extend(corner_events.iter().map(|e| e.0));
    heights.push((1, 1));
    let square_term = rise[0] * rise[2] - rise[1] * rise[3];
    let linear = low[0] * rise[2] + low[2] * rise[0] - low[1] * rise[3] - low[3] * rise[1];
    // Intervals: signs of the corners, and whether corners 0 and 2 are joined if they are in question.
    let mut intervals: Vec<([bool; 4], bool)> = Vec::new();
    let mut events: Vec<Event> = Vec::new();
    for (n, pair) in heights.windows(2).enumerate() {
        let [a, b] = [pair[0], pair[1]];
        let middle = (a.0 * b.1 + b.0 * a.1, 2 * a.1 * b.1);
        let inside: [bool; 4] = std::array::from_fn(|i| value(i, middle) > 0);
        let ambiguous = inside[0] == inside[2] && inside[1] == inside[3] && inside[0] != inside[1];
        // In an ambiguous slice with corner 0 inside A·C > B·D joins the first pair; else it joins the second, whose
        // corners are inside: the same arcs as when the first pair is joined outside.
        let joined = |r: Ratio| product(r) > 0;
        if !ambiguous {
            intervals.push((inside, false));
        } else {
            // At an end that is a corner's zero the product is that of the other pair, so it is not zero.
            let (pa, pb) = (product(a), product(b));
            if pa == 0 || pb == 0 {
                return None;
            }
            let extremum =
                if square_term == 0 { None } else { Some((-linear * square_term.signum(), 2 * square_term.abs())) };
            let within = extremum.filter(|e| e.0 * a.1 > a.0 * e.1 && e.0 * b.1 < b.0 * e.1);
            intervals.push((inside, joined(a)));
            match within {
                Some(e) if (pa > 0) == (pb > 0) => {
                    let pe = product(e);
                    if pe == 0 {
                        return None;
                    }
                    if (pe > 0) != (pa > 0) {
                        events.push(Event::Saddle);
                        intervals.push((inside, joined(e)));
                        events.push(Event::Saddle);
                        intervals.push((inside, joined(b)));
                    }
                }
                _ if (pa > 0) != (pb > 0) => {
                    events.push(Event::Saddle);
                    intervals.push((inside, joined(b)));
                }
                _ => {}
            }
        }
        if n + 1 < heights.len() - 1 {
            events.push(Event::Corner(corner_events[n].1));
        }
    }
    // Arcs as a graph: node 4·interval + side.
    let mut graph = UnionFind((0..4 * intervals.len()).collect());
    let mut euler = 0;
    let count = |n: usize| arcs(intervals[n].0, intervals[n].1).len() as i64;
    for (n, &(inside, joined)) in intervals.iter().enumerate() {
        for [a, b] in arcs(inside, joined) {
            graph.join(4 * n + a, 4 * n + b);
        }
        euler -= count(n);
    }
    euler += count(0) + count(intervals.len() - 1);
    let mut named: Vec<(usize, [usize; 2])> = Vec::new();
    for (n, event) in events.iter().enumerate() {
        let crossed = |n: usize, side: usize| intervals[n].0[side] != intervals[n].0[(side + 1) % 4];
        for side in 0..4 {
            if crossed(n, side) && crossed(n + 1, side) {
                graph.join(4 * n + side, 4 * (n + 1) + side);
            }
        }
        match *event {
            Event::Saddle => {
                // Two arcs meet in one point: a cross.
                (1..4).for_each(|side| graph.join(4 * n, 4 * n + side));
                euler += 1;
            }
            Event::Corner(i) => {
                let sides: Vec<usize> = [n, n + 1]
                    .into_iter()
                    .flat_map(|n| [i, (i + 3) % 4].map(|side| (n, side)))
                    .filter(|&(n, side)| crossed(n, side))
                    .map(|(n, side)| 4 * n + side)
                    .collect();
                sides.windows(2).for_each(|w| graph.join(w[0], w[1]));
                named.push((sides[0], [corners[i][0], corners[i][1]]));
                euler += count(n).max(count(n + 1));
            }
        }
    }
    for (n, end) in [(0, 0), (intervals.len() - 1, 1)] {
        for side in (0..4).filter(|&s| intervals[n].0[s] != intervals[n].0[(s + 1) % 4]) {
            let (a, b) = (corners[side][end], corners[(side + 1) % 4][end]);
            named.push((4 * n + side, [a.min(b), a.max(b)]));
        }
    }
    for a in 0..named.len() {
        for b in 0..a {
            if graph.root(named[a].0) == graph.root(named[b].0) {
                joins.push([named[a].1, named[b].1]);
            }
        }
    }
    Some(euler)
}

/// The judge: grid of whole numbers, none of them 0.
pub fn judge(samples: &[i128], n: usize, axis: usize) -> Option<Topology> {
    let node = |i: usize, j: usize, k: usize| i + n * (j + n * k);
    let name = |low: usize, high: usize| {
        3 * low
            + if high - low == 1 {
                0
            } else if high - low == n {
                1
            } else {
                2
            }
    };
    let mut graph = UnionFind((0..3 * samples.len()).collect());
    let (mut cells, mut faces, mut points) = (0i64, 0i64, 0i64);
    let mut crossed = vec![false; 3 * samples.len()];
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                let at = node(i, j, k);
                for (a, step, last) in [(0, 1, i), (1, n, j), (2, n * n, k)] {
                    if last + 1 < n && (samples[at] > 0) != (samples[at + step] > 0) {
                        crossed[3 * at + a] = true;
                        points += 1;
                    }
                    // The face across axis a at this node: two arcs for four crossings.
                    let [(u, lu), (v, lv)] = [[(n, j), (n * n, k)], [(n * n, k), (1, i)], [(1, i), (n, j)]][a];
                    if lu + 1 < n && lv + 1 < n {
                        let signs = [at, at + u, at + u + v, at + v].map(|c| samples[c] > 0);
                        faces += (0..4).filter(|&s| signs[s] != signs[(s + 1) % 4]).count() as i64 / 2;
                    }
                }
                if i + 1 < n && j + 1 < n && k + 1 < n {
                    let corner = |c: usize| node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                    let mut joins = Vec::new();
                    cells += sweep(std::array::from_fn(|c| samples[corner(c)]), axis, &mut joins)?;
                    for [a, b] in joins {
                        graph.join(name(corner(a[0]), corner(a[1])), name(corner(b[0]), corner(b[1])));
                    }
                }
            }
        }
    }
    let components = (0..crossed.len()).filter(|&e| crossed[e] && graph.root(e) == e).count();
    Some(Topology { components, euler: cells - faces + points })
}

/// What the zero set of one cell's interpolant is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct CellTopology {
    pub components: usize,
    pub euler: i64,
    /// Closed curves in which it meets the cell's faces.
    pub loops: usize,
}

/// The judge of one cell of whole numbers, none of them 0. `None` where the surface is singular.
pub fn judge_cell(f: [i128; 8]) -> Option<CellTopology> {
    let name = |[low, high]: [usize; 2]| 8 * low + high;
    let pieces = |graph: &UnionFind| {
        let steps = (0..8usize).flat_map(|low| [1, 2, 4].map(|step| (low, low | step)));
        let crossed = steps.filter(|&(low, high)| low < high && (f[low] > 0) != (f[high] > 0));
        crossed.filter(|&(low, high)| graph.root(name([low, high])) == name([low, high])).count()
    };
    let mut verdicts = Vec::new();
    for axis in 0..3 {
        let (mut graph, mut joins) = (UnionFind((0..64).collect()), Vec::new());
        let euler = sweep(f, axis, &mut joins)?;
        joins.into_iter().for_each(|[a, b]| graph.join(name(a), name(b)));
        verdicts.push((pieces(&graph), euler));
    }
    assert!(verdicts.iter().all(|verdict| *verdict == verdicts[0]), "the judge disagrees with itself on {f:?}");
    let mut curves = UnionFind((0..64).collect());
    for face in 0..6 {
        let end = face % 2;
        let corners = square(face / 2).map(|c| c[end]);
        let side = |s: usize| {
            let (a, b) = (corners[s], corners[(s + 1) % 4]);
            name([a.min(b), a.max(b)])
        };
        let signs = corners.map(|c| f[c] > 0);
        let product = f[corners[0]] * f[corners[2]] - f[corners[1]] * f[corners[3]];
        for [a, b] in arcs(signs, product > 0) {
            curves.join(side(a), side(b));
        }
    }
    let (components, euler) = verdicts[0];
    Some(CellTopology { components, euler, loops: pieces(&curves) })
}
