//! Tables that compare pellicle with other methods, printed. Stages are measured by `cargo bench`.

mod rivals;
mod rosenberg;

use clap::{Parser, Subcommand};

/// Counts bytes, so that tables can tell memory.
#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// Tables that compare pellicle with other methods.
#[derive(Debug, Parser)]
#[command(name = "pellicle-bench", arg_required_else_help = true, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    table: Table,
}

#[derive(Debug, Subcommand)]
enum Table {
    /// Figure 7 of Rosenberg & Birdwell 2008: marching slices beside two ways to follow a surface
    #[command(name = "rosenberg-2008")]
    Rosenberg2008(rosenberg::Args),
}

fn main() {
    match Cli::parse().table {
        Table::Rosenberg2008(args) => rosenberg::run(&args),
    }
}
