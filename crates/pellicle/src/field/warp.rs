//! The spaces in which a surface is tessellated for a camera: view space and post-projection space.
//!
//! In both the domain's x runs to the right and y up in the picture, and z is depth in front of the eye, so that cells lie
//! square to the line of sight. In post-projection space x and y are places in the picture, from −1 to 1, and z goes from 0 at
//! the near plane to 1 at the far one. A cell of fixed size there is as small as its picture: fine near the camera, coarse far
//! away.
//!
//! With the depth buffer's z a cell is as wide as its distance, but as deep as the square of it: either near cells are flat or far
//! ones are rods, and either way many are wasted. With [`Depth::Even`] all have one shape.
//!
//! Source: Uralsky, Practical metaballs and implicit surfaces, 2006, tessellation space; even depth is this project's (as the
//! logarithmic slices of Olsson, Billeter, Assarsson, Clustered deferred and forward shading, 2012).

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

/// How the third axis of post-projection space goes from the near plane to the far one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Depth {
    /// As a depth buffer's: evenly in one over the distance.
    #[default]
    Buffer,
    /// Evenly in the logarithm of the distance: a cell is as deep as it is wide at every distance, when there are
    /// ln(far / near) / (2 · tangent) times as many in depth as across.
    Even,
}

/// Post-projection space of a perspective camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    view: View,
    /// Tangents of half the angles of view, across and up.
    tangents: [f64; 2],
    near: f64,
    far: f64,
    depth: Depth,
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
        Ok(Self { view, tangents, near, far, depth: Depth::Buffer })
    }

    /// With another third axis.
    pub fn with_depth(self, depth: Depth) -> Self {
        Self { depth, ..self }
    }

    /// Post-projection coordinates of a world position in front of the eye.
    pub fn to_projection(&self, at: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.view.to_view(at);
        let depth = match self.depth {
            Depth::Buffer => (1.0 - self.near / z) * self.far / (self.far - self.near),
            Depth::Even => (z / self.near).ln() / (self.far / self.near).ln(),
        };
        [x / (z * self.tangents[0]), y / (z * self.tangents[1]), depth]
    }
}

impl Warp for Projection {
    fn to_world(&self, [x, y, depth]: [f64; 3]) -> [f64; 3] {
        let z = match self.depth {
            Depth::Buffer => self.near / (1.0 - depth * (self.far - self.near) / self.far),
            Depth::Even => self.near * (self.far / self.near).powf(depth),
        };
        self.view.place_of([x * z * self.tangents[0], y * z * self.tangents[1], z])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_and_back_is_where_it_was() {
        let view = View::new([1.0, 2.0, 5.0], [0.5, 0.0, -1.0], [0.0, 1.0, 0.0]).expect("good");
        let buffer = Projection::new(view, [0.8, 0.5], 0.5, 20.0).expect("good");
        for projection in [buffer, buffer.with_depth(Depth::Even)] {
            for p in [[0.0, 0.0, 0.0], [1.0, -0.5, 2.0], [-3.0, 1.0, -8.0]] {
                for back in [view.to_world(view.to_view(p)), projection.to_world(projection.to_projection(p))] {
                    assert!((0..3).all(|a| (back[a] - p[a]).abs() < 1e-12), "{p:?} {back:?}");
                }
            }
            let depth = |depth: f64| view.to_view(projection.to_world([0.0, 0.0, depth]))[2];
            assert!((depth(0.0) - 0.5).abs() < 1e-12 && (depth(1.0) - 20.0).abs() < 1e-9);
        }
    }

    #[test]
    fn even_cells_have_one_shape_at_every_distance() {
        let view = View::new([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]).expect("good");
        let projection = Projection::new(view, [0.5, 0.5], 2.0, 32.0).expect("good").with_depth(Depth::Even);
        let step = 1e-3;
        for depth in [0.0, 0.3, 0.9] {
            let at = |p: [f64; 3]| projection.to_world(p);
            let width = at([step, 0.0, depth])[0] - at([0.0, 0.0, depth])[0];
            let length = at([0.0, 0.0, depth])[2] - at([0.0, 0.0, depth + step])[2];
            assert!((length / width / (16f64.ln() / 0.5) - 1.0).abs() < 2e-3, "{depth}: {length} {width}");
        }
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
