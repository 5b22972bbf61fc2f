//! What the caller of the real-time engine chooses, and what a frame amounted to.

use super::{Reuse, keep::Kept};
use crate::{
    Error, Lanes,
    march::slices::{Counts, MOST_CELLS, Seeds, Times},
};

/// A field made by particles, each of which contributes within its reach.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Metaball {
    /// (1 − s²)²/4, with s the distance in reaches: Triquet et al. 2001, Rosenberg & Birdwell 2008.
    #[default]
    Triquet,
    /// 1 − 4/9 s⁶ + 17/9 s⁴ − 22/9 s²: Wyvill et al. 1986.
    Wyvill,
    /// ρ² (1/s² − 1): Uralsky's inverse square, cut off at the reach.
    InverseSquare {
        /// ρ: the particle's radius in reaches.
        radius: f64,
    },
    /// The SPH colour field of the bulk road: cubic spline kernels weighed by the particles' volumes. Strengths and
    /// reaches of particles are not used.
    Sph,
}

/// Parameters of the real-time engine. Lengths in world units.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// The field that is summed.
    pub field: Metaball,
    /// Reach of a particle, R_c: beyond it, it contributes exactly nothing. > 0.
    pub reach: f64,
    /// Edge of a lattice cube, S. > 0, between a sixtieth and a thousand times the reach.
    pub spacing: f64,
    /// Isovalue, T: a corner is inside when its value is greater. > 0, default 0.2.
    pub iso: f64,
    /// Cubes of a block along each axis, 1 to 63; with [`Seeds::Particles`] also few enough that with margins of
    /// ⌈reach/spacing⌉ cubes on both sides there are at most 63. Default 39. One less than a multiple of 4 is best, since
    /// nodes are evaluated four by four along each axis and a block has one node more than cubes. With levels of detail
    /// blocks have the largest power of two of cubes that is not more than this: 32 by default.
    pub block: [usize; 3],
    /// How the surface is found.
    pub seeds: Seeds,
    /// Whether vertices get normals. Default on.
    pub normals: bool,
    /// Whether blocks that did not change are used again. Default off.
    pub reuse: Reuse,
    /// Vector unit.
    pub lanes: Lanes,
}

impl Params {
    /// Metaballs of this reach on cubes of this edge, with the paper's isovalue: a lone particle is a ball of a third of
    /// the reach.
    pub fn new(reach: f64, spacing: f64) -> Self {
        Self {
            field: Metaball::Triquet,
            reach,
            spacing,
            iso: 0.2,
            block: [39; 3],
            seeds: Seeds::Complete,
            normals: true,
            reuse: Reuse::Off,
            lanes: Lanes::Auto,
        }
    }

    /// Cubes of the margin around a block.
    pub(super) fn margin(&self) -> usize {
        match self.seeds {
            Seeds::Complete => 0,
            Seeds::Particles => (self.reach / self.spacing).ceil() as usize,
        }
    }

    /// Cubes of a block along each axis where blocks have levels: halved as often as can be.
    pub(super) fn block_of_levels(&self) -> [usize; 3] {
        self.block.map(|n| 1 << n.ilog2())
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first parameter that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let positive = |name, value: f64| {
            if value.is_normal() && value > 0.0 && (1.0 / value).is_normal() {
                Ok(())
            } else {
                Err(Error::Parameter { name, value, must: "an ordinary number greater than 0" })
            }
        };
        positive("reach", self.reach)?;
        positive("spacing", self.spacing)?;
        if !((self.iso as f32).is_normal() && self.iso > 0.0) {
            return Err(Error::Parameter { name: "iso", value: self.iso, must: "a finite number greater than 0" });
        }
        if let Metaball::InverseSquare { radius } = self.field
            && !(radius > 0.0 && radius <= 1.0)
        {
            return Err(Error::Parameter { name: "radius", value: radius, must: "greater than 0, at most 1 reach" });
        }
        let cells = self.reach / self.spacing;
        if !(1e-3..=60.0).contains(&cells) {
            let must = "at least a sixtieth of the reach and at most a thousand times";
            return Err(Error::Parameter { name: "spacing", value: self.spacing, must });
        }
        let most = MOST_CELLS - (2 * self.margin()).min(MOST_CELLS);
        for size in self.block {
            if size == 0 || size > most {
                let must = "1 to 63, less two margins where seeds come from particles";
                return Err(Error::Parameter { name: "block", value: size as f64, must });
            }
        }
        Ok(())
    }
}

/// Number of levels of detail that there can be: cells of 1 to 32 times the spacing.
pub const MOST_LEVELS: usize = 6;

/// What one frame amounted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Frame {
    /// Particles handed in.
    pub particles: usize,
    /// Blocks with particles, those left out not counted.
    pub blocks: usize,
    /// Those of them that had not changed and were used again; `counts` then tell of when they were marched.
    pub reused: usize,
    /// Blocks at each level of detail.
    pub levels: [usize; MOST_LEVELS],
    /// Vertices of the surface.
    pub vertices: usize,
    /// Triangles of the surface.
    pub triangles: usize,
    /// Triangles left out because a neighbouring block did not find the same surface; always 0 with [`Seeds::Complete`].
    pub unmatched: usize,
    /// What the blocks counted.
    pub counts: Counts,
    /// How long it took, by the clock given to [`Engine::set_clock`](super::Engine::set_clock).
    pub times: Times,
    /// Bytes of the particles on the lattice and their distribution to blocks.
    pub particle_bytes: usize,
    /// Bytes of the surfaces that are kept for [`Reuse::Unchanged`].
    pub kept_bytes: usize,
    /// Bytes by which blocks find each other's vertices; with levels of detail, the signs of all their nodes.
    pub seam_bytes: usize,
}

impl Frame {
    /// Counts a block in.
    pub(super) fn take<V>(&mut self, block: &Kept<V>) {
        self.counts.add(&block.piece.counts);
        if !block.reused {
            self.times.add(&block.piece.times);
        }
        self.reused += usize::from(block.reused);
    }
}
