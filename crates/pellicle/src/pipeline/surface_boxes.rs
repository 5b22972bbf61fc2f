//! The boxes of nodes around surface particles: where the paper's band looks.
//!
//! Surface particles are found by a colour field of their own, whatever the field of the surface is, so particles are sorted
//! once more, by its support. Where a field moves particles, their own places count.

use rayon::prelude::*;

use crate::{
    Control, Error, Params, Positions,
    bricks::marks::Nodes,
    field::surface_particles::{Finder, SUPPORT},
    lattice::Lattice,
    lookup::cells::Cells,
    math::simd::Unit,
};

/// Half of a box's edge in particle radii: two spacings.
const REACH: f64 = 4.0;

/// Reused from frame to frame.
#[derive(Default)]
pub(super) struct SurfaceBoxes {
    cells: Cells,
    finder: Finder,
    /// One for each surface particle.
    pub(super) boxes: Vec<Nodes>,
}

impl SurfaceBoxes {
    /// Bytes that are held of each particle, if all are surface particles.
    pub(super) const BYTES_PER_PARTICLE: u64 =
        Cells::BYTES_PER_PARTICLE + (Finder::COLUMNS * size_of::<f32>() + size_of::<Nodes>()) as u64;

    /// Forgets the boxes.
    pub(super) fn clear(&mut self) {
        self.boxes.clear();
    }

    /// Finds surface particles and makes the boxes around them. Radii that the particles bring, or the common one, say how wide the
    /// colour field and the boxes are; they were checked.
    pub(super) fn find(
        &mut self,
        unit: Unit,
        params: &Params,
        positions: Positions<'_>,
        control: &Control<'_>,
    ) -> Result<&[Nodes], Error> {
        let radii = positions.radii();
        let common = params.particle_radius;
        let largest = radii.map_or(common, |radii| radii.iter().copied().fold(0.0, f32::max).into());
        if !positions.is_empty() {
            let support = SUPPORT * largest;
            self.cells.build(positions, Lattice { spacing: params.spacing().min(support), support })?;
            let of = |radii: &[f32]| -> Vec<f32> {
                self.cells.order().iter().map(|&i| (f64::from(radii[i as usize]) / largest) as f32).collect()
            };
            self.finder.find(unit, &self.cells, radii.map(of).as_deref(), control);
            control.check()?;
            let (per_node, order, found) = (1.0 / params.spacing(), self.cells.order(), &self.finder.found);
            let surface = order.par_iter().zip(found).filter(|(_, found)| **found > 0.0).map(|(&i, _)| i as usize);
            self.boxes.par_extend(surface.map(|i| {
                let reach = REACH * radii.map_or(common, |radii| radii[i].into());
                positions
                    .get(i)
                    .map(|v| [((v - reach) * per_node).ceil() as i32, ((v + reach) * per_node).floor() as i32])
            }));
        }
        Ok(&self.boxes)
    }
}
