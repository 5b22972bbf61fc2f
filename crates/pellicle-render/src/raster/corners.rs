//! Vertices in the picture, and the triangles that must be cut before they can be there.
//!
//! A vertex behind the camera has no place in the picture, one far outside none that fits. Triangles with such a corner are
//! cut by the near plane and by a guard band around the picture, when they are met: they are few, so nothing is stored.

use crate::raster::SUBPIXELS;
use crate::vector::{Vec3, add_scaled, sub};
use crate::view::View;

/// A vertex in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    /// From the picture's left border in 1/256 pixel, below 2^23 in size; or [`FAR`] or [`INVALID`].
    pub x: i32,
    /// From the picture's upper border, likewise.
    pub y: i32,
    /// Larger is nearer; see [`View::key`].
    pub key: f32,
}

/// Behind the near plane or outside of the guard band.
const FAR: i32 = i32::MIN;
/// Not a number.
const INVALID: i32 = i32::MIN + 1;

/// Half of the guard band's edge in pixels, from the middle of the picture. With half a picture (8192) it stays below
/// 2^15 pixels, so products of two differences stay below 2^49: exact in `f64`.
const GUARD: f64 = 24_000.0;

/// Added before rounding by truncation: coordinates become positive.
const BIAS: i32 = 1 << 24;

impl Corner {
    /// The corner of a view point.
    #[inline(always)]
    pub fn of(view: &View, v: Vec3) -> Self {
        let [x, y] = view.screen(v);
        let inside = (x - view.centre[0]).abs() <= GUARD && (y - view.centre[1]).abs() <= GUARD;
        if v[2] > view.near && inside {
            Self::at(x, y, view.key(v[2]))
        } else {
            let valid = v.iter().all(|x| x.is_finite());
            Self { x: if valid { FAR } else { INVALID }, y: 0, key: 0.0 }
        }
    }

    #[inline(always)]
    fn at(x: f64, y: f64, key: f32) -> Self {
        // Within the guard band, so the sum is positive and far from the limits of i32.
        let snap = |x: f64| (x * f64::from(SUBPIXELS) + (f64::from(BIAS) + 0.5)) as i32 - BIAS;
        Self { x: snap(x), y: snap(y), key }
    }
}

/// Calls `emit` with the triangle as it is in the picture: once where nothing must be cut. `at` gives view points.
#[inline(always)]
pub(crate) fn pieces(
    view: &View,
    corners: &[Corner],
    triangle: [u32; 3],
    at: impl Fn(u32) -> Vec3,
    mut emit: impl FnMut([Corner; 3]),
) {
    let flat = triangle.map(|v| corners[v as usize]);
    // Both special values are far below every coordinate.
    if flat.iter().all(|c| c.x > INVALID) {
        emit(flat);
    } else if flat.iter().all(|c| c.x != INVALID) {
        cut(view, triangle.map(at), &mut emit);
    }
}

/// Distances from the planes that bound what can be in the picture; inside is at least 0.
fn distance(view: &View, plane: usize, v: Vec3) -> f64 {
    let reach = GUARD / view.scale * if view.perspective { v[2] } else { 1.0 };
    match plane {
        0 if view.perspective => v[2] - view.near * (1.0 + 1e-9),
        0 => 1.0,
        1 => reach - v[0],
        2 => reach + v[0],
        3 => reach - v[1],
        _ => reach + v[1],
    }
}

/// Sutherland and Hodgman, "Reentrant polygon clipping", 1974.
#[cold]
fn cut(view: &View, triangle: [Vec3; 3], emit: &mut impl FnMut([Corner; 3])) {
    let mut polygon = triangle.to_vec();
    let mut next = Vec::with_capacity(8);
    for plane in 0..5 {
        next.clear();
        for i in 0..polygon.len() {
            let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (da, db) = (distance(view, plane, a), distance(view, plane, b));
            if da >= 0.0 {
                next.push(a);
            }
            // From the inner end to the outer one: the neighbour across this edge gets the same point.
            if (da >= 0.0) != (db >= 0.0) {
                let (inner, outer, d_in, d_out) = if da >= 0.0 { (a, b, da, db) } else { (b, a, db, da) };
                next.push(add_scaled(inner, d_in / (d_in - d_out), sub(outer, inner)));
            }
        }
        std::mem::swap(&mut polygon, &mut next);
    }
    let corners: Vec<Corner> = polygon.iter().map(|&v| cut_corner(view, v)).collect();
    for i in 2..corners.len() {
        emit([corners[0], corners[i - 1], corners[i]]);
    }
}

/// A corner on a plane may lie a rounding error outside: it is moved onto it.
fn cut_corner(view: &View, v: Vec3) -> Corner {
    let depth = if view.perspective { v[2].max(view.near) } else { v[2] };
    let [x, y] = view.screen([v[0], v[1], depth]);
    let within = |x: f64, centre: f64| x.clamp(centre - GUARD, centre + GUARD);
    Corner::at(within(x, view.centre[0]), within(y, view.centre[1]), view.key(depth))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Lens};

    fn view() -> View {
        let lens = Lens::Perspective { angle: 90.0 };
        let camera = Camera { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0], lens };
        View::new(&camera, 100, 100).unwrap()
    }

    fn drawn(view: &View, points: [Vec3; 3]) -> Vec<[Corner; 3]> {
        let corners = points.map(|p| Corner::of(view, p));
        let mut out = Vec::new();
        pieces(view, &corners, [0, 1, 2], |v| points[v as usize], |piece| out.push(piece));
        out
    }

    #[test]
    fn corners_are_snapped_to_the_nearest_step() {
        let view = view();
        let corner = Corner::of(&view, [0.0, 0.0, 1.0]);
        assert_eq!((corner.x, corner.y, corner.key), (50 * 256, 50 * 256, 1.0));
        assert_eq!(Corner::of(&view, [-1.0, 1.0, 1.0]).x, 0);
        assert_eq!(Corner::of(&view, [-1.0 - 1.6 / (50.0 * 256.0), 0.0, 1.0]).x, -2);
    }

    #[test]
    fn what_is_in_front_is_not_cut() {
        assert_eq!(drawn(&view(), [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0]]).len(), 1);
    }

    #[test]
    fn what_is_behind_is_gone_and_what_crosses_is_cut() {
        let view = view();
        assert!(drawn(&view, [[0.0, 0.0, -1.0], [1.0, 0.0, -2.0], [0.0, 1.0, -3.0]]).is_empty());
        let crossing = drawn(&view, [[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.0, -0.1, -1.0]]);
        assert!(crossing.len() >= 2, "{crossing:?}");
        for corner in crossing.iter().flatten() {
            assert!(corner.x.abs() < 1 << 23 && corner.y.abs() < 1 << 23 && corner.key > 0.0, "{corner:?}");
        }
        // A floor through the eye's plane reaches below the picture.
        assert!(crossing.iter().flatten().any(|c| c.y > 100 * 256));
    }

    #[test]
    fn huge_and_invalid_corners() {
        let view = view();
        let huge = drawn(&view, [[-1e30, -1e30, 5.0], [1e30, -1e30, 5.0], [0.0, 1e30, 5.0]]);
        assert!(!huge.is_empty());
        assert!(drawn(&view, [[f64::NAN, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0]]).is_empty());
        assert!(drawn(&view, [[f64::INFINITY, 0.0, 1.0], [1.0, 0.0, -2.0], [0.0, 1.0, 3.0]]).is_empty());
    }
}
