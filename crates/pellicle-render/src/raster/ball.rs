//! Spheres: where they are in the picture, and where a ray meets them.

use crate::vector::{Vec3, add_scaled, dot, sub};
use crate::view::{Ray, View};

/// A sphere in view coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ball {
    pub centre: Vec3,
    pub radius: f64,
}

/// Where a ray meets a sphere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    pub depth: f64,
    /// Whether the ray comes from within.
    pub inside: bool,
}

impl Ball {
    /// Left, top, right and bottom in pixels, or nothing where it cannot be seen. Not more than a rounding error too small.
    pub fn extent(&self, view: &View) -> Option<[f64; 4]> {
        let Self { centre: [x, y, z], radius } = *self;
        if !(self.centre.iter().all(|x| x.is_finite()) && radius > 0.0 && z + radius > view.near) {
            return None;
        }
        if !view.perspective {
            let [px, py] = view.screen(self.centre);
            let r = radius * view.scale;
            return Some([px - r, py - r, px + r, py + r]);
        }
        if z - radius <= view.near {
            // Around the eye, or beside it: anywhere.
            return Some([f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY]);
        }
        // The tangents from the eye in the plane of one axis and the depth.
        let tangents = |x: f64| {
            let root = radius * (x * x + z * z - radius * radius).sqrt();
            let below = z * z - radius * radius;
            [(x * z - root) / below, (x * z + root) / below].map(|t| t * view.scale)
        };
        let ([left, right], [low, high]) = (tangents(x), tangents(y));
        Some([view.centre[0] + left, view.centre[1] - high, view.centre[0] + right, view.centre[1] - low])
    }

    /// The first point on the ray that is at least `near` deep.
    #[inline(always)]
    pub fn meet(&self, ray: &Ray, near: f64) -> Option<Hit> {
        let to = sub(self.centre, ray.origin);
        let a = dot(ray.direction, ray.direction);
        let b = dot(ray.direction, to);
        let c = dot(to, to) - self.radius * self.radius;
        let square = b * b - a * c;
        if square < 0.0 || square.is_nan() {
            return None;
        }
        let root = square.sqrt();
        let (first, last) = ((b - root) / a, (b + root) / a);
        if first > near {
            Some(Hit { depth: first, inside: false })
        } else if last > near {
            Some(Hit { depth: last, inside: true })
        } else {
            None
        }
    }

    /// The outward unit normal where the ray meets the sphere; where it passes by, at the nearest point of the outline.
    pub fn normal(&self, ray: &Ray, near: f64) -> (Vec3, Option<Hit>) {
        let hit = self.meet(ray, near);
        let depth = hit.map_or_else(
            || dot(ray.direction, sub(self.centre, ray.origin)) / dot(ray.direction, ray.direction),
            |hit| hit.depth,
        );
        let from = sub(add_scaled(ray.origin, depth, ray.direction), self.centre);
        (crate::vector::normalized(from).unwrap_or([0.0, 0.0, -1.0]), hit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Lens};

    #[test]
    fn the_extent_holds_every_ray_that_meets_and_no_more() {
        for lens in [Lens::Perspective { angle: 80.0 }, Lens::Orthographic { height: 4.0 }] {
            let camera = Camera { eye: [0.0; 3], target: [0.0, 0.0, -3.0], up: [0.0, 1.0, 0.0], lens };
            let view = View::new(&camera, 200, 200).unwrap();
            let ball = Ball { centre: [0.7, -0.4, 2.5], radius: 0.6 };
            let extent = ball.extent(&view).unwrap();
            let mut seen = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
            for step in 0..4_000_000u32 {
                let (x, y) = (f64::from(step % 2000) / 10.0, f64::from(step / 2000) / 10.0);
                if ball.meet(&view.ray(x, y), view.near).is_some() {
                    seen = [seen[0].min(x), seen[1].min(y), seen[2].max(x), seen[3].max(y)];
                }
            }
            for side in 0..4 {
                assert!((extent[side] - seen[side]).abs() < 0.3, "{lens:?} {extent:?} {seen:?}");
            }
        }
    }

    #[test]
    fn from_within_the_far_side_is_met() {
        let ball = Ball { centre: [0.0, 0.0, 0.5], radius: 1.0 };
        let ray = Ray { origin: [0.0; 3], direction: [0.0, 0.0, 1.0] };
        let hit = ball.meet(&ray, 1e-5).unwrap();
        assert!(hit.inside && (hit.depth - 1.5).abs() < 1e-12);
    }
}
