//! Particle files in: one file per format.
//!
//! Positions keep the precision of the file. Attributes are read only when asked for; the others are passed over.
//! Positions that are NaN or infinite are handed on as they are: what to do about them is not the reader's decision.

pub(crate) mod bgeo;
pub(crate) mod bi4;
pub(crate) mod csv;
pub(crate) mod hdf5;
mod join;
pub(crate) mod json;
mod json_nodes;
pub(crate) mod lammps;
pub(crate) mod npy;
pub(crate) mod npy_header;
pub(crate) mod npz;
pub(crate) mod ply;
pub(crate) mod pvd;
pub(crate) mod text_xyz;
pub(crate) mod vtk;
pub(crate) mod vtu;
pub(crate) mod write_bgeo;
pub(crate) mod write_csv;
pub(crate) mod write_json;
pub(crate) mod write_npy;
pub(crate) mod write_ply;
pub(crate) mod write_text_xyz;
pub(crate) mod write_xyz;
pub(crate) mod xyz;

use std::borrow::Cow;
use std::path::Path;

use pellicle::Positions;

use crate::error::Error;
use crate::formats::catalog::ReadParticles;
use crate::formats::detect;
use crate::meshes::WriteOptions;
use crate::output::Written;

pub use pvd::{PvdEntry, read_pvd};

/// Positions as the file has them.
#[derive(Debug, Clone, PartialEq)]
pub enum PositionData {
    /// Single precision.
    F32(Vec<[f32; 3]>),
    /// Double precision.
    F64(Vec<[f64; 3]>),
}

impl PositionData {
    /// A view for the core's calls.
    pub fn view(&self) -> Positions<'_> {
        match self {
            PositionData::F32(positions) => Positions::from(positions),
            PositionData::F64(positions) => Positions::from(positions),
        }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        match self {
            PositionData::F32(positions) => positions.len(),
            PositionData::F64(positions) => positions.len(),
        }
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Default for PositionData {
    fn default() -> Self {
        PositionData::F32(Vec::new())
    }
}

/// Values of an attribute. Smaller integers are widened to `i32`, `u32` and `u64` to `i64` (beyond its range they
/// saturate).
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValues {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
    /// Integers of up to 32 bits.
    I32(Vec<i32>),
    /// Integers of up to 64 bits.
    I64(Vec<i64>),
}

impl AttributeValues {
    /// Number of values: particles times components.
    pub fn len(&self) -> usize {
        match self {
            AttributeValues::F32(values) => values.len(),
            AttributeValues::F64(values) => values.len(),
            AttributeValues::I32(values) => values.len(),
            AttributeValues::I64(values) => values.len(),
        }
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A values-per-particle channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticleAttribute {
    /// The name, translated: Houdini's `v`, `N`, `Cd` and `pscale` are `velocity`, `normal`, `color` and `radius`. Colours
    /// count from 0 to 1.
    pub name: String,
    /// Numbers per particle: 1 for a scalar, 3 for a vector.
    pub components: usize,
    /// `components` values per particle, particle after particle.
    pub values: AttributeValues,
}

impl ParticleAttribute {
    /// The values in single precision, as the core takes them; borrowed where the file has them so.
    pub fn to_f32(&self) -> Cow<'_, [f32]> {
        match &self.values {
            AttributeValues::F32(values) => Cow::Borrowed(values),
            AttributeValues::F64(values) => values.iter().map(|&v| v as f32).collect(),
            AttributeValues::I32(values) => values.iter().map(|&v| v as f32).collect(),
            AttributeValues::I64(values) => values.iter().map(|&v| v as f32).collect(),
        }
    }

    /// With colours from 0 to 1, as Houdini, glTF and OBJ have them, where the file has bytes: whole numbers up to 255, of
    /// which, where they may be fractions, some are greater than 1.
    pub(crate) fn with_unit_colors(mut self) -> ParticleAttribute {
        if self.name != "color" || !matches!(self.components, 3 | 4) {
            return self;
        }
        // In place where the numbers have the same size.
        self.values = match self.values {
            AttributeValues::I32(v) if v.iter().all(|v| (0..=255).contains(v)) => {
                AttributeValues::F32(v.into_iter().map(|v| v as f32 / 255.0).collect())
            }
            AttributeValues::I64(v) if v.iter().all(|v| (0..=255).contains(v)) => {
                AttributeValues::F32(v.into_iter().map(|v| v as f32 / 255.0).collect())
            }
            AttributeValues::F32(v) if are_bytes(v.iter().map(|&v| f64::from(v))) => {
                AttributeValues::F32(v.into_iter().map(|v| v / 255.0).collect())
            }
            AttributeValues::F64(v) if are_bytes(v.iter().copied()) => {
                AttributeValues::F64(v.into_iter().map(|v| v / 255.0).collect())
            }
            other => other,
        };
        self
    }
}

/// Whether parts of colours are whole numbers up to 255, some of them greater than 1.
fn are_bytes(mut parts: impl Iterator<Item = f64>) -> bool {
    let is_byte = |v: f64| (0.0..=255.0).contains(&v) && v.fract() == 0.0;
    parts.try_fold(0.0f64, |most, v| is_byte(v).then_some(most.max(v))).is_some_and(|most| most > 1.0)
}

/// The particles of one file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Particles {
    /// One position per particle.
    pub positions: PositionData,
    /// The attributes that were asked for, in the order of the file.
    pub attributes: Vec<ParticleAttribute>,
}

impl Particles {
    /// The attribute of this name, if it was read.
    pub fn attribute(&self, name: &str) -> Option<&ParticleAttribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }
}

/// Which attributes to read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AttributeChoice {
    /// The velocity, if the file has one.
    #[default]
    Velocity,
    /// Every attribute that is made of numbers.
    All,
    /// Positions only.
    None,
    /// These, by the name in the file or the translated one. One that is missing is an error.
    Names(Vec<String>),
}

impl AttributeChoice {
    /// Whether an attribute of this name in memory is among those that are asked for, by this name or by one that a
    /// format has for it.
    pub fn wants(&self, name: &str, components: usize) -> bool {
        match self {
            AttributeChoice::Velocity => name == "velocity",
            AttributeChoice::All => true,
            AttributeChoice::None => false,
            AttributeChoice::Names(names) => {
                names.iter().any(|n| n == name || crate::formats::names::canonical(n, components) == name)
            }
        }
    }
}

/// How to read particles.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ReadOptions {
    /// Which attributes to read; the others cost no memory.
    pub attributes: AttributeChoice,
    /// Attributes to read besides, by name; one that is missing is an error. What a selection looks at need not be
    /// carried further.
    pub also: Vec<String>,
    /// Where a file holds several sets of particles: the name of the one to read, such as an array of an NPZ archive,
    /// a key of a JSON object or a group of an HDF5 file. Formats without names refuse it.
    pub array: Option<String>,
    /// Which time step to read where a file holds several, counted from 0. One that is not there is an error.
    pub frame: usize,
    /// What the numbers of a file without header are.
    pub raw: RawType,
}

/// The type of the numbers in raw files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RawType {
    /// As the extension says (`.f64`), else single precision.
    #[default]
    Auto,
    /// Single precision, little-endian.
    F32,
    /// Double precision, little-endian.
    F64,
}

impl ReadOptions {
    /// For a format that holds one set of particles, without a name: refuses what would choose among several.
    pub(crate) fn single(&self, path: &Path, format_name: &str) -> Result<(), Error> {
        self.refuse_array(path, format_name)?;
        self.refuse_frame(path, format_name)
    }

    /// For a format that has no names for sets of particles.
    pub(crate) fn refuse_array(&self, path: &Path, format_name: &str) -> Result<(), Error> {
        let Some(array) = &self.array else { return Ok(()) };
        let what = format!("there are no named arrays in {format_name}, so '{array}' cannot be chosen: leave it out");
        Err(Error::Unsupported { path: path.into(), what })
    }

    /// For a format that holds one time step.
    pub(crate) fn refuse_frame(&self, path: &Path, format_name: &str) -> Result<(), Error> {
        if self.frame == 0 {
            return Ok(());
        }
        let what = format!(
            "{format_name} holds one time step, number 0, so number {} cannot be chosen: leave it out",
            self.frame
        );
        Err(Error::Unsupported { path: path.into(), what })
    }

    /// Whether the attribute is to be read that is `name` in memory and `original` in the file.
    pub(crate) fn wants(&self, name: &str, original: &str) -> bool {
        if self.also.iter().any(|n| n == name || n == original) {
            return true;
        }
        match &self.attributes {
            AttributeChoice::Velocity => name == "velocity",
            AttributeChoice::All => true,
            AttributeChoice::None => false,
            AttributeChoice::Names(names) => names.iter().any(|n| n == name || n == original),
        }
    }

    /// Checks that every attribute asked for by name is among `(name, original)`.
    pub(crate) fn check<'a>(
        &self,
        path: &Path,
        found: impl Iterator<Item = (&'a str, &'a str)> + Clone,
    ) -> Result<(), Error> {
        let named = match &self.attributes {
            AttributeChoice::Names(names) => names.as_slice(),
            _ => &[],
        };
        for name in named.iter().chain(&self.also) {
            if !found.clone().any(|(n, original)| n == name || original == name) {
                let available = found.map(|(n, _)| n.to_owned()).collect();
                return Err(Error::NoAttribute { path: path.into(), name: name.clone(), available });
            }
        }
        Ok(())
    }
}

/// Reads the particles of a file. The format follows from the file's extension, or from its first bytes where the
/// extension tells nothing.
///
/// Read are:
/// - raw little-endian triples (`.xyz`, `.raw`, `.f32`; `.f64`);
/// - text, plain or gzipped: tables (`.csv`, `.tsv`, `.txt`, `.dat`), XYZ and extended XYZ (`.xyz`, `.extxyz`; several
///   frames), LAMMPS dumps (`.dump`, `.lammpstrj`; several frames), JSON (`.json`; parts by their path);
/// - NumPy arrays (`.npy`) and archives (`.npz`; arrays by name);
/// - PLY, Houdini's classic BGEO, DualSPHysics' BI4;
/// - legacy VTK; VTU and VTP (ASCII, base64 or appended; zlib, LZ4 or LZMA); of ParaView's lists of files (`.pvd`, `.pvtu`,
///   `.pvtp`) a step with all its parts;
/// - with the feature `hdf5` HDF5 of SWIFT, Gadget, PySPH and VTKHDF, and any dataset of three columns.
///
/// [`ReadOptions::array`] and [`ReadOptions::frame`] choose where there are several; formats that hold one set of
/// particles refuse both. Every text is kept in double precision.
///
/// # Errors
/// Whatever [`Error`] names except for its `Length` and `Sink`. Nothing that a file contains makes this panic, or use memory out of proportion to
/// the file's size.
pub fn read_particles(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let read = detect::particles(path)?.read_particles;
    match read {
        Some(read) => read_by(read, path, options),
        None => Err(Error::Unsupported { path: path.into(), what: "particles of this format are not read".into() }),
    }
}

/// Reads by the reader of a format, and does what is the same for all formats.
pub(crate) fn read_by(read: ReadParticles, path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    let mut particles = read(path, options)?;
    particles.attributes = particles.attributes.into_iter().map(ParticleAttribute::with_unit_colors).collect();
    Ok(particles)
}

/// Writes particles in the format that the extension of `path` names: PLY, classic BGEO (compressed where the name ends in
/// `.bgeo.gz`), legacy VTK, VTU, VTP, raw (`.xyz` in single, `.f64` in double precision), extended XYZ, CSV, NPY, NPZ or
/// JSON.
///
/// Positions and attributes keep their precision where the format has it. What it has no room for is left out or narrowed,
/// and told by the result: raw and NPY files hold positions only; BGEO is in single precision; integers of 64 bits become
/// narrower ones in PLY and BGEO where all fit.
///
/// # Errors
/// As [`write_mesh`](crate::write_mesh); JSON cannot hold numbers that are not finite.
pub fn write_particles(path: &Path, particles: &Particles, options: &WriteOptions) -> Result<Written, Error> {
    let write = detect::particles_out(path)?;
    let count = particles.positions.len();
    for attribute in &particles.attributes {
        let (found, expected) = (attribute.values.len(), count.saturating_mul(attribute.components));
        if found != expected {
            let what = format!("the attribute '{}'", attribute.name);
            return Err(Error::Length { path: path.into(), what, found: found as u64, expected: expected as u64 });
        }
    }
    write(path, particles, options)
}

/// The names of all attributes, for formats that leave them out.
fn attribute_names(particles: &Particles) -> Vec<String> {
    particles.attributes.iter().map(|attribute| attribute.name.clone()).collect()
}
