//! The command line as typed: flags, defaults and help. What they mean together is worked out in `resolve`.
//!
//! A value that can be judged by itself (a radius of 0, a size of "lots") is refused here by its value parser, which
//! makes it a usage error with exit code 2. Radii, factors and the threshold are named as in splashsurf, whose long names
//! work as hidden aliases, so that its users can switch.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use pellicle_io::AttributeChoice;

mod convert;

pub use convert::{ConvertArgs, RawArg, UpArg};

use crate::values::{parse_attributes, parse_positive, parse_size, parse_threads};

/// Particles to surface meshes: fast, exact, in bounded memory, the same bytes every time.
#[derive(Debug, Parser)]
#[command(name = "pellicle", version, arg_required_else_help = true, disable_help_subcommand = true)]
#[command(
    after_help = "Start with:  pellicle demo            make a splash and its surface, no data needed\n             \
pellicle mesh FRAME.vtk  your particles to FRAME.ply\n             \
pellicle VERB --help     every option with its default and unit\n\n\
Exit codes:  0 done, 1 work failed, 2 wrong usage, 130 interrupted"
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Particles to a closed triangle mesh
    Mesh(Box<MeshArgs>),
    /// One file of particles or a mesh to another format
    Convert(Box<ConvertArgs>),
    /// What is in a particle or mesh file
    Info(InfoArgs),
    /// Is a mesh closed, manifold and oriented outward? Exit code 1 if not
    Check(CheckArgs),
    /// Make a splash of particles and its surface, to see that all works
    Demo(DemoArgs),
}

impl Verb {
    /// The verb as typed.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Mesh(_) => "mesh",
            Self::Convert(_) => "convert",
            Self::Info(_) => "info",
            Self::Check(_) => "check",
            Self::Demo(_) => "demo",
        }
    }

    /// How much is said, and in which form.
    pub fn talk(&self) -> Talk {
        let (talk, verbose) = match self {
            Self::Mesh(args) => (&args.talk, args.more.verbose),
            Self::Convert(args) => (&args.talk, false),
            Self::Info(args) => (&args.talk, false),
            Self::Check(args) => (&args.talk, false),
            Self::Demo(args) => (&args.talk, args.more.verbose),
        };
        Talk { json: talk.json, quiet: talk.quiet, verbose }
    }
}

/// The options about what is said, together.
#[derive(Debug, Clone, Copy, Default)]
pub struct Talk {
    /// A report for machines on stdout.
    pub json: bool,
    /// No text but warnings and errors.
    pub quiet: bool,
    /// More text than usual.
    pub verbose: bool,
}

/// Options that every verb has.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct TalkArgs {
    /// Print a machine-readable report on stdout; all text goes to stderr
    #[arg(long)]
    pub json: bool,
    /// Print warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// More than usual is said.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct VerboseArgs {
    /// Print parameters, stage times and peak memory too
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

/// `mesh IN`.
#[derive(Debug, Args)]
#[command(
    after_help = "Lengths \"in radii\" are multiples of the particle radius -r. The kernel's support radius is 2*l*r.\n\
The mesh has the same bytes whatever --threads, --max-memory and --band are."
)]
pub struct MeshArgs {
    /// Particle file: .ply .vtk .vtu .bgeo .npy .csv .xyz (raw little-endian f32 triples)
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// Mesh file: .ply .obj .vtk [default: IN with the extension .ply; IN_surface.ply if that is IN itself]
    #[arg(short, long, value_name = "FILE", alias = "output-file")]
    pub output: Option<PathBuf>,

    /// What the surface is.
    #[command(flatten)]
    pub surface: SurfaceArgs,

    /// Attributes to carry to the vertices: velocity, all, none, or NAME,... [default: velocity if IN has it]
    #[arg(long, value_name = "NAMES", value_parser = parse_attributes, help_heading = "Vertices")]
    pub attributes: Option<AttributeChoice>,
    /// Unit normals from the field's gradient
    #[arg(long, value_name = "on|off", default_value = "off", hide_possible_values = true, help_heading = "Vertices")]
    pub normals: Switch,
    /// Leave out particles whose position is NaN or infinite, and count them [default: such a particle is an error]
    #[arg(long, help_heading = "Input")]
    pub drop_invalid: bool,

    /// Threads, at least 1 [default: one per processor that this process may use]
    #[arg(short = 'n', long, alias = "num-threads")]
    #[arg(value_name = "N", value_parser = parse_threads, help_heading = "Machine")]
    pub threads: Option<NonZeroUsize>,
    /// Memory for particles, lattice and mesh, such as 512M or 8G (K, M, G, T are powers of 1024); the work is cut in
    /// blocks to fit, or refused with the number needed [default: what the system can give]
    #[arg(long, value_name = "BYTES", value_parser = parse_size, help_heading = "Machine")]
    pub max_memory: Option<u64>,

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

/// `info FILE`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Particle or mesh file
    #[arg(value_name = "FILE")]
    pub input: PathBuf,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `check MESH`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Mesh file: .ply .obj .vtk
    #[arg(value_name = "MESH")]
    pub input: PathBuf,
    /// Accept edges with one triangle: a sheet with a rim may still be manifold [default: such an edge fails]
    #[arg(long)]
    pub allow_boundary: bool,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder for demo.ply; it must exist
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub output_dir: PathBuf,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
    /// And more.
    #[command(flatten)]
    pub more: VerboseArgs,
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
