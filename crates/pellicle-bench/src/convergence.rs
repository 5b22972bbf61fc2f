//! Orders of convergence on a sphere, a torus and a gyroid whose surfaces are known: how fast errors fall as cells shrink.
//!
//! Four resolutions, and the slope of the line through log(error) over log(spacing). Vertex position: greatest distance of a
//! vertex from the surface (|F| / |∇F| for the gyroid). Normal: greatest angle between a vertex's normal and the surface's,
//! from the samples' gradient and from faces. Area: against the known area; the gyroid's from the finest mesh by
//! extrapolation, since no closed form is known. Expected: position 2, normals at least 1, area 2.

use pellicle::{ContourParams, Mesh, VertexNormals, Volume, contour, mesh::Report};

/// A function whose 0 is the surface, greater inside; its gradient; the exact area within the box, if it is known.
struct Surface {
    name: &'static str,
    value: fn([f64; 3]) -> f64,
    gradient: fn([f64; 3]) -> [f64; 3],
    area: Option<f64>,
    /// Half edge of the box around the origin.
    half: f64,
}

const PI: f64 = std::f64::consts::PI;

/// The torus's tube radius; its centre line has radius 1.
const TUBE: f64 = 0.4;

const SURFACES: [Surface; 3] = [
    Surface {
        name: "sphere",
        // The distance: of a quadratic central differences are exact, and there is no order to see.
        value: |p| 1.0 - p.iter().map(|x| x * x).sum::<f64>().sqrt(),
        gradient: |p| {
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            p.map(|x| -x / length)
        },
        area: Some(4.0 * PI),
        half: 1.3,
    },
    Surface {
        name: "torus",
        value: |p| TUBE * TUBE - (p[0].hypot(p[1]) - 1.0).powi(2) - p[2] * p[2],
        gradient: |p| {
            let ring = p[0].hypot(p[1]);
            let along = -2.0 * (ring - 1.0) / ring;
            [along * p[0], along * p[1], -2.0 * p[2]]
        },
        area: Some(4.0 * PI * PI * TUBE),
        half: 1.6,
    },
    Surface {
        name: "gyroid",
        value: |p| p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos(),
        gradient: |p| {
            let along = |a: usize, b: usize, c: usize| p[a].cos() * p[b].cos() - p[c].sin() * p[a].sin();
            [along(0, 1, 2), along(1, 2, 0), along(2, 0, 1)]
        },
        area: None,
        half: PI,
    },
];

/// Nodes along an axis.
const RESOLUTIONS: [usize; 4] = [25, 49, 97, 193];

/// Errors of one mesh.
struct Errors {
    position: f64,
    gradient_normal: f64,
    face_normal: f64,
    area: f64,
}

/// See the module.
pub fn run(_: &[String]) -> Result<(), String> {
    println!(
        "{:8} {:>6} {:>12} {:>14} {:>14} {:>12}",
        "surface", "nodes", "position", "normal (grad)", "normal (face)", "area"
    );
    for surface in &SURFACES {
        let mut errors = RESOLUTIONS.map(|n| errors(surface, n)).into_iter().collect::<Result<Vec<_>, _>>()?;
        if surface.area.is_none() {
            // Richardson: what the two finest would have at spacing 0 with an error of order 2; both are then judged.
            let (fine, coarse) = (errors[3].area, errors[2].area);
            let limit = fine + (fine - coarse) / 3.0;
            errors.iter_mut().for_each(|e| e.area = (e.area / limit - 1.0).abs());
        }
        for (n, e) in RESOLUTIONS.iter().zip(&errors) {
            let Errors { position, gradient_normal, face_normal, area } = e;
            println!(
                "{:8} {n:6} {position:12.3e} {gradient_normal:14.3e} {face_normal:14.3e} {area:12.3e}",
                surface.name
            );
        }
        let order = |of: fn(&Errors) -> f64| slope(&errors.iter().map(of).collect::<Vec<_>>());
        println!(
            "{:8} {:>6} {:12.2} {:14.2} {:14.2} {:12.2}",
            surface.name,
            "order",
            order(|e| e.position),
            order(|e| e.gradient_normal),
            order(|e| e.face_normal),
            order(|e| e.area)
        );
    }
    Ok(())
}

fn errors(surface: &Surface, n: usize) -> Result<Errors, String> {
    let spacing = 2.0 * surface.half / (n - 1) as f64;
    let at = |i: usize| -surface.half + i as f64 * spacing;
    let samples: Vec<f64> =
        (0..n * n * n).map(|i| (surface.value)([at(i % n), at(i / n % n), at(i / (n * n))])).collect();
    let make = |normals: VertexNormals| -> Result<Mesh, pellicle::Error> {
        let volume = Volume::new(&samples, [n; 3])?.with_origin([-surface.half; 3])?.with_spacing([spacing; 3])?;
        let params = ContourParams { normals, ..ContourParams::default() };
        contour(&volume.with_border(pellicle::Border::Open), 0.0, &params)
    };
    let by_gradient = make(VertexNormals::Gradient).map_err(|error| error.to_string())?;
    let by_faces = make(VertexNormals::Faces).map_err(|error| error.to_string())?;
    let mut errors = Errors { position: 0.0, gradient_normal: 0.0, face_normal: 0.0, area: 0.0 };
    for v in 0..by_gradient.vertices.len() {
        let p = by_gradient.position(v);
        let gradient = (surface.gradient)(p);
        let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        errors.position = errors.position.max((surface.value)(p).abs() / length);
        let angle = |n: [f32; 3]| {
            let off: f64 = (0..3).map(|a| (gradient[a] / length + f64::from(n[a])).powi(2)).sum();
            2.0 * (0.5 * off.sqrt()).asin()
        };
        errors.gradient_normal = errors.gradient_normal.max(angle(by_gradient.normals[v]));
        // Fans of faces are cut at the border of the box; where samples equal the isovalue a fan may have no area at all.
        let has_normal = by_faces.normals[v] != [0.0; 3];
        if has_normal && p.iter().all(|x| x.abs() < surface.half - 1.5 * spacing) {
            errors.face_normal = errors.face_normal.max(angle(by_faces.normals[v]));
        }
    }
    let area = Report::of(&by_gradient).area;
    errors.area = surface.area.map_or(area, |want| (area / want - 1.0).abs());
    Ok(errors)
}

/// Slope of log(error) over log(spacing), by least squares.
fn slope(errors: &[f64]) -> f64 {
    let x: Vec<f64> = RESOLUTIONS.iter().map(|&n| -((n - 1) as f64).ln()).collect();
    let y: Vec<f64> = errors.iter().map(|e| e.ln()).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(&x), mean(&y));
    let up: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
    up / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
}
