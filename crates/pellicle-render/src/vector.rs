//! The few vectors that a picture needs, and the two functions of angles.
//!
//! Only `+ − × ÷` and square roots, which IEEE 754 rounds in one way everywhere: the sine of a platform's mathematics
//! library could move a vertex, and with it a byte of a picture.

/// A point or a direction in double precision.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + s·b.
pub(crate) fn add_scaled(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

pub(crate) fn scale(a: Vec3, s: f64) -> Vec3 {
    a.map(|x| x * s)
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// `a` at length 1, or nothing if its length is 0 or not an ordinary number.
pub(crate) fn normalized(a: Vec3) -> Option<Vec3> {
    // Scaled first, so that neither 1e-200 nor 1e200 is lost when squared.
    let largest = a.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) || a.iter().any(|x| x.is_nan()) {
        return None;
    }
    let a = a.map(|x| x / largest);
    Some(scale(a, 1.0 / length(a)))
}

/// Sine and cosine of an angle in degrees.
pub(crate) fn sin_cos(degrees: f64) -> (f64, f64) {
    // The nearest quarter turn goes by swaps and signs, the rest lies within 45 degrees: series.
    let quarters = (degrees / 90.0).round();
    let x = (degrees - quarters * 90.0) * (std::f64::consts::PI / 180.0);
    let (mut sin, mut cos) = (0.0, 0.0);
    let mut term = 1.0;
    for k in 0..20 {
        match k % 4 {
            0 => cos += term,
            1 => sin += term,
            2 => cos -= term,
            _ => sin -= term,
        }
        term *= x / f64::from(k + 1);
    }
    match quarters.rem_euclid(4.0) as i32 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_agree_with_the_platform_to_the_last_digits() {
        for degrees in [-720.5, -91.0, -45.0, 0.0, 1e-9, 30.0, 45.0, 60.0, 89.9, 90.0, 180.0, 271.3, 3600.0] {
            let (sin, cos) = sin_cos(degrees);
            let (s, c) = f64::to_radians(degrees).sin_cos();
            assert!((sin - s).abs() < 1e-14 && (cos - c).abs() < 1e-14, "{degrees}: {sin} {s}, {cos} {c}");
        }
        assert_eq!(sin_cos(90.0), (1.0, 0.0));
    }

    #[test]
    fn extremes_are_normalized_and_nothing_is_not() {
        assert_eq!(normalized([1e-200, 0.0, 0.0]), Some([1.0, 0.0, 0.0]));
        assert_eq!(normalized([0.0, -1e200, 0.0]), Some([0.0, -1.0, 0.0]));
        assert_eq!(normalized([0.0; 3]), None);
        assert_eq!(normalized([f64::NAN, 1.0, 0.0]), None);
        assert_eq!(normalized([f64::INFINITY, 1.0, 0.0]), None);
    }
}
