//! What the caller hands in: borrowed views of positions and attributes. Nothing is copied here.

mod spacing;
pub(crate) mod walls;

pub use spacing::infer_radius;
pub use walls::{Ghosts, Solid, Walls};

use crate::Error;

/// A borrowed view of particle positions in world units: packed `f32` or `f64` triples, or triples within larger records.
#[derive(Debug, Clone, Copy)]
pub struct Positions<'a> {
    view: View<'a>,
    radii: Option<&'a [f32]>,
}

#[derive(Debug, Clone, Copy)]
enum View<'a> {
    F32(&'a [[f32; 3]]),
    F64(&'a [[f64; 3]]),
    /// `values[i * stride ..][.. 3]` is particle i.
    Strided32 {
        values: &'a [f32],
        stride: usize,
    },
    Strided64 {
        values: &'a [f64],
        stride: usize,
    },
}

impl<'a> Positions<'a> {
    /// Positions within records of `stride` numbers, of which the first three are x, y, z: pass the slice from the
    /// first x on. A last record may be cut after its z.
    ///
    /// # Errors
    /// [`Error::Parameter`] when `stride` is below 3, [`Error::Length`] when the last record ends before its z.
    pub fn strided_f32(values: &'a [f32], stride: usize) -> Result<Self, Error> {
        check_stride(values.len(), stride)?;
        Ok(Self::of(View::Strided32 { values, stride }))
    }

    /// As [`strided_f32`](Self::strided_f32), in double precision.
    ///
    /// # Errors
    /// As [`strided_f32`](Self::strided_f32).
    pub fn strided_f64(values: &'a [f64], stride: usize) -> Result<Self, Error> {
        check_stride(values.len(), stride)?;
        Ok(Self::of(View::Strided64 { values, stride }))
    }

    fn of(view: View<'a>) -> Self {
        Self { view, radii: None }
    }

    /// The same particles, each with a radius of its own: half of its spacing at rest, in world units, finite and > 0.
    /// [`Params::particle_radius`](crate::Params::particle_radius) remains the unit of lengths that are counted in radii. What
    /// the radii do is the field's business, see [`ScalarField`](crate::ScalarField). A wrong number of them, or one that is
    /// none, is told when the work begins.
    #[must_use]
    pub fn with_radii(self, radii: &'a [f32]) -> Self {
        Self { radii: Some(radii), ..self }
    }

    /// The particles' own radii, where they have any.
    pub(crate) fn radii(&self) -> Option<&'a [f32]> {
        self.radii
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        match self.view {
            View::F32(p) => p.len(),
            View::F64(p) => p.len(),
            View::Strided32 { values, stride } => values.len().div_ceil(stride),
            View::Strided64 { values, stride } => values.len().div_ceil(stride),
        }
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of particle `i`, which must be below [`len`](Self::len).
    #[inline(always)]
    pub fn get(&self, i: usize) -> [f64; 3] {
        match self.view {
            View::F32(p) => p[i].map(f64::from),
            View::F64(p) => p[i],
            View::Strided32 { values, stride } => {
                let at = &values[i * stride..i * stride + 3];
                [f64::from(at[0]), f64::from(at[1]), f64::from(at[2])]
            }
            View::Strided64 { values, stride } => {
                let at = &values[i * stride..i * stride + 3];
                [at[0], at[1], at[2]]
            }
        }
    }
}

fn check_stride(len: usize, stride: usize) -> Result<(), Error> {
    if stride < 3 {
        return Err(Error::Parameter { name: "stride", value: stride as f64, must: "at least 3" });
    }
    if matches!(len % stride, 1 | 2) {
        return Err(Error::Length { what: "the last record".into(), found: len % stride, expected: 3 });
    }
    Ok(())
}

impl<'a> From<&'a [[f32; 3]]> for Positions<'a> {
    fn from(p: &'a [[f32; 3]]) -> Self {
        Self::of(View::F32(p))
    }
}

impl<'a> From<&'a [[f64; 3]]> for Positions<'a> {
    fn from(p: &'a [[f64; 3]]) -> Self {
        Self::of(View::F64(p))
    }
}

impl<'a> From<&'a Vec<[f32; 3]>> for Positions<'a> {
    fn from(p: &'a Vec<[f32; 3]>) -> Self {
        Self::of(View::F32(p))
    }
}

impl<'a> From<&'a Vec<[f64; 3]>> for Positions<'a> {
    fn from(p: &'a Vec<[f64; 3]>) -> Self {
        Self::of(View::F64(p))
    }
}

impl<'a, const N: usize> From<&'a [[f32; 3]; N]> for Positions<'a> {
    fn from(p: &'a [[f32; 3]; N]) -> Self {
        Self::of(View::F32(p))
    }
}

impl<'a, const N: usize> From<&'a [[f64; 3]; N]> for Positions<'a> {
    fn from(p: &'a [[f64; 3]; N]) -> Self {
        Self::of(View::F64(p))
    }
}

/// A borrowed values-per-particle channel to carry to the surface.
#[derive(Debug, Clone, Copy)]
pub struct Attribute<'a> {
    /// Name, passed on to the mesh.
    pub name: &'a str,
    /// Numbers per particle: 1 for a scalar, 3 for a vector. At least 1.
    pub components: usize,
    /// `components` values per particle, particle after particle.
    pub values: &'a [f32],
    /// How vertices get their values.
    pub carry: Carry,
}

impl<'a> Attribute<'a> {
    /// A channel whose mean is carried.
    pub fn new(name: &'a str, components: usize, values: &'a [f32]) -> Self {
        Self { name, components, values, carry: Carry::Mean }
    }

    /// How fast the surface moves along its outward normal, one number a vertex, from the particles' velocities, three a
    /// particle; in their unit. See [`Carry::NormalSpeed`].
    ///
    /// ```
    /// # use pellicle::{Attribute, Control, Params, Reconstructor};
    /// // A drop that falls.
    /// let (positions, velocities) = ([[0.0f32; 3]], [0.0, 0.0, -2.0]);
    /// let attributes = [Attribute::normal_speed("normal_velocity", &velocities)];
    /// let (params, control) = (Params { normals: true, ..Params::new(0.05) }, Control::default());
    /// let mut reconstructor = Reconstructor::new();
    /// let mesh = reconstructor.extract((&positions).into(), &attributes, &params, &control)?.to_mesh()?;
    /// for (speed, normal) in mesh.attributes[0].values.iter().zip(&mesh.normals) {
    ///     assert!((speed - -2.0 * normal[2]).abs() < 1e-5);
    /// }
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    pub fn normal_speed(name: &'a str, velocities: &'a [f32]) -> Self {
        Self { name, components: 3, values: velocities, carry: Carry::NormalSpeed }
    }

    /// Numbers per vertex: as many as per particle, but for a speed one.
    pub fn width(&self) -> usize {
        if self.carry == Carry::NormalSpeed { 1 } else { self.components }
    }

    /// How vertices made from others get theirs: once it is there a speed is a number like any other.
    pub fn carry_on(&self) -> Carry {
        if self.carry == Carry::NormalSpeed { Carry::Mean } else { self.carry }
    }
}

/// How a vertex gets its value of an attribute: from the particles around, later from vertices that it takes the place of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Carry {
    /// Their mean, weighted by what each contributes to the field, or by how near each vertex is.
    #[default]
    Mean,
    /// The nearest one's: for ids and types, whose mean means nothing. Of equally near ones the first in canonical order
    /// (by cell, then by index) counts, of vertices the first.
    Nearest,
    /// Of particle velocities: the speed of the surface along its outward normal, one number. Where the field is a sum over
    /// the particles (SPH, anisotropic, metaballs), that of the level set: φ_t/|∇φ| with φ_t = −Σ ∇w_i·v_i, what each particle
    /// brings held fixed. Else the normal part of their weighted mean. Of vertices the mean.
    NormalSpeed,
}
