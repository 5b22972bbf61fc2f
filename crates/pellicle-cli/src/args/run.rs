//! Options about the run, shared by the verbs that work.

use std::num::NonZeroUsize;

use clap::Args;

use super::{ConfigArgs, TalkArgs, VerboseArgs};
use crate::values::{parse_size, parse_threads};

/// What it may take.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Run")]
pub struct MachineArgs {
    /// Threads, at least 1 [default: one per processor]
    #[arg(short = 'n', long, alias = "num-threads", value_name = "N", value_parser = parse_threads)]
    pub threads: Option<NonZeroUsize>,
    /// Limit of memory, such as 512M or 8G [default: what the system can give]
    #[arg(long, value_name = "BYTES", value_parser = parse_size)]
    pub max_memory: Option<u64>,
}

/// Where options come from, and what is said.
#[derive(Debug, Clone, Default, Args)]
pub struct RunArgs {
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
