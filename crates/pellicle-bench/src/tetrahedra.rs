//! The talk's table: splits into tetrahedra beside marching cubes, by triangles, quality, error and time.
//!
//! Three surfaces whose distance is known everywhere (to first order for the gyroid), each sampled in 96³ cells of `f32`; all
//! methods get the same samples. Then the functions themselves, which tetrahedra with nodes in the middle of cells can ask
//! there. `--scan FILE ISO` adds a volume, whose surface is taken to be that of its trilinear interpolant. Errors are in units
//! of a cell's edge, times are medians of five runs in milliseconds. `--of NAME` keeps to one surface.
//!
//! Prints a table in Markdown; with `--json`, rows `{surface, source, method, triangles, radius_ratio_mean,
//! radius_ratio_p5, radius_ratio_p1, radius_ratio_min, min_angle_p1, error_rms, error_max, milliseconds, threads}`.

use std::{path::Path, time::Instant};

use pellicle::mesh::{Deviation, Quality, Report};
use pellicle::{
    Border, ContourParams, Control, Domain, Function, Mesh, Tetrahedra, TetrahedraParams, Volume, contour,
    contour_function_tetrahedra, contour_tetrahedra,
};

const CELLS: usize = 96;
const RUNS: usize = 5;

/// A surface at the value 0 of a function, in the cube from −1 to 1.
struct Surface {
    name: &'static str,
    value: fn([f64; 3]) -> f64,
}

const SURFACES: [Surface; 3] = [
    Surface { name: "sphere", value: |p| 0.8 - p.iter().map(|v| v * v).sum::<f64>().sqrt() },
    Surface { name: "torus", value: |p| 0.25 - (p[0].hypot(p[1]) - 0.6).hypot(p[2]) },
    Surface { name: "gyroid", value: gyroid },
];

/// Two periods along each axis, moved so that no node has a value of exactly 0; open at the cube's border.
fn gyroid(p: [f64; 3]) -> f64 {
    let [(sx, cx), (sy, cy), (sz, cz)] = p.map(|v| (std::f64::consts::TAU * v + 0.123).sin_cos());
    sx * cy + sy * cz + sz * cx
}

/// Samples on a grid of cells of edge `spacing`.
struct Samples {
    name: &'static str,
    values: Vec<f32>,
    nodes: [usize; 3],
    origin: f64,
    spacing: f64,
    iso: f64,
}

impl Samples {
    fn of(surface: &Surface) -> Self {
        let (n, spacing) = (CELLS + 1, 2.0 / CELLS as f64);
        let at = |i: usize| [i % n, i / n % n, i / (n * n)].map(|i| i as f64 * spacing - 1.0);
        let values = (0..n * n * n).map(|i| (surface.value)(at(i)) as f32).collect();
        Self { name: surface.name, values, nodes: [n; 3], origin: -1.0, spacing, iso: 0.0 }
    }

    /// A scan, in units of its own cells.
    fn read(file: &str, iso: &str) -> Result<Self, String> {
        let iso = iso.parse().map_err(|_| format!("{iso}: not an isovalue"))?;
        let data = pellicle_io::read_volume(Path::new(file), &pellicle_io::VolumeOptions::default())
            .map_err(|error| error.to_string())?;
        let values = (0..data.samples.len()).map(|i| data.samples.get_f64(i) as f32).collect();
        Ok(Self { name: "scan", values, nodes: data.header.dims, origin: 0.0, spacing: 1.0, iso })
    }

    fn volume(&self) -> Result<Volume<'_>, String> {
        Volume::new(&self.values, self.nodes)
            .and_then(|v| v.with_spacing([self.spacing; 3]))
            .and_then(|v| v.with_origin([self.origin; 3]))
            .map(|v| v.with_border(Border::Open))
            .map_err(|error| error.to_string())
    }

    /// Value and gradient of the trilinear interpolant.
    fn trilinear(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let at = p.map(|v| (v - self.origin) / self.spacing);
        let cell: [usize; 3] = std::array::from_fn(|a| (at[a].max(0.0) as usize).min(self.nodes[a] - 2));
        let t: [f64; 3] = std::array::from_fn(|a| at[a] - cell[a] as f64);
        let (mut value, mut gradient) = (0.0, [0.0; 3]);
        for c in 0..8usize {
            let [x, y, z]: [usize; 3] = std::array::from_fn(|a| cell[a] + (c >> a & 1));
            let sample = f64::from(self.values[x + self.nodes[0] * (y + self.nodes[1] * z)]);
            let weight: [f64; 3] = std::array::from_fn(|a| if c >> a & 1 == 1 { t[a] } else { 1.0 - t[a] });
            value += sample * weight[0] * weight[1] * weight[2];
            for a in 0..3 {
                let sign = if c >> a & 1 == 1 { 1.0 } else { -1.0 };
                gradient[a] += sign * sample * weight[(a + 1) % 3] * weight[(a + 2) % 3] / self.spacing;
            }
        }
        (value - self.iso, gradient)
    }
}

/// Value, greater than 0 inside, and gradient.
type Truth<'a> = &'a (dyn Fn([f64; 3]) -> (f64, [f64; 3]) + Sync);

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let after = |name: &str| words.iter().position(|word| word == name).map(|i| &words[i + 1..]);
    let only = after("--of").and_then(|rest| rest.first());
    let is_wanted = |name: &str| only.is_none_or(|only| only == name);
    let mut rows = Vec::new();
    for surface in SURFACES.iter().filter(|surface| is_wanted(surface.name)) {
        let truth = |p: [f64; 3]| ((surface.value)(p), surface.value.gradient(p, 1e-6));
        of_samples(&Samples::of(surface), &truth, &mut rows)?;
        let spacing = 2.0 / CELLS as f64;
        let domain = Domain { border: Border::Open, ..Domain::covering([[-1.0; 3], [1.0; 3]], spacing) };
        for split in Tetrahedra::ALL {
            let params = TetrahedraParams { split, normals: false };
            let make = || contour_function_tetrahedra(&surface.value, &domain, 0.0, &params, &Control::default());
            rows.push(measure((surface.name, "function", name(split)), spacing, &truth, make)?);
        }
    }
    if let Some([file, iso, ..]) = after("--scan").filter(|_| is_wanted("scan")) {
        let samples = Samples::read(file, iso)?;
        of_samples(&samples, &|p| samples.trilinear(p), &mut rows)?;
    }
    if words.iter().any(|word| word == "--json") {
        rows.iter().for_each(|row| println!("{}", row.json()));
    } else {
        print_table(&rows);
    }
    Ok(())
}

fn of_samples(samples: &Samples, truth: Truth<'_>, rows: &mut Vec<Row>) -> Result<(), String> {
    let volume = samples.volume()?;
    let row = |method| (samples.name, "samples", method);
    let cubes = || contour(&volume, samples.iso, &ContourParams::default());
    rows.push(measure(row("marching cubes"), samples.spacing, truth, cubes)?);
    for split in Tetrahedra::ALL {
        let make = || contour_tetrahedra(&volume, samples.iso, split, &Control::default());
        rows.push(measure(row(name(split)), samples.spacing, truth, make)?);
    }
    Ok(())
}

fn name(split: Tetrahedra) -> &'static str {
    match split {
        Tetrahedra::Five => "MT5",
        Tetrahedra::Six => "MT6",
        Tetrahedra::BodyCentred => "body-centred (CCL)",
        Tetrahedra::Simplex => "simplex",
        Tetrahedra::Regularised => "regularised",
    }
}

/// One line of a table.
struct Row {
    surface: &'static str,
    source: &'static str,
    method: &'static str,
    triangles: usize,
    quality: Quality,
    /// Root mean square and largest, in cells.
    errors: [f64; 2],
    milliseconds: f64,
}

fn measure(
    (surface, source, method): (&'static str, &'static str, &'static str),
    spacing: f64,
    truth: Truth<'_>,
    make: impl Fn() -> Result<Mesh, pellicle::Error>,
) -> Result<Row, String> {
    let mut mesh = Mesh::default();
    let mut times: Vec<f64> = Vec::new();
    for _ in 0..RUNS {
        let start = Instant::now();
        mesh = make().map_err(|error| error.to_string())?;
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let report = Report::of(&mesh);
    let defects = report.duplicate_half_edges + report.non_manifold_edges + report.non_manifold_vertices;
    let is_open = ["gyroid", "scan"].contains(&surface);
    if defects > 0 || (!is_open && report.boundary_half_edges > 0) {
        return Err(format!("{method} of the {surface}: {report:?}"));
    }
    let error = Deviation::from_field(&mesh, 200_000, 0.0, truth);
    let errors = [error.rms, error.max].map(|e| e / spacing);
    let (triangles, quality) = (mesh.triangles.len(), Quality::of(&mesh));
    Ok(Row { surface, source, method, triangles, quality, errors, milliseconds: times[RUNS / 2] })
}

impl Row {
    fn json(&self) -> String {
        let (q, [rms, max]) = (&self.quality, self.errors);
        format!(
            "{{\"surface\": \"{}\", \"source\": \"{}\", \"method\": \"{}\", \"triangles\": {}, \"radius_ratio_mean\": {}, \
             \"radius_ratio_p5\": {}, \"radius_ratio_p1\": {}, \"radius_ratio_min\": {}, \"min_angle_p1\": {}, \"error_rms\": {rms}, \"error_max\": {max}, \
             \"milliseconds\": {}, \"threads\": {}}}",
            self.surface,
            self.source,
            self.method,
            self.triangles,
            q.radius_ratio.mean,
            q.radius_ratio.p5,
            q.radius_ratio.p1,
            q.radius_ratio.min,
            q.min_angle.p1,
            self.milliseconds,
            rayon::current_num_threads()
        )
    }
}

fn print_table(rows: &[Row]) {
    println!("{} threads\n", rayon::current_num_threads());
    println!(
        "| surface | source | method | triangles | radius ratio: mean | 5 % | 1 % | least | smallest angle, 1 % | error rms, cells | \
         largest | ms |\n|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    for row in rows {
        let (q, [rms, max]) = (&row.quality, row.errors);
        println!(
            "| {} | {} | {} | {} | {:.3} | {:.3} | {:.3} | {:.4} | {:.1}° | {rms:.5} | {max:.4} | {:.1} |",
            row.surface,
            row.source,
            row.method,
            row.triangles,
            q.radius_ratio.mean,
            q.radius_ratio.p5,
            q.radius_ratio.p1,
            q.radius_ratio.min,
            q.min_angle.p1,
            row.milliseconds
        );
    }
}
