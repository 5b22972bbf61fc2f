//! `--config FILE.toml` and `--print-config`: everything on the command line can be kept, shared and repeated.
//!
//! A file has a table per verb, and in it the long names of options, `-` as `_` or as it is:
//!
//! ```toml
//! [mesh]
//! input = ["run/frame_####.vtk"]
//! radius = 0.025
//! skip_existing = true
//! ```
//!
//! What is typed wins over the file. The options are those that the command line knows, no list is kept here: the
//! file becomes further arguments, so that its values are judged by the same rules and with the same messages. Paths
//! count from the working folder, as they do when typed.

use std::ffi::{OsStr, OsString};
use std::fmt::Write as _;
use std::path::Path;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, CommandFactory, FromArgMatches};
use toml::{Table, Value};

use crate::args::Cli;
use crate::failure::Failure;

/// Options that are not kept: they are about this one run.
const NOT_KEPT: [&str; 4] = ["config", "print_config", "help", "version"];

/// Parses the command line, with the options of its `--config` filled in. Wrong usage ends the process with code 2,
/// `--help` and `--version` with 0.
pub fn parse(arguments: Vec<OsString>) -> Result<(Cli, Option<String>), Failure> {
    let typed = Cli::command().get_matches_from(&arguments);
    let merged = match kept_options(&typed)? {
        Some(more) => Cli::command().get_matches_from(arguments.into_iter().chain(more)),
        None => typed,
    };
    let printed = print(&merged);
    let cli = Cli::from_arg_matches(&merged).unwrap_or_else(|error| error.exit());
    Ok((cli, printed))
}

/// The verb's own grammar.
fn verb_command(verb: &str) -> Option<Command> {
    Cli::command().find_subcommand(verb).cloned()
}

fn has(matches: &ArgMatches, id: &str) -> bool {
    matches.try_contains_id(id).unwrap_or(false)
}

/// The options of the file that `--config` names, as arguments; `None` without a file.
fn kept_options(matches: &ArgMatches) -> Result<Option<Vec<OsString>>, Failure> {
    let Some((verb, typed)) = matches.subcommand() else { return Ok(None) };
    let Ok(Some(path)) = typed.try_get_one::<std::path::PathBuf>("config") else { return Ok(None) };
    let Some(command) = verb_command(verb) else { return Ok(None) };
    let text = std::fs::read_to_string(path).map_err(|e| Failure::file(path, format_args!("cannot read: {e}")))?;
    let tables: Table = text.parse().map_err(|e| usage(path, e))?;
    for (name, value) in &tables {
        if verb_command(name).is_none() || !value.is_table() {
            let what = format!("'{name}' is not a verb: options stand in the table of their verb, such as [{verb}]");
            return Err(usage(path, what));
        }
    }
    let Some(Value::Table(options)) = tables.get(verb) else { return Ok(Some(Vec::new())) };
    let (mut named, mut positional) = (Vec::new(), Vec::new());
    for (key, value) in options {
        let arg = find(&command, key).ok_or_else(|| usage(path, unknown(&command, verb, key)))?;
        if typed.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine) {
            continue;
        }
        let words = words(value).ok_or_else(|| {
            usage(
                path,
                format_args!(
                    "{key} in [{verb}] is a {}: write a number, a text, true or false, or a list",
                    value.type_str()
                ),
            )
        })?;
        match (arg.get_long(), arg.get_action()) {
            (None, _) => positional.extend(words),
            (Some(long), ArgAction::SetTrue) => match value {
                Value::Boolean(true) => named.push(format!("--{long}")),
                Value::Boolean(false) => {}
                _ => return Err(usage(path, format_args!("{key} in [{verb}] is a switch: write true or false"))),
            },
            // A list of several values follows its name; `=` binds one value even if it begins with a dash.
            (Some(long), _) if words.len() > 1 && takes_several(arg) => {
                named.extend([format!("--{long}")].into_iter().chain(words))
            }
            (Some(long), _) => named.extend(words.iter().map(|word| format!("--{long}={word}"))),
        }
    }
    if !positional.is_empty() {
        named.push("--".into());
    }
    Ok(Some(named.into_iter().chain(positional).map(OsString::from).collect()))
}

fn usage(path: &Path, what: impl std::fmt::Display) -> Failure {
    Failure::Usage(format!("{}: {what}", path.display()))
}

/// The option of this long name, or the positional of this name.
fn find<'a>(command: &'a Command, key: &str) -> Option<&'a Arg> {
    let wanted = key.replace('-', "_");
    command.get_arguments().find(|arg| name(arg) == wanted && !NOT_KEPT.contains(&arg.get_id().as_str()))
}

/// The name of an option in the file.
fn name(arg: &Arg) -> String {
    arg.get_long().unwrap_or(arg.get_id().as_str()).replace('-', "_")
}

fn unknown(command: &Command, verb: &str, key: &str) -> String {
    let kept = command.get_arguments().filter(|arg| !NOT_KEPT.contains(&arg.get_id().as_str()));
    let names: Vec<String> = kept.map(name).collect();
    format!("[{verb}] has no option '{key}'; it has {}", names.join(", "))
}

/// A value as it would be typed.
fn words(value: &Value) -> Option<Vec<String>> {
    let word = |value: &Value| match value {
        Value::String(text) => Some(text.clone()),
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) => Some(value.to_string()),
        _ => None,
    };
    match value {
        Value::Array(values) => values.iter().map(word).collect(),
        value => Some(vec![word(value)?]),
    }
}

/// The options in force as TOML; `None` unless `--print-config` asks for it. What was not given stands as a comment.
fn print(matches: &ArgMatches) -> Option<String> {
    let (verb, matches) = matches.subcommand()?;
    if !has(matches, "print_config") || !matches.get_flag("print_config") {
        return None;
    }
    let command = verb_command(verb)?;
    let mut text =
        format!("# pellicle {verb} --config THIS_FILE does the same again; what is typed besides wins.\n[{verb}]\n");
    for arg in command.get_arguments().filter(|arg| !NOT_KEPT.contains(&arg.get_id().as_str())) {
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
        let _ = writeln!(text, "\n# {}", help.replace('\n', "\n# "));
        let name = name(arg);
        let given =
            matches.value_source(arg.get_id().as_str()).is_some_and(|source| source != ValueSource::DefaultValue);
        let comment = if given { "" } else { "# " };
        let _ = match value(arg, matches) {
            Some(value) => writeln!(text, "{comment}{name} = {value}"),
            None => writeln!(text, "# {name} ="),
        };
    }
    Some(text)
}

/// The value in force, if there is one.
fn value(arg: &Arg, matches: &ArgMatches) -> Option<Value> {
    let id = arg.get_id().as_str();
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        return Some(Value::Boolean(matches.get_flag(id)));
    }
    let mut values: Vec<Value> = matches.get_raw(id)?.map(scalar).collect();
    if takes_several(arg) || values.len() > 1 { Some(Value::Array(values)) } else { values.pop() }
}

/// Whether several values follow the name; else each has the name before it.
fn takes_several(arg: &Arg) -> bool {
    arg.get_num_args().is_some_and(|range| range.max_values() > 1)
}

/// A number where the text is one and nothing is lost, else a text.
fn scalar(raw: &OsStr) -> Value {
    let text = raw.to_string_lossy();
    if let Ok(value) = text.parse::<i64>()
        && value.to_string() == text
    {
        return Value::Integer(value);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value.to_string() == text => Value::Float(value),
        _ => Value::String(text.into_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches(line: &str) -> ArgMatches {
        Cli::command().try_get_matches_from(line.split_whitespace()).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn what_is_printed_gives_the_same_command_again() {
        let line = "pellicle mesh a.vtk b.vtk -r 0.025 -c 0.75 --skip-existing --crop 0,0,0 1,-,1 --attributes all \
                    --max-memory 2G --wall plane=0,1,0,0 --wall a.stl --frames -5--1 --where x>0 -o out/ --print-config";
        let text = print(&matches(line)).expect("asked for");
        let path = std::env::temp_dir().join(format!("pellicle-config-{}.toml", std::process::id()));
        std::fs::write(&path, &text).unwrap();
        let file = path.to_string_lossy();
        let again = [&["pellicle", "mesh", "--config", &file], &["--print-config"][..]].concat();
        let (_, printed) = parse(again.iter().map(OsString::from).collect()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(printed.as_deref(), Some(text.as_str()));
        assert!(text.contains("\nradius = 0.025\n") && text.contains("\n# band = \"auto\"\n"), "{text}");

        // What is typed wins, also over a list.
        let typed = ["pellicle", "mesh", "c.vtk", "--config", &file, "-r", "0.5", "--print-config"];
        let (_, printed) = parse(typed.iter().map(OsString::from).collect()).unwrap_or_else(|e| panic!("{e}"));
        let printed = printed.expect("asked for");
        assert!(printed.contains("\ninput = [\"c.vtk\"]\n") && printed.contains("\nradius = 0.5\n"), "{printed}");
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn wrong_files_are_usage_errors_that_name_the_key() {
        let path = std::env::temp_dir().join(format!("pellicle-config-wrong-{}.toml", std::process::id()));
        for (text, expected) in [
            ("radius = 1", "'radius' is not a verb"),
            ("[mesh]\nraduis = 1", "no option 'raduis'"),
            ("[mesh]\nskip_existing = 3", "true or false"),
            ("[mesh]\nradius = {}", "write a number"),
            ("[mesh", "unclosed table"),
            ("[mesh]\nconfig = 'x'", "no option 'config'"),
        ] {
            std::fs::write(&path, text).unwrap();
            let line = ["pellicle", "mesh", "a.vtk", "--config", &path.to_string_lossy()].map(OsString::from);
            match parse(line.to_vec()) {
                Err(Failure::Usage(message)) => assert!(message.contains(expected), "{text}: {message}"),
                other => panic!("{text}: {other:?}"),
            }
        }
        std::fs::remove_file(path).unwrap();
    }
}
