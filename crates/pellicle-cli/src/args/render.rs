//! `render`: its options.

use std::path::PathBuf;

use clap::Args;

use super::{FrameArgs, InputArgs, RunArgs};
use crate::values::{parse_pixels, parse_point, parse_positive, parse_range};

/// `render IN... -o OUT`.
#[derive(Debug, Args)]
#[command(
    disable_help_flag = true,
    after_help = "A file with faces is drawn as a surface, any other as spheres; no GPU and no window is needed."
)]
pub struct RenderArgs {
    /// Mesh or particle files: one, several, a folder, a .pvd, or a pattern such as f_####.ply
    #[arg(value_name = "IN", required_unless_present_any = ["config", "print_config"])]
    pub input: Vec<PathBuf>,
    /// Picture, pattern or folder/ [default: IN with the extension .png]
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1920x1080", value_parser = parse_pixels, help_heading = "Output")]
    pub size: (u32, u32),
    /// N pictures of one file, once around; OUT is a pattern [default: one picture]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000), help_heading = "Output")]
    pub turntable: Option<u32>,
    /// What is drawn.
    #[command(flatten)]
    pub look: LookArgs,
    /// From where.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Which particles.
    #[command(flatten)]
    pub from: InputArgs,
    /// Which frames.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// The run.
    #[command(flatten)]
    pub run: RunArgs,
}

/// The looks.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Picture")]
pub struct LookArgs {
    /// Show this attribute, or a vector's length, by colours [default: none]
    #[arg(long, value_name = "NAME")]
    pub color_by: Option<String>,
    /// Values at the ends of the colour bar [default: each frame's own]
    #[arg(long, value_name = "LOW,HIGH", requires = "color_by", value_parser = parse_range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,
    /// Draw the edges of triangles
    #[arg(long)]
    pub wireframe: bool,
    /// Paint the inside red, so that holes and flipped triangles show
    #[arg(long, conflicts_with = "color_by")]
    pub sides: bool,
    /// Particles' radius [default: their radius attribute, or inferred]
    #[arg(short, long, value_name = "LENGTH", value_parser = parse_positive)]
    pub radius: Option<f64>,
    /// Dark background
    #[arg(long)]
    pub dark: bool,
    /// A line of text in the lower left corner [default: none]
    #[arg(long, value_name = "TEXT")]
    pub caption: Option<String>,
}

/// The camera.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Picture")]
pub struct CameraArgs {
    /// Degrees around the up axis, from the front to the right
    #[arg(long, value_name = "DEGREES", default_value = "30", allow_hyphen_values = true)]
    pub azimuth: f64,
    /// Degrees above the horizon, -90 to 90
    #[arg(long, value_name = "DEGREES", default_value = "22", allow_hyphen_values = true)]
    pub elevation: f64,
    /// Where the camera stands, X,Y,Z [default: where it sees all]
    #[arg(long, value_name = "POINT", value_parser = parse_point, allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// What it looks at, with --eye, X,Y,Z [default: the middle]
    #[arg(long, value_name = "POINT", value_parser = parse_point, requires = "eye", allow_hyphen_values = true)]
    pub look_at: Option<[f64; 3]>,
    /// Vertical angle of view in degrees, above 0 and below 170
    #[arg(long, value_name = "DEGREES", default_value = "30")]
    pub fov: f64,
}
