//! Scalar fields by name: `--field solenthaler:t-high=2`, and in words, for reports and headers.

use pellicle::{Error, Params, ScalarField};

use crate::failure::Failure;

/// Reads `NAME` or `NAME:KEY=VALUE,...`.
pub fn parse(text: &str) -> Result<ScalarField, Failure> {
    let (name, settings) = text.split_once(':').unwrap_or((text, ""));
    let usage = |what: String| Failure::Usage(format!("--field {text}: {what}"));
    let mut field = ScalarField::from_name(name.trim())
        .ok_or_else(|| usage(format!("no field has this name (there are {})", ScalarField::NAMES.join(", "))))?;
    for setting in settings.split(',').map(str::trim).filter(|s| !s.is_empty()) {
        let (key, value) = setting.split_once('=').ok_or_else(|| usage(format!("'{setting}' is not KEY=VALUE")))?;
        let value = value.trim().parse().map_err(|_| usage(format!("{key}: '{value}' is not a number")))?;
        let key = key.trim().replace('_', "-");
        let mut parameters = field.parameters();
        let Some(parameter) = parameters.iter_mut().find(|p| p.name == key) else {
            let names: Vec<_> = parameters.iter().map(|p| p.name).collect();
            let known = if names.is_empty() { "no parameters of its own".into() } else { names.join(", ") };
            return Err(usage(format!("'{key}' is no parameter of {name}, which has {known}")));
        };
        *parameter.value = value;
    }
    Ok(field)
}

/// The field with all its parameters, as [`parse`] reads it.
pub fn show(mut field: ScalarField) -> String {
    let name = field.name();
    let settings: Vec<String> = field.parameters().iter().map(|p| format!("{}={}", p.name, p.value)).collect();
    if settings.is_empty() { name.into() } else { format!("{name}:{}", settings.join(",")) }
}

/// What is wrong with the parameters of a surface, by the names of options.
pub fn check(params: &Params) -> Result<(), Failure> {
    params.check().map_err(|error| match error {
        Error::Parameter { name, value, must } => {
            let option = match name {
                "iso" => "-t".into(),
                "smoothing_length" => "-l".into(),
                "cell_size" => "-c".into(),
                "particle_radius" => "-r".into(),
                own => format!("--field {}: {}", params.field.name(), own.replace('_', "-")),
            };
            Failure::Usage(format!("{option} = {value}: must be {must}"))
        }
        other => Failure::Usage(other.to_string()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_can_be_read() {
        for name in ScalarField::NAMES {
            let field = parse(name).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(field.name(), name);
            assert_eq!(parse(&show(field)).unwrap_or_else(|e| panic!("{e}")), field);
            assert!(Params::with_field(1.0, field).check().is_ok(), "{name}: its defaults are in range");
        }
        let field = parse("solenthaler: t_high=2, radius = 1.1").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(show(field), "solenthaler:radius=1.1,t-low=0.4,t-high=2");
    }

    #[test]
    fn what_means_nothing_is_told() {
        for (text, part) in [
            ("mud", "there are sph"),
            ("sph:radius=1", "no parameters"),
            ("solenthaler:radius", "KEY=VALUE"),
            ("solenthaler:t-high=x", "not a number"),
            ("solenthaler:w-min=1", "radius, t-low, t-high"),
        ] {
            let message = parse(text).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        }
        let params = Params::with_field(1.0, parse("zhu-bridson:radius=-1").unwrap_or_else(|e| panic!("{e}")));
        let message = check(&params).unwrap_err().to_string();
        assert!(message.contains("--field zhu-bridson: radius = -1"), "{message}");
    }
}
