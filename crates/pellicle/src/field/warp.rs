//! The spaces in which a surface is tessellated for a camera: view space and post-projection space.
//!
//! In both the domain's x runs to the right and y up in the picture, and z is depth in front of the eye, so that cells lie
//! square to the line of sight. In post-projection space x and y are places in the picture, from −1 to 1, and z is the depth
//! buffer's: 0 at the near plane, 1 at the far one. A cell of fixed size there is as small as its picture: fine near the
//! camera, coarse far away.
//!
//! Source: Uralsky, Practical metaballs and implicit surfaces, 2006, tessellation space.

use super::function::Warp;
use crate::Error;

/// Where a camera stands and how it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    eye: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    forward: [f64; 3],
}

impl View {
    /// A camera at `eye` that looks at `target`, with `up` as near to the picture's vertical as can be.
    ///
    /// # Errors
    /// [`Error::Parameter`] when they do not tell a direction: not finite, in one place, in one line.
    pub fn new(eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> Result<Self, Error> {
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let must = "eye, target and up that are finite and not in one line";
            if length.is_finite() && length > 1e-12 {
                Ok(v.map(|x| x / length))
            } else {
                Err(Error::Parameter { name: "view", value: length, must })
            }
        };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let forward = unit(std::array::from_fn(|a| target[a] - eye[a]))?;
        let right = unit(cross(forward, unit(up)?))?;
        Ok(Self { eye, right, up: cross(right, forward), forward })
    }

    /// View coordinates (right, up, depth) of a world position.
    pub fn to_view(&self, at: [f64; 3]) -> [f64; 3] {
        let d: [f64; 3] = std::array::from_fn(|a| at[a] - self.eye[a]);
        [self.right, self.up, self.forward].map(|axis| (0..3).map(|a| axis[a] * d[a]).sum())
    }

    fn place_of(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.eye[a] + x * self.right[a] + y * self.up[a] + z * self.forward[a])
    }
}

impl Warp for View {
    fn to_world(&self, at: [f64; 3]) -> [f64; 3] {
        self.place_of(at)
    }
}

/// Post-projection space of a perspective camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    view: View,
    /// Tangents of half the angles of view, across and up.
    tangents: [f64; 2],
    near: f64,
    far: f64,
}

impl Projection {
    /// A camera with these tangents of half the angles of view, across and up, and depths of the near and the far plane.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless tangents are positive and 0 < near < far.
    pub fn new(view: View, tangents: [f64; 2], near: f64, far: f64) -> Result<Self, Error> {
        if let Some(&value) = tangents.iter().find(|t| !(t.is_finite() && **t > 0.0)) {
            return Err(Error::Parameter { name: "tangents", value, must: "finite and greater than 0" });
        }
        if !(near > 0.0 && near < far && far.is_finite()) {
            return Err(Error::Parameter {
                name: "near",
                value: near,
                must: "greater than 0 and less than a finite far",
            });
        }
        Ok(Self { view, tangents, near, far })
    }

    /// Post-projection coordinates of a world position in front of the eye.
    pub fn to_projection(&self, at: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.view.to_view(at);
        let depth = (1.0 - self.near / z) * self.far / (self.far - self.near);
        [x / (z * self.tangents[0]), y / (z * self.tangents[1]), depth]
    }
}

impl Warp for Projection {
    fn to_world(&self, [x, y, depth]: [f64; 3]) -> [f64; 3] {
        let z = self.near / (1.0 - depth * (self.far - self.near) / self.far);
        self.view.place_of([x * z * self.tangents[0], y * z * self.tangents[1], z])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_and_back_is_where_it_was() {
        let view = View::new([1.0, 2.0, 5.0], [0.5, 0.0, -1.0], [0.0, 1.0, 0.0]).expect("good");
        let projection = Projection::new(view, [0.8, 0.5], 0.5, 20.0).expect("good");
        for p in [[0.0, 0.0, 0.0], [1.0, -0.5, 2.0], [-3.0, 1.0, -8.0]] {
            for back in [view.to_world(view.to_view(p)), projection.to_world(projection.to_projection(p))] {
                assert!((0..3).all(|a| (back[a] - p[a]).abs() < 1e-12), "{p:?} {back:?}");
            }
        }
        let depth = |depth: f64| view.to_view(projection.to_world([0.0, 0.0, depth]))[2];
        assert!((depth(0.0) - 0.5).abs() < 1e-12 && (depth(1.0) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn what_sees_nothing_is_refused() {
        assert!(View::new([0.0; 3], [0.0; 3], [0.0, 1.0, 0.0]).is_err());
        assert!(View::new([0.0; 3], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0]).is_err());
        let view = View::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]).expect("good");
        assert!(Projection::new(view, [1.0, 0.0], 1.0, 2.0).is_err());
        assert!(Projection::new(view, [1.0, 1.0], 0.0, 2.0).is_err());
        assert!(Projection::new(view, [1.0, 1.0], 3.0, 2.0).is_err());
    }
}
