//! Meshes, cameras and pictures that several tests use.

#![allow(dead_code, reason = "each test file uses its own part")]

use pellicle::{Mesh, Params};
use pellicle_render::{Background, Camera, Color, Framing, Image, Lens, Scene, Settings, draw};

/// Nothing in a scene has this color.
pub const BEHIND: Color = Color([255, 0, 255]);

/// A picture of this size before a color that nothing else has.
pub fn plain(width: u32, height: u32) -> Settings {
    Settings { background: Background::Plain(BEHIND), ..Settings::new(width, height) }
}

/// Looks at the origin along −z; the picture is two units high.
pub fn ahead() -> Camera {
    let lens = Lens::Orthographic { height: 2.0 };
    Camera { eye: [0.0, 0.0, 4.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], lens }
}

/// Draws with the automatic camera.
pub fn taken(scene: &Scene<'_>, settings: &Settings) -> Image {
    let camera = Framing::default().fit(&scene.bounds(), settings.aspect()).unwrap();
    draw(scene, &camera, settings).unwrap()
}

/// A small splash and its mesh.
pub fn splash() -> (pellicle_scenes::Scene, Mesh) {
    let splash = pellicle_scenes::splash(4_000, 1);
    let params = Params { normals: true, cell_size: 1.0, ..Params::new(f64::from(splash.radius)) };
    let mesh = pellicle::reconstruct(&splash.positions, &params).unwrap();
    (splash, mesh)
}

/// A square of `n` × `n` cells of two triangles, seen from +z its outside, with corners moved off the grid. Its border is
/// at ±`half`.
pub fn sheet(n: u32, half: f32) -> Mesh {
    let mut random = pellicle_scenes::Random::new(7);
    let mut mesh = Mesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let place = |k: u32, shift: f64| {
                let shift = if k == 0 || k == n { 0.0 } else { shift as f32 * 0.7 };
                ((k as f32 + shift) / n as f32 * 2.0 - 1.0) * half
            };
            mesh.vertices.push([place(i, random.unit() - 0.5), place(j, random.unit() - 0.5), 0.0]);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            mesh.triangles.push([a, a + 1, a + n + 2]);
            mesh.triangles.push([a, a + n + 2, a + n + 1]);
        }
    }
    mesh
}

/// How many pixels have this color.
pub fn count(image: &Image, color: Color) -> usize {
    image.pixels().chunks(3).filter(|p| *p == color.0).count()
}
