//! The largest real part of the eigenvalues of 3×3 matrices that need not be symmetric, 16 at a time, by nothing but
//! correctly rounded operations.
//!
//! With τ a third of the trace and D = J − τ the eigenvalues are τ + t, where t³ + p t + q = 0, p = −½ tr D², q = −det D.
//! One root is real for certain: the one on the side of −q, farthest out. A start beyond it is √(−p)₊ + 1.16 c, where
//! c = |q|^(21/64), made of square roots, is within 15 % of the cube root for 1e-12 < |q| < 1e12. From there Newton's
//! iteration falls to the root without ever passing it, for the cubic is convex there; the derivative at the root is at
//! least 2 t², or p, so it never divides by next to nothing, and a fixed number of steps is enough. The other two roots are
//! −t/2 ± √(−p − ¾ t²): a pair of real ones or of complex ones. The largest real part is continuous throughout: where
//! the pair turns complex the root is 0.
//!
//! Source: this project; the depressed cubic is Cardano's.

use super::simd::Simd;

/// A 3×3 matrix in each lane, row by row.
pub(crate) type Matrix<F> = [[F; 3]; 3];

/// Steps of Newton's iteration. After five the error is below a rounding of `f32` relative to the root.
const STEPS: usize = 6;

/// The largest real part, and what its derivative is made of.
#[derive(Clone, Copy)]
pub(crate) struct Largest<F> {
    /// The largest real part.
    pub(crate) value: F,
    /// J less a third of its trace.
    deviator: Matrix<F>,
    p: F,
    /// The real root that the value follows.
    root: F,
    /// How the value follows it: 1, or −½ for the real part of a complex pair.
    rate: F,
}

/// a·b − c·d.
#[inline(always)]
fn cross<S: Simd>(s: S, a: S::F, b: S::F, c: S::F, d: S::F) -> S::F {
    s.sub(s.mul(a, b), s.mul(c, d))
}

/// Cofactors of a matrix: the derivatives of its determinant.
#[inline(always)]
fn cofactors<S: Simd>(s: S, m: &Matrix<S::F>) -> Matrix<S::F> {
    // Written out: the array's own functions need not be inlined, and then run without the vector unit.
    let mut to = *m;
    for i in 0..3 {
        for j in 0..3 {
            let (r, t) = ((i + 1) % 3, (i + 2) % 3);
            let (u, v) = ((j + 1) % 3, (j + 2) % 3);
            to[i][j] = cross(s, m[r][u], m[t][v], m[r][v], m[t][u]);
        }
    }
    to
}

/// The largest real part of the eigenvalues of `j`.
#[inline(always)]
pub(crate) fn largest_real_part<S: Simd>(s: S, j: &Matrix<S::F>) -> Largest<S::F> {
    let zero = s.splat(0.0);
    let third = s.mul(s.splat(1.0 / 3.0), s.add(s.add(j[0][0], j[1][1]), j[2][2]));
    let mut d = *j;
    for a in 0..3 {
        d[a][a] = s.sub(d[a][a], third);
    }
    // −½ tr D², as squares and products of pairs.
    let squares = s.add(s.add(s.mul(d[0][0], d[0][0]), s.mul(d[1][1], d[1][1])), s.mul(d[2][2], d[2][2]));
    let pairs = s.add(s.add(s.mul(d[0][1], d[1][0]), s.mul(d[0][2], d[2][0])), s.mul(d[1][2], d[2][1]));
    let p = s.sub(zero, s.add(s.mul(s.splat(0.5), squares), pairs));
    let determinant = s.add(
        s.add(
            s.mul(d[0][0], cross(s, d[1][1], d[2][2], d[1][2], d[2][1])),
            s.mul(d[0][1], cross(s, d[1][2], d[2][0], d[1][0], d[2][2])),
        ),
        s.mul(d[0][2], cross(s, d[1][0], d[2][1], d[1][1], d[2][0])),
    );
    // Mirrored so that the root is not negative.
    let is_mirrored = s.gt(zero, determinant);
    let size = s.max(determinant, s.sub(zero, determinant));
    let outer = newton(s, p, size);
    let single = s.select(is_mirrored, s.sub(zero, outer), outer);
    let middle = s.mul(s.splat(-0.5), single);
    let under = s.sub(s.sub(zero, p), s.mul(s.splat(0.75), s.mul(single, single)));
    let pair = s.add(middle, s.sqrt(s.max(under, zero)));
    let from_pair = s.gt(pair, single);
    let is_complex = s.gt(zero, under) & from_pair;
    let most = s.select(from_pair, pair, single);
    Largest {
        value: s.add(third, most),
        deviator: d,
        p,
        root: s.select(is_complex, single, most),
        rate: s.select(is_complex, s.splat(-0.5), s.splat(1.0)),
    }
}

/// The largest root of t³ + p t − size, size ≥ 0.
#[inline(always)]
fn newton<S: Simd>(s: S, p: S::F, size: S::F) -> S::F {
    let tiny = s.splat(1e-30);
    let quarter = s.sqrt(s.sqrt(s.max(size, tiny)));
    let sixteenth = s.sqrt(s.sqrt(quarter));
    let sixty_fourth = s.sqrt(s.sqrt(sixteenth));
    let cube_root = s.mul(s.splat(1.16), s.mul(s.mul(quarter, sixteenth), sixty_fourth));
    let mut t = s.add(s.sqrt(s.max(s.sub(s.splat(0.0), p), s.splat(0.0))), cube_root);
    for _ in 0..STEPS {
        // t − (t³ + p t − size)/(3 t² + p) = (2 t³ + size)/(3 t² + p).
        let sq = s.mul(t, t);
        let above = s.add(s.mul(s.mul(s.splat(2.0), sq), t), size);
        let below = s.max(s.add(s.mul(s.splat(3.0), sq), p), tiny);
        t = s.div(above, below);
    }
    t
}

impl<F: Copy> Largest<F> {
    /// Its derivatives by the entries of J. Where a root is double there are none: those of τ alone.
    #[inline(always)]
    pub(crate) fn derivatives<S: Simd<F = F>>(&self, s: S) -> Matrix<F> {
        let (zero, third) = (s.splat(0.0), s.splat(1.0 / 3.0));
        let root_sq = s.mul(self.root, self.root);
        let slope = s.add(s.mul(s.splat(3.0), root_sq), self.p);
        let size = s.max(slope, s.sub(zero, slope));
        let is_simple = s.gt(size, s.mul(s.splat(1e-4), s.max(root_sq, s.splat(1e-6))));
        let scale = s.select(is_simple, s.div(self.rate, s.select(is_simple, slope, s.splat(1.0))), zero);
        let cofactors = cofactors(s, &self.deviator);
        // With D traceless the trace of its cofactors is p.
        let on_diagonal = s.mul(third, s.sub(s.splat(1.0), s.mul(scale, self.p)));
        let mut to = cofactors;
        for a in 0..3 {
            for b in 0..3 {
                let entry = s.mul(scale, s.add(s.mul(self.root, self.deviator[b][a]), cofactors[a][b]));
                to[a][b] = if a == b { s.add(entry, on_diagonal) } else { entry };
            }
        }
        to
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::Portable;

    fn value(j: [[f64; 3]; 3]) -> f64 {
        f64::from(largest_real_part(Portable, &j.map(|row| row.map(|v| [v as f32; 16]))).value[7])
    }

    /// The largest real part in double precision, by bisection for one real root.
    fn reference(j: [[f64; 3]; 3]) -> f64 {
        let trace = j[0][0] + j[1][1] + j[2][2];
        let minor = |a: usize, b: usize| j[a][a] * j[b][b] - j[a][b] * j[b][a];
        let second = minor(0, 1) + minor(0, 2) + minor(1, 2);
        let det = (0..3)
            .map(|c| j[0][c] * (j[1][(c + 1) % 3] * j[2][(c + 2) % 3] - j[1][(c + 2) % 3] * j[2][(c + 1) % 3]))
            .sum::<f64>();
        let polynomial = |t: f64| ((t - trace) * t + second) * t - det;
        let bound = 1.0 + trace.abs().max(second.abs()).max(det.abs());
        let (mut low, mut high) = (-bound, bound);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            *(if polynomial(middle) < 0.0 { &mut low } else { &mut high }) = middle;
        }
        let (sum, product) = (trace - low, second - low * (trace - low));
        low.max(0.5 * sum + (0.25 * sum * sum - product).max(0.0).sqrt())
    }

    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f64 / f64::from(1 << 23) - 1.0
    }

    #[test]
    fn known_matrices() {
        let diagonal = |a, b, c| [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]];
        for (a, b, c) in [(1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (-1.0, -2.0, -2.0), (0.0, 0.0, 3.5)] {
            assert!((value(diagonal(a, b, c)) - f64::max(a, f64::max(b, c))).abs() < 1e-5, "{a} {b} {c}");
        }
        // A turn about z with growth 0.3, and decay along z: the pair is complex.
        assert!((value([[0.3, -2.0, 0.0], [2.0, 0.3, 0.0], [0.0, 0.0, -1.0]]) - 0.3).abs() < 1e-5);
    }

    #[test]
    fn random_matrices_of_every_size_agree_with_bisection() {
        let mut state = 1;
        for i in 0..20_000 {
            let size = 10f64.powi(i % 7 - 3);
            let base = if i % 3 == 0 { 1.0 } else { 0.0 };
            let j: [[f64; 3]; 3] = std::array::from_fn(|a| {
                std::array::from_fn(|b| f64::from((size * random(&mut state) + if a == b { base } else { 0.0 }) as f32))
            });
            let (found, want) = (value(j), reference(j));
            // A double root costs half of the digits.
            assert!((found - want).abs() < 2e-3 * size + 2e-6, "{j:?}: {found}, {want}");
        }
    }

    #[test]
    fn it_is_continuous_where_roots_meet() {
        // Along this path two roots meet, turn complex, and the real one takes over.
        let at = |t: f64| value([[0.5, t, 0.0], [-1.0 + 0.1 * t, 0.5, 0.2], [0.1, 0.0, 0.5 + 0.2 * t]]);
        for i in -4000..4000 {
            let t = f64::from(i) * 5e-4;
            // A root of the step is the most that a square root's end can make.
            assert!((at(t + 1e-4) - at(t)).abs() < 0.02, "{t}: {} {}", at(t), at(t + 1e-4));
        }
    }

    #[test]
    fn derivatives_are_finite_differences() {
        let mut state = 5;
        let mut seen = [0; 2];
        for _ in 0..500 {
            let j: Matrix<f64> = std::array::from_fn(|_| std::array::from_fn(|_| random(&mut state)));
            let found = largest_real_part(Portable, &j.map(|row| row.map(|v| [v as f32; 16])));
            let derivatives = found.derivatives(Portable);
            seen[usize::from(found.rate[0] < 0.0)] += 1;
            for a in 0..3 {
                for b in 0..3 {
                    let moved = |by: f64| {
                        let mut moved = j;
                        moved[a][b] += by;
                        reference(moved)
                    };
                    let want = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                    let exact = f64::from(derivatives[a][b][0]);
                    assert!(
                        (exact - want).abs() < 2e-3 * (1.0 + want.abs() * want.abs()),
                        "{j:?} {a}{b}: {exact} {want}"
                    );
                }
            }
        }
        assert!(seen[0] > 50 && seen[1] > 50, "{seen:?}");
    }
}
