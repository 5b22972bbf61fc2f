//! A splash as one HTML page: `cargo run -p pellicle-render --example page -- OUT.html [PARTICLES] [TITLE]`

use pellicle::Params;
use pellicle_render::{Page, page};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments.first().map_or("splash.html", String::as_str);
    let particles = arguments.get(1).map_or(Ok(30_000), |text| text.parse())?;
    let splash = pellicle_scenes::splash(particles, 1);
    let params = Params { normals: true, cell_size: 1.0, ..Params::new(f64::from(splash.radius)) };
    let mesh = pellicle::reconstruct(&splash.positions, &params)?;
    let html = page(&mesh, &Page::new(arguments.get(2).map_or("Splash", String::as_str)))?;
    std::fs::write(out, html)?;
    println!("{}", mesh.triangles.len());
    Ok(())
}
