//! Options about many frames at once.

use clap::Args;

/// Which frames, and what to do about those that are done.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Input")]
pub struct FrameArgs {
    /// Frames of a pattern: 1-100, 1-100:5, 3,7,20-30 [default: all there]
    #[arg(long, value_name = "RANGE", allow_hyphen_values = true)]
    pub frames: Option<String>,
    /// Only every N-th frame from the K-th on [default: all]
    #[arg(long, value_name = "K/N")]
    pub shard: Option<String>,
    /// Leave out frames whose output is there and newer [default: no]
    #[arg(long)]
    pub skip_existing: bool,
}

/// And those to come.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Input")]
pub struct WatchArgs {
    /// Wait for more, until none came for so long [default: Ctrl-C]
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, require_equals = true, default_missing_value = "inf")]
    #[arg(value_parser = parse_patience)]
    pub watch: Option<f64>,
}

fn parse_patience(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(seconds) if seconds > 0.0 => Ok(seconds),
        _ => Err("must be a number of seconds greater than 0".into()),
    }
}
