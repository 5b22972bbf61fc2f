//! `--crop MIN MAX`: the particles within a box.
//!
//! The box is closed: particles on its faces stay. Coordinates are those after `--scale`. The surface closes at the cut: what
//! is left is meshed as if there was nothing else, so a wall of triangles appears there, about a particle radius beyond the
//! last particles, and particles near it are less dense than they were. To look into a fluid rather cut the mesh (`--clamp`, which
//! is written in the same way).

use std::array;

/// A closed box; infinite bounds are open sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crop {
    min: [f64; 3],
    max: [f64; 3],
}

const FORM: &str = "write two corners, such as 0,0,0 1,2.5,1 (- leaves a side open)";

impl Crop {
    /// From the words after `--crop`: two corners `x,y,z`, or six numbers. `-` leaves a side open, as do `-inf` and `inf`.
    ///
    /// # Errors
    /// What is no number, too many or too few, and a MIN above its MAX, by axis.
    pub fn parse<S: AsRef<str>>(words: &[S]) -> Result<Self, String> {
        let corners: Vec<Vec<&str>> = words.iter().map(|word| fields(word.as_ref())).collect();
        if corners.len() == 2 && corners.iter().any(|corner| corner.len() != 3) {
            let counts: Vec<String> = corners.iter().map(|corner| corner.len().to_string()).collect();
            return Err(format!("the corners have {} coordinates, 3 and 3 are needed: {FORM}", counts.join(" and ")));
        }
        let fields = corners.concat();
        let Ok(fields) = <[&str; 6]>::try_from(fields.as_slice()) else {
            return Err(format!("{} numbers, 6 are needed: {FORM}", fields.len()));
        };
        let mut bounds = [0.0; 6];
        for (i, (bound, field)) in bounds.iter_mut().zip(fields).enumerate() {
            let open = if i < 3 { f64::NEG_INFINITY } else { f64::INFINITY };
            let number = if field == "-" { Ok(open) } else { field.parse::<f64>() };
            *bound = match number {
                Ok(value) if !value.is_nan() => value,
                _ => return Err(format!("'{field}' is not a number: {FORM}")),
            };
        }
        let crop = Self { min: array::from_fn(|a| bounds[a]), max: array::from_fn(|a| bounds[a + 3]) };
        for (a, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (min, max) = (crop.min[a], crop.max[a]);
            if min > max {
                return Err(format!("MIN is above MAX in {axis}: {min} > {max} (the smaller corner comes first)"));
            }
            if min == f64::INFINITY || max == f64::NEG_INFINITY {
                return Err(format!("the box is empty in {axis}: {min} to {max}"));
            }
        }
        Ok(crop)
    }

    /// Whether a position lies in the box or on its faces; one that is NaN does not.
    pub fn contains(&self, position: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= position[a] && position[a] <= self.max[a])
    }

    /// The corners, for records and reports.
    pub fn corners(&self) -> [[f64; 3]; 2] {
        [self.min, self.max]
    }
}

/// Numbers between commas or blanks. An empty one, as in `1,,2`, stays, to be complained about.
fn fields(word: &str) -> Vec<&str> {
    if word.contains(',') { word.split(',').map(str::trim).collect() } else { word.split_whitespace().collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_six_numbers_mean_the_same() {
        let crop = Crop { min: [0.0, -1.5, 2.0], max: [1.0, 2e3, 2.0] };
        for words in [&["0,-1.5,2", "1,2e3,2"][..], &["0", "-1.5", "2", "1", "2e3", "2"], &["0, -1.5, 2", "1 2000 2"]] {
            assert_eq!(Crop::parse(words), Ok(crop), "{words:?}");
        }
        let open = Crop::parse(&["-,-inf,0", "-,5,inf"]).unwrap();
        let inf = f64::INFINITY;
        assert_eq!(open.corners(), [[-inf, -inf, 0.0], [inf, 5.0, inf]]);
    }

    #[test]
    fn faces_belong_to_the_box() {
        let crop = Crop::parse(&["0,0,0", "1,1,1"]).unwrap();
        assert!(crop.contains([0.0, 0.5, 1.0]) && crop.contains([1.0; 3]));
        for out in [[-1e-12, 0.5, 0.5], [0.5, 1.0 + 1e-12, 0.5], [0.5, 0.5, f64::NAN], [f64::INFINITY, 0.5, 0.5]] {
            assert!(!crop.contains(out), "{out:?}");
        }
        assert!(Crop::parse(&["-,-,-", "-,-,-"]).unwrap().contains([1e300, -1e300, 0.0]));
    }

    #[test]
    fn mistakes_are_named() {
        for (words, hint) in [
            (&["0,0,0", "1,1"][..], "3 and 2 coordinates"),
            (&["0,0,0"], "3 numbers, 6 are needed"),
            (&["0", "0", "0", "1", "1"], "5 numbers"),
            (&["0,0,a", "1,1,1"], "'a' is not a number"),
            (&["0,,0", "1,1,1"], "'' is not a number"),
            (&["0,nan,0", "1,1,1"], "'nan' is not a number"),
            (&["0,2,0", "1,1,1"], "in y: 2 > 1"),
            (&["0,0,inf", "1,1,1"], "in z"),
            (&["0,0,inf", "1,1,inf"], "empty in z"),
            (&["-inf,0,0", "-inf,1,1"], "empty in x"),
        ] {
            let message = Crop::parse(words).unwrap_err();
            assert!(message.contains(hint), "{words:?}: {message}");
        }
    }
}
