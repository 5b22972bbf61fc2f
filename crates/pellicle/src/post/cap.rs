//! Loops in a plane filled with triangles over their own vertices: the caps of a cut.
//!
//! ```text
//! nest    loops that run clockwise are holes of the smallest loop around them
//! bridge  a hole is joined to what is around it by an edge that runs there and back, so that a polygon is one ring
//! clip    ears are cut off the ring, those with the shortest new edge first
//! ```
//!
//! No vertex is added, moved or left out, however many lie on a line, so what was a border is closed by index. Where rounding made
//! loops cross themselves no ear may be left; then the convex corner with the shortest new edge goes all the same, and a few
//! triangles may overlap. What comes out is checked: each edge once in each direction. A polygon for which that fails is
//! given back, to be closed otherwise.
//!
//! Source: ears are Meisters, Polygons Have Ears, 1975; bridges are Eberly, Triangulation by Ear Clipping, 2002.

use std::{cmp::Reverse, collections::BinaryHeap};

use rayon::prelude::*;

/// A place in the plane.
pub(super) type Point = [f64; 2];

/// Fills loops, which run counter-clockwise around what is to be filled. Returns triangles, and the loops that could not be
/// filled.
pub(super) fn fill(points: &[Point], loops: &[Vec<u32>]) -> (Vec<[u32; 3]>, Vec<usize>) {
    let parts: Vec<(Vec<[u32; 3]>, Vec<usize>)> = nest(points, loops)
        .into_par_iter()
        .map(|polygon| match fill_polygon(points, loops, &polygon) {
            Some(triangles) => (triangles, Vec::new()),
            None => (Vec::new(), polygon),
        })
        .collect();
    let mut all = (Vec::new(), Vec::new());
    for (triangles, failed) in parts {
        all.0.extend(triangles);
        all.1.extend(failed);
    }
    all
}

/// Twice the area of a triangle, positive when counter-clockwise.
#[inline(always)]
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// Twice the area within a loop.
fn area(points: &[Point], ring: &[u32]) -> f64 {
    let Some(&first) = ring.first() else { return 0.0 };
    let at = |v: u32| points[v as usize];
    ring.windows(2).map(|pair| turn(at(first), at(pair[0]), at(pair[1]))).sum()
}

/// The smallest box around a loop.
fn bounds(points: &[Point], ring: &[u32]) -> [Point; 2] {
    ring.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], &v| {
        let p = points[v as usize];
        [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
    })
}

/// Whether a point lies within a loop.
fn contains(points: &[Point], ring: &[u32], p: Point) -> bool {
    let mut inside = false;
    let mut a = points[ring[ring.len() - 1] as usize];
    for &v in ring {
        let b = points[v as usize];
        if (a[1] > p[1]) != (b[1] > p[1]) && (turn(a, b, p) > 0.0) == (b[1] > a[1]) {
            inside = !inside;
        }
        a = b;
    }
    inside
}

/// Loops that belong together: an outer one first, then its holes. A hole with nothing around it stands alone.
fn nest(points: &[Point], loops: &[Vec<u32>]) -> Vec<Vec<usize>> {
    // What is not a number is filled as it comes.
    let areas: Vec<f64> =
        loops.iter().map(|ring| area(points, ring)).map(|a| if a.is_nan() { 0.0 } else { a }).collect();
    let boxes: Vec<[Point; 2]> = loops.iter().map(|ring| bounds(points, ring)).collect();
    let outer: Vec<usize> = (0..loops.len()).filter(|&i| areas[i] >= 0.0).collect();
    let around = |hole: usize| {
        let p = points[loops[hole][0] as usize];
        let holds = |&&o: &&usize| {
            let [low, high] = boxes[o];
            (0..2).all(|a| low[a] <= boxes[hole][0][a] && boxes[hole][1][a] <= high[a])
                && contains(points, &loops[o], p)
        };
        outer.iter().filter(holds).copied().min_by(|&a, &b| areas[a].total_cmp(&areas[b]))
    };
    let owners: Vec<(usize, Option<usize>)> =
        (0..loops.len()).into_par_iter().filter(|&i| areas[i] < 0.0).map(|hole| (hole, around(hole))).collect();
    let mut polygons: Vec<Vec<usize>> =
        (0..loops.len()).map(|i| if areas[i] >= 0.0 { vec![i] } else { Vec::new() }).collect();
    for (hole, owner) in owners {
        polygons[owner.unwrap_or(hole)].push(hole);
    }
    polygons.retain(|polygon| !polygon.is_empty());
    polygons
}

fn fill_polygon(points: &[Point], loops: &[Vec<u32>], polygon: &[usize]) -> Option<Vec<[u32; 3]>> {
    let mut ring = loops[polygon[0]].clone();
    let is_turned = area(points, &ring) < 0.0;
    // A hole on its own is filled as seen from behind.
    let place = |v: u32| {
        let [x, y] = points[v as usize];
        if is_turned { [y, x] } else { [x, y] }
    };
    let mut holes: Vec<Vec<u32>> = polygon[1..].iter().map(|&hole| leftmost_first(&loops[hole], place)).collect();
    holes.sort_by(|a, b| {
        let [p, q] = [a, b].map(|hole| place(hole[0]));
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(a[0].cmp(&b[0]))
    });
    for hole in holes {
        let at = bridge(&ring, place, place(hole[0]))?;
        let joined = hole.iter().copied().chain([hole[0], ring[at]]);
        ring.splice(at + 1..at + 1, joined);
    }
    let triangles = Ears::new(&ring, place).clip();
    is_sound(&triangles).then_some(triangles)
}

/// A loop that begins at its leftmost vertex, the lowest of several.
fn leftmost_first(ring: &[u32], place: impl Fn(u32) -> Point) -> Vec<u32> {
    let key = |&i: &usize| place(ring[i]);
    let first = (0..ring.len()).min_by(|a, b| {
        let [p, q] = [key(a), key(b)];
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(a.cmp(b))
    });
    let (before, after) = ring.split_at(first.unwrap_or(0));
    [after, before].concat()
}

/// Position in the ring of a vertex that the point, in the ring's inside, sees to its left.
fn bridge(ring: &[u32], place: impl Fn(u32) -> Point, p: Point) -> Option<usize> {
    let n = ring.len();
    let at = |i: usize| place(ring[i % n]);
    // The nearest edge that runs down to the left of the point.
    let (mut best, mut hit) = (None, f64::NEG_INFINITY);
    for i in 0..n {
        let (a, b) = (at(i), at(i + 1));
        if a[1] >= p[1] && p[1] >= b[1] && a[1] > b[1] {
            let x = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            if x <= p[0] && x > hit {
                hit = x;
                best = Some(if a[0] < b[0] { i } else { (i + 1) % n });
            }
        }
    }
    let first = best?;
    // What is in the triangle between hides its end; of that the vertex with the least angle to the left is seen.
    let end = at(first);
    let corner = [hit, p[1]];
    let (u, v) = if p[1] < end[1] { (p, corner) } else { (corner, p) };
    let angle = |q: Point| (p[1] - q[1]).abs() / (p[0] - q[0]);
    let (mut found, mut least) = (first, f64::INFINITY);
    for i in 0..n {
        let q = at(i);
        let is_within = turn(u, end, q) >= 0.0 && turn(end, v, q) >= 0.0 && turn(v, u, q) >= 0.0;
        let is_candidate = i == first || (q[0] < p[0] && q[0] >= end[0].min(hit) && is_within);
        if !is_candidate || !opens_to(at(i + n - 1), q, at(i + 1), p) {
            continue;
        }
        let slope = if q[0] < p[0] { angle(q) } else { f64::MAX };
        if slope < least || (slope == least && q[0] > at(found)[0]) {
            (found, least) = (i, slope);
        }
    }
    Some(found)
}

/// Whether the inside at corner `b`, between `a` before and `c` after, opens towards `p`.
fn opens_to(a: Point, b: Point, c: Point, p: Point) -> bool {
    if turn(a, b, c) > 0.0 {
        turn(b, p, a) >= 0.0 && turn(b, c, p) >= 0.0
    } else {
        turn(b, p, a) > 0.0 || turn(b, c, p) > 0.0
    }
}

/// A ring that is being clipped.
struct Ears<'a> {
    ring: &'a [u32],
    place: Vec<Point>,
    next: Vec<u32>,
    previous: Vec<u32>,
    is_left: Vec<bool>,
    grid: Grid,
}

/// A corner to be clipped: length² of the new edge as bits, position, and its neighbours when it was looked at.
type Corner = Reverse<(u64, u32, u32, u32)>;

impl<'a> Ears<'a> {
    fn new(ring: &'a [u32], place: impl Fn(u32) -> Point) -> Self {
        let n = ring.len() as u32;
        let place: Vec<Point> = ring.iter().map(|&v| place(v)).collect();
        Self {
            ring,
            next: (0..n).map(|i| (i + 1) % n).collect(),
            previous: (0..n).map(|i| (i + n - 1) % n).collect(),
            is_left: vec![true; ring.len()],
            grid: Grid::of(&place),
            place,
        }
    }

    fn corner(&self, i: u32) -> Corner {
        let (a, c) = (self.previous[i as usize], self.next[i as usize]);
        let [p, q] = [a, c].map(|i| self.place[i as usize]);
        Reverse((((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)).to_bits(), i, a, c))
    }

    fn turn_at(&self, i: u32) -> f64 {
        let at = |i: u32| self.place[i as usize];
        turn(at(self.previous[i as usize]), at(i), at(self.next[i as usize]))
    }

    fn clip(mut self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.ring.len());
        let mut left = self.ring.len();
        let mut heap: BinaryHeap<Corner> = (0..left as u32).map(|i| self.corner(i)).collect();
        let (mut blocked, mut has_clipped, mut is_forced) = (Vec::new(), false, false);
        while left >= 3 {
            let Some(Reverse((_, i, a, c))) = heap.pop() else {
                // All are blocked: once more, since what blocked them may be gone, then by force.
                is_forced = !has_clipped;
                has_clipped = false;
                heap.extend(blocked.drain(..));
                if heap.is_empty() {
                    break;
                }
                continue;
            };
            if !self.is_left[i as usize] || self.previous[i as usize] != a || self.next[i as usize] != c {
                continue;
            }
            // By force any convex corner goes, and where there is none the first of all.
            let may_go = left == 3 || self.is_ear(i) || (is_forced && (self.turn_at(i) > 0.0 || heap.is_empty()));
            if !may_go {
                blocked.push(self.corner(i));
                continue;
            }
            triangles.push([a, i, c].map(|i| self.ring[i as usize]));
            self.is_left[i as usize] = false;
            self.next[a as usize] = c;
            self.previous[c as usize] = a;
            left -= 1;
            (has_clipped, is_forced) = (true, false);
            if left == 2 {
                break;
            }
            heap.extend([self.corner(a), self.corner(c)]);
        }
        triangles
    }

    /// Whether a corner is convex and nothing of the ring is in its triangle.
    fn is_ear(&self, i: u32) -> bool {
        if self.turn_at(i) <= 0.0 {
            return false;
        }
        let [a, b, c] = [self.previous[i as usize], i, self.next[i as usize]].map(|i| self.place[i as usize]);
        let hides = |&j: &u32| {
            let p = self.place[j as usize];
            // Vertices at the corners are those of bridges, whose edges lie outside or along.
            self.is_left[j as usize]
                && turn(a, b, p) >= 0.0
                && turn(b, c, p) >= 0.0
                && turn(c, a, p) >= 0.0
                && p != a
                && p != b
                && p != c
        };
        let low = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
        let high = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
        !self.grid.rows(low, high).any(|places| places.iter().any(hides))
    }
}

/// Points by squares of the plane, row after row.
struct Grid {
    low: Point,
    per: f64,
    columns: usize,
    rows: usize,
    start: Vec<u32>,
    points: Vec<u32>,
}

impl Grid {
    fn of(place: &[Point]) -> Self {
        let all: Vec<u32> = (0..place.len() as u32).collect();
        let [low, high] = bounds(place, &all);
        let side = ((high[0] - low[0]) * (high[1] - low[1]) / place.len() as f64).sqrt();
        // A thin strip has one row: no more squares along it than points.
        let side = side.max((high[0] - low[0]).max(high[1] - low[1]) / place.len() as f64).max(f64::MIN_POSITIVE);
        let per = 1.0 / side;
        let count = |a: usize| ((high[a] - low[a]) * per) as usize + 1;
        let mut grid = Self { low, per, columns: count(0), rows: count(1), start: Vec::new(), points: Vec::new() };
        grid.start = vec![0; grid.columns * grid.rows + 2];
        let squares: Vec<usize> = place.iter().map(|p| grid.column(p[0]) + grid.columns * grid.row(p[1])).collect();
        squares.iter().for_each(|&square| grid.start[square + 2] += 1);
        for i in 2..grid.start.len() {
            grid.start[i] += grid.start[i - 1];
        }
        grid.points = vec![0; place.len()];
        for (i, &square) in squares.iter().enumerate() {
            grid.points[grid.start[square + 1] as usize] = i as u32;
            grid.start[square + 1] += 1;
        }
        grid
    }

    fn column(&self, x: f64) -> usize {
        (((x - self.low[0]) * self.per) as usize).min(self.columns - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low[1]) * self.per) as usize).min(self.rows - 1)
    }

    /// The points in and near a box.
    fn rows(&self, low: Point, high: Point) -> impl Iterator<Item = &[u32]> {
        let (first, last) = (self.column(low[0]), self.column(high[0]));
        (self.row(low[1])..=self.row(high[1])).map(move |row| {
            let at = row * self.columns;
            &self.points[self.start[at + first] as usize..self.start[at + last + 1] as usize]
        })
    }
}

/// Whether no vertex is named twice in a triangle and no edge runs twice in one direction.
fn is_sound(triangles: &[[u32; 3]]) -> bool {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.collect();
    sides.sort_unstable();
    sides.iter().all(|[a, b]| a != b) && sides.windows(2).all(|pair| pair[0] != pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop around a point, with `n` corners whose distance changes, clockwise if `turns` is −1.
    fn star(points: &mut Vec<Point>, centre: Point, radius: f64, n: usize, turns: f64) -> Vec<u32> {
        let first = points.len() as u32;
        points.extend((0..n).map(|i| {
            let angle = turns * i as f64 / n as f64 * std::f64::consts::TAU;
            let r = radius * (1.0 + 0.4 * (5.0 * angle).sin());
            [centre[0] + r * angle.cos(), centre[1] + r * angle.sin()]
        }));
        (first..points.len() as u32).collect()
    }

    /// Fills, and checks that the borders are used once and the area is all there, without overlap.
    fn judge(points: &[Point], loops: &[Vec<u32>]) {
        let (triangles, failed) = fill(points, loops);
        assert!(failed.is_empty());
        let at = |v: u32| points[v as usize];
        let areas: Vec<f64> = triangles.iter().map(|t| turn(at(t[0]), at(t[1]), at(t[2]))).collect();
        let whole: f64 = loops.iter().map(|ring| area(points, ring)).sum();
        let covered: f64 = areas.iter().map(|a| a.abs()).sum();
        assert!((covered - whole).abs() < 1e-9 * whole.abs(), "{covered} {whole}");
        let mut sides: Vec<[u32; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        sides.sort_unstable();
        let border: usize = loops.iter().map(Vec::len).sum();
        let single = sides.iter().filter(|[a, b]| sides.binary_search(&[*b, *a]).is_err()).count();
        assert_eq!(single, border);
        for ring in loops {
            for i in 0..ring.len() {
                assert!(sides.binary_search(&[ring[i], ring[(i + 1) % ring.len()]]).is_ok());
            }
        }
    }

    #[test]
    fn rings_with_holes_and_islands_are_covered_once() {
        let mut points = Vec::new();
        let mut loops = vec![star(&mut points, [0.0; 2], 10.0, 200, 1.0)];
        for (i, centre) in [[0.0, 0.0], [3.0, 1.0], [-3.0, 1.5], [0.5, 3.5], [0.2, -3.0]].into_iter().enumerate() {
            loops.push(star(&mut points, centre, 1.0, 20 + i, -1.0));
        }
        loops.push(star(&mut points, [0.0; 2], 0.4, 17, 1.0));
        loops.push(star(&mut points, [30.0, 2.0], 3.0, 31, 1.0));
        judge(&points, &loops);
    }

    #[test]
    fn corners_on_a_line_all_stay() {
        // A square with ten points on each side, and a square hole likewise whose sides are in line with nothing.
        let mut points = Vec::new();
        let mut square = |low: f64, high: f64, back: bool| {
            let first = points.len() as u32;
            let along = |t: usize| low + (high - low) * t as f64 / 10.0;
            points.extend((0..10).map(|t| [along(t), low]));
            points.extend((0..10).map(|t| [high, along(t)]));
            points.extend((0..10).map(|t| [along(10 - t), high]));
            points.extend((0..10).map(|t| [low, along(10 - t)]));
            let ring = first..points.len() as u32;
            if back { ring.rev().collect() } else { ring.collect::<Vec<u32>>() }
        };
        let loops = [square(0.0, 10.0, false), square(2.0, 7.0, true), square(3.0, 4.0, false)];
        judge(&points, &loops);
    }

    #[test]
    fn loops_that_cross_themselves_still_close() {
        let points = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [-1.0, 1.0]];
        let (triangles, failed) = fill(&points, &[vec![0, 1, 2, 3, 4]]);
        assert!(failed.is_empty() && triangles.len() == 3 && is_sound(&triangles));
        let flat = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.5, 0.0]];
        let (triangles, _) = fill(&flat, &[vec![0, 1, 2, 3]]);
        assert!(triangles.len() == 2 && is_sound(&triangles));
        // A hole with nothing around it is filled as seen from behind.
        let (triangles, _) = fill(&[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]], &[vec![0, 1, 2]]);
        assert_eq!(triangles.len(), 1);
    }
}
