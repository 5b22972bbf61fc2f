//! `pellicle-bench draw-order [--json]`: how often triangles are drawn in the wrong order.
//!
//! Of every two triangles that overlap on the screen, the one that is farther where they overlap must come first from back to
//! front. All such pairs of a frame are found by brute force over a grid of the screen: two projected triangles are clipped
//! against each other, and their depths are compared in the middle of what is left. Pairs are left out where the overlap is
//! less than a millionth of the smaller triangle, or both are at the same depth.
//!
//! Seeds from particles may step back to a slab that was left; the exact variant keeps triangles back and sorts them, the fast
//! one does not. A complete search never steps back. With levels of
//! detail, cells are as large as the distance from the eye allows: three sizes in blocks of 8 finest cells.
//!
//! Source: this project; the variants are those of Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008,
//! section 5.

use pellicle::Mesh;
use pellicle::realtime::{DrawOrder, Engine, Params, Region, Seeds, Sorting, Sweep, View};
use pellicle_scenes::{FRAMES, ISO, Play, SUPPORT, Show};
use rayon::prelude::*;

/// How the surface is made.
#[derive(Clone, Copy)]
enum Way {
    Complete,
    Seeds(Sorting),
    Levels,
}

/// What is tried: its name, and how the engine is set.
const VARIANTS: [(&str, Way, Option<Sweep>); 10] = [
    ("no order", Way::Complete, None),
    ("fast, best axis", Way::Seeds(Sorting::Fast), Some(Sweep::BestAxis)),
    ("fast, rotated", Way::Seeds(Sorting::Fast), Some(Sweep::Rotated)),
    ("exact, best axis", Way::Seeds(Sorting::Exact), Some(Sweep::BestAxis)),
    ("exact, rotated", Way::Seeds(Sorting::Exact), Some(Sweep::Rotated)),
    ("complete, best axis", Way::Complete, Some(Sweep::BestAxis)),
    ("complete, rotated", Way::Complete, Some(Sweep::Rotated)),
    ("levels, no order", Way::Levels, None),
    ("levels, best axis", Way::Levels, Some(Sweep::BestAxis)),
    ("levels, rotated", Way::Levels, Some(Sweep::Rotated)),
];

/// Runs the verb.
pub fn run(words: &[String]) -> Result<(), String> {
    let json = match words {
        [] => false,
        [word] if word == "--json" => true,
        _ => return Err("nothing, or --json".into()),
    };
    if !json {
        println!("{:<10} {:>5}  {:<19} {:>12} {:>9} {:>10}", "show", "S", "variant", "pairs", "wrong", "share");
    }
    let settings = [(Show::Fountain, 1.0), (Show::Blob, 0.4), (Show::Explosion, 0.75), (Show::Monster, 0.5)];
    for (show, spacing) in settings {
        for (name, way, sweep) in VARIANTS {
            let tally = of_show(show, spacing, way, sweep)?;
            let share = tally.wrong as f64 / tally.pairs.max(1) as f64;
            if json {
                let row = serde_json::json!({
                    "scene": show.name(), "spacing": spacing, "variant": name,
                    "pairs": tally.pairs, "wrong": tally.wrong, "share": share,
                });
                println!("{row}");
            } else {
                let (pairs, wrong) = (tally.pairs, tally.wrong);
                println!("{:<10} {spacing:>5}  {name:<19} {pairs:>12} {wrong:>9} {:>9.4}%", show.name(), 100.0 * share);
            }
        }
    }
    Ok(())
}

/// Pairs that overlap, and those of them in the wrong order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Tally {
    pairs: usize,
    wrong: usize,
}

/// Over three frames, each seen from three sides.
fn of_show(show: Show, spacing: f64, way: Way, sweep: Option<Sweep>) -> Result<Tally, String> {
    const FORWARD: [[f64; 3]; 3] = [[0.1, -0.25, -1.0], [-1.0, -0.6, -0.7], [0.5, -1.0, 0.6]];
    let params = Params { iso: ISO.into(), ..Params::new(SUPPORT.into(), spacing) };
    let params = match way {
        Way::Complete => params,
        Way::Seeds(_) => Params { seeds: Seeds::Particles, ..params },
        Way::Levels => Params { block: [8; 3], ..params },
    };
    let mut engine = Engine::new(params).map_err(|error| error.to_string())?;
    let (mut mesh, mut play, mut tally) = (Mesh::default(), Play::new(show, 1), Tally::default());
    for frame in [FRAMES / 4, FRAMES / 2, FRAMES - 1] {
        while play.frame() < frame {
            play.step();
        }
        let positions = &play.balls().positions;
        let (middle, radius) = around(positions);
        for forward in FORWARD {
            let length = forward.iter().map(|x| x * x).sum::<f64>().sqrt();
            // Near enough for a wide field of view.
            let eye = std::array::from_fn(|a| middle[a] - 1.6 * radius * forward[a] / length);
            let order = DrawOrder::BackToFront;
            let sorting = if let Way::Seeds(sorting) = way { sorting } else { Sorting::Fast };
            let view = sweep.map(|sweep| View { eye: Some(eye), forward, order, sweep, sorting });
            engine.set_view(view).map_err(|error| error.to_string())?;
            let frame = match way {
                Way::Complete | Way::Seeds(_) => engine.update(positions, &mut mesh),
                Way::Levels => {
                    let wish = |block: &Region| block.level_by_distance(eye, 1.2 * radius);
                    engine.update_with_levels(positions, wish, &mut mesh)
                }
            };
            frame.map_err(|error| error.to_string())?;
            let one = judge(&projected(&mesh, eye, forward));
            tally = Tally { pairs: tally.pairs + one.pairs, wrong: tally.wrong + one.wrong };
        }
    }
    Ok(tally)
}

/// The middle of the particles' box, and the distance from there to a corner of it and a ball more.
fn around(positions: &[[f32; 3]]) -> ([f64; 3], f64) {
    let bound = |a: usize| {
        let values = positions.iter().map(|p| f64::from(p[a]));
        values.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)))
    };
    let bounds = [bound(0), bound(1), bound(2)];
    let radius = bounds.iter().map(|(low, high)| (0.5 * (high - low)).powi(2)).sum::<f64>().sqrt();
    (bounds.map(|(low, high)| 0.5 * (low + high)), radius + f64::from(SUPPORT))
}

/// A triangle on the screen: x, y and the inverse of the depth, which is even in the picture.
type Flat = [[f64; 3]; 3];

fn projected(mesh: &Mesh, eye: [f64; 3], forward: [f64; 3]) -> Vec<Flat> {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let unit = |a: [f64; 3]| a.map(|x| x / dot(a, a).sqrt());
    let forward = unit(forward);
    let right = unit(cross(forward, [0.0, 1.0, 0.0]));
    let up = cross(right, forward);
    let corner = |v: u32| {
        let p = mesh.position(v as usize);
        let from: [f64; 3] = std::array::from_fn(|a| p[a] - eye[a]);
        let depth = dot(from, forward);
        [dot(from, right) / depth, dot(from, up) / depth, 1.0 / depth]
    };
    mesh.triangles.iter().map(|t| t.map(corner)).collect()
}

/// Triangles in the order in which they are drawn, the farthest first.
fn judge(triangles: &[Flat]) -> Tally {
    let grid = Grid::new(triangles);
    (0..grid.cells.len())
        .into_par_iter()
        .map(|cell| {
            let (mut tally, list) = (Tally::default(), &grid.cells[cell]);
            for (i, &first) in list.iter().enumerate() {
                for &second in &list[i + 1..] {
                    let (a, b) = (&triangles[first as usize], &triangles[second as usize]);
                    // A pair that shares several cells belongs to one of them.
                    if grid.home(a, b) == Some(cell)
                        && let Some(is_right) = comes_first(a, b)
                    {
                        tally.pairs += 1;
                        tally.wrong += usize::from(!is_right);
                    }
                }
            }
            tally
        })
        .reduce(Tally::default, |a, b| Tally { pairs: a.pairs + b.pairs, wrong: a.wrong + b.wrong })
}

/// Whether `a`, drawn first, is farther than `b` where they overlap; nothing if they don't, or touch there.
fn comes_first(a: &Flat, b: &Flat) -> Option<bool> {
    let overlap = clipped(a, b);
    let area = area_of(&overlap);
    if area <= 1e-6 * area_of(a).abs().min(area_of(b).abs()) {
        return None;
    }
    let n = overlap.len() as f64;
    let place: [f64; 2] = std::array::from_fn(|k| overlap.iter().map(|p| p[k]).sum::<f64>() / n);
    let (near_a, near_b) = (inverse_depth(a, place), inverse_depth(b, place));
    ((near_a - near_b).abs() > 1e-7 * near_a.abs()).then_some(near_a < near_b)
}

fn area_of(polygon: &[[f64; 3]]) -> f64 {
    let pairs = polygon.iter().zip(polygon.iter().cycle().skip(1));
    0.5 * pairs.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>()
}

/// What of `a` lies within `b`, counter-clockwise. Source: Sutherland & Hodgman, "Reentrant polygon clipping", 1974.
fn clipped(a: &Flat, b: &Flat) -> Vec<[f64; 3]> {
    let oriented = |t: &Flat| if area_of(t) < 0.0 { [t[0], t[2], t[1]] } else { *t };
    let (mut polygon, b) = (oriented(a).to_vec(), oriented(b));
    for i in 0..3 {
        let (from, to) = (b[i], b[(i + 1) % 3]);
        let side = |p: [f64; 3]| (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
        let mut next = Vec::with_capacity(polygon.len() + 1);
        for (j, &p) in polygon.iter().enumerate() {
            let q = polygon[(j + 1) % polygon.len()];
            let (d, e) = (side(p), side(q));
            if d >= 0.0 {
                next.push(p);
            }
            if (d >= 0.0) != (e >= 0.0) {
                next.push(std::array::from_fn(|k| p[k] + d / (d - e) * (q[k] - p[k])));
            }
        }
        polygon = next;
    }
    polygon
}

fn inverse_depth(t: &Flat, [x, y]: [f64; 2]) -> f64 {
    let weight = |p: [f64; 3], q: [f64; 3]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
    let weights = [weight(t[1], t[2]), weight(t[2], t[0]), weight(t[0], t[1])];
    (0..3).map(|k| weights[k] * t[k][2]).sum::<f64>() / weights.iter().sum::<f64>()
}

/// The screen in cells, each with the triangles whose box meets it.
struct Grid {
    low: [f64; 2],
    /// Cells a unit, and cells in a row.
    scale: f64,
    across: usize,
    cells: Vec<Vec<u32>>,
}

impl Grid {
    fn new(triangles: &[Flat]) -> Self {
        let (mut low, mut high, mut size) = ([f64::MAX; 2], [f64::MIN; 2], 0.0);
        for [from, to] in triangles.iter().map(bounds) {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(from[k]), high[k].max(to[k]));
                size += to[k] - from[k];
            }
        }
        let scale = triangles.len().max(1) as f64 / size.max(f64::MIN_POSITIVE);
        let cells = |k: usize| ((high[k] - low[k]) * scale).max(0.0) as usize + 1;
        let across = cells(0);
        let mut grid = Self { low, scale, across, cells: vec![Vec::new(); across * cells(1)] };
        for (i, t) in triangles.iter().enumerate() {
            let [from, to] = bounds(t).map(|p| grid.cell(p));
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    grid.cells[x + across * y].push(i as u32);
                }
            }
        }
        grid
    }

    fn cell(&self, p: [f64; 2]) -> [usize; 2] {
        std::array::from_fn(|k| ((p[k] - self.low[k]) * self.scale) as usize)
    }

    /// The cell where the boxes of both begin to overlap.
    fn home(&self, a: &Flat, b: &Flat) -> Option<usize> {
        let ([low_a, high_a], [low_b, high_b]) = (bounds(a), bounds(b));
        let low = [low_a[0].max(low_b[0]), low_a[1].max(low_b[1])];
        let overlap = (0..2).all(|k| low[k] <= high_a[k].min(high_b[k]));
        let [x, y] = self.cell(low);
        overlap.then_some(x + self.across * y)
    }
}

/// The least and the largest x and y.
fn bounds(t: &Flat) -> [[f64; 2]; 2] {
    let over = |f: fn(f64, f64) -> f64| std::array::from_fn(|k| f(f(t[0][k], t[1][k]), t[2][k]));
    [over(f64::min), over(f64::max)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, size: f64, depth: f64) -> Flat {
        [[x, y, 1.0 / depth], [x + size, y, 1.0 / depth], [x, y + size, 1.0 / depth]]
    }

    #[test]
    fn what_is_drawn_first_must_be_farther() {
        let (far, near, aside) = (at(0.0, 0.0, 1.0, 5.0), at(0.1, 0.1, 1.0, 2.0), at(3.0, 0.0, 1.0, 1.0));
        assert_eq!(judge(&[far, near, aside]), Tally { pairs: 1, wrong: 0 });
        assert_eq!(judge(&[near, aside, far]), Tally { pairs: 1, wrong: 1 });
        // They touch along an edge, or lie in one plane.
        let other_half = [[1.0, 0.0, 0.2], [1.0, 1.0, 0.2], [0.0, 1.0, 0.2]];
        assert_eq!(judge(&[far, other_half, at(0.2, 0.2, 0.3, 5.0)]), Tally::default());
    }

    #[test]
    fn a_pair_is_counted_once_however_many_cells_it_shares() {
        let mut triangles: Vec<Flat> = (0..400).map(|i| at(f64::from(i % 20), f64::from(i / 20), 0.05, 3.0)).collect();
        triangles.push(at(0.0, 0.0, 40.0, 9.0));
        triangles.push(at(-1.0, -1.0, 43.0, 8.0));
        // The large ones lie over each other in the right order, and over all the small ones in the wrong one.
        let tally = judge(&triangles);
        assert_eq!((tally.pairs - tally.wrong, tally.wrong), (1, 800));
    }
}
