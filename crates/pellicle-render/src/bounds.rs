//! The box around what is drawn: what an automatic camera frames.

use crate::vector::Vec3;

/// An axis-parallel box in world units. May be empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least coordinates; above `max` when the box is empty.
    pub min: [f64; 3],
    /// Largest coordinates.
    pub max: [f64; 3],
}

/// Beyond this a coordinate is taken for a mistake and not framed: squares of larger ones overflow.
const FARTHEST: f64 = 1e100;

impl Bounds {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// Whether nothing is in the box.
    pub fn is_empty(&self) -> bool {
        !(0..3).all(|a| self.min[a] <= self.max[a])
    }

    /// The least box around both: for a camera that serves a whole sequence of frames.
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|a| self.min[a].min(other.min[a])),
            max: std::array::from_fn(|a| self.max[a].max(other.max[a])),
        }
    }

    /// Grows to hold a point. Points that are not finite, or further than 1e100 from the origin, are left out.
    pub fn add(&mut self, point: [f64; 3]) {
        self.add_ball(point, 0.0);
    }

    pub(crate) fn add_ball(&mut self, centre: Vec3, radius: f64) {
        let fits = |x: f64| x.abs() <= FARTHEST;
        if centre.iter().all(|&x| fits(x)) && fits(radius) {
            for a in 0..3 {
                self.min[a] = self.min[a].min(centre[a] - radius);
                self.max[a] = self.max[a].max(centre[a] + radius);
            }
        }
    }

    /// Centre and half of the edges of a box that a camera can frame: nothing becomes the unit box at the origin, a single
    /// point a box of half a unit around it.
    pub(crate) fn framed(&self) -> (Vec3, Vec3) {
        if self.is_empty() {
            return ([0.0; 3], [0.5; 3]);
        }
        let centre: Vec3 = std::array::from_fn(|a| self.min[a] / 2.0 + self.max[a] / 2.0);
        let half: Vec3 = std::array::from_fn(|a| self.max[a] / 2.0 - self.min[a] / 2.0);
        let largest = half.iter().fold(0.0f64, |most, &x| most.max(x));
        let farthest = centre.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        // Below a few steps of the numbers themselves there is nothing to see.
        if largest > farthest * 1e-14 && largest > 1e-100 {
            (centre, half)
        } else {
            (centre, [0.5f64.max(farthest * 1e-9); 3])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_and_a_point_can_be_framed() {
        assert_eq!(Bounds::EMPTY.framed(), ([0.0; 3], [0.5; 3]));
        let mut bounds = Bounds::EMPTY;
        bounds.add([1.0, 2.0, 3.0]);
        assert!(!bounds.is_empty());
        assert_eq!(bounds.framed(), ([1.0, 2.0, 3.0], [0.5; 3]));
    }

    #[test]
    fn what_is_not_a_place_is_left_out() {
        let mut bounds = Bounds::EMPTY;
        bounds.add([f64::NAN, 0.0, 0.0]);
        bounds.add([0.0, f64::INFINITY, 0.0]);
        bounds.add([0.0, 1e200, 0.0]);
        assert!(bounds.is_empty());
        bounds.add([0.0; 3]);
        bounds.add([2.0, 0.0, 0.0]);
        assert_eq!(bounds.framed(), ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
    }
}
