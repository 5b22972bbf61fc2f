//! Options about the volumes that come in, shared by the verbs that read them.

use clap::{Args, ValueEnum};
use pellicle_io::{Axes, SampleType};

use crate::values::{parse_dims, parse_point, parse_sample_type};

/// How to read a volume, beyond what its file says.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Volumes")]
pub struct VolumeArgs {
    /// Which number of each sample, from 0, where there are several
    #[arg(long, value_name = "N")]
    pub component: Option<usize>,
    /// Index order of NumPy arrays [default: zyx]
    #[arg(long, value_name = "zyx|xyz", hide_possible_values = true)]
    pub axes: Option<AxesArg>,
    /// Distance of samples along each axis [default: the file's, else 1]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub spacing: Option<[f64; 3]>,
    /// Place of the first sample [default: the file's, else 0,0,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub origin: Option<[f64; 3]>,
    /// Read raw numbers: samples along x, y, z, and numbers per sample if several
    #[arg(long, value_name = "X,Y,Z[,N]", value_parser = parse_dims)]
    pub dims: Option<[u64; 4]>,
    /// Raw numbers: i8 u8 i16 u16 i32 u32 i64 u64 f16 f32 f64 [default: f32]
    #[arg(long = "type", value_name = "TYPE", value_parser = parse_sample_type, requires = "dims")]
    pub kind: Option<SampleType>,
    /// Raw numbers: order of their bytes [default: little]
    #[arg(long, value_name = "little|big", hide_possible_values = true, requires = "dims")]
    pub endian: Option<EndianArg>,
    /// Raw numbers: bytes before the first [default: 0]
    #[arg(long, value_name = "BYTES", requires = "dims")]
    pub skip: Option<u64>,
}

impl VolumeArgs {
    /// The first of these options that was given, if any was.
    pub fn given(&self) -> Option<&'static str> {
        let all = [
            ("--component", self.component.is_some()),
            ("--axes", self.axes.is_some()),
            ("--spacing", self.spacing.is_some()),
            ("--origin", self.origin.is_some()),
            ("--dims", self.dims.is_some()),
        ];
        all.iter().find(|(_, is_given)| *is_given).map(|(name, _)| *name)
    }
}

/// Index order of NumPy arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum AxesArg {
    /// `array[z][y][x]`.
    Zyx,
    /// `array[x][y][z]`.
    Xyz,
}

impl From<AxesArg> for Axes {
    fn from(axes: AxesArg) -> Self {
        match axes {
            AxesArg::Zyx => Axes::Zyx,
            AxesArg::Xyz => Axes::Xyz,
        }
    }
}

/// Order of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EndianArg {
    /// The least byte first.
    Little,
    /// The greatest byte first.
    Big,
}
