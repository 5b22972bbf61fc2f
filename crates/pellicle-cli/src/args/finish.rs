//! Options about what is done to a mesh once it is there, shared by the verbs that make one.

use clap::Args;
use pellicle::post::components::Keep;
use pellicle::post::decimate::Target;

use crate::finish::{Smooth, parse_decimate, parse_keep, parse_smooth};
use crate::walls::{Wall, parse_wall};

/// What is done to a mesh once it is there.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Surface")]
pub struct FinishArgs {
    /// No slivers, smooth, with normals: iterations=25,... [default: no]
    #[arg(long, value_name = "KEY=VALUE,...", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    #[arg(value_parser = parse_smooth)]
    pub smooth: Option<Smooth>,
    /// Fewer faces: 0.1, triangles=N, error=LENGTH [default: all]
    #[arg(long, value_name = "SHARE", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    #[arg(value_parser = parse_decimate)]
    pub decimate: Option<Target>,
    /// Components: largest=N,volume=V,cavities=off [default: all]
    #[arg(long, value_name = "KEY=VALUE,...", value_parser = parse_keep)]
    pub keep: Option<Keep>,
    /// Pair triangles to quads; not for STL, GLB, NPZ [default: no]
    #[arg(long)]
    pub quads: bool,
    /// Flat contact: plane=NX,NY,NZ,D, box=..., FILE [default: no]
    #[arg(long, value_name = "WALL", value_parser = parse_wall)]
    pub wall: Vec<Wall>,
    /// Cut the surface at this box, flat caps; '-' is open [default: no]
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], allow_hyphen_values = true)]
    pub clamp: Option<Vec<String>>,
}
