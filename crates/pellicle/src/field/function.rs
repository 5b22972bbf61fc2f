//! Scalar fields that are given as functions of position, and the box in which they are sampled.
//!
//! A function is evaluated brick by brick, where it is asked for; no dense array is made. Inside is *greater* than the
//! isovalue. The box may be *warped*: the lattice stays a regular one, and a map takes its points to the world, where the
//! function lives. Sampling in view space and in post-projection space are such warps.
//!
//! Source: tessellation spaces after Uralsky, Practical metaballs and implicit surfaces, 2006.

use crate::{Border, Error};

/// A scalar function of position. Closures are functions.
pub trait Function: Sync {
    /// Value at a world position. NaN is outside and infinitely low.
    fn value(&self, at: [f64; 3]) -> f64;

    /// Values at world positions that are close together; each the same, to the last bit, as [`value`](Self::value) has it.
    fn values(&self, at: &[[f64; 3]], to: &mut [f64]) {
        at.iter().zip(to).for_each(|(&at, to)| *to = self.value(at));
    }

    /// Gradient at a world position. Unless a function knows better, central differences over `step`, a length in world
    /// units that is small beside what the function shows.
    fn gradient(&self, at: [f64; 3], step: f64) -> [f64; 3] {
        std::array::from_fn(|a| {
            let along = |s: f64| self.value(std::array::from_fn(|b| if a == b { at[b] + s } else { at[b] }));
            (along(step) - along(-step)) / (2.0 * step)
        })
    }
}

impl<F: Fn([f64; 3]) -> f64 + Sync> Function for F {
    fn value(&self, at: [f64; 3]) -> f64 {
        self(at)
    }
}

/// The unit normal that points outward where this is the gradient; zero where there is none.
pub(crate) fn outward(gradient: [f64; 3]) -> [f32; 3] {
    let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    gradient.map(|g| if length > 0.0 && length.is_finite() { (-g / length) as f32 } else { 0.0 })
}

/// A map from the coordinates of a [`Domain`] to the world. It must be continuous and one-to-one on the domain.
pub trait Warp: Sync {
    /// The world position of a point of the domain.
    fn to_world(&self, at: [f64; 3]) -> [f64; 3];
}

/// A box of cells in which a function is sampled.
#[derive(Clone, Copy)]
pub struct Domain<'a> {
    /// Lowest corner, in the domain's coordinates.
    pub low: [f64; 3],
    /// Edges of a cell, in the domain's coordinates; greater than 0.
    pub spacing: [f64; 3],
    /// Cells along each axis, at least 1.
    pub cells: [usize; 3],
    /// What happens where the box ends.
    pub border: Border,
    /// From the domain's coordinates to the world; `None`: they are the world's.
    pub warp: Option<&'a dyn Warp>,
}

impl<'a> Domain<'a> {
    /// Cubic cells of this edge that cover a box of the world, closed at its border.
    ///
    /// ```
    /// let domain = pellicle::Domain::covering([[-1.0; 3], [1.0, 1.0, 2.0]], 0.1);
    /// assert_eq!(domain.cells, [20, 20, 30]);
    /// ```
    pub fn covering([low, high]: [[f64; 3]; 2], spacing: f64) -> Self {
        // A part of a cell is a cell, but for rounding.
        let cells = |a: usize| ((high[a] - low[a]) / spacing - 1e-9).ceil().max(1.0) as usize;
        Self { low, spacing: [spacing; 3], cells: [cells(0), cells(1), cells(2)], border: Border::Closed, warp: None }
    }

    /// With this map to the world.
    pub fn warped(self, warp: &'a dyn Warp) -> Self {
        Self { warp: Some(warp), ..self }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a corner that is not finite or a spacing that is not positive, [`Error::Dims`] for too many or
    /// too few cells.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(&value) = self.low.iter().find(|v| !v.is_finite()) {
            return Err(Error::Parameter { name: "low", value, must: "finite" });
        }
        if let Some(&value) = self.spacing.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            return Err(Error::Parameter { name: "spacing", value, must: "a finite number greater than 0" });
        }
        if self.cells.iter().any(|&n| !(1..1 << 30).contains(&n)) {
            return Err(Error::Dims { dims: self.cells.map(|n| n.saturating_add(1)) });
        }
        Ok(())
    }

    /// World position of a point in units of cells.
    pub(crate) fn to_world(self, at: [f64; 3]) -> [f64; 3] {
        let at = std::array::from_fn(|a| self.low[a] + at[a] * self.spacing[a]);
        self.warp.map_or(at, |warp| warp.to_world(at))
    }

    /// World position that a mesh of this domain counts from.
    pub(crate) fn mesh_origin(&self) -> [f64; 3] {
        if self.warp.is_some() { self.to_world(self.cells.map(|n| 0.5 * n as f64)) } else { self.low }
    }

    /// Whether the warp turns right hands into left ones, judged in the middle.
    pub(crate) fn is_left_handed(&self) -> bool {
        let middle = self.cells.map(|n| 0.5 * n as f64);
        let at = self.to_world(middle);
        let step = |a: usize| {
            let next = self.to_world(std::array::from_fn(|b| middle[b] + if a == b { 0.25 } else { 0.0 }));
            [0, 1, 2].map(|i| next[i] - at[i])
        };
        super::volume::determinant([step(0), step(1), step(2)]) < 0.0
    }

    /// A length in the world that is small beside a cell in the middle.
    pub(crate) fn small_step(&self) -> f64 {
        let middle = self.cells.map(|n| 0.5 * n as f64);
        let (at, next) = (self.to_world(middle), self.to_world([middle[0] + 1.0, middle[1], middle[2]]));
        1e-3 * (0..3).map(|a| (next[a] - at[a]).powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_second_order() {
        let function = |p: [f64; 3]| p[0] * p[0] + 3.0 * p[1] - p[2] * p[2] * p[2];
        let gradient = function.gradient([1.0, 2.0, -1.0], 1e-4);
        for (found, expected) in gradient.into_iter().zip([2.0, 3.0, -3.0]) {
            assert!((found - expected).abs() < 1e-6, "{gradient:?}");
        }
    }

    #[test]
    fn what_cannot_be_sampled_is_refused() {
        let good = Domain::covering([[0.0; 3], [1.0; 3]], 0.1);
        assert_eq!((good.check(), good.cells), (Ok(()), [10; 3]));
        for bad in [
            Domain { low: [f64::NAN, 0.0, 0.0], ..good },
            Domain { spacing: [0.1, 0.0, 0.1], ..good },
            Domain { cells: [0, 1, 1], ..good },
            Domain { cells: [1 << 40, 1, 1], ..good },
        ] {
            assert!(bad.check().is_err());
        }
    }
}
