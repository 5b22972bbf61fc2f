//! The talk's table: splits into tetrahedra beside marching cubes, by triangles, quality, error and time.
//!
//! Three surfaces whose distance is known everywhere (to first order for the gyroid), each sampled in 96³ cells of `f32`; all
//! methods get the same samples. Then the functions themselves, which tetrahedra with nodes in the middle of cells can ask
//! there. Errors are in units of a cell's edge, times are medians of five runs in milliseconds.
//!
//! Prints two tables in Markdown; with `--json`, rows `{surface, source, method, triangles, radius_ratio_mean,
//! radius_ratio_p1, radius_ratio_min, min_angle_p1, error_rms, error_max, milliseconds, threads}`.

use std::time::Instant;

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

/// See the module.
pub fn run(words: &[String]) -> Result<(), String> {
    let json = words.iter().any(|word| word == "--json");
    let spacing = 2.0 / CELLS as f64;
    let domain = Domain { border: Border::Open, ..Domain::covering([[-1.0; 3], [1.0; 3]], spacing) };
    let mut rows = Vec::new();
    for surface in &SURFACES {
        let node = |n: usize| [n % (CELLS + 1), n / (CELLS + 1) % (CELLS + 1), n / ((CELLS + 1) * (CELLS + 1))];
        let samples: Vec<f32> = (0..(CELLS + 1).pow(3))
            .map(|n| (surface.value)(node(n).map(|i| i as f64 * spacing - 1.0)) as f32)
            .collect();
        let volume = Volume::new(&samples, [CELLS + 1; 3])
            .and_then(|v| v.with_spacing([spacing; 3]))
            .and_then(|v| v.with_origin([-1.0; 3]))
            .map_err(|error| error.to_string())?
            .with_border(Border::Open);
        rows.push(measure(surface, "samples", "marching cubes", || contour(&volume, 0.0, &ContourParams::default()))?);
        for split in Tetrahedra::ALL {
            let make = || contour_tetrahedra(&volume, 0.0, split, &Control::default());
            rows.push(measure(surface, "samples", name(split), make)?);
        }
        for split in Tetrahedra::ALL {
            let params = TetrahedraParams { split, normals: false };
            let make = || contour_function_tetrahedra(&surface.value, &domain, 0.0, &params, &Control::default());
            rows.push(measure(surface, "function", name(split), make)?);
        }
    }
    if json {
        rows.iter().for_each(|row| println!("{}", row.json()));
    } else {
        print_tables(&rows);
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
    error: Deviation,
    milliseconds: f64,
}

fn measure(
    surface: &Surface,
    source: &'static str,
    method: &'static str,
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
    if defects > 0 || (surface.name != "gyroid" && report.boundary_half_edges > 0) {
        return Err(format!("{method} of the {}: {report:?}", surface.name));
    }
    let field = |p: [f64; 3]| ((surface.value)(p), surface.value.gradient(p, 1e-6));
    Ok(Row {
        surface: surface.name,
        source,
        method,
        triangles: mesh.triangles.len(),
        quality: Quality::of(&mesh),
        error: Deviation::from_field(&mesh, 200_000, 0.0, field),
        milliseconds: times[RUNS / 2],
    })
}

impl Row {
    /// Errors in cells: root mean square and largest.
    fn errors(&self) -> [f64; 2] {
        [self.error.rms, self.error.max].map(|e| e * CELLS as f64 / 2.0)
    }

    fn json(&self) -> String {
        let (q, [rms, max]) = (&self.quality, self.errors());
        format!(
            "{{\"surface\": \"{}\", \"source\": \"{}\", \"method\": \"{}\", \"triangles\": {}, \"radius_ratio_mean\": {}, \
             \"radius_ratio_p1\": {}, \"radius_ratio_min\": {}, \"min_angle_p1\": {}, \"error_rms\": {rms}, \"error_max\": {max}, \
             \"milliseconds\": {}, \"threads\": {}}}",
            self.surface,
            self.source,
            self.method,
            self.triangles,
            q.radius_ratio.mean,
            q.radius_ratio.p1,
            q.radius_ratio.min,
            q.min_angle.p1,
            self.milliseconds,
            rayon::current_num_threads()
        )
    }
}

fn print_tables(rows: &[Row]) {
    println!("{CELLS}³ cells, {} threads\n", rayon::current_num_threads());
    println!(
        "| surface | source | method | triangles | radius ratio: mean | 1 % | least | smallest angle, 1 % | error rms, cells | \
         largest | ms |\n|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    for row in rows {
        let (q, [rms, max]) = (&row.quality, row.errors());
        println!(
            "| {} | {} | {} | {} | {:.3} | {:.3} | {:.4} | {:.1}° | {rms:.5} | {max:.4} | {:.1} |",
            row.surface,
            row.source,
            row.method,
            row.triangles,
            q.radius_ratio.mean,
            q.radius_ratio.p1,
            q.radius_ratio.min,
            q.min_angle.p1,
            row.milliseconds
        );
    }
}
