//! `contour`: its options.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use pellicle::VertexNormals;

use super::input::UpArg;
use super::volume::VolumeArgs;
use super::{FinishArgs, FrameArgs, MachineArgs, RunArgs};
use crate::values::{IsoValues, Labels, parse_isos, parse_labels, parse_positive};

/// `contour IN`.
#[derive(Debug, Args)]
#[command(
    disable_help_flag = true,
    after_help = "Inside is where values are greater than the isovalue. What is in a file, with a value to try: pellicle info FILE\n\
Patterns: ####, {}, %04d, $F4. File types: pellicle formats"
)]
pub struct ContourArgs {
    /// Volume files: one, several, or a pattern such as step_####.vti
    #[arg(value_name = "IN", required_unless_present_any = ["config", "print_config"])]
    pub input: Vec<PathBuf>,
    /// Mesh file, pattern, folder/ or .pvd [default: IN with .ply]
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Draw each mesh to this PNG file or pattern [default: no picture]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub png: Option<PathBuf>,
    /// Metres in a unit of length, for formats that are in metres (GLB) [default: the file's unit, else 1]
    #[arg(long, value_name = "METRES", value_parser = parse_positive, help_heading = "Output")]
    pub metres_per_unit: Option<f64>,

    /// What the surface is.
    #[command(flatten)]
    pub surface: ContourSurfaceArgs,

    /// What is done to it.
    #[command(flatten)]
    pub finish: FinishArgs,

    /// Array of a file that has several [default: the active or the first]
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub array: Option<String>,
    /// Time step of a file that has several, from 0 [default: 0]
    #[arg(long, value_name = "N", help_heading = "Input")]
    pub step: Option<usize>,
    /// Keep samples in this box, X,Y,Z each; '-' is open [default: all]
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], allow_hyphen_values = true, help_heading = "Input")]
    pub crop: Option<Vec<String>>,
    /// Multiply lengths of IN, first of all [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = parse_positive, help_heading = "Input")]
    pub scale: Option<f64>,
    /// The axis of IN that points up, for pictures and GLB
    #[arg(long, value_name = "y|z", default_value = "z", hide_possible_values = true, help_heading = "Input")]
    pub up: UpArg,
    /// How to read it.
    #[command(flatten)]
    pub from: VolumeArgs,

    /// Which frames.
    #[command(flatten)]
    pub frames: FrameArgs,

    /// What it may take.
    #[command(flatten)]
    pub machine: MachineArgs,
    /// The run.
    #[command(flatten)]
    pub run: RunArgs,
}

/// The parameters that decide the surface.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Surface")]
pub struct ContourSurfaceArgs {
    /// Value at the surface; of several each has its own file OUT_V
    #[arg(short, long, value_name = "V,...", value_parser = parse_isos, allow_hyphen_values = true)]
    pub iso: Option<IsoValues>,
    /// In place of an isovalue the surface of each label: all but 0, or those named; each its own file OUT_LABEL
    #[arg(
        long,
        value_name = "all|A,B,...",
        value_parser = parse_labels,
        allow_hyphen_values = true,
        conflicts_with_all = ["iso", "method", "normals"]
    )]
    pub labels: Option<Labels>,
    /// Close the surface where the volume ends [default: this]
    #[arg(long, conflicts_with = "open")]
    pub closed: bool,
    /// Let the surface end where the volume ends
    #[arg(long)]
    pub open: bool,
    /// Keep the connected piece of largest area only
    #[arg(long)]
    pub largest: bool,
    /// How cells become triangles: the first three are marching cubes, the others tetrahedra
    #[arg(long, value_name = "METHOD", default_value = "classic")]
    pub method: MethodArg,
    /// Normals of vertices: from the samples' gradient or from the triangles around
    #[arg(long, value_name = "FROM", default_value = "off")]
    pub normals: VolumeNormalsArg,
}

/// How cells become triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// One table: by signs alone, the fastest.
    Classic,
    /// Faces as the bilinear interpolant.
    Consistent,
    /// Cells as the trilinear interpolant, with its tunnels.
    Topological,
    /// Five tetrahedra a cell.
    Tetra5,
    /// Six tetrahedra a cell.
    Tetra6,
    /// The body-centred lattice.
    Bcc,
    /// The same on a sheared lattice.
    Simplex,
    /// Body-centred, with well-shaped triangles.
    Regularised,
}

/// Where normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum VolumeNormalsArg {
    /// None.
    Off,
    /// The samples.
    Gradient,
    /// The triangles.
    Faces,
}

impl From<VolumeNormalsArg> for VertexNormals {
    fn from(normals: VolumeNormalsArg) -> Self {
        match normals {
            VolumeNormalsArg::Off => Self::Off,
            VolumeNormalsArg::Gradient => Self::Gradient,
            VolumeNormalsArg::Faces => Self::Faces,
        }
    }
}
