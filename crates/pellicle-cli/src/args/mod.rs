//! The command line as typed: flags, defaults and help. What they mean together is worked out in `resolve`.
//!
//! A value that can be judged by itself (a radius of 0, a size of "lots") is refused here by its value parser, which
//! makes it a usage error with exit code 2. Radii, factors and the threshold are named as in splashsurf, whose long names
//! work as hidden aliases, so that its users can switch.

mod contour;
mod convert;
mod finish;
mod input;
mod mesh;
mod render;
mod run;
mod sequence;
mod volume;

use std::num::NonZeroUsize;
use std::path::PathBuf;

use crate::values::{parse_finite, parse_pixels};
use clap::{Args, Parser, Subcommand, ValueEnum};

pub use contour::{ContourArgs, MethodArg};
pub use convert::ConvertArgs;
pub use finish::FinishArgs;
pub use input::InputArgs;
pub use mesh::{BandArg, CellArg, MeshArgs, Switch};
pub use render::{CameraArgs, LookArgs, RenderArgs};
pub use run::{MachineArgs, RunArgs};
pub use sequence::{FrameArgs, WatchArgs};
pub use volume::{EndianArg, VolumeArgs};

/// Particles and volumes to surface meshes: fast, exact, in bounded memory, the same bytes every time.
#[derive(Debug, Parser)]
#[command(name = "pellicle", version, arg_required_else_help = true, disable_help_subcommand = true)]
#[command(
    after_help = "Start with:  pellicle demo            make a splash and its surface, no data needed\n             \
pellicle mesh FRAME.vtk  your particles to FRAME.ply\n             \
pellicle info SCAN.nii   a volume, with an isovalue to try\n             \
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
    /// Volumes to triangle meshes: the surface where values pass an isovalue
    Contour(Box<ContourArgs>),
    /// Particles, meshes or volumes to another format
    Convert(Box<ConvertArgs>),
    /// What is in a particle, mesh or volume file
    Info(Box<InfoArgs>),
    /// Is a mesh closed, manifold and oriented outward? Exit code 1 if not
    Check(Box<CheckArgs>),
    /// Meshes and particles to pictures (PNG)
    Render(Box<RenderArgs>),
    /// Make a splash of particles, its surface and pictures, to see that all works; or metaballs
    Demo(DemoArgs),
    /// Which file types are read and written
    Formats(FormatsArgs),
    /// Which scalar fields there are, and their parameters
    Fields(FieldsArgs),
    /// Print a script that completes this command in your shell
    Completions(CompletionsArgs),
    /// Write the manual pages
    Man(ManArgs),
}

impl Verb {
    /// The verb as typed.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Mesh(_) => "mesh",
            Self::Contour(_) => "contour",
            Self::Convert(_) => "convert",
            Self::Info(_) => "info",
            Self::Check(_) => "check",
            Self::Render(_) => "render",
            Self::Demo(_) => "demo",
            Self::Formats(_) => "formats",
            Self::Fields(_) => "fields",
            Self::Completions(_) => "completions",
            Self::Man(_) => "man",
        }
    }

    /// How much is said, and in which form.
    pub fn talk(&self) -> Talk {
        let (talk, verbose) = match self {
            Self::Mesh(args) => (&args.run.talk, args.run.more.verbose),
            Self::Contour(args) => (&args.run.talk, args.run.more.verbose),
            Self::Convert(args) => (&args.run.talk, args.run.more.verbose),
            Self::Info(args) => (&args.talk, false),
            Self::Formats(args) => (&args.talk, false),
            Self::Fields(args) => (&args.talk, false),
            Self::Check(args) => (&args.talk, false),
            Self::Render(args) => (&args.run.talk, args.run.more.verbose),
            Self::Demo(args) => (&args.talk, args.more.verbose),
            Self::Completions(_) | Self::Man(_) => return Talk::default(),
        };
        Talk { json: talk.json, quiet: talk.quiet, verbose }
    }
}

/// The options about what is said, together.
#[derive(Debug, Clone, Copy, Default)]
pub struct Talk {
    /// Print a report for machines on stdout; text goes to stderr
    pub json: bool,
    /// No text but warnings and errors.
    pub quiet: bool,
    /// Print parameters, stage times and peak memory too
    pub verbose: bool,
}

/// Options that every verb has.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Run")]
pub struct TalkArgs {
    /// Print a machine-readable report on stdout; all text goes to stderr
    #[arg(long)]
    pub json: bool,
    /// Print warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Print this help
    #[arg(short, long, action = clap::ArgAction::Help)]
    pub help: Option<bool>,
}

/// More than usual is said.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Run")]
pub struct VerboseArgs {
    /// Print parameters, stage times and peak memory too
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

/// `formats`.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct FormatsArgs {
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `fields`.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct FieldsArgs {
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `completions SHELL`.
#[derive(Debug, Args)]
#[command(after_help = "bash:  pellicle completions bash > ~/.local/share/bash-completion/completions/pellicle\n\
zsh:   pellicle completions zsh > a folder of $fpath/_pellicle\n\
fish:  pellicle completions fish > ~/.config/fish/completions/pellicle.fish")]
pub struct CompletionsArgs {
    /// Which shell
    #[arg(value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}

/// `man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for the pages, a file for each verb; it must exist
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub output_dir: PathBuf,
}

/// Options from a file and into one.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Run")]
pub struct ConfigArgs {
    /// Options from a TOML file, as --print-config prints it [default: none]
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Print all options as TOML, and do nothing else
    #[arg(long, hide = true)]
    pub print_config: bool,
}

/// `info FILE`.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct InfoArgs {
    /// Particle, mesh or volume file
    #[arg(value_name = "FILE")]
    pub input: PathBuf,
    /// Which particles.
    #[command(flatten)]
    pub from: InputArgs,
    /// How to read a volume.
    #[command(flatten)]
    pub volume: VolumeArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `check MESH`.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct CheckArgs {
    /// Mesh file, of any type that `pellicle formats` lists
    #[arg(value_name = "MESH")]
    pub input: PathBuf,
    /// Accept edges with one triangle: a sheet with a rim may still be manifold [default: such an edge fails]
    #[arg(long)]
    pub allow_boundary: bool,
    /// Tell the shapes of the triangles, too: radius ratio, aspect, angles, edges, valence
    #[arg(long)]
    pub quality: bool,
    /// Mesh file to measure the distance to, both ways; implies --quality [default: none]
    #[arg(long, value_name = "MESH")]
    pub reference: Option<PathBuf>,
    /// Volume file to measure the distance to: from its surface at --iso [default: none]
    #[arg(long, value_name = "VOLUME", requires = "iso")]
    pub field: Option<PathBuf>,
    /// Value at the surface of --field
    #[arg(short, long, value_name = "V", value_parser = parse_finite, allow_hyphen_values = true, requires = "field")]
    pub iso: Option<f64>,
    /// Array of --field where it has several [default: the active or the first]
    #[arg(long, value_name = "NAME", requires = "field")]
    pub array: Option<String>,
    /// Time step of --field where it has several, from 0 [default: 0]
    #[arg(long, value_name = "N", requires = "field")]
    pub step: Option<usize>,
    /// Samples of each surface for distances; at least one a triangle is taken
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    pub samples: usize,
    /// How to read the volume.
    #[command(flatten)]
    pub from: VolumeArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// What `demo` shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DemoArg {
    /// A splash of particles and its surface
    Splash,
    /// Inverse-square metaballs by tetrahedra, in object, view and post-projection space, and with noise
    Metaballs,
    /// Frame by frame: a jet of water, up to 3000 particles
    Fountain,
    /// Frame by frame: 100 particles that stretch, part and meet
    Blob,
    /// Frame by frame: 1000 particles that fly apart
    Explosion,
    /// Frame by frame: 250 particles with tentacles and a hide
    Monster,
}

/// `demo`.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct DemoArgs {
    /// What to show
    #[arg(value_name = "WHAT", default_value = "splash")]
    pub what: DemoArg,
    /// Pictures of what moves frame by frame, WHAT_0000.png and on, spread over its 300 frames
    #[arg(long, value_name = "N", default_value = "60")]
    pub frames: NonZeroUsize,
    /// Width and height of these pictures in pixels
    #[arg(long, value_name = "WxH", default_value = "960x720", value_parser = parse_pixels)]
    pub size: (u32, u32),
    /// Folder for the files: demo.ply and others, metaballs.ply and others, or pictures; it must exist
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub output_dir: PathBuf,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
    /// And more.
    #[command(flatten)]
    pub more: VerboseArgs,
}
