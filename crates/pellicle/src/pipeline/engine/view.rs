//! The viewer, for whom triangles are put in order, and the pose of the lattice that this asks for.

use crate::{
    Error,
    lattice::Coord,
    march::slices::{DrawOrder, Sight, Sorting},
    math::vector::{Axes, dot, from_axes},
};

/// How the slabs are turned towards the viewer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sweep {
    /// Along the lattice's axis that is nearest to the viewer's direction. The lattice stays as it is: a still fluid
    /// keeps its triangles, but for rounding.
    #[default]
    BestAxis,
    /// Along the viewer's direction: the lattice is turned with him about the world's origin.
    Rotated,
}

/// Where from, and in which order, the surface is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The viewer's place in the world; `None` when he is infinitely far away.
    pub eye: Option<[f64; 3]>,
    /// The direction in which he looks, of any length greater than 0.
    pub forward: [f64; 3],
    /// What is drawn first.
    pub order: DrawOrder,
    /// How the lattice is swept.
    pub sweep: Sweep,
    /// How strictly the order is kept where the march makes another one.
    pub sorting: Sorting,
}

impl View {
    /// Checks that all numbers are finite and that there is a direction.
    pub(super) fn check(&self) -> Result<(), Error> {
        let eye = self.eye.unwrap_or_default();
        let length = dot(self.forward, self.forward).sqrt();
        if let Some(&value) = eye.iter().find(|v| !v.is_finite()) {
            return Err(Error::Parameter { name: "eye", value, must: "finite" });
        }
        if !(length.is_normal() && (1.0 / length).is_normal()) {
            return Err(Error::Parameter { name: "forward", value: length, must: "of a length greater than 0" });
        }
        Ok(())
    }

    /// The axes of the lattice in the world in which slabs come in draw order from the lowest to the highest.
    pub(super) fn axes(&self) -> Axes {
        // Upwards is towards what is drawn last.
        let sign = match self.order {
            DrawOrder::BackToFront => -1.0,
            DrawOrder::FrontToBack => 1.0,
        };
        let length = dot(self.forward, self.forward).sqrt();
        let up = self.forward.map(|v| sign * v / length);
        match self.sweep {
            Sweep::BestAxis => {
                let axis = (0..3).fold(2, |best, a| if up[a].abs() > up[best].abs() { a } else { best });
                let sign = up[axis].signum();
                let unit = |a: usize, by: f64| std::array::from_fn(|i| if i == a % 3 { by } else { 0.0 });
                [unit(axis + 1, 1.0), unit(axis + 2, sign), unit(axis, sign)]
            }
            Sweep::Rotated => {
                let least = (0..3).fold(0, |best, a| if up[a].abs() < up[best].abs() { a } else { best });
                let along = up[least];
                let x: [f64; 3] = std::array::from_fn(|i| f64::from(i == least) - along * up[i]);
                let length = dot(x, x).sqrt();
                let x = x.map(|v| v / length);
                let y = [up[1] * x[2] - up[2] * x[1], up[2] * x[0] - up[0] * x[2], up[0] * x[1] - up[1] * x[0]];
                [x, y, up]
            }
        }
    }

    /// The lattice cube in which the viewer is, given the axes and the spacing.
    pub(super) fn cube(&self, axes: &Axes, spacing: f64) -> [i64; 3] {
        /// Farther than any block, but far from overflow.
        const FAR: f64 = (1u64 << 40) as f64;
        let length = dot(self.forward, self.forward).sqrt();
        axes.map(|axis| match self.eye {
            Some(eye) => (dot(axis, eye) / spacing).floor().clamp(-FAR, FAR) as i64,
            // From infinity the viewer is on one side of everything, or exactly level with it.
            None => {
                let along = dot(axis, self.forward) / length;
                if along.abs() < 1e-9 { 0 } else { (-FAR * along.signum()) as i64 }
            }
        })
    }
}

/// Corners of the block at `at`, of `size` cells, in world units, where the lattice may have axes of its own.
pub(super) fn corners(axes: Option<&Axes>, at: Coord, size: [usize; 3], spacing: f64) -> [[f64; 3]; 8] {
    std::array::from_fn(|c| {
        let node = |a: usize| (f64::from(at[a]) + f64::from(c as u32 >> a & 1)) * size[a] as f64 * spacing;
        from_axes(axes, std::array::from_fn(node))
    })
}

/// A key that puts blocks of `size` cells in draw order.
pub(super) fn block_key(at: Coord, size: [usize; 3], sight: &Sight) -> u64 {
    const MOST: u64 = (1 << 21) - 1;
    (0..3).rev().fold(0, |key, a| {
        let distance = (i64::from(at[a]) - sight.cube[a].div_euclid(size[a] as i64)).unsigned_abs().min(MOST);
        key << 21 | if sight.order == DrawOrder::BackToFront { MOST - distance } else { distance }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_rotations_that_turn_slabs_towards_the_viewer() {
        for forward in [[0.0, 0.0, 2.0], [1.0, -3.0, 0.5], [-0.2, 0.1, 0.1], [5.0, 5.0, 5.0]] {
            for (order, sign) in [(DrawOrder::BackToFront, -1.0), (DrawOrder::FrontToBack, 1.0)] {
                for sweep in [Sweep::BestAxis, Sweep::Rotated] {
                    let axes = View { eye: None, forward, order, sweep, sorting: Sorting::Fast }.axes();
                    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                        assert!((dot(axes[i], axes[j]) - f64::from(i == j)).abs() < 1e-12, "{axes:?}");
                    }
                    let [x, y, z] = axes;
                    let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
                    assert!((dot(cross, z) - 1.0).abs() < 1e-12, "no mirror image: {axes:?}");
                    assert!(sign * dot(z, forward) > 0.5 * dot(forward, forward).sqrt(), "{axes:?}");
                }
            }
        }
    }
}
