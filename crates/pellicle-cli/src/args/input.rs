//! Options about the particles that come in, shared by all verbs that read them.

use clap::{Args, ValueEnum};
use pellicle_io::{RawType, Up};

use crate::values::parse_positive;

/// Which particles, and how to read them.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Input")]
pub struct InputArgs {
    /// Keep particles where this holds: 'type==0 && density>500' [default: all]
    #[arg(long = "where", value_name = "CONDITION")]
    pub condition: Option<String>,
    /// Keep particles in this box, X,Y,Z each; '-' is open [default: all]
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], allow_hyphen_values = true)]
    pub crop: Option<Vec<String>>,
    /// Multiply lengths and velocities of IN, first of all [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = parse_positive)]
    pub scale: Option<f64>,
    /// The axis of IN that points up, for pictures and GLB
    #[arg(long, value_name = "y|z", default_value = "y", hide_possible_values = true)]
    pub up: UpArg,
    /// Array, key or group of a file that has several [default: the usual]
    #[arg(long, value_name = "NAME")]
    pub array: Option<String>,
    /// Time step of a file that has several, from 0 [default: 0]
    #[arg(long, value_name = "N")]
    pub step: Option<usize>,
    /// Numbers of raw files [default: f64 if named .f64, else f32]
    #[arg(long, value_name = "f32|f64", hide_possible_values = true)]
    pub raw: Option<RawArg>,
    /// Leave out positions that are NaN or infinite [default: they are errors]
    #[arg(long)]
    pub drop_invalid: bool,
}

/// The axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum UpArg {
    /// As in Houdini and SPlisHSPlasH.
    #[default]
    Y,
    /// As in Blender and DualSPHysics.
    Z,
}

impl From<UpArg> for Up {
    fn from(up: UpArg) -> Self {
        match up {
            UpArg::Y => Up::Y,
            UpArg::Z => Up::Z,
        }
    }
}

/// The type of raw numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RawArg {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

impl From<RawArg> for RawType {
    fn from(raw: RawArg) -> Self {
        match raw {
            RawArg::F32 => RawType::F32,
            RawArg::F64 => RawType::F64,
        }
    }
}
