//! `mesh`: its options.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use pellicle_io::AttributeChoice;

use super::{FinishArgs, FrameArgs, InputArgs, MachineArgs, RunArgs, WatchArgs};
use crate::values::{parse_attributes, parse_finite, parse_positive};

/// `mesh IN`.
#[derive(Debug, Args)]
#[command(
    disable_help_flag = true,
    override_usage = "pellicle mesh [OPTIONS] IN...",
    after_help = "IN: files, a folder, a .pvd, a pattern: frame_####.vtk ({}, %04d, $F4). RADII: multiples of -r"
)]
pub struct MeshArgs {
    /// Particle files: one, several, a folder, a .pvd, or a pattern such as frame_####.vtk
    #[arg(value_name = "IN", hide = true, required_unless_present_any = ["config", "print_config"])]
    pub input: Vec<PathBuf>,
    /// Mesh file, pattern, folder/ or .pvd [default: IN with .ply]
    #[arg(short, long, value_name = "OUT", alias = "output-file", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Draw each mesh to this PNG file or pattern [default: no picture]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub png: Option<PathBuf>,
    /// Write particles without neighbours here [default: mesh them]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub spray: Option<PathBuf>,
    /// velocity, normal_velocity, all, none, NAME,... [default: velocity]
    #[arg(long, value_name = "NAMES", value_parser = parse_attributes, help_heading = "Output")]
    pub attributes: Option<AttributeChoice>,
    /// Unit normals from the field's gradient
    #[arg(long, value_name = "on|off", default_value = "off", hide_possible_values = true, help_heading = "Output")]
    pub normals: Switch,

    /// What the surface is.
    #[command(flatten)]
    pub surface: SurfaceArgs,

    /// What is done to it.
    #[command(flatten)]
    pub finish: FinishArgs,

    /// Which particles.
    #[command(flatten)]
    pub from: InputArgs,
    /// Which frames.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// And frames to come.
    #[command(flatten)]
    pub watch: WatchArgs,

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
pub struct SurfaceArgs {
    /// Particle radius, half the spacing at rest [default: inferred]
    #[arg(short, long, alias = "particle-radius", value_name = "LENGTH", value_parser = parse_positive)]
    pub radius: Option<f64>,
    /// Scalar field; pellicle fields lists them [default: sph]
    #[arg(long, value_name = "FIELD")]
    pub field: Option<String>,
    /// Smoothing length; larger is smoother [default: the field's; sph 2]
    #[arg(short = 'l', long)]
    #[arg(value_name = "RADII", value_parser = parse_positive)]
    pub smoothing_length: Option<f64>,
    /// Edge of a lattice cell; half: 4 times the faces
    #[arg(short, long, alias = "cube-size")]
    #[arg(value_name = "RADII", value_parser = parse_positive, default_value = "0.5")]
    pub cell: f64,
    /// Field at the surface [default: the field's; sph 0.6]
    #[arg(short, long, alias = "surface-threshold", allow_negative_numbers = true)]
    #[arg(value_name = "VALUE", value_parser = parse_finite)]
    pub threshold: Option<f64>,
    /// Attribute with each particle's own radius [default: one for all]
    #[arg(long, value_name = "NAME")]
    pub radius_attribute: Option<String>,
    /// Near the surface, all, or as Akinci 2012 (holes)
    #[arg(long, value_name = "auto|full|paper", default_value = "auto", hide_possible_values = true, hide = true)]
    pub band: BandArg,
    /// Cut as tetra5, tetra6, bcc, simplex, regularised
    #[arg(long, value_name = "NAME", default_value = "cubes", hide_possible_values = true)]
    pub method: CellArg,
}

/// How cells become triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CellArg {
    /// Marching cubes.
    Cubes,
    /// Five tetrahedra a cell, alternating.
    Tetra5,
    /// Six tetrahedra a cell.
    Tetra6,
    /// The body-centred lattice.
    Bcc,
    /// The same tetrahedra, under their other name.
    Simplex,
    /// Body-centred, with well-shaped triangles.
    Regularised,
}

/// A choice written as a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Do.
    On,
    /// Don't.
    Off,
}

/// Where to evaluate the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BandArg {
    /// Near the surface.
    Auto,
    /// Everywhere.
    Full,
    /// Near surface particles.
    Paper,
}
