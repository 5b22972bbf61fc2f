//! Fewer triangles: the edges whose loss changes the surface least collapse.
//!
//! Every vertex has a quadric, the sum over its triangles of area times squared distance to the triangle's plane. An edge
//! collapses to the place where the sum of its two quadrics is least, and that sum is its cost. Work goes in rounds: all edges
//! whose cost is the least of every edge at their two vertices and at the neighbors of these collapse at once. No two of them
//! touch each other's triangles, so the outcome is that of one after the other, in any order, and the same bytes for any
//! number of threads. A round looks only at the cheaper half of the vertices, which keeps the order close to that of one
//! queue.
//!
//! To each quadric comes a small share of the squared distance to the line through the vertex along its normal. It hardly
//! counts where the surface bends, and spreads the vertices evenly where it is flat and any place would do.
//!
//! An edge stays when the surface would change its topology (the link condition), a triangle would turn by more than 78
//! degrees or lose its shape, or one of its ends is at an open border or where more than two triangles share an edge. So a
//! closed manifold stays one, with the same components and genus, and borders stay as they are. Attributes and normals are
//! interpolated along the edge; of those that say so ([`Carry::Nearest`](crate::Carry::Nearest)) the nearer end's stays.
//!
//! Source: Garland & Heckbert, Surface Simplification Using Quadric Error Metrics, 1997; Liu, Rahimzadeh & Zordan,
//! Controlling Quadric Error Simplification with Line Quadrics, 2025; Dey et al., Topology Preserving Edge Contraction,
//! 1999, for the link condition. The rounds are this project's.

mod collapse;
mod fans;
mod quadric;

use super::{
    check,
    rebuild::{NONE, merge},
};
use crate::{Control, Error, Mesh};
use collapse::Shrinking;

/// Where decimation ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// At this number of triangles, or at one less where an even number must go. More are left where no edge may collapse.
    Triangles(usize),
    /// At this share of the triangles, from 0 to 1.
    Share(f64),
    /// Before a collapse moves a vertex farther than this from the planes of the triangles that it stands for, in world
    /// units: root of the mean square by area, the spread along the surface included with a small weight. An estimate, not a
    /// bound: single points may lie a few times as far from the first surface.
    Error(f64),
}

impl Default for Target {
    /// A quarter of the triangles.
    fn default() -> Self {
        Self::Share(0.25)
    }
}

impl Target {
    pub(super) fn check(&self) -> Result<(), Error> {
        match *self {
            Self::Share(share) if !(0.0..=1.0).contains(&share) => {
                Err(Error::Parameter { name: "share", value: share, must: "between 0 and 1" })
            }
            Self::Error(error) if !(error >= 0.0 && error.is_finite()) => {
                Err(Error::Parameter { name: "error", value: error, must: "0 or greater" })
            }
            _ => Ok(()),
        }
    }

    /// Triangles that must be left, and the error that is allowed.
    fn limits(&self, triangles: usize) -> (usize, f64) {
        match *self {
            Self::Triangles(left) => (left, f64::INFINITY),
            Self::Share(share) => ((share * triangles as f64).round() as usize, f64::INFINITY),
            Self::Error(error) => (0, error),
        }
    }
}

/// Collapses edges until the target is met or none may collapse. Vertices without triangles go.
///
/// ```
/// # use pellicle::{Control, Params, mesh::Report, post::decimate::{Target, decimate}};
/// let mut mesh = pellicle::reconstruct(&[[0.0f32; 3], [0.05, 0.0, 0.0]], &Params::new(0.025))?;
/// decimate(&mut mesh, Target::Triangles(100), &Control::default())?;
/// assert!(mesh.triangles.len() <= 100 && Report::of(&mesh).closed_manifold());
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a target out of range, [`Error::Count`] for an index that names no vertex, [`Error::Length`] for
/// an attribute of the wrong length, [`Error::Cancelled`]; the mesh is then as it was.
pub fn decimate(mesh: &mut Mesh, target: Target, control: &Control<'_>) -> Result<(), Error> {
    target.check()?;
    check(mesh)?;
    let (left, error) = target.limits(mesh.triangles.len());
    if left >= mesh.triangles.len() {
        return Ok(());
    }
    let mut work = mesh.clone();
    let mut shrinking = Shrinking::new(&work, error);
    while shrinking.triangles() > left {
        control.check()?;
        if !shrinking.round(&mut work, left) {
            break;
        }
    }
    shrinking.finish(&mut work);
    let mut target = vec![NONE; work.vertices.len()];
    work.triangles.as_flattened().iter().for_each(|&v| target[v as usize] = v);
    merge(&mut work, &target);
    *mesh = work;
    Ok(())
}

#[cfg(test)]
mod tests;
