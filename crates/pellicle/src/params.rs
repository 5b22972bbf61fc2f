//! What the caller chooses. Lengths are in world units unless a name says otherwise.

mod scalar_field;

pub use scalar_field::{
    AnisotropicParams, FieldParameter, MetaballKernel, MetaballParams, OnderikParams, ScalarField, SolenthalerParams,
    ZhuBridsonParams,
};

use crate::Error;

/// Where the field is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Band {
    /// Only where the surface can be. The mesh equals that of [`Band::Full`]: tested on real and adversarial data, not
    /// proven (see `docs/`).
    #[default]
    Auto,
    /// At every node that any particle's support reaches.
    Full,
    /// The narrow band of Akinci et al. 2012: nodes within two spacings of a [surface particle](crate::surface_particles) along
    /// each axis; a cell has triangles only if all its eight nodes are such. They are those of [`Band::Full`], but **there may be
    /// holes**, where the surface lies farther from surface particles: meshes need not be closed. Marching cubes only, and no
    /// [`Walls`](crate::Walls).
    Paper,
}

/// Which vector unit computes. Every choice gives the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lanes {
    /// The widest that this machine has.
    #[default]
    Auto,
    /// AVX-512 (F, BW, DQ, VL), one register of 16 lanes.
    Avx512,
    /// AVX2, two registers of 8 lanes.
    Avx2,
    /// Plain Rust on arrays of 16, which the compiler vectorises as it can: with NEON on 64-bit Arm, where it was not
    /// tested.
    Portable,
}

/// Parameters of a surface of particles. Radii and factors follow splashsurf, so that its users can switch.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// Particle radius r_p: half of the rest spacing. World units, > 0.
    pub particle_radius: f64,
    /// What the surface is a level set of.
    pub field: ScalarField,
    /// Smoothing length in particle radii; the field's support radius is twice it, so this is also the support radius in
    /// spacings. > 0, default 2 (support 4 r_p) for the SPH field; [`ScalarField::smoothing_length`] tells others.
    pub smoothing_length: f64,
    /// Edge of a lattice cell in particle radii. > 0, default 0.5.
    pub cell_size: f64,
    /// Isovalue: a sample is inside when it is greater. Default 0.6 for the SPH field; [`ScalarField::iso`] tells others and
    /// the unit. > 0 for fields that are 0 outside; those that measure distance also take 0 and less.
    pub iso: f64,
    /// Where to evaluate.
    pub band: Band,
    /// Whether vertices get normals from the field's gradient. Default off.
    pub normals: bool,
    /// Bytes that sorted particles, lattice data and the mesh (unless it is written in chunks) may take together. `None`: no
    /// limit. Work is cut into blocks to fit, with the same mesh, or refused with the number needed. Buffers of about a
    /// megabyte a thread come on top.
    pub max_memory: Option<u64>,
    /// Vector unit.
    pub lanes: Lanes,
}

impl Params {
    /// The defaults for particles of this radius: those of the SPH field.
    pub fn new(particle_radius: f64) -> Self {
        Self::with_field(particle_radius, ScalarField::Sph)
    }

    /// The defaults of a field for particles of this radius.
    ///
    /// ```
    /// use pellicle::{Params, ScalarField, SolenthalerParams};
    ///
    /// let params = Params::with_field(0.025, ScalarField::Solenthaler(SolenthalerParams::default()));
    /// assert_eq!((params.support(), params.iso), (0.2, 0.0));
    /// ```
    pub fn with_field(particle_radius: f64, field: ScalarField) -> Self {
        Self {
            particle_radius,
            field,
            smoothing_length: field.smoothing_length(),
            cell_size: 0.5,
            iso: field.iso(),
            band: Band::Auto,
            normals: false,
            max_memory: None,
            lanes: Lanes::Auto,
        }
    }

    /// Support radius of the field in world units: how far a particle of this radius reaches.
    pub fn support(&self) -> f64 {
        2.0 * self.smoothing_length * self.particle_radius
    }

    /// Edge of a lattice cell in world units.
    pub fn spacing(&self) -> f64 {
        self.cell_size * self.particle_radius
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first parameter that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let positive = |name, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(Error::Parameter { name, value, must: "a finite number greater than 0" })
            }
        };
        positive("particle_radius", self.particle_radius)?;
        positive("smoothing_length", self.smoothing_length)?;
        positive("cell_size", self.cell_size)?;
        self.field.check(self)?;
        let (support, spacing) = (self.support(), self.spacing());
        if !(support.is_normal() && spacing.is_normal() && (1.0 / support).is_normal()) {
            let (value, must) = (self.particle_radius, "a length whose products and reciprocals are ordinary numbers");
            return Err(Error::Parameter { name: "particle_radius", value, must });
        }
        // Below, one particle's surface has more triangles than can be indexed; above, no node meets a particle.
        if !(1e-5..=1e6).contains(&(spacing / support)) {
            let (value, must) = (self.cell_size, "between 1e-5 and 1e6 times the support in radii");
            return Err(Error::Parameter { name: "cell_size", value, must });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_in_range() {
        assert_eq!(Params::new(0.025).check(), Ok(()));
        assert_eq!(Params::new(1e-30).check(), Ok(()));
    }

    #[test]
    fn what_overflows_or_vanishes_is_refused_by_name() {
        let name = |params: Params| match params.check() {
            Err(Error::Parameter { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320, f64::MAX] {
            assert_eq!(name(Params::new(radius)), "particle_radius", "{radius}");
        }
        for cell_size in [1e-9, 1e9, 0.0, f64::NAN] {
            assert_eq!(name(Params { cell_size, ..Params::new(1.0) }), "cell_size", "{cell_size}");
        }
        assert_eq!(name(Params { iso: -0.1, ..Params::new(1.0) }), "iso");
        assert_eq!(name(Params { smoothing_length: 0.0, ..Params::new(1.0) }), "smoothing_length");
    }
}
