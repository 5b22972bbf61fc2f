//! `fields`: which scalar fields there are, with their parameters and defaults, from the table that `--field` goes by.

use pellicle::{FieldParameter, ScalarField};
use serde_json::{Value, json};

use crate::args::FieldsArgs;
use crate::console::Console;
use crate::failure::Failure;

/// Runs the verb.
pub fn run(_args: &FieldsArgs, console: &Console) -> Result<(), Failure> {
    console.say(format_args!("{:<24}{:>4}{:>5}  own parameters, as --field NAME:KEY=VALUE,...", "field", "-l", "-t"));
    for mut field in ScalarField::NAMES.into_iter().filter_map(ScalarField::from_name) {
        let start = format!("{:<24}{:>4}{:>5}  ", field.name(), field.smoothing_length(), field.iso());
        let lines: Vec<String> = field.parameters().iter().map(line).collect();
        for (i, line) in lines.iter().enumerate() {
            let start = if i == 0 { start.as_str() } else { "" };
            console.say(format_args!("{start:<35}{line}"));
        }
        if lines.is_empty() {
            console.say(format_args!("{start}none"));
        }
    }
    console.say("\n-l is the support in spacings (2 radii). Where -t is 0 by default it counts in spacings: 0.1 shrinks, -0.1 swells.");
    console.say("Which field to take: docs/src/fields.md");
    console.report(|| {
        let entry = |p: &FieldParameter<'_>| json!({"name": p.name, "default": *p.value, "unit": p.unit, "what": p.what});
        let field = |mut field: ScalarField| -> Value {
            let parameters: Vec<_> = field.parameters().iter().map(entry).collect();
            json!({
                "name": field.name(),
                "smoothing_length": field.smoothing_length(),
                "threshold": field.iso(),
                "parameters": parameters,
            })
        };
        json!({"fields": ScalarField::NAMES.into_iter().filter_map(ScalarField::from_name).map(field).collect::<Vec<_>>()})
    });
    Ok(())
}

/// A parameter in words.
fn line(p: &FieldParameter<'_>) -> String {
    let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
    format!("{}={}{unit}: {}", p.name, p.value, p.what)
}
