//! The `pellicle` command: arguments as typed (`args`), as meant (`resolve`), and one file per verb (`commands`).
//!
//! Results go to stdout, warnings and errors to stderr. Exit codes: 0 done, 1 the work failed, 2 wrong usage, 130
//! interrupted. An output file appears whole or not at all.

mod args;
mod batch;
mod choose;
mod clock;
mod cloud;
mod commands;
mod config;
mod console;
mod failure;
mod field;
mod finish;
mod frame;
mod interrupt;
mod machine;
mod picture;
mod plan;
mod resolve;
mod sequence;
mod series;
mod spray;
mod surface;
mod target;
mod values;
mod volume;
mod walls;
mod watch;

use std::process::ExitCode;

use args::{Talk, Verb};
use console::Console;

fn main() -> ExitCode {
    // Wrong usage ends here with code 2; --help and --version with 0.
    let (cli, printed) = match config::parse(std::env::args_os().collect()) {
        Ok(parsed) => parsed,
        Err(failure) => return fail(&Console::new("", Talk::default()), &failure),
    };
    if let Some(text) = printed {
        print!("{text}");
        return ExitCode::SUCCESS;
    }
    let console = Console::new(cli.verb.name(), cli.verb.talk());
    let result = match &cli.verb {
        Verb::Mesh(args) => commands::mesh::run(args, &console),
        Verb::Contour(args) => commands::contour::run(args, &console),
        Verb::Convert(args) => commands::convert::run(args, &console),
        Verb::Info(args) => commands::info::run(args, &console),
        Verb::Check(args) => commands::check::run(args, &console),
        Verb::Render(args) => commands::render::run(args, &console),
        Verb::Demo(args) => commands::demo::run(args, &console),
        Verb::Formats(args) => commands::formats::run(args, &console),
        Verb::Fields(args) => commands::fields::run(args, &console),
        Verb::Completions(args) => commands::manual::completions(args, &console),
        Verb::Man(args) => commands::manual::man(args, &console),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => fail(&console, &failure),
    }
}

fn fail(console: &Console, failure: &failure::Failure) -> ExitCode {
    console.fail(failure);
    ExitCode::from(failure.exit_code())
}
