//! The `pellicle` command: arguments as typed (`args`), as meant (`resolve`), and one file per verb (`commands`).
//!
//! Results go to stdout, warnings and errors to stderr. Exit codes: 0 done, 1 the work failed, 2 wrong usage, 130
//! interrupted. An output file appears whole or not at all.

mod args;
mod clock;
mod cloud;
mod commands;
mod console;
mod failure;
mod interrupt;
mod machine;
mod resolve;
mod surface;
mod target;
mod values;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Verb};
use console::Console;

fn main() -> ExitCode {
    // Wrong usage ends here with code 2; --help and --version with 0.
    let cli = Cli::parse();
    let console = Console::new(cli.verb.name(), cli.verb.talk());
    let result = match &cli.verb {
        Verb::Mesh(args) => commands::mesh::run(args, &console),
        Verb::Convert(args) => commands::convert::run(args, &console),
        Verb::Info(args) => commands::info::run(args, &console),
        Verb::Check(args) => commands::check::run(args, &console),
        Verb::Demo(args) => commands::demo::run(args, &console),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            console.fail(&failure);
            ExitCode::from(failure.exit_code())
        }
    }
}
