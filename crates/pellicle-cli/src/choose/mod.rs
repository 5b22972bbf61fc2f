//! Which of a file's particles make the surface: `--scale`, `--drop-invalid`, `--crop`, `--where`, in this order.
//!
//! So a crop is in scaled units, and an expression sees scaled values and no NaN position. A particle whose position is not
//! finite is an error unless it is dropped: a crop does not hide it. Each particle that goes is counted once, by the first
//! that refuses it. `index` in an expression is the number in the file, whatever else is left out.
//!
//! Marks are gathered first, one byte a particle, and applied at once, in place.

pub mod crop;
pub mod expression;
pub mod retain;
#[cfg(test)]
mod sample;
pub mod transform;

use std::path::Path;

use pellicle::Error;
use pellicle_io::Particles;
use rayon::prelude::*;

use crate::failure::Failure;
use crop::Crop;
use expression::Expression;

/// What to keep of a file, and at what size. The default keeps everything.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Factor for positions and what scales with them, finite and greater than 0.
    pub scale: Option<f64>,
    /// What becomes of particles whose positions are not finite.
    pub invalid: Invalid,
    /// Particles outside this box are left out.
    pub crop: Option<Crop>,
    /// Particles that do not satisfy this are left out. The attributes that it names must have been read.
    pub filter: Option<Expression>,
}

/// What to do about positions that are NaN or infinite.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Invalid {
    /// The first one is an error.
    #[default]
    Refuse,
    /// They are left out.
    Drop,
    /// They are no concern, but lie in no box.
    Keep,
}

/// What became of a file's particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Chosen {
    /// Left out, as their position is not finite.
    pub dropped_invalid: usize,
    /// Left out, as they lie outside the box.
    pub cropped: usize,
    /// Left out by the expression.
    pub filtered: usize,
    /// The others.
    pub kept: usize,
}

impl Choice {
    /// The attributes that must be read besides those that are carried.
    pub fn names(&self) -> Vec<String> {
        let names = self.filter.iter().flat_map(Expression::names);
        names.map(str::to_owned).collect()
    }

    /// What decides the result, a line each, for the output's header.
    pub fn record(&self) -> Vec<String> {
        let scale = self.scale.map(|factor| format!("scale {factor}"));
        let crop = self.crop.as_ref().map(|crop| {
            let [[x, y, z], [u, v, w]] = crop.corners();
            format!("crop {x},{y},{z} {u},{v},{w}")
        });
        let filter = self.filter.as_ref().map(|filter| format!("where {}", filter.text()));
        [scale, crop, filter].into_iter().flatten().collect()
    }

    /// Scales the particles, and leaves out those that are not wanted. Runs in the current rayon pool. `path` is their file,
    /// for messages.
    ///
    /// # Errors
    /// The first position that is not finite, where some particles are to be chosen and such ones refused; an expression
    /// that does not fit the attributes.
    pub fn apply(&self, particles: &mut Particles, path: &Path) -> Result<Chosen, Failure> {
        let before = particles.positions.len();
        // Without a choice nobody is left out, and the reconstruction looks at every position itself; but of what a scale
        // makes infinite the position in the file is told here.
        let looks_at_all = self.invalid == Invalid::Drop || (self.invalid == Invalid::Refuse && self.scale.is_some());
        if self.crop.is_none() && self.filter.is_none() && !looks_at_all {
            if let Some(factor) = self.scale {
                transform::scale(particles, factor);
            }
            return Ok(Chosen { kept: before, ..Chosen::default() });
        }
        if let Some(factor) = self.scale {
            transform::scale(particles, factor);
        }
        let mut chosen = Chosen::default();
        let mut keep = self.finite(particles, path)?;
        let mut left = count(&keep);
        chosen.dropped_invalid = before - left;
        let mut went = |keep: &[bool]| {
            let now = count(keep);
            std::mem::replace(&mut left, now) - now
        };
        if let Some(crop) = &self.crop {
            let view = particles.positions.view();
            keep.par_iter_mut().enumerate().with_min_len(1 << 12).for_each(|(i, keep)| {
                *keep &= crop.contains(view.get(i));
            });
            chosen.cropped = went(&keep);
        }
        if let Some(filter) = &self.filter {
            let bound =
                filter.bind(particles).map_err(|error| Failure::file(path, format_args!("--where: {error}")))?;
            bound.narrow(&mut keep);
            chosen.filtered = went(&keep);
        }
        chosen.kept = left;
        retain::retain(particles, &keep);
        Ok(chosen)
    }

    /// Marks the particles whose positions are finite.
    fn finite(&self, particles: &Particles, path: &Path) -> Result<Vec<bool>, Failure> {
        let view = particles.positions.view();
        let is_finite = |i: usize| view.get(i).iter().all(|v| v.is_finite());
        let keep: Vec<bool> = (0..view.len()).into_par_iter().with_min_len(1 << 12).map(is_finite).collect();
        match (self.invalid, keep.iter().position(|&k| !k)) {
            (Invalid::Refuse, Some(index)) => {
                Err(Failure::core(path, Error::NotFinite { index, position: view.get(index) }))
            }
            (Invalid::Keep, Some(_)) => Ok(vec![true; keep.len()]),
            _ => Ok(keep),
        }
    }
}

fn count(keep: &[bool]) -> usize {
    keep.iter().filter(|&&k| k).count()
}

#[cfg(test)]
mod tests {
    use pellicle_io::{AttributeValues, PositionData};

    use super::*;
    use sample::sample;

    fn choice(scale: f64, crop: &[&str], filter: &str) -> Choice {
        Choice {
            scale: Some(scale),
            invalid: Invalid::Drop,
            crop: Some(Crop::parse(crop).unwrap()),
            filter: Some(Expression::parse(filter).unwrap()),
        }
    }

    #[test]
    fn everything_stays_by_default() {
        let mut particles = sample(7);
        let chosen = Choice::default().apply(&mut particles, Path::new("a")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(chosen, Chosen { kept: 7, ..Chosen::default() });
        assert_eq!(particles, sample(7));
    }

    #[test]
    fn steps_run_in_order_and_count_each_particle_once() {
        let mut particles = sample(20);
        let PositionData::F64(positions) = &mut particles.positions else { panic!() };
        positions[3][1] = f64::NAN;
        positions[15][2] = f64::INFINITY;
        // In scaled units the box holds the particles 4 to 12; of these the even ones stay, by their number in the file.
        let choice = choice(0.5, &["2,-,-", "6,6,6"], "index % 2 == 0 and id == index and x < 5.5");
        assert_eq!(choice.names(), ["id"]);
        let chosen = choice.apply(&mut particles, Path::new("a")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(chosen, Chosen { dropped_invalid: 2, cropped: 9, filtered: 5, kept: 4 });
        assert_eq!(particles.attributes[0].values, AttributeValues::I32(vec![4, 6, 8, 10]));
        assert_eq!(particles.positions, PositionData::F64(vec![[2.0; 3], [3.0; 3], [4.0; 3], [5.0; 3]]));
    }

    #[test]
    fn an_invalid_position_is_an_error_though_cropped_away() {
        let mut particles = sample(5);
        let PositionData::F64(positions) = &mut particles.positions else { panic!() };
        positions[2][0] = f64::NAN;
        let choice = Choice { invalid: Invalid::Refuse, ..choice(1.0, &["0,0,0", "1,1,1"], "x < 9") };
        let message = choice.apply(&mut particles, Path::new("a.ply")).unwrap_err().to_string();
        assert!(message.contains("a.ply: particle 2") && message.contains("--drop-invalid"), "{message}");
    }

    #[test]
    fn what_scaling_overflows_is_named() {
        let mut particles =
            Particles { positions: PositionData::F32(vec![[1.0; 3], [1e38; 3]]), attributes: Vec::new() };
        let choice = Choice { scale: Some(100.0), ..Choice::default() };
        let message = choice.apply(&mut particles, Path::new("a.ply")).unwrap_err().to_string();
        assert!(message.contains("particle 1"), "{message}");
    }

    #[test]
    fn an_expression_that_does_not_fit_names_the_file_and_the_option() {
        let choice = choice(1.0, &["-,-,-", "-,-,-"], "uvw.x > 1");
        let message = choice.apply(&mut sample(3), Path::new("a.ply")).unwrap_err().to_string();
        assert!(message.starts_with("a.ply: --where: ") && message.contains("did you mean uv?"), "{message}");
    }
}
