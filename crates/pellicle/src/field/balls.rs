//! Inverse-square metaballs as a function: Σ r_j²/d² with a radius for each ball, culled by a tree of bounding spheres.
//!
//! ```text
//! f(x) = Σ_j s · r_j² (1/d_j² − 1/R_j²) where d_j < R_j,    R_j = reach · r_j,    s = 1 / (1 − 1/reach²)
//! ```
//!
//! The talk's sum has no end, so that every ball would count everywhere. Cut off at R_j, and shifted so that it does not jump
//! there, it has; the factor s keeps a lone ball's radius at r_j for the isovalue 1. With a reach of 3 to 6 radii a
//! handful of balls count at a point. Near a centre the value is bounded by taking d at least r_j/1000.
//!
//! A sphere of the tree holds the reach of all balls below it. Balls are summed in the tree's order, and one out of reach is
//! worth exactly 0: whatever is culled for many points together, or one by one, the value has the same bits.
//!
//! Source: Uralsky, Practical metaballs and implicit surfaces, 2006 (the sum, its gradient, the tree of bounding
//! spheres); cut-off and factor are this project's.

use crate::{Error, Function};

/// Balls and their tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Metaballs {
    nodes: Vec<Node>,
    balls: Vec<Ball>,
    reach: f64,
    factor: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Ball {
    centre: [f64; 3],
    radius_sq: f64,
    reach_sq: f64,
}

/// A leaf holds balls `next..next + len`; another node, with `len` 0, is followed by its lower half, and `next` is the upper.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    centre: [f64; 3],
    radius: f64,
    next: u32,
    len: u32,
}

/// Most balls of a leaf.
const LEAF: usize = 4;
/// Enough for a balanced tree of 2³² balls.
const MOST_DEPTH: usize = 64;

impl Metaballs {
    /// Balls by centre and radius, each with a reach of so many radii, which must be more than 1.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a centre that is not finite, [`Error::Parameter`] for a radius or a reach out of range,
    /// [`Error::Length`] when there are not as many radii as centres.
    pub fn new(centres: &[[f32; 3]], radii: &[f32], reach: f64) -> Result<Self, Error> {
        if radii.len() != centres.len() {
            return Err(Error::Length { what: "the radii".into(), found: radii.len(), expected: centres.len() });
        }
        if !(reach.is_finite() && reach > 1.0) {
            return Err(Error::Parameter {
                name: "reach",
                value: reach,
                must: "a finite number of radii greater than 1",
            });
        }
        let mut balls = Vec::with_capacity(centres.len());
        for (index, (centre, &radius)) in centres.iter().zip(radii).enumerate() {
            let (centre, radius) = (centre.map(f64::from), f64::from(radius));
            if !centre.iter().all(|v| v.is_finite()) {
                return Err(Error::NotFinite { index, position: centre });
            }
            if !(radius.is_finite() && radius > 0.0) {
                return Err(Error::Parameter { name: "radius", value: radius, must: "a finite number greater than 0" });
            }
            balls.push(Ball { centre, radius_sq: radius * radius, reach_sq: (reach * radius).powi(2) });
        }
        let mut tree =
            Self { nodes: Vec::new(), balls: Vec::new(), reach, factor: 1.0 / (1.0 - 1.0 / (reach * reach)) };
        if !balls.is_empty() {
            tree.build(&mut balls, 0);
        }
        tree.balls = balls;
        Ok(tree)
    }

    /// Number of balls.
    pub fn len(&self) -> usize {
        self.balls.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.balls.is_empty()
    }

    /// A box that holds all of the surface for every isovalue above 0, if there are balls: beyond their reach the value is 0.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let root = self.nodes.first()?;
        let mut found = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for ball in &self.balls {
            for a in 0..3 {
                found[0][a] = found[0][a].min(ball.centre[a] - ball.reach_sq.sqrt()).max(root.centre[a] - root.radius);
                found[1][a] = found[1][a].max(ball.centre[a] + ball.reach_sq.sqrt()).min(root.centre[a] + root.radius);
            }
        }
        Some(found)
    }

    /// Spheres of the tree and balls that are looked at for one point: what culling leaves of them.
    pub fn visits(&self, at: [f64; 3]) -> (usize, usize) {
        let (mut spheres, mut balls) = (0, 0);
        self.visit(at, 0.0, &mut spheres, |range| balls += range.len());
        (spheres, balls)
    }

    fn build(&mut self, balls: &mut [Ball], first: usize) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for ball in balls.iter() {
            for a in 0..3 {
                low[a] = low[a].min(ball.centre[a]);
                high[a] = high[a].max(ball.centre[a]);
            }
        }
        let centre = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
        let radius = balls.iter().fold(0.0f64, |r, b| r.max(distance_sq(b.centre, centre).sqrt() + b.reach_sq.sqrt()));
        let node = self.nodes.len();
        // A little more than rounding may take away.
        let radius = radius * (1.0 + 1e-12);
        self.nodes.push(Node { centre, radius, next: first as u32, len: balls.len() as u32 });
        if balls.len() <= LEAF {
            return;
        }
        let axis = (1..3).fold(0, |best, a| if high[a] - low[a] > high[best] - low[best] { a } else { best });
        let half = balls.len() / 2;
        balls.select_nth_unstable_by(half, |a, b| a.centre[axis].total_cmp(&b.centre[axis]));
        let (lower, upper) = balls.split_at_mut(half);
        self.build(lower, first);
        (self.nodes[node].next, self.nodes[node].len) = (self.nodes.len() as u32, 0);
        self.build(upper, first + half);
    }

    /// Calls `work` with the leaves' ranges of balls that may reach a sphere, in order.
    #[inline]
    fn visit(&self, centre: [f64; 3], radius: f64, spheres: &mut usize, mut work: impl FnMut(std::ops::Range<usize>)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0u32; MOST_DEPTH];
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let index = stack[len];
            let node = &self.nodes[index as usize];
            *spheres += 1;
            if distance_sq(centre, node.centre) > (node.radius + radius).powi(2) {
                continue;
            }
            if node.len > 0 {
                work(node.next as usize..(node.next + node.len) as usize);
            } else {
                (stack[len], stack[len + 1]) = (node.next, index + 1);
                len += 2;
            }
        }
    }

    #[inline]
    fn add(&self, ball: &Ball, at: [f64; 3], sum: &mut f64) {
        let dist_sq = distance_sq(at, ball.centre);
        if dist_sq < ball.reach_sq {
            let near = dist_sq.max(1e-6 * ball.radius_sq);
            *sum += self.factor * ball.radius_sq * (1.0 / near - 1.0 / ball.reach_sq);
        }
    }
}

#[inline]
fn distance_sq(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)
}

impl Function for Metaballs {
    fn value(&self, at: [f64; 3]) -> f64 {
        let mut sum = 0.0;
        self.visit(at, 0.0, &mut 0, |range| self.balls[range].iter().for_each(|ball| self.add(ball, at, &mut sum)));
        sum
    }

    fn values(&self, at: &[[f64; 3]], to: &mut [f64]) {
        // One walk of the tree for all points; those of a brick are close together.
        let n = at.len().max(1) as f64;
        let centre: [f64; 3] = std::array::from_fn(|a| at.iter().map(|p| p[a]).sum::<f64>() / n);
        let radius = at.iter().fold(0.0f64, |r, p| r.max(distance_sq(*p, centre))).sqrt();
        to.fill(0.0);
        // Points that are not finite leave the sphere without a size; one by one they are merely out of reach.
        if !radius.is_finite() {
            at.iter().zip(to).for_each(|(&p, to)| *to = self.value(p));
            return;
        }
        self.visit(centre, radius * (1.0 + 1e-12), &mut 0, |range| {
            for ball in &self.balls[range] {
                at.iter().zip(to.iter_mut()).for_each(|(&p, to)| self.add(ball, p, to));
            }
        });
    }

    fn gradient(&self, at: [f64; 3], _: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.visit(at, 0.0, &mut 0, |range| {
            for ball in &self.balls[range] {
                let dist_sq = distance_sq(at, ball.centre);
                if dist_sq < ball.reach_sq {
                    let near = dist_sq.max(1e-6 * ball.radius_sq);
                    let slope = -2.0 * self.factor * ball.radius_sq / (near * near);
                    (0..3).for_each(|a| sum[a] += slope * (at[a] - ball.centre[a]));
                }
            }
        });
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(n: usize) -> Metaballs {
        let at = |i: usize, k: usize, m: usize| (i * k % m) as f32 / m as f32 * 10.0;
        let centres: Vec<[f32; 3]> = (0..n).map(|i| [at(i, 37, 101), at(i, 53, 97), at(i, 29, 89)]).collect();
        let radii: Vec<f32> = (0..n).map(|i| 0.1 + (i % 7) as f32 * 0.05).collect();
        Metaballs::new(&centres, &radii, 4.0).expect("good")
    }

    #[test]
    fn a_lone_ball_has_its_radius() {
        let ball = Metaballs::new(&[[1.0, 2.0, 3.0]], &[0.5], 3.0).expect("good");
        assert!((ball.value([1.5, 2.0, 3.0]) - 1.0).abs() < 1e-12);
        assert_eq!(ball.value([2.6, 2.0, 3.0]), 0.0);
        assert!(ball.value([1.0, 2.0, 3.0]).is_finite());
    }

    #[test]
    fn the_tree_sums_what_the_plain_sum_sums() {
        let balls = scattered(300);
        for i in 0..200 {
            let p = [41, 67, 83].map(|k| f64::from(i * k % 103) / 103.0 * 12.0 - 1.0);
            let mut plain = 0.0;
            balls.balls.iter().for_each(|ball| balls.add(ball, p, &mut plain));
            assert_eq!(balls.value(p), plain);
            let (spheres, looked_at) = balls.visits(p);
            assert!(spheres < 150 && looked_at < 150, "{spheres} {looked_at}");
        }
    }

    #[test]
    fn many_points_at_once_are_the_same_to_the_last_bit() {
        let balls = scattered(120);
        let points: Vec<[f64; 3]> =
            (0..64).map(|n| [n & 3, n >> 2 & 3, n >> 4].map(|v| 3.0 + 0.2 * v as f64)).collect();
        let mut values = vec![0.0; 64];
        balls.values(&points, &mut values);
        for (p, value) in points.iter().zip(values) {
            assert_eq!(balls.value(*p), value);
        }
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let balls = scattered(50);
        for p in [[2.0, 3.0, 4.0], [5.5, 5.1, 4.9], [8.0, 1.0, 2.0]] {
            let function = |p: [f64; 3]| balls.value(p);
            let (exact, found) = (balls.gradient(p, 0.0), function.gradient(p, 1e-5));
            for a in 0..3 {
                assert!((exact[a] - found[a]).abs() < 1e-6 * exact[a].abs().max(1.0), "{exact:?} {found:?}");
            }
        }
    }

    #[test]
    fn bad_balls_are_refused() {
        assert!(matches!(Metaballs::new(&[[0.0; 3]], &[], 3.0), Err(Error::Length { .. })));
        assert!(matches!(Metaballs::new(&[[f32::NAN; 3]], &[1.0], 3.0), Err(Error::NotFinite { index: 0, .. })));
        assert!(matches!(Metaballs::new(&[[0.0; 3]], &[0.0], 3.0), Err(Error::Parameter { name: "radius", .. })));
        assert!(matches!(Metaballs::new(&[[0.0; 3]], &[1.0], 1.0), Err(Error::Parameter { name: "reach", .. })));
        let none = Metaballs::new(&[], &[], 3.0).expect("none is fine");
        assert!(none.is_empty() && none.bounds().is_none() && none.value([0.0; 3]) == 0.0);
    }
}
