//! `convert`: its options.

use std::path::PathBuf;

use clap::Args;
use pellicle_io::AttributeChoice;

use super::{FrameArgs, InputArgs, RunArgs, VolumeArgs};
use crate::values::{parse_attributes, parse_positive};

/// `convert IN OUT`.
#[derive(Debug, Args)]
#[command(
    disable_help_flag = true,
    after_help = "A file with faces is a mesh; grids of samples are volumes; any other holds particles. A mesh becomes particles,\n\
its vertices, where OUT can hold particles only. What OUT has no room for is left out, and said. File types: pellicle formats"
)]
pub struct ConvertArgs {
    /// Particle, mesh or volume file, a folder, a .pvd, or a pattern such as frame_####.vtk
    #[arg(value_name = "IN", required_unless_present_any = ["config", "print_config"])]
    pub input: Option<PathBuf>,
    /// File to write, pattern or .pvd; the extension chooses the format
    #[arg(value_name = "OUT", required_unless_present_any = ["config", "print_config"])]
    pub output: Option<PathBuf>,
    /// Attributes to keep: all, none, velocity or NAME,...
    #[arg(long, value_name = "NAMES", value_parser = parse_attributes, default_value = "all", help_heading = "Output")]
    pub attributes: AttributeChoice,
    /// Metres in a unit of length, after --scale, for formats that are in metres (GLB)
    #[arg(long, value_name = "METRES", value_parser = parse_positive, default_value = "1", help_heading = "Output")]
    pub metres_per_unit: f64,
    /// Which particles.
    #[command(flatten)]
    pub from: InputArgs,
    /// How to read volumes.
    #[command(flatten)]
    pub volume: VolumeArgs,
    /// Which frames.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// The run.
    #[command(flatten)]
    pub run: RunArgs,
}
