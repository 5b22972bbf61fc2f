//! The command line as typed: flags, defaults and help. What they mean together is worked out in `resolve`.
//!
//! A value that can be judged by itself (a radius of 0, a size of "lots") is refused here by its value parser, which
//! makes it a usage error with exit code 2. Radii, factors and the threshold are named as in splashsurf, whose long names
//! work as hidden aliases, so that its users can switch.

mod input;
mod mesh;
mod render;
mod sequence;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub use input::InputArgs;
pub use mesh::{BandArg, MeshArgs, Switch};
pub use render::{CameraArgs, LookArgs, RenderArgs};
pub use sequence::{FrameArgs, WatchArgs};

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
            Self::Info(_) => "info",
            Self::Check(_) => "check",
            Self::Demo(_) => "demo",
        }
    }

    /// How much is said, and in which form.
    pub fn talk(&self) -> Talk {
        let (talk, verbose) = match self {
            Self::Mesh(args) => (&args.talk, args.more.verbose),
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

/// Options from a file and into one.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct ConfigArgs {
    /// Take options that are not typed here from this TOML file, as --print-config writes it
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Print all options as TOML, and do nothing else
    #[arg(long)]
    pub print_config: bool,
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

