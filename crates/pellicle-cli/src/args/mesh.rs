//! `mesh`: its options.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use pellicle_io::AttributeChoice;

use super::{ConfigArgs, FrameArgs, InputArgs, TalkArgs, VerboseArgs, WatchArgs};
use crate::values::{parse_attributes, parse_positive, parse_size, parse_threads};

/// `mesh IN`.
#[derive(Debug, Args)]
#[command(
    after_help = "Lengths \"in radii\" are multiples of the particle radius -r. The kernel's support radius is 2*l*r.\n\
The mesh has the same bytes whatever --threads, --max-memory and --band are."
)]
pub struct MeshArgs {
    /// Particle files: one, several, a folder, a .pvd, or a pattern (frame_####.vtk, frame_%04d.vtk, frame_{}.vtk)
    #[arg(value_name = "IN", required_unless_present_any = ["config", "print_config"])]
    pub input: Vec<PathBuf>,
    /// Mesh file, pattern (out/f_####.glb), folder/, or .pvd with .vtp files [default: IN with the extension .ply]
    #[arg(short, long, value_name = "OUT", alias = "output-file", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Draw each mesh to this PNG file, or pattern [default: no picture]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub png: Option<PathBuf>,
    /// Write particles without neighbours to this file as points with radius; the surface leaves them out [default:
    /// they are part of the surface]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub spray: Option<PathBuf>,

    /// What the surface is.
    #[command(flatten)]
    pub surface: SurfaceArgs,

    /// Which particles.
    #[command(flatten)]
    pub from: InputArgs,
    /// Which frames.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// And frames to come.
    #[command(flatten)]
    pub watch: WatchArgs,

    /// Attributes to carry to the vertices: velocity, all, none, or NAME,... [default: velocity if IN has it]
    #[arg(long, value_name = "NAMES", value_parser = parse_attributes, help_heading = "Vertices")]
    pub attributes: Option<AttributeChoice>,
    /// Unit normals from the field's gradient
    #[arg(long, value_name = "on|off", default_value = "off", hide_possible_values = true, help_heading = "Vertices")]
    pub normals: Switch,

    /// Threads, at least 1 [default: one per processor that this process may use]
    #[arg(short = 'n', long, alias = "num-threads")]
    #[arg(value_name = "N", value_parser = parse_threads, help_heading = "Machine")]
    pub threads: Option<NonZeroUsize>,
    /// Memory for particles, lattice and mesh, such as 512M or 8G (K, M, G, T are powers of 1024); the work is cut in
    /// blocks to fit, or refused with the number needed [default: what the system can give]
    #[arg(long, value_name = "BYTES", value_parser = parse_size, help_heading = "Machine")]
    pub max_memory: Option<u64>,

    /// Options from a file.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
    /// And more.
    #[command(flatten)]
    pub more: VerboseArgs,
}

/// The parameters that decide the surface.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Surface")]
pub struct SurfaceArgs {
    /// Particle radius, half of the particles' spacing at rest, in world units [default: inferred from the
    /// particles, and printed]
    #[arg(short, long, alias = "particle-radius", value_name = "LENGTH", value_parser = parse_positive)]
    pub radius: Option<f64>,
    /// Smoothing length in radii; larger is smoother
    #[arg(short = 'l', long)]
    #[arg(value_name = "RADII", value_parser = parse_positive, default_value = "2")]
    pub smoothing_length: f64,
    /// Edge of a lattice cell in radii; half the edge gives four times the triangles
    #[arg(short, long, alias = "cube-size")]
    #[arg(value_name = "RADII", value_parser = parse_positive, default_value = "0.5")]
    pub cell: f64,
    /// Value of the colour field at the surface: 0 outside, about 1 deep inside; smaller is fatter
    #[arg(short, long, alias = "surface-threshold")]
    #[arg(value_name = "VALUE", value_parser = parse_positive, default_value = "0.6")]
    pub threshold: f64,
    /// Where to evaluate the field: auto (near the surface only) or full (at every node, to check auto)
    #[arg(long, value_name = "auto|full", default_value = "auto", hide_possible_values = true)]
    pub band: BandArg,
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
}
