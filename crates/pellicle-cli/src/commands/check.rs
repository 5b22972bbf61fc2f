//! `check MESH`: is the mesh closed, 2-manifold and oriented outward? In words, and by the exit code. With `--quality` also
//! how good its triangles are, with `--reference` how far it is from another, and with `--field` from the volume it was made of.

mod field;

use pellicle::Mesh;
use pellicle::mesh::{Comparison, Deviation, Quality, Report, Summary, VALENCE_END};
use serde_json::{Value, json};

use crate::args::CheckArgs;
use crate::console::Console;
use crate::failure::Failure;
use crate::values::{show_count, show_many, show_number, show_vertices};

/// Runs the verb.
pub fn run(args: &CheckArgs, console: &Console) -> Result<(), Failure> {
    if let (None, Some(option)) = (&args.field, args.from.given()) {
        return Err(Failure::Usage(format!("{option} is for the volume of --field, and none is given")));
    }
    let mesh = pellicle_io::read_mesh(&args.input).map_err(Failure::from)?;
    let report = Report::of(&mesh);
    let verdict = Verdict::of(&report, args.allow_boundary);
    let quality = (args.quality || args.reference.is_some()).then(|| Quality::of(&mesh));
    let comparison = match &args.reference {
        Some(path) => {
            let reference = pellicle_io::read_mesh(path).map_err(Failure::from)?;
            Some(Comparison::of(&mesh, &reference, args.samples))
        }
        None => None,
    };
    let from_field = args.field.as_ref().map(|path| field::measure(args, path, &mesh)).transpose()?;

    console.say(format_args!("{}: {}", args.input.display(), overview(&report)));
    for line in measures(&report) {
        console.say(line);
    }
    let shapes = quality.iter().flat_map(quality_lines);
    for line in shapes.chain(comparison.iter().flat_map(comparison_lines)) {
        console.say(line);
    }
    if let Some(found) = &from_field {
        console.say(distance_line("to the field's surface", found));
    }
    for defect in &verdict.defects {
        console.say(format_args!("  DEFECT: {defect}"));
    }
    for remark in remarks(&report) {
        console.say(format_args!("  note: {remark}"));
    }
    console.report(|| {
        let mut json = as_json(args, &mesh, &report, &verdict);
        json["quality"] = quality.as_ref().map_or(Value::Null, quality_json);
        json["distance"] = comparison.as_ref().map_or(Value::Null, |found| comparison_json(args, found));
        json["field"] = from_field.as_ref().map_or(Value::Null, |found| field::as_json(args, found));
        json
    });

    let what =
        if args.allow_boundary { "manifold and oriented outward" } else { "closed, manifold and oriented outward" };
    if verdict.defects.is_empty() {
        console.say(format_args!("  it is {what}"));
        Ok(())
    } else {
        Err(Failure::file(&args.input, format_args!("the mesh is not {what}: {}", verdict.defects.join("; "))))
    }
}

/// What is wrong, in words; nothing if the mesh passes.
struct Verdict {
    defects: Vec<String>,
}

impl Verdict {
    fn of(report: &Report, allow_boundary: bool) -> Self {
        let mut defects = Vec::new();
        let mut count = |found: usize, noun: &str| {
            if found > 0 {
                defects.push(format!("{noun}: {}", show_count(found)));
            }
        };
        count(report.nan_vertices, "vertices with positions that are not finite");
        count(report.out_of_range_triangles, "triangles with an index that names no vertex");
        count(report.repeated_index_triangles, "triangles that name a vertex twice");
        count(report.duplicate_half_edges, "sides along which several triangles run the same way");
        count(report.non_manifold_edges, "edges with more than two triangles");
        count(report.non_manifold_vertices, "vertices where separate pieces touch");
        if !allow_boundary {
            count(report.boundary_half_edges, "sides without a neighbour (holes; --allow-boundary accepts them)");
        }
        if report.signed_volume < 0.0 && report.boundary_half_edges == 0 {
            defects.push("the triangles face inward (the volume is negative)".into());
        }
        Self { defects }
    }
}

fn overview(report: &Report) -> String {
    format!("{}, {}", show_vertices(report.vertices), show_many(report.triangles, "triangle"))
}

fn measures(report: &Report) -> Vec<String> {
    let mut lines = vec![format!(
        "  {}, Euler characteristic {}{}",
        show_many(report.components, "component"),
        report.euler_characteristic,
        if report.closed_manifold() { format!(", genus {}", report.genus()) } else { String::new() },
    )];
    let volume = if report.boundary_half_edges == 0 {
        format!(", volume {}", show_number(report.signed_volume))
    } else {
        String::new()
    };
    lines.push(format!("  area {}{volume}", show_number(report.area)));
    lines
}

/// What is worth knowing but breaks nothing.
fn remarks(report: &Report) -> Vec<String> {
    let mut remarks = Vec::new();
    if report.triangles == 0 {
        remarks.push("the mesh is empty".into());
    }
    if report.unused_vertices > 0 {
        remarks.push(format!("{} used by no triangle", show_vertices(report.unused_vertices)));
    }
    if report.zero_area_triangles > 0 {
        remarks.push(format!("{} of area 0", show_many(report.zero_area_triangles, "triangle")));
    }
    remarks
}

fn as_json(args: &CheckArgs, mesh: &Mesh, report: &Report, verdict: &Verdict) -> Value {
    json!({
        "input": args.input.to_string_lossy(),
        "allow_boundary": args.allow_boundary,
        "passed": verdict.defects.is_empty(),
        "defects": verdict.defects,
        "closed_manifold": report.closed_manifold(),
        "vertices": report.vertices,
        "triangles": report.triangles,
        "attributes": mesh.attributes.iter().map(|a| &a.name).collect::<Vec<_>>(),
        "nan_vertices": report.nan_vertices,
        "out_of_range_triangles": report.out_of_range_triangles,
        "unused_vertices": report.unused_vertices,
        "repeated_index_triangles": report.repeated_index_triangles,
        "duplicate_half_edges": report.duplicate_half_edges,
        "boundary_half_edges": report.boundary_half_edges,
        "non_manifold_edges": report.non_manifold_edges,
        "non_manifold_vertices": report.non_manifold_vertices,
        "components": report.components,
        "euler_characteristic": report.euler_characteristic,
        "zero_area_triangles": report.zero_area_triangles,
        "area": report.area,
        "signed_volume": report.signed_volume,
    })
}

fn quality_lines(quality: &Quality) -> Vec<String> {
    let mut lines = vec![
        format!(
            "  triangles: {} measured, {} of area 0, {} without a shape",
            show_count(quality.triangles),
            show_count(quality.degenerate_triangles),
            show_count(quality.skipped_triangles)
        ),
        format!("  {:<18}{:>11}{:>11}{:>11}{:>11}{:>11}{:>11}", "", "min", "1 %", "5 %", "median", "mean", "max"),
    ];
    for (name, summary) in summaries(quality) {
        let Summary { min, p1, p5, median, mean, max, .. } = summary;
        let numbers = [min, p1, p5, median, mean, max].map(|v| format!("{:>11}", show_number(v))).concat();
        lines.push(format!("  {:<18}{numbers}", name.replace('_', " ")));
    }
    let valences = quality.valence.iter().enumerate().filter(|(n, count)| *n > 0 && **count > 0);
    let valences: Vec<String> = valences
        .map(|(n, count)| format!("{n}{}: {}", if n == VALENCE_END { "+" } else { "" }, show_count(*count)))
        .collect();
    lines.push(format!("  valence            {}", valences.join(", ")));
    lines
}

fn distance_line(name: &str, deviation: &Deviation) -> String {
    format!(
        "  distance {name}: mean {}, rms {}, max {} ({} samples{})",
        show_number(deviation.mean),
        show_number(deviation.rms),
        show_number(deviation.max),
        show_count(deviation.samples),
        if deviation.skipped_samples > 0 {
            format!(", {} of them without a distance", show_count(deviation.skipped_samples))
        } else {
            String::new()
        }
    )
}

fn comparison_lines(comparison: &Comparison) -> Vec<String> {
    vec![
        distance_line("to the reference", &comparison.to_reference),
        distance_line("from the reference", &comparison.from_reference),
        format!("  Hausdorff distance {}", show_number(comparison.hausdorff())),
    ]
}

/// Distributions by name.
fn summaries(quality: &Quality) -> [(&'static str, Summary); 5] {
    [
        ("radius_ratio", quality.radius_ratio),
        ("aspect_ratio", quality.aspect_ratio),
        ("min_angle", quality.min_angle),
        ("max_angle", quality.max_angle),
        ("edge_length", quality.edge_length),
    ]
}

fn quality_json(quality: &Quality) -> Value {
    let mut json = json!({
        "triangles": quality.triangles,
        "skipped_triangles": quality.skipped_triangles,
        "degenerate_triangles": quality.degenerate_triangles,
        "valence": quality.valence,
        "area": quality.area,
        "volume": quality.volume,
    });
    for (name, s) in summaries(quality) {
        json[name] = json!({
            "min": s.min, "p1": s.p1, "p5": s.p5, "median": s.median, "mean": s.mean, "p95": s.p95, "p99": s.p99,
            "max": s.max,
        });
    }
    json
}

fn deviation_json(d: &Deviation) -> Value {
    json!({
        "samples": d.samples,
        "skipped_samples": d.skipped_samples,
        "mean": d.mean,
        "rms": d.rms,
        "max": d.max,
    })
}

fn comparison_json(args: &CheckArgs, comparison: &Comparison) -> Value {
    json!({
        "reference": args.reference.as_ref().map(|path| path.to_string_lossy()),
        "to_reference": deviation_json(&comparison.to_reference),
        "from_reference": deviation_json(&comparison.from_reference),
        "hausdorff": comparison.hausdorff(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        Mesh {
            vertices: vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        }
    }

    fn defects(mesh: &Mesh, allow_boundary: bool) -> Vec<String> {
        Verdict::of(&Report::of(mesh), allow_boundary).defects
    }

    #[test]
    fn a_closed_outward_mesh_passes_and_so_does_the_empty_one() {
        assert_eq!(defects(&tetrahedron(), false), Vec::<String>::new());
        assert_eq!(defects(&Mesh::default(), false), Vec::<String>::new());
    }

    #[test]
    fn a_hole_fails_unless_boundaries_are_allowed() {
        let mut mesh = tetrahedron();
        mesh.triangles.pop();
        assert_eq!(defects(&mesh, false).len(), 1);
        assert_eq!(defects(&mesh, true), Vec::<String>::new());
    }

    #[test]
    fn an_inward_mesh_fails_although_it_is_closed() {
        let mut mesh = tetrahedron();
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        assert!(Report::of(&mesh).closed_manifold());
        assert!(defects(&mesh, false)[0].contains("inward"));
        assert!(defects(&mesh, true)[0].contains("inward"), "there is no boundary, so the volume means something");
    }

    #[test]
    fn a_nan_and_a_wild_index_fail() {
        let mut mesh = tetrahedron();
        mesh.vertices[2][1] = f32::NAN;
        assert!(defects(&mesh, true)[0].contains("not finite"));
        let mut mesh = tetrahedron();
        mesh.triangles[0][0] = 4;
        assert!(defects(&mesh, true)[0].contains("names no vertex"));
    }
}
