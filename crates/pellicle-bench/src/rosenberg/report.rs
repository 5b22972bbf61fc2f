//! The table, as text and as JSON.

use serde_json::json;

use super::{Row, Setting};

/// One object for one row.
pub fn json(setting: &Setting, approach: usize, row: &Row) -> serde_json::Value {
    json!({
        "scene": setting.show.name(),
        "spacing": setting.spacing,
        "approach": approach,
        "cubes_per_s": row.cubes_per_s,
        "triangles_per_s": row.triangles_per_s,
        "render_bytes": row.render_bytes,
        "cache_bytes": row.cache_bytes,
        "fps": row.fps,
    })
}

/// The rows of one setting, each beside the paper's.
pub fn scene(setting: &Setting, rows: &[Row], frames: usize) {
    println!(
        "\n{} S={}: {} cubes, {} triangles a frame; approach 2 in blocks of {}, particles in cells of {} R_c, approach 3 of {}",
        setting.show.name(),
        setting.spacing,
        rows[0].cubes / frames,
        rows[0].triangles / frames,
        setting.block,
        setting.cells[0],
        setting.cells[1]
    );
    println!(
        "approach     cubes/s      tris/s  render MB  cache MB     fps |   paper: cubes/s     tris/s  render  cache   fps"
    );
    for (i, (row, paper)) in rows.iter().zip(&setting.paper).enumerate() {
        println!(
            "{:>8} {:>11.0} {:>11.0} {:>10.3} {:>9.3} {:>7.1} | {:>16.0} {:>10.0} {:>7.3} {:>6.3} {:>5.1}",
            i + 1,
            row.cubes_per_s,
            row.triangles_per_s,
            row.render_bytes as f64 / 1e6,
            row.cache_bytes as f64 / 1e6,
            row.fps,
            paper.cubes_per_s,
            paper.triangles_per_s,
            paper.render_mb,
            paper.cache_mb,
            paper.fps
        );
    }
}

/// Geometric means over the settings.
pub fn ratios(settings: &[Vec<Row>]) {
    let mean = |of: &dyn Fn(&[Row]) -> f64| {
        (settings.iter().map(|rows| of(rows).ln()).sum::<f64>() / settings.len() as f64).exp()
    };
    let bytes = |row: &Row| (row.render_bytes + row.cache_bytes) as f64;
    println!("\nGeometric means over the {} settings", settings.len());
    for rival in [1, 2] {
        println!(
            "approach 1 over {}: speed {:.2}x, memory 1/{:.1} (render 1/{:.1}, cache 1/{:.2})",
            rival + 1,
            mean(&|rows| rows[0].fps / rows[rival].fps),
            mean(&|rows| bytes(&rows[rival]) / bytes(&rows[0])),
            mean(&|rows| rows[rival].render_bytes as f64 / rows[0].render_bytes as f64),
            mean(&|rows| rows[rival].cache_bytes as f64 / rows[0].cache_bytes as f64),
        );
    }
}
