//! A camera made ready for one size of picture: world to view, view to pixels, pixels to rays.
//!
//! View coordinates are x to the right, y up, z forward, from the eye, in world units: note that z forward makes them
//! left-handed. Pixels count from the upper left corner of the picture, y down; pixel (i, j) covers i..i+1, j..j+1.

use crate::Error;
use crate::camera::{Camera, Lens, half_tangent};
use crate::vector::{Vec3, dot, scale};

/// Nearer than this share of the distance to the target is cut off: keys are reciprocal depths in `f32`, which stay exact
/// to seven digits at all distances, so the plane can be very near. It keeps projections finite.
const NEAR: f64 = 1e-5;

#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    pub eye: Vec3,
    /// Right, up, forward.
    pub axes: [Vec3; 3],
    pub perspective: bool,
    /// Pixels for a unit of length at depth 1 (perspective) or anywhere (orthographic).
    pub scale: f64,
    /// The middle of the picture in pixels.
    pub centre: [f64; 2],
    /// Least depth drawn; minus infinity where there is none.
    pub near: f64,
    /// The target's depth: keys of an orthographic picture count from there.
    distance: f64,
    /// The camera's up, in view coordinates with z towards the viewer: where the light of the sky comes from.
    pub sky: [f32; 3],
}

/// Points `origin + t·direction`; t is the depth.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
}

impl View {
    pub fn new(camera: &Camera, width: u32, height: u32) -> Result<Self, Error> {
        let (axes, distance) = camera.axes()?;
        let (width, height) = (f64::from(width), f64::from(height));
        let (perspective, half, near) = match camera.lens {
            Lens::Perspective { angle } => (true, half_tangent(angle), NEAR * distance),
            Lens::Orthographic { height } => (false, height / 2.0, f64::NEG_INFINITY),
        };
        let up = crate::vector::normalized(camera.up).unwrap_or(axes[1]);
        let sky = [dot(axes[0], up) as f32, dot(axes[1], up) as f32, -dot(axes[2], up) as f32];
        let centre = [width / 2.0, height / 2.0];
        Ok(Self { eye: camera.eye, axes, perspective, scale: height / 2.0 / half, centre, near, distance, sky })
    }

    /// View coordinates of a point given relative to the eye, or of a direction.
    #[inline(always)]
    pub fn point(&self, p: Vec3) -> Vec3 {
        [dot(self.axes[0], p), dot(self.axes[1], p), dot(self.axes[2], p)]
    }

    /// Pixel coordinates of a view point, which must not be nearer than `near`.
    #[inline(always)]
    pub fn screen(&self, v: Vec3) -> [f64; 2] {
        let s = if self.perspective { self.scale / v[2] } else { self.scale };
        [self.centre[0] + s * v[0], self.centre[1] - s * v[1]]
    }

    /// What decides who is in front: larger is nearer. Linear over the picture on every plane.
    #[inline(always)]
    pub fn key(&self, depth: f64) -> f32 {
        if self.perspective { (self.distance / depth) as f32 } else { (self.distance - depth) as f32 }
    }

    /// The ray through a place in the picture.
    #[inline(always)]
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let (x, y) = ((x - self.centre[0]) / self.scale, (self.centre[1] - y) / self.scale);
        if self.perspective {
            Ray { origin: [0.0; 3], direction: [x, y, 1.0] }
        } else {
            Ray { origin: [x, y, 0.0], direction: [0.0, 0.0, 1.0] }
        }
    }
}

impl Ray {
    /// The unit vector back along the ray.
    pub fn back(&self) -> Vec3 {
        scale(self.direction, -1.0 / dot(self.direction, self.direction).sqrt())
    }
}
