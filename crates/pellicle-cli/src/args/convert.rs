//! `convert IN OUT` as typed.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use pellicle_io::AttributeChoice;

use super::TalkArgs;
use crate::values::{parse_attributes, parse_positive};

/// `convert IN OUT`.
#[derive(Debug, Args)]
#[command(
    after_help = "A file with faces is a mesh; any other holds particles. A mesh becomes particles, its vertices, where OUT can\n\
hold particles only. What OUT has no room for is left out, and said."
)]
pub struct ConvertArgs {
    /// Particle or mesh file
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// File to write; the extension chooses the format
    #[arg(value_name = "OUT")]
    pub output: PathBuf,

    /// Where IN holds several sets of particles: the name of the one to read, such as an array of an NPZ archive
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub array: Option<String>,
    /// Where IN holds several time steps: the one to read, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Input")]
    pub frame: usize,
    /// What the numbers of a raw IN without header are [default: f64 for .f64, else f32]
    #[arg(long, value_name = "f32|f64", hide_possible_values = true, help_heading = "Input")]
    pub raw: Option<RawArg>,
    /// Attributes to keep: all, none, or NAME,...
    #[arg(long, value_name = "NAMES", value_parser = parse_attributes, default_value = "all", help_heading = "Input")]
    pub attributes: AttributeChoice,
    /// Leave out particles whose position is NaN or infinite, and count them; a mesh with such vertices is refused
    #[arg(long, help_heading = "Input")]
    pub drop_invalid: bool,

    /// Multiply all lengths by this: positions, radius and velocity (length per time)
    #[arg(long, value_name = "FACTOR", value_parser = parse_positive, default_value = "1", help_heading = "Output")]
    pub scale: f64,
    /// Which axis of IN points up: a .glb, whose y is up, turns z up to y up; other formats keep the coordinates
    #[arg(long, value_name = "y|z", default_value = "y", hide_possible_values = true, help_heading = "Output")]
    pub up: UpArg,
    /// Metres in a unit of length, after --scale, for formats that are in metres (.glb)
    #[arg(long, value_name = "METRES", value_parser = parse_positive, default_value = "1", help_heading = "Output")]
    pub metres_per_unit: f64,

    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// The numbers of a raw file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RawArg {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UpArg {
    /// The second.
    Y,
    /// The third.
    Z,
}
