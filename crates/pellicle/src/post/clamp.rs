//! A surface cut at a box and closed on its faces.
//!
//! Six [cuts](super::cut) in turn: the lower and the upper face of x, of y, of z. What is beyond a face goes; where the
//! surface leaves the box flat caps close it. The box need not lie on the lattice: the vertices of a cap have the coordinate
//! of its face to the last bit, edges and corners of the box are sharp. A box that is full of fluid becomes the surface.
//!
//! Unlike choosing particles in a box, which makes the fluid end there, the fluid goes on beyond and the cut runs through it.
//!
//! Source: this project.

use super::cut::{Plane, cut};
use crate::{Control, Error, Mesh};

/// A closed box in world units. Infinite bounds are open sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lower corner.
    pub min: [f64; 3],
    /// The upper corner.
    pub max: [f64; 3],
}

impl Bounds {
    pub(super) fn check(&self) -> Result<(), Error> {
        for (min, max) in self.min.into_iter().zip(self.max) {
            if min.is_nan() || max.is_nan() || min >= max {
                return Err(Error::Parameter { name: "min", value: min, must: "below max in every coordinate" });
            }
        }
        Ok(())
    }
}

/// Keeps what is within the box, and closes it. Closed manifolds stay such; attributes and normals are carried as by
/// [`cut`].
///
/// ```
/// # use pellicle::{Control, Params, mesh::Report, post::clamp::{Bounds, clamp}};
/// let positions: Vec<[f32; 3]> = (0..125).map(|i| [i % 5, i / 5 % 5, i / 25].map(|v| v as f32 * 0.1)).collect();
/// let mut mesh = pellicle::reconstruct(&positions, &Params::new(0.05))?;
/// clamp(&mut mesh, &Bounds { min: [0.1; 3], max: [0.3; 3] }, &Control::default())?;
/// let report = Report::of(&mesh);
/// assert!(report.closed_manifold() && (report.signed_volume - 0.008).abs() < 1e-8);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a box without inside, the others of [`cut`]. When cancelled the mesh may be cut at some faces.
pub fn clamp(mesh: &mut Mesh, bounds: &Bounds, control: &Control<'_>) -> Result<(), Error> {
    bounds.check()?;
    for a in 0..3 {
        for (sign, bound) in [(-1.0, bounds.min[a]), (1.0, bounds.max[a])] {
            if bound.is_finite() {
                let mut normal = [0.0; 3];
                normal[a] = sign;
                cut(mesh, &Plane { normal, offset: sign * bound }, control)?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, mesh::Report, reconstruct};

    #[test]
    fn a_box_in_full_fluid_is_the_surface_and_elsewhere_it_cuts() {
        let positions: Vec<[f32; 3]> =
            (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(|v| 40.0 + v as f32 * 0.1)).collect();
        let all = reconstruct(&positions, &Params::new(0.05)).unwrap();
        for (min, max, volume) in [
            ([40.2; 3], [40.45, 40.61, 40.7], Some(0.25 * 0.41 * 0.5)),
            ([40.5, 39.0, 40.2], [42.0, 40.4, 40.5], None),
            ([f64::NEG_INFINITY; 3], [40.3, f64::INFINITY, f64::INFINITY], None),
            ([50.0; 3], [51.0; 3], Some(0.0)),
        ] {
            let mut mesh = all.clone();
            clamp(&mut mesh, &Bounds { min, max }, &Control::default()).unwrap();
            let report = Report::of(&mesh);
            assert!(report.closed_manifold() && report.nan_vertices == 0, "{report:?}");
            let [low, high] = [min, max].map(|bound: [f64; 3]| bound.map(|x| x as f32));
            assert!(mesh.vertices.iter().all(|v| (0..3).all(|a| low[a] <= v[a] && v[a] <= high[a])));
            match volume {
                Some(volume) => assert!((report.signed_volume - volume).abs() < 1e-5, "{report:?}"),
                None => assert!(report.signed_volume > 0.01 && report.components == 1),
            }
        }
    }

    #[test]
    fn a_box_without_inside_is_refused() {
        let refuse = |min, max| clamp(&mut Mesh::default(), &Bounds { min, max }, &Control::default()).is_err();
        assert!(refuse([0.0; 3], [1.0, 0.0, 1.0]) && refuse([f64::NAN, 0.0, 0.0], [1.0; 3]));
    }
}
