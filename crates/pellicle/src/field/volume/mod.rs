//! A borrowed view of a regular grid of samples: what the volume road takes in.
//!
//! Node (i, j, k) has the sample at element `first + i·strides[0] + j·strides[1] + k·strides[2]` of the caller's slice, and
//! lies at `origin + i·directions[0] + j·directions[1] + k·directions[2]` in the world. Samples stay in their type and are
//! never copied as a whole. Directions need be neither axis-parallel nor orthogonal nor right-handed; triangles wind
//! counter-clockwise seen from outside all the same.
//!
//! A node may be *absent*: its sample is NaN, the mask says so, or it lies beyond the border of a closed volume. An absent
//! node is outside and infinitely low: the surface ends in the last node that is present, so the caps of a closed volume
//! lie in the planes of its border.
//!
//! Source: Gourlay 2014, Fluid Simulation for Video Games 18, `GridWrapper` (strides and direction vectors); signed strides,
//! other types, masks and borders are this project's.

mod interpolant;
mod scalar;

pub use interpolant::Interpolant;
pub use scalar::Samples;
pub(crate) use scalar::{Cut, Scalar, with_samples};

use crate::Error;

/// What happens where the volume ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Border {
    /// Beyond is outside: surfaces close in the planes of the border.
    #[default]
    Closed,
    /// There is nothing beyond: surfaces end at the border.
    Open,
}

/// A borrowed regular grid of samples.
///
/// ```
/// use pellicle::{Border, Volume};
/// let samples: Vec<u16> = vec![0; 4 * 5 * 6];
/// let volume = Volume::new(&samples, [4, 5, 6])?.with_spacing([0.5, 0.5, 2.0])?.with_border(Border::Open);
/// assert_eq!(volume.dims(), [4, 5, 6]);
/// # Ok::<(), pellicle::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Volume<'a> {
    samples: Samples<'a>,
    dims: [usize; 3],
    first: usize,
    strides: [isize; 3],
    origin: [f64; 3],
    directions: [[f64; 3]; 3],
    mask: Option<&'a [bool]>,
    border: Border,
}

/// Most nodes along an axis.
const MOST_NODES: usize = (1 << 31) - 4;

impl<'a> Volume<'a> {
    /// Packed samples, the first axis fastest, with the origin at (0, 0, 0), node distance 1 and a closed border.
    ///
    /// # Errors
    /// [`Error::Dims`] when an axis has fewer than 2 nodes or too many, [`Error::Length`] when the slice is not as long as
    /// the dims say.
    pub fn new(samples: impl Into<Samples<'a>>, dims: [usize; 3]) -> Result<Self, Error> {
        let samples = samples.into();
        let volume = Self::shaped(samples, dims)?;
        let expected = dims[0] * dims[1] * dims[2];
        if samples.len() != expected {
            let what = format!("the volume of {} × {} × {} nodes", dims[0], dims[1], dims[2]);
            return Err(Error::Length { what, found: samples.len(), expected });
        }
        Ok(volume)
    }

    /// Samples anywhere within a slice: `first` is the element of node (0, 0, 0), `strides` are counted in elements, may be
    /// negative or zero.
    ///
    /// # Errors
    /// [`Error::Dims`] as in [`new`](Self::new), [`Error::Strides`] when a node would lie outside of the slice.
    pub fn strided(
        samples: impl Into<Samples<'a>>,
        dims: [usize; 3],
        first: usize,
        strides: [isize; 3],
    ) -> Result<Self, Error> {
        let samples = samples.into();
        let volume = Self { first, strides, ..Self::shaped(samples, dims)? };
        // Lowest and highest element that any node has; i128 holds them all.
        let reach = |a: usize| strides[a] as i128 * (dims[a] as i128 - 1);
        let lowest = first as i128 + (0..3).map(|a| reach(a).min(0)).sum::<i128>();
        let highest = first as i128 + (0..3).map(|a| reach(a).max(0)).sum::<i128>();
        if lowest < 0 || highest >= samples.len() as i128 {
            return Err(Error::Strides { lowest, highest, len: samples.len() });
        }
        Ok(volume)
    }

    fn shaped(samples: Samples<'a>, dims: [usize; 3]) -> Result<Self, Error> {
        let nodes = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).filter(|&n| n <= isize::MAX as usize / 8);
        if dims.iter().any(|d| !(2..=MOST_NODES).contains(d)) || nodes.is_none() {
            return Err(Error::Dims { dims });
        }
        Ok(Self {
            samples,
            dims,
            first: 0,
            strides: [1, dims[0] as isize, (dims[0] * dims[1]) as isize],
            origin: [0.0; 3],
            directions: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            mask: None,
            border: Border::Closed,
        })
    }

    /// With node (0, 0, 0) at this place in the world.
    ///
    /// # Errors
    /// [`Error::Parameter`] when a coordinate is not finite.
    pub fn with_origin(self, origin: [f64; 3]) -> Result<Self, Error> {
        if let Some(&value) = origin.iter().find(|v| !v.is_finite()) {
            return Err(Error::Parameter { name: "origin", value, must: "finite" });
        }
        Ok(Self { origin, ..self })
    }

    /// With axes parallel to the world's and these node distances, which may be negative (a mirrored axis).
    ///
    /// # Errors
    /// As [`with_directions`](Self::with_directions).
    pub fn with_spacing(self, spacing: [f64; 3]) -> Result<Self, Error> {
        let along = |a: usize| std::array::from_fn(|b| if a == b { spacing[a] } else { 0.0 });
        self.with_directions([along(0), along(1), along(2)])
    }

    /// With these steps from a node to the next along each axis.
    ///
    /// # Errors
    /// [`Error::Parameter`] when the three do not span space: not finite, zero, or in one plane.
    pub fn with_directions(self, directions: [[f64; 3]; 3]) -> Result<Self, Error> {
        let scale: f64 = directions.iter().map(|d| length(*d)).product();
        let det = determinant(directions);
        // In one plane up to rounding: the volume of the cell is nothing beside the product of its edges.
        if !(det.is_finite() && scale.is_normal() && det.abs() > 1e-12 * scale) {
            let must = "directions that span space: finite, not zero, not in one plane";
            return Err(Error::Parameter { name: "the cell's volume", value: det, must });
        }
        Ok(Self { directions, ..self })
    }

    /// With a mask that is laid out as the samples: element e of the mask tells whether sample e is present.
    ///
    /// # Errors
    /// [`Error::Length`] when it has not as many elements as the samples.
    pub fn with_mask(self, present: &'a [bool]) -> Result<Self, Error> {
        if present.len() != self.samples.len() {
            return Err(Error::Length { what: "the mask".into(), found: present.len(), expected: self.samples.len() });
        }
        Ok(Self { mask: Some(present), ..self })
    }

    /// With this border.
    pub fn with_border(self, border: Border) -> Self {
        Self { border, ..self }
    }

    /// Nodes along each axis.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The samples as handed in.
    pub fn samples(&self) -> Samples<'a> {
        self.samples
    }

    /// Steps between elements along each axis.
    pub fn strides(&self) -> [isize; 3] {
        self.strides
    }

    /// Place of node (0, 0, 0) in the world.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Step in the world along each axis.
    pub fn directions(&self) -> [[f64; 3]; 3] {
        self.directions
    }

    /// The mask, if there is one.
    pub fn mask(&self) -> Option<&'a [bool]> {
        self.mask
    }

    /// What happens at the border.
    pub fn border(&self) -> Border {
        self.border
    }

    /// Number of cells.
    pub fn cells(&self) -> u64 {
        self.dims.iter().map(|&d| d as u64 - 1).product()
    }

    /// Element of a node, which must be within the dims.
    #[inline(always)]
    pub fn element(&self, node: [usize; 3]) -> usize {
        let [i, j, k] = [0, 1, 2].map(|a| node[a] as isize * self.strides[a]);
        (self.first as isize + i + j + k) as usize
    }

    /// Value of a node, which must be within the dims; `None` where it is absent.
    pub fn value(&self, node: [usize; 3]) -> Option<f64> {
        let element = self.element(node);
        if self.mask.is_some_and(|present| !present[element]) {
            return None;
        }
        Some(self.samples.value(element)).filter(|v| !v.is_nan())
    }

    /// Place of a node, or of any point in node coordinates, in the world.
    pub fn position(&self, node: [f64; 3]) -> [f64; 3] {
        let d = &self.directions;
        std::array::from_fn(|a| self.origin[a] + (node[0] * d[0][a] + node[1] * d[1][a] + node[2] * d[2][a]))
    }

    /// Whether the three directions form a left-handed frame.
    pub fn is_left_handed(&self) -> bool {
        determinant(self.directions) < 0.0
    }

    /// Lowest and highest value present, or `None` when all are absent.
    pub fn range(&self) -> Option<(f64, f64)> {
        let [nx, ny, nz] = self.dims;
        let rows = (0..nz).flat_map(|k| (0..ny).map(move |j| [j, k]));
        let values = rows.flat_map(|[j, k]| (0..nx).filter_map(move |i| self.value([i, j, k])));
        values.fold(None, |range, v| match range {
            None => Some((v, v)),
            Some((low, high)) => Some((v.min(low), v.max(high))),
        })
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Signed volume of the cell that three directions span.
pub(crate) fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[cfg(test)]
mod tests;
