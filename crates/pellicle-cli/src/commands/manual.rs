//! `completions SHELL` and `man`: made from the same description of the command line that parses it, so they cannot differ
//! from it.

use std::io::Write;

use clap::CommandFactory;

use crate::args::{Cli, CompletionsArgs, ManArgs};
use crate::console::Console;
use crate::failure::Failure;

/// Prints a script that completes the command's options in a shell.
pub fn completions(args: &CompletionsArgs, _console: &Console) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "pellicle", &mut script);
    // A reader that has gone away is no error.
    let _ = std::io::stdout().write_all(&script);
    Ok(())
}

/// Writes a page per verb.
pub fn man(args: &ManArgs, console: &Console) -> Result<(), Failure> {
    let folder = &args.output_dir;
    for (name, command) in pages() {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page).map_err(|error| Failure::file(folder, error))?;
        let path = folder.join(format!("{name}.1"));
        pellicle_io::write_file(&path, &page)?;
        console.say(format_args!("{}", path.display()));
    }
    Ok(())
}

/// The command itself and each verb, under the names that `man` looks for.
fn pages() -> Vec<(String, clap::Command)> {
    let mut root = Cli::command();
    root.build();
    let verb = |command: &clap::Command| {
        let name = format!("pellicle-{}", command.get_name());
        (name.clone(), command.clone().name(name).bin_name(format!("pellicle {}", command.get_name())))
    };
    let verbs: Vec<_> = root.get_subcommands().map(verb).collect();
    [("pellicle".to_owned(), root)].into_iter().chain(verbs).collect()
}
