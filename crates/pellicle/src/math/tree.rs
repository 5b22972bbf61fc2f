//! Triangles in a tree of boxes: what is nearest, and how often the surface winds around a point.
//!
//! Source: Ericson, Real-time collision detection, 2005, section 5.1.5, for the closest point by regions; the count of crossings is
//! that of Hormann & Agathos, The point in polygon problem for arbitrary polygons, 2001, one dimension up.

use super::vector::{add_scaled, cross, dot, subtract};

/// A triangle's corners in the world.
pub(crate) type Triangle = [[f64; 3]; 3];

/// A box of triangles: a leaf holds them, another node is followed by its lower half.
#[derive(Debug, Clone)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// Of a leaf: first triangle. Else the node of the upper half.
    next: u32,
    /// Triangles of a leaf, 0 for other nodes.
    len: u32,
}

/// Triangles in a tree of boxes, halved at the median of the longest side.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    triangles: Vec<Triangle>,
}

/// Most triangles of a leaf.
const LEAF: usize = 4;

/// Nodes that wait while a tree is walked. It is balanced, so its depth is at most 32 halvings of 2³² triangles.
const STACK: usize = 64;

impl Tree {
    pub(crate) fn of(mut triangles: Vec<Triangle>) -> Self {
        let mut tree = Self { nodes: Vec::new(), triangles: Vec::new() };
        if !triangles.is_empty() {
            tree.build(&mut triangles, 0);
        }
        tree.triangles = triangles;
        tree
    }

    fn build(&mut self, triangles: &mut [Triangle], first: usize) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in triangles.iter().flatten() {
            for a in 0..3 {
                low[a] = low[a].min(corner[a]);
                high[a] = high[a].max(corner[a]);
            }
        }
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, next: first as u32, len: triangles.len() as u32 });
        if triangles.len() <= LEAF {
            return;
        }
        let side = subtract(high, low);
        let axis = (1..3).fold(0, |best, a| if side[a] > side[best] { a } else { best });
        let middle = |t: &Triangle| t[0][axis] + t[1][axis] + t[2][axis];
        let half = triangles.len() / 2;
        triangles.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        let (lower, upper) = triangles.split_at_mut(half);
        self.build(lower, first);
        (self.nodes[node].next, self.nodes[node].len) = (self.nodes.len() as u32, 0);
        self.build(upper, first + half);
    }

    /// Distance to the nearest triangle, whose number `last` becomes. Infinite without triangles.
    pub(crate) fn distance(&self, from: [f64; 3], last: &mut usize) -> f64 {
        let Some(triangle) = self.triangles.get(*last) else { return f64::INFINITY };
        let mut best = distance_sq(from, *triangle);
        self.nearer(from, &mut best, last);
        best.sqrt()
    }

    /// The nearest triangle closer than `limit`, and how far it is.
    pub(crate) fn nearest(&self, from: [f64; 3], limit: f64) -> Option<(f64, &Triangle)> {
        let (mut best, mut found) = (limit * limit, usize::MAX);
        if !self.nodes.is_empty() {
            self.nearer(from, &mut best, &mut found);
        }
        self.triangles.get(found).map(|triangle| (best.sqrt(), triangle))
    }

    /// Looks for triangles whose squared distance is less than `best`.
    fn nearer(&self, from: [f64; 3], best: &mut f64, found: &mut usize) {
        let mut stack = [(0u32, 0.0f64); STACK];
        let mut len = 1;
        stack[0] = (0, self.box_distance_sq(0, from));
        while len > 0 {
            len -= 1;
            let (index, bound) = stack[len];
            if bound >= *best {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.len > 0 {
                for i in node.next as usize..(node.next + node.len) as usize {
                    let distance = distance_sq(from, self.triangles[i]);
                    if distance < *best {
                        (*best, *found) = (distance, i);
                    }
                }
                continue;
            }
            let mut halves = [index + 1, node.next].map(|half| (half, self.box_distance_sq(half as usize, from)));
            if halves[0].1 < halves[1].1 {
                halves.swap(0, 1);
            }
            stack[len..len + 2].copy_from_slice(&halves);
            len += 2;
        }
    }

    fn box_distance_sq(&self, node: usize, from: [f64; 3]) -> f64 {
        let Node { low, high, .. } = &self.nodes[node];
        (0..3).map(|a| (low[a] - from[a]).max(from[a] - high[a]).max(0.0).powi(2)).sum()
    }

    /// Calls `work` with every triangle that comes nearer than `limit`.
    pub(crate) fn for_each_near<'a>(&'a self, from: [f64; 3], limit: f64, mut work: impl FnMut(&'a Triangle)) {
        self.walk(
            |tree, node| tree.box_distance_sq(node, from) < limit * limit,
            |triangle| {
                if distance_sq(from, *triangle) < limit * limit {
                    work(triangle);
                }
            },
        );
    }

    /// Whether a point is within the surface: along most of the three axes it has crossings of one direction more than of the
    /// other. Exact for closed meshes, whatever their orientation; small holes are outvoted. No point on the surface has a
    /// side to be relied on.
    pub(crate) fn contains(&self, point: [f64; 3]) -> bool {
        (0..3).filter(|&axis| self.windings(point, axis) != 0).count() >= 2
    }

    /// Crossings of the line from a point up an axis, those from within less those from without.
    fn windings(&self, point: [f64; 3], axis: usize) -> i32 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut count = 0;
        let is_met = |tree: &Self, node: usize| {
            let Node { low, high, .. } = &tree.nodes[node];
            high[axis] >= point[axis]
                && low[u] <= point[u]
                && point[u] <= high[u]
                && low[v] <= point[v]
                && point[v] <= high[v]
        };
        self.walk(is_met, |triangle| {
            let flat = triangle.map(|p| [p[u] - point[u], p[v] - point[v]]);
            let around = turns(flat);
            if around != 0 {
                let normal = cross(subtract(triangle[1], triangle[0]), subtract(triangle[2], triangle[0]));
                let above = dot(normal, subtract(triangle[0], point));
                count += around * i32::from(if normal[axis] > 0.0 { above > 0.0 } else { above < 0.0 });
            }
        });
        count
    }

    /// Where the line from a point along an axis first meets a triangle, as a share of `length`, which may be negative.
    pub(crate) fn first_hit(&self, from: [f64; 3], axis: usize, length: f64) -> Option<f64> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (low_end, high_end) = (from[axis].min(from[axis] + length), from[axis].max(from[axis] + length));
        let is_met = |tree: &Self, node: usize| {
            let Node { low, high, .. } = &tree.nodes[node];
            let is_beside = |a: usize| low[a] <= from[a] && from[a] <= high[a];
            high[axis] >= low_end && low[axis] <= high_end && is_beside(u) && is_beside(v)
        };
        let mut first: Option<f64> = None;
        self.walk(is_met, |triangle| {
            if turns(triangle.map(|p| [p[u] - from[u], p[v] - from[v]])) != 0 {
                let normal = cross(subtract(triangle[1], triangle[0]), subtract(triangle[2], triangle[0]));
                let share = dot(normal, subtract(triangle[0], from)) / (normal[axis] * length);
                if (0.0..=1.0).contains(&share) {
                    first = Some(first.map_or(share, |first| first.min(share)));
                }
            }
        });
        first
    }

    /// Calls `work` with the triangles of all leaves that are met.
    fn walk<'a>(&'a self, is_met: impl Fn(&Self, usize) -> bool, mut work: impl FnMut(&'a Triangle)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0u32; STACK];
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let index = stack[len];
            if !is_met(self, index as usize) {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.len > 0 {
                self.triangles[node.next as usize..(node.next + node.len) as usize].iter().for_each(&mut work);
                continue;
            }
            stack[len..len + 2].copy_from_slice(&[index + 1, node.next]);
            len += 2;
        }
    }
}

/// How often a triangle in the plane turns around the origin: 1, −1 or 0. A side counts where it passes the first axis from
/// below or from above; those that two triangles share are judged with the same numbers, so no point is lost between.
fn turns(corners: [[f64; 2]; 3]) -> i32 {
    let mut count = 0;
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        if (a[1] > 0.0) == (b[1] > 0.0) {
            continue;
        }
        // From the lower to the upper end, whichever comes first.
        let (low, high) = if a[1] > 0.0 { (b, a) } else { (a, b) };
        if low[0] * high[1] - high[0] * low[1] > 0.0 {
            count += if a[1] > 0.0 { -1 } else { 1 };
        }
    }
    count
}

/// The normal of a triangle's plane with its square, and the product with the way there, where a point is over the triangle.
#[inline(always)]
fn over(p: [f64; 3], [a, b, c]: Triangle) -> Option<([f64; 3], f64, f64)> {
    let (ab, ac, ap) = (subtract(b, a), subtract(c, a), subtract(p, a));
    let normal = cross(ab, ac);
    let size = dot(normal, normal);
    // Barycentric coordinates of the projection to the plane.
    let v = dot(cross(ap, ac), normal) / size;
    let w = dot(cross(ab, ap), normal) / size;
    (size > 0.0 && v >= 0.0 && w >= 0.0 && v + w <= 1.0).then(|| (normal, size, dot(ap, normal)))
}

/// Squared distance between two points.
fn apart_sq(p: [f64; 3], q: [f64; 3]) -> f64 {
    let d = subtract(p, q);
    dot(d, d)
}

/// Squared distance from a point to a triangle.
fn distance_sq(p: [f64; 3], triangle: Triangle) -> f64 {
    if let Some((_, size, height)) = over(p, triangle) {
        return height.powi(2) / size;
    }
    let [a, b, c] = triangle;
    let to = |q: [f64; 3], r: [f64; 3]| apart_sq(p, on_side(p, q, r));
    to(a, b).min(to(b, c)).min(to(c, a))
}

/// The point of a triangle closest to `p`, and whether it is within the triangle, not on a side.
pub(crate) fn closest(p: [f64; 3], triangle: Triangle) -> ([f64; 3], bool) {
    if let Some((normal, size, height)) = over(p, triangle) {
        return (add_scaled(p, normal, -height / size), true);
    }
    let [a, b, c] = triangle;
    let sides = [on_side(p, a, b), on_side(p, b, c), on_side(p, c, a)];
    let nearest = sides.into_iter().min_by(|q, r| apart_sq(p, *q).total_cmp(&apart_sq(p, *r)));
    (nearest.unwrap_or(a), false)
}

/// The point of a side closest to `p`.
fn on_side(p: [f64; 3], q: [f64; 3], r: [f64; 3]) -> [f64; 3] {
    let (side, from) = (subtract(r, q), subtract(p, q));
    let size = dot(side, side);
    let t = if size > 0.0 { (dot(from, side) / size).clamp(0.0, 1.0) } else { 0.0 };
    add_scaled(q, side, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube from 0 to 1, each side two triangles.
    fn cube() -> Vec<Triangle> {
        let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|v| v as f64);
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c].map(corner), [a, c, d].map(corner)]).collect()
    }

    #[test]
    fn inside_is_told_also_below_edges_and_corners() {
        let tree = Tree::of(cube());
        // On the diagonals of the sides, and in line with edges and corners of the triangles.
        for t in [0.25, 0.5, 0.75] {
            for inside in [[t; 3], [t, t, 0.5], [t, 1.0 - t, 0.3]] {
                assert!(tree.contains(inside), "{inside:?}");
            }
        }
        for outside in
            [[1.5, 0.5, 0.5], [-0.5, -0.5, -0.5], [0.0, 0.0, 2.0], [1.0, 1.0, -1.0], [0.5, 2.0, 0.5], [-1.0, 0.0, 0.0]]
        {
            assert!(!tree.contains(outside), "{outside:?}");
        }
        // Turned inside out, and with a triangle missing.
        let flipped = cube().into_iter().map(|[a, b, c]| [a, c, b]).collect();
        assert!(Tree::of(flipped).contains([0.4; 3]));
        let mut torn = cube();
        torn.remove(2);
        assert!(Tree::of(torn.clone()).contains([0.4, 0.6, 0.5]) && Tree::of(torn).windings([0.4, 0.6, 0.5], 0) == 0);
    }

    #[test]
    fn the_nearest_triangle_and_its_closest_point() {
        let tree = Tree::of(cube());
        let Some((far, triangle)) = tree.nearest([0.3, 0.4, 1.25], 1.0) else { panic!("one is near") };
        assert!((far - 0.25).abs() < 1e-15);
        let (at, is_within) = closest([0.3, 0.4, 1.25], *triangle);
        assert!(is_within && at == [0.3, 0.4, 1.0]);
        assert!(tree.nearest([0.3, 0.4, 1.25], 0.25).is_none());
        assert_eq!(closest([2.0, 2.0, 2.0], [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]), ([1.0, 1.0, 0.0], false));
        assert!((tree.distance([0.5, 0.5, 3.0], &mut 0) - 2.0).abs() < 1e-15);
        assert_eq!(tree.first_hit([0.3, 0.4, 0.75], 2, 0.5), Some(0.5));
        assert_eq!(tree.first_hit([0.3, 0.4, 1.5], 2, -2.0), Some(0.25));
        assert_eq!(tree.first_hit([0.3, 0.4, 1.5], 2, 2.0), None);
        assert!(Tree::of(Vec::new()).nearest([0.0; 3], 1.0).is_none());
        let mut near = 0;
        tree.for_each_near([0.5, 0.5, 0.9], 0.2, |_| near += 1);
        assert_eq!(near, 2);
    }

    #[test]
    fn the_tree_finds_what_a_search_through_all_triangles_finds() {
        let corner = |i: usize, k: usize| [37, 53, 29].map(|m| (i * m * (k + 3) % 97) as f64 * 0.01);
        let mut triangles: Vec<Triangle> = (0..300).map(|i| [0, 1, 2].map(|k| corner(i, k))).collect();
        // Degenerate ones are segments.
        triangles.push([corner(0, 0), corner(0, 0), corner(5, 0)]);
        let tree = Tree::of(triangles);
        let mut last = 0;
        for i in 0..400 {
            let p = [37, 53, 29].map(|k| f64::from(i * k % 101) / 50.0 - 0.5);
            let all = tree.triangles.iter().map(|&t| distance_sq(p, t)).fold(f64::INFINITY, f64::min).sqrt();
            // Boxes are judged with roundings of their own.
            assert!((tree.distance(p, &mut last) - all).abs() < 1e-12, "{p:?}");
            assert!(tree.nearest(p, 9.0).is_some_and(|found| (found.0 - all).abs() < 1e-12), "{p:?}");
        }
    }

    #[test]
    fn the_closest_point_is_right_over_every_region_of_a_triangle() {
        let triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        for (point, distance) in [
            ([1.0, 1.0, 2.0], 2.0),
            ([-3.0, -4.0, 0.0], 5.0),
            ([2.0, -1.0, 0.0], 1.0),
            ([7.0, -4.0, 0.0], 5.0),
            ([-2.0, 1.0, 0.0], 2.0),
            ([0.0, 5.0, 0.0], 2.0),
            // Over the longest side: 3x + 4y = 12.
            ([4.0, 3.0, 0.0], 2.4),
        ] {
            assert!((distance_sq(point, triangle).sqrt() - distance).abs() < 1e-12, "{point:?}");
        }
    }
}
