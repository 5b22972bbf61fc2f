//! `info FILE`: what a particle, mesh or volume file holds, and what to type next.

use std::path::Path;

use pellicle::{Mesh, infer_radius};
use pellicle_io::{AttributeChoice, AttributeValues, Particles, PositionData, holds_volume, read_content};
use serde_json::{Value, json};

use crate::args::InfoArgs;
use crate::choose::Invalid;
use crate::console::Console;
use crate::failure::Failure;
use crate::machine;
use crate::resolve::selection;
use crate::values::{show_argument, show_many, show_number, show_vertices};

/// Runs the verb.
pub fn run(args: &InfoArgs, console: &Console) -> Result<(), Failure> {
    let path = &args.input;
    if args.volume.dims.is_some() || holds_volume(path)? {
        return super::info_volume::run(args, console);
    }
    if let Some(option) = args.volume.given() {
        return Err(Failure::Usage(format!("{option}: {} does not hold a volume", path.display())));
    }
    let (read, choice) = selection(&args.from, AttributeChoice::All, Invalid::Keep)?;
    let info = machine::thread_pool(machine::default_threads())?.install(|| -> Result<_, Failure> {
        Ok(match read_content(path, &read)? {
            pellicle_io::Content::Mesh(mesh) => Info::of_mesh(&mesh),
            pellicle_io::Content::Particles(mut particles) => {
                choice.apply(&mut particles, path)?;
                Info::of_particles(&particles)
            }
        })
    })?;
    info.tell(path, console);
    console.report(|| info.as_json(path));
    Ok(())
}

/// What there is to tell about a file.
struct Info {
    content: Content,
    /// Box around the finite positions, if there are any.
    bounds: Option<[[f64; 3]; 2]>,
    attributes: Vec<AttributeInfo>,
}

enum Content {
    Particles { count: usize, invalid: usize, precision: &'static str, radius: Option<f64> },
    Mesh { vertices: usize, triangles: usize, has_normals: bool },
}

struct AttributeInfo {
    name: String,
    kind: &'static str,
    components: usize,
    /// Smallest and largest value of each component, NaN left out; empty without particles.
    ranges: Vec<[f64; 2]>,
}

impl Info {
    fn of_particles(particles: &Particles) -> Self {
        let view = particles.positions.view();
        let positions = || (0..view.len()).map(|i| view.get(i));
        let invalid = positions().filter(|p| !is_finite(p)).count();
        let precision = match particles.positions {
            PositionData::F32(_) => "f32",
            PositionData::F64(_) => "f64",
        };
        // A spacing among positions that are not finite means nothing.
        let radius = if invalid == 0 { infer_radius(view) } else { None };
        let attributes = particles.attributes.iter().map(|a| {
            let (kind, ranges) = match &a.values {
                AttributeValues::F32(v) => ("f32", ranges(v.iter().map(|&x| f64::from(x)), a.components)),
                AttributeValues::F64(v) => ("f64", ranges(v.iter().copied(), a.components)),
                AttributeValues::I32(v) => ("i32", ranges(v.iter().map(|&x| f64::from(x)), a.components)),
                AttributeValues::I64(v) => ("i64", ranges(v.iter().map(|&x| x as f64), a.components)),
            };
            AttributeInfo { name: a.name.clone(), kind, components: a.components, ranges }
        });
        Self {
            content: Content::Particles { count: view.len(), invalid, precision, radius },
            bounds: bounds(positions()),
            attributes: attributes.collect(),
        }
    }

    fn of_mesh(mesh: &Mesh) -> Self {
        let attributes = mesh.attributes.iter().map(|a| AttributeInfo {
            name: a.name.clone(),
            kind: "f32",
            components: a.components,
            ranges: ranges(a.values.iter().map(|&x| f64::from(x)), a.components),
        });
        Self {
            content: Content::Mesh {
                vertices: mesh.vertices.len(),
                triangles: mesh.triangles.len(),
                has_normals: !mesh.normals.is_empty(),
            },
            bounds: bounds((0..mesh.vertices.len()).map(|i| mesh.position(i))),
            attributes: attributes.collect(),
        }
    }

    fn tell(&self, path: &Path, console: &Console) {
        let file = path.display();
        match self.content {
            Content::Particles { count, precision, .. } => {
                console.say(format_args!("{file}: {}, positions in {precision}", show_many(count, "particle")));
            }
            Content::Mesh { vertices, triangles, has_normals } => {
                let normals = if has_normals { ", normals" } else { "" };
                let (vertices, triangles) = (show_vertices(vertices), show_many(triangles, "triangle"));
                console.say(format_args!("{file}: mesh of {vertices}, {triangles}{normals}"));
            }
        }
        if let Some([low, high]) = self.bounds {
            console.say(format_args!("  box    {} to {}", show_point(low), show_point(high)));
        }
        for attribute in &self.attributes {
            console.say(format_args!("  {attribute}"));
        }
        self.advise(path, console);
    }

    /// What to do with it.
    fn advise(&self, path: &Path, console: &Console) {
        let file = show_argument(path);
        match self.content {
            Content::Mesh { .. } => console.say(format_args!("Next: pellicle check {file}")),
            Content::Particles { count: 0, .. } => {}
            Content::Particles { invalid, .. } if invalid > 0 => {
                let invalid = show_many(invalid, "particle");
                console.warn(format!("{}: {invalid} whose positions are not finite", path.display()));
                console.say(format_args!("Next: pellicle mesh {file} --drop-invalid"));
            }
            Content::Particles { radius: Some(radius), .. } => {
                let (spacing, radius) = (show_number(2.0 * radius), show_number(radius));
                console.say(format_args!("  spacing {spacing}, so the particle radius is about {radius} (inferred)"));
                console.say(format_args!("Next: pellicle mesh {file} -r {radius}"));
            }
            Content::Particles { radius: None, .. } => {
                console.say("  the spacing cannot be inferred from fewer than two distinct positions");
                console.say(format_args!("Next: pellicle mesh {file} -r RADIUS"));
            }
        }
    }

    fn as_json(&self, path: &Path) -> Value {
        let mut value = match self.content {
            Content::Particles { count, invalid, precision, radius } => json!({
                "kind": "particles",
                "particles": count,
                "particles_invalid": invalid,
                "position_type": precision,
                "particle_radius_inferred": radius,
                "spacing_inferred": radius.map(|r| 2.0 * r),
            }),
            Content::Mesh { vertices, triangles, has_normals } => json!({
                "kind": "mesh",
                "vertices": vertices,
                "triangles": triangles,
                "normals": has_normals,
            }),
        };
        value["input"] = json!(path.to_string_lossy());
        value["box"] = json!(self.bounds);
        value["attributes"] = self.attributes.iter().map(AttributeInfo::as_json).collect();
        value
    }
}

impl AttributeInfo {
    fn as_json(&self) -> Value {
        json!({
            "name": self.name,
            "type": self.kind,
            "components": self.components,
            "min": self.ranges.iter().map(|r| r[0]).collect::<Vec<_>>(),
            "max": self.ranges.iter().map(|r| r[1]).collect::<Vec<_>>(),
        })
    }
}

impl std::fmt::Display for AttributeInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.name, self.kind)?;
        if self.components != 1 {
            write!(f, " × {}", self.components)?;
        }
        for (i, [low, high]) in self.ranges.iter().enumerate() {
            write!(f, "{} {} to {}", if i == 0 { "," } else { ";" }, show_number(*low), show_number(*high))?;
        }
        Ok(())
    }
}

fn is_finite(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.is_finite())
}

pub fn show_point(p: [f64; 3]) -> String {
    format!("({}, {}, {})", show_number(p[0]), show_number(p[1]), show_number(p[2]))
}

/// Box around the positions that are finite.
fn bounds(positions: impl Iterator<Item = [f64; 3]>) -> Option<[[f64; 3]; 2]> {
    positions.filter(is_finite).fold(None, |bounds, p| {
        let [low, high] = bounds.unwrap_or([p, p]);
        Some([std::array::from_fn(|a| p[a].min(low[a])), std::array::from_fn(|a| p[a].max(high[a]))])
    })
}

/// Smallest and largest value of each component. `f64::min` and `max` pass over NaN.
fn ranges(values: impl ExactSizeIterator<Item = f64>, components: usize) -> Vec<[f64; 2]> {
    if values.len() == 0 {
        return Vec::new();
    }
    let components = components.max(1);
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; components];
    for (i, value) in values.enumerate() {
        let [low, high] = &mut ranges[i % components];
        *low = low.min(value);
        *high = high.max(value);
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_per_component_and_pass_over_nan() {
        let values = [1.0, 10.0, f64::NAN, -5.0, 3.0, 0.0];
        assert_eq!(ranges(values.into_iter(), 2), [[1.0, 3.0], [-5.0, 10.0]]);
        assert!(ranges(std::iter::empty::<f64>().collect::<Vec<_>>().into_iter(), 3).is_empty());
    }

    #[test]
    fn the_box_is_that_of_finite_positions() {
        let positions = [[0., 1., 2.], [f64::NAN, 100., 0.], [-1., 5., 2.], [0., 0., f64::INFINITY]];
        assert_eq!(bounds(positions.into_iter()), Some([[-1., 1., 2.], [0., 5., 2.]]));
        assert_eq!(bounds([[f64::NAN; 3]].into_iter()), None);
    }
}
