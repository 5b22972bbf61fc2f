//! Where the samples of a volume lie in the world.

use crate::error::Error;
use crate::source::Source;

/// The place of each sample: node `(i, j, k)` lies at `origin + i · steps[0] + j · steps[1] + k · steps[2]`.
///
/// The steps hold the spacing; they need not be at right angles, and may be left-handed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// The first sample.
    pub origin: [f64; 3],
    /// From one sample to the next along each axis.
    pub steps: [[f64; 3]; 3],
}

impl Default for Grid {
    fn default() -> Grid {
        Grid::new([0.0; 3], [1.0; 3])
    }
}

impl Grid {
    /// Along the axes of the world.
    pub fn new(origin: [f64; 3], spacing: [f64; 3]) -> Grid {
        let [x, y, z] = spacing;
        Grid { origin, steps: [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]] }
    }

    /// The place of a sample, or between samples.
    pub fn point(&self, [i, j, k]: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = &self.steps;
        std::array::from_fn(|axis| self.origin[axis] + (i * a[axis] + j * b[axis] + k * c[axis]))
    }

    /// Lengths of the steps.
    pub fn spacing(&self) -> [f64; 3] {
        self.steps.map(|step| step.iter().map(|x| x * x).sum::<f64>().sqrt())
    }

    /// The volume that the steps span; negative where they are left-handed.
    pub fn determinant(&self) -> f64 {
        let [a, b, c] = &self.steps;
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    }

    /// The same, from the centres of cells whose corners this tells.
    pub(super) fn at_centers(mut self) -> Grid {
        self.origin = self.point([0.5; 3]);
        self
    }

    /// Refuses what no place follows from.
    pub(super) fn check(&self, source: &Source<'_>) -> Result<(), Error> {
        self.problem().map_or(Ok(()), |what| Err(source.fail(what)))
    }

    /// What is wrong with it, if anything is.
    pub fn problem(&self) -> Option<String> {
        if !self.origin.iter().chain(self.steps.as_flattened()).all(|x| x.is_finite()) {
            return Some("the origin and the directions of the volume's axes are not all finite".into());
        }
        let spacing = self.spacing();
        if let Some(axis) = spacing.iter().position(|&length| length == 0.0 || !length.is_finite()) {
            let (length, name) = (spacing[axis], ["x", "y", "z"][axis]);
            return Some(format!("the spacing along {name} is {length}: it must be finite and not 0"));
        }
        let flat = self.determinant().abs() / (spacing[0] * spacing[1] * spacing[2]);
        // NaN where the products overflow.
        if flat.is_nan() || flat < 1e-6 {
            return Some("the directions of the volume's axes lie in a plane, so that its cells have no volume".into());
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_without_volume_are_told_apart_from_left_handed_ones() {
        assert_eq!(Grid::new([1.0, 2.0, 3.0], [0.5, -1.0, 2.0]).problem(), None);
        assert_eq!(Grid::new([0.0; 3], [1e-100, 1e-100, 1.0]).problem(), None);
        assert!(Grid::new([0.0; 3], [1.0, 0.0, 1.0]).problem().unwrap().contains("along y is 0"));
        assert!(Grid::new([f64::NAN; 3], [1.0; 3]).problem().unwrap().contains("finite"));
        let flat = Grid { origin: [0.0; 3], steps: [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] };
        assert!(flat.problem().unwrap().contains("plane"));
    }

    #[test]
    fn centres_lie_half_a_step_further() {
        let grid = Grid::new([1.0, 2.0, 3.0], [2.0, 4.0, -6.0]).at_centers();
        assert_eq!(grid.origin, [2.0, 4.0, 0.0]);
        assert_eq!(grid.point([1.0, 0.0, 0.0]), [4.0, 4.0, 0.0]);
    }
}
