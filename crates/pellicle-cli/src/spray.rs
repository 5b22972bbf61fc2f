//! Isolated particles go their own way: a drop that touches no other is a sphere, which a renderer draws better and cheaper
//! than a mesh does.
//!
//! Its surface is its own, so without it the rest of the mesh is what it was. Its radius is the particle radius: half of the
//! spacing at rest. (A lone particle's surface by the colour field is a sphere, too, of about the same size.)

use std::path::Path;

use pellicle::{Control, IsolationParams, Params, isolated};
use pellicle_io::{AttributeValues, ParticleAttribute, Particles};

use crate::choose::retain::{copy, retain};
use crate::failure::Failure;

/// Takes the isolated particles out of `particles` and returns them, in the file's order, with all attributes that were read
/// and a `radius`, their own or the particle radius of `params`, unless they have one; `radii` stays beside `particles`. Runs in the current rayon pool. `path` is their
/// file, for messages.
///
/// # Errors
/// A position that is not finite, a radius that is none, an interruption.
pub fn split(
    particles: &mut Particles,
    radii: &mut Option<Vec<f32>>,
    params: &Params,
    control: &Control<'_>,
    path: &Path,
) -> Result<Particles, Failure> {
    let isolation = IsolationParams::of(params);
    let is_spray = isolated(particles.positions.view(), &isolation, control).map_err(|e| Failure::core(path, e))?;
    let mut spray = copy(particles, &is_spray);
    let is_kept: Vec<bool> = is_spray.into_iter().map(|s| !s).collect();
    retain(particles, &is_kept);
    let own = radii.as_mut().map(|radii| {
        let (mut gone, mut kept) = (Vec::new(), is_kept.iter());
        radii.retain(|&radius| {
            let stays = kept.next() != Some(&false);
            gone.extend((!stays).then_some(radius));
            stays
        });
        gone
    });
    if spray.attribute("radius").is_none() {
        let values = own.unwrap_or_else(|| vec![params.particle_radius as f32; spray.positions.len()]);
        let values = AttributeValues::F32(values);
        spray.attributes.push(ParticleAttribute { name: "radius".into(), components: 1, values });
    }
    Ok(spray)
}

#[cfg(test)]
mod tests {
    use pellicle_io::PositionData;

    use super::*;

    fn particles() -> Particles {
        let id = AttributeValues::I64(vec![10, 11, 12, 13]);
        Particles {
            positions: PositionData::F32(vec![[9.0; 3], [0.0; 3], [-9.0; 3], [0.1; 3]]),
            attributes: vec![ParticleAttribute { name: "id".into(), components: 1, values: id }],
        }
    }

    fn take(particles: &mut Particles) -> Particles {
        let path = Path::new("a.ply");
        split(particles, &mut None, &Params::new(0.25), &Control::default(), path).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn lone_particles_leave_with_their_attributes_and_a_radius() {
        let mut rest = particles();
        let spray = take(&mut rest);
        assert_eq!(rest.positions, PositionData::F32(vec![[0.0; 3], [0.1; 3]]));
        assert_eq!(rest.attributes.len(), 1);
        assert_eq!(rest.attributes[0].values, AttributeValues::I64(vec![11, 13]));
        assert_eq!(spray.positions, PositionData::F32(vec![[9.0; 3], [-9.0; 3]]));
        assert_eq!(spray.attribute("id").map(|a| &a.values), Some(&AttributeValues::I64(vec![10, 12])));
        assert_eq!(spray.attribute("radius").map(|a| &a.values), Some(&AttributeValues::F32(vec![0.25; 2])));
        assert_eq!(take(&mut rest).positions.len(), 0);
    }

    #[test]
    fn a_radius_of_their_own_is_kept() {
        let mut rest = particles();
        rest.attributes[0].name = "radius".into();
        let spray = take(&mut rest);
        assert_eq!(spray.attributes.len(), 1);
        assert_eq!(spray.attributes[0].values, AttributeValues::I64(vec![10, 12]));
    }

    #[test]
    fn the_other_surface_is_what_it_was() {
        let mut rest = particles();
        let PositionData::F32(all) = rest.positions.clone() else { panic!() };
        let params = Params::new(0.25);
        let whole = pellicle::reconstruct(&all, &params).unwrap_or_else(|e| panic!("{e}"));
        take(&mut rest);
        let PositionData::F32(rest) = &rest.positions else { panic!() };
        let part = pellicle::reconstruct(rest, &params).unwrap_or_else(|e| panic!("{e}"));
        let near = |v: &&[f32; 3]| v.iter().all(|x| x.abs() < 5.0);
        let (left, mut right): (Vec<_>, Vec<_>) =
            (part.vertices.clone(), whole.vertices.iter().filter(near).copied().collect());
        let order = |a: &[f32; 3], b: &[f32; 3]| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal);
        let mut left = left;
        left.sort_by(order);
        right.sort_by(order);
        assert!(!left.is_empty() && left == right);
    }
}
