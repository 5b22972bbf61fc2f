//! Eigenvalues and eigenvectors of symmetric 3×3 matrices, by a fixed number of sweeps, and cube roots: nothing but correctly
//! rounded operations, so that the bytes are the same on every machine.
//!
//! Source: Jacobi 1846, in the cyclic form of Golub & Van Loan, Matrix Computations, section 8.5; Newton's iteration for the cube
//! root.

/// A symmetric matrix, row by row.
pub(crate) type Symmetric = [[f64; 3]; 3];

/// Sweeps over the three entries off the diagonal. They vanish quadratically; after five they are below a rounding.
const SWEEPS: usize = 6;

/// Eigenvalues, largest first, and the eigenvectors that belong to them, of length 1.
pub(crate) fn eigen(mut a: Symmetric) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut vectors, p, q);
        }
    }
    let values = [a[0][0], a[1][1], a[2][2]];
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| values[j].total_cmp(&values[i]));
    (order.map(|i| values[i]), order.map(|i| vectors[i]))
}

/// Turns axes p and q such that the entry between them vanishes; rows of `vectors` turn along.
fn rotate(a: &mut Symmetric, vectors: &mut [[f64; 3]; 3], p: usize, q: usize) {
    let between = a[p][q];
    if between == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * between);
    let size = theta.abs() + (theta * theta + 1.0).sqrt();
    let tangent = if theta < 0.0 { -1.0 / size } else { 1.0 / size };
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    let sine = tangent * cosine;
    a[p][p] -= tangent * between;
    a[q][q] += tangent * between;
    (a[p][q], a[q][p]) = (0.0, 0.0);
    let r = 3 - p - q;
    let (of_p, of_q) = (a[r][p], a[r][q]);
    a[r][p] = cosine * of_p - sine * of_q;
    a[r][q] = sine * of_p + cosine * of_q;
    (a[p][r], a[q][r]) = (a[r][p], a[r][q]);
    for i in 0..3 {
        let (of_p, of_q) = (vectors[p][i], vectors[q][i]);
        vectors[p][i] = cosine * of_p - sine * of_q;
        vectors[q][i] = sine * of_p + cosine * of_q;
    }
}

/// The cube root of an ordinary number greater than 0.
pub(crate) fn cube_root(v: f64) -> f64 {
    // A third of the exponent, to within a tenth of the root.
    let mut root = f64::from_bits(v.to_bits() / 3 + 0x2a9f_7893_782d_a1ce);
    for _ in 0..5 {
        root -= (root - v / (root * root)) / 3.0;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_vectors_make_the_matrix_again() {
        let mut state = 9u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        for i in 0..1000 {
            let scale = 10f64.powi(i % 9 - 4);
            let [a, b, c, d, e, f] = std::array::from_fn(|_| scale * next());
            let matrix = [[a, b, c], [b, d, e], [c, e, f]];
            let (values, vectors) = eigen(matrix);
            assert!(values[0] >= values[1] && values[1] >= values[2]);
            for r in 0..3 {
                for s in 0..3 {
                    let again: f64 = (0..3).map(|k| values[k] * vectors[k][r] * vectors[k][s]).sum();
                    assert!((again - matrix[r][s]).abs() < 1e-13 * scale, "{matrix:?}: {again} at {r} {s}");
                    let product: f64 = (0..3).map(|k| vectors[r][k] * vectors[s][k]).sum();
                    assert!((product - f64::from(u8::from(r == s))).abs() < 1e-13, "{vectors:?}");
                }
            }
        }
    }

    #[test]
    fn cube_roots_are_cube_roots() {
        for i in -300..300 {
            let v = 1.37 * 10f64.powi(i);
            let root = cube_root(v);
            assert!((root * root * root / v - 1.0).abs() < 1e-15 * 8.0, "{v}: {root}");
        }
    }
}
