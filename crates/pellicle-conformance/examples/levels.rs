//! The blob at one cell size, at twice that, and half and half with transition cells between, also on a lattice that is turned
//! with a viewer: `levels [FOLDER]`.
//!
//! Prints for each mesh its size, its errors against the field, the shape of its triangles and the least time of a frame,
//! and writes it to `FOLDER/blob-{fine,coarse,mixed,seen}.ply`. For `docs/src/level-of-detail.md`.

use std::{path::PathBuf, time::Instant};

use pellicle::{
    Mesh,
    mesh::{Quality, Report},
    realtime::{DrawOrder, Engine, Params, Region, Sorting, Sweep, View},
};
use pellicle_io::{WriteOptions, write_mesh};
use pellicle_scenes::{ISO, Play, SUPPORT, Show};

const SPACING: f64 = 0.25;

/// The level that a block asks for.
type Wish<'a> = dyn Fn(&Region) -> u8 + 'a;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map(PathBuf::from);
    let mut play = Play::new(Show::Blob, 1);
    (0..60).for_each(|_| play.step());
    let positions = &play.balls().positions;
    let middle = positions.iter().map(|p| f64::from(p[0])).sum::<f64>() / positions.len() as f64;
    let mut engine = Engine::new(Params { iso: ISO.into(), block: [8; 3], ..Params::new(SUPPORT.into(), SPACING) })?;
    let field = Field(positions);
    println!("mesh,vertices,triangles,closed,distance_mean,distance_max,angle_mean,angle_p99,ratio_min,ratio_mean,ms");
    let half = |block: &Region| u8::from(0.5 * (block.low[0] + block.high[0]) > middle);
    let forward = [-0.4, -0.5, -0.77];
    let view =
        View { eye: None, forward, order: DrawOrder::BackToFront, sweep: Sweep::Rotated, sorting: Sorting::Fast };
    let ways: [(&str, &Wish<'_>, Option<View>); 4] =
        [("fine", &|_| 0, None), ("coarse", &|_| 1, None), ("mixed", &half, None), ("seen", &half, Some(view))];
    for (name, wish, view) in ways {
        engine.set_view(view)?;
        let mut mesh = Mesh::default();
        let mut least = f64::INFINITY;
        for _ in 0..20 {
            let start = Instant::now();
            engine.update_with_levels(positions, wish, &mut mesh)?;
            least = least.min(start.elapsed().as_secs_f64());
        }
        describe(name, &mesh, &field, least);
        if let Some(folder) = &folder {
            write_mesh(&folder.join(format!("blob-{name}.ply")), &mesh, &WriteOptions::default())?;
        }
    }
    engine.set_view(None)?;
    let mut mesh = Mesh::default();
    let mut least = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        engine.update(positions, &mut mesh)?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    describe("fine, without levels", &mesh, &field, least);
    Ok(())
}

/// Triquet's metaballs in double precision.
struct Field<'a>(&'a [[f32; 3]]);

impl Field<'_> {
    /// Value and gradient.
    fn at(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let reach_sq = f64::from(SUPPORT).powi(2);
        let (mut value, mut gradient) = (0.0, [0.0; 3]);
        for ball in self.0 {
            let d: [f64; 3] = std::array::from_fn(|a| p[a] - f64::from(ball[a]));
            let u = (1.0 - d.iter().map(|v| v * v).sum::<f64>() / reach_sq).max(0.0);
            value += u * u / 4.0;
            (0..3).for_each(|a| gradient[a] -= u / reach_sq * d[a]);
        }
        (value, gradient)
    }
}

fn describe(name: &str, mesh: &Mesh, field: &Field<'_>, seconds: f64) {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (mut distances, mut angles) = (Vec::new(), Vec::new());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.position(v as usize));
        let centre = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0);
        let (value, gradient) = field.at(centre);
        // To first order, in cells.
        distances.push(((value - f64::from(ISO)) / length(gradient) / SPACING).abs());
        let (u, v): (Vec<f64>, Vec<f64>) = (0..3).map(|i| (b[i] - a[i], c[i] - a[i])).unzip();
        let normal: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            u[j] * v[k] - u[k] * v[j]
        });
        let area = length(normal);
        if area > 0.0 {
            let along: f64 = (0..3).map(|i| -normal[i] * gradient[i]).sum::<f64>() / (area * length(gradient));
            angles.push(along.clamp(-1.0, 1.0).acos().to_degrees());
        }
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    angles.sort_by(f64::total_cmp);
    let quality = Quality::of(mesh);
    println!(
        "{name},{},{},{},{:.4},{:.4},{:.2},{:.2},{:.5},{:.4},{:.3}",
        mesh.vertices.len(),
        mesh.triangles.len(),
        Report::of(mesh).closed_manifold(),
        mean(&distances),
        distances.iter().copied().fold(0.0, f64::max),
        mean(&angles),
        angles[angles.len() * 99 / 100],
        quality.radius_ratio.min,
        quality.radius_ratio.mean,
        1e3 * seconds,
    );
}
