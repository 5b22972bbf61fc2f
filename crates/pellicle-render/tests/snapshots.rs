//! Small pictures of every look, compared byte for byte with those kept in `snapshots`.
//!
//! Drawing uses only operations that round the same everywhere, so no tolerance is needed. After a change of looks:
//! `PELLICLE_SNAPSHOTS=write cargo test -p pellicle-render --test snapshots`, then look at the pictures.

mod common;

use std::path::Path;

use common::{splash, taken};
use pellicle::Mesh;
use pellicle_render::{
    Framing, Image, Layer, Paint, Samples, Scalars, Scene, Settings, Shading, Spheres, Surface, Wireframe, draw,
};

fn compare(name: &str, image: &Image) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots").join(name).with_extension("png");
    if std::env::var_os("PELLICLE_SNAPSHOTS").is_some_and(|value| value == "write") {
        std::fs::write(&path, image.encode_png().unwrap()).unwrap();
        return;
    }
    let file = std::fs::File::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut kept = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut kept).unwrap();
    assert_eq!((info.width, info.height), (image.width(), image.height()), "{name}");
    let differ = kept.iter().zip(image.pixels()).filter(|(a, b)| a != b).count();
    let most = kept.iter().zip(image.pixels()).map(|(a, b)| a.abs_diff(*b)).max();
    assert_eq!(differ, 0, "{name}: bytes that differ, by up to {most:?}");
}

fn small() -> Settings {
    Settings::new(96, 72)
}

fn of(surface: Surface<'_>, settings: &Settings) -> Image {
    taken(&Scene { layers: vec![Layer::Mesh(surface)] }, settings)
}

#[test]
fn surface() {
    let (_, mesh) = splash();
    compare("surface", &of(Surface::new(&mesh), &small()));
    let turned = Framing { up: [0.0, 0.0, 1.0], angle: None, ..Framing::default() };
    let scene = Scene::of_mesh(&mesh);
    let camera = turned.orbit(&scene.bounds(), small().aspect(), 75.0).unwrap();
    compare("surface-orthographic", &draw(&scene, &camera, &small()).unwrap());
}

#[test]
fn without_normals() {
    let (_, mesh) = splash();
    let bare = Mesh { normals: Vec::new(), ..mesh };
    compare("averaged", &of(Surface::new(&bare), &Settings { samples: Samples::Sixteen, ..small() }));
    compare("flat", &of(Surface { shading: Shading::Flat, ..Surface::new(&bare) }, &small()));
}

#[test]
fn wireframe() {
    let (_, mesh) = splash();
    let settings = Settings::new(192, 144);
    let camera = Framing { angle: Some(9.0), ..Framing::default() };
    let scene =
        Scene { layers: vec![Layer::Mesh(Surface { wireframe: Some(Wireframe::default()), ..Surface::new(&mesh) })] };
    // From where the whole would be seen, at a third of the angle: triangles of many pixels.
    let whole = Framing::default().fit(&scene.bounds(), settings.aspect()).unwrap();
    let lens = camera.fit(&scene.bounds(), settings.aspect()).unwrap().lens;
    compare("wireframe", &draw(&scene, &pellicle_render::Camera { lens, ..whole }, &settings).unwrap());
}

#[test]
fn both_sides() {
    let (_, mesh) = splash();
    let triangles = mesh.triangles[..mesh.triangles.len() * 3 / 4].to_vec();
    let open = Mesh { triangles, ..mesh };
    compare("check", &of(Surface { paint: Paint::CHECK, ..Surface::new(&open) }, &small()));
}

#[test]
fn values_with_a_bar() {
    let (_, mesh) = splash();
    let mut heights: Vec<f32> = mesh.vertices.iter().map(|v| v[1]).collect();
    for (height, v) in heights.iter_mut().zip(&mesh.vertices) {
        if v[0] > 0.6 {
            *height = f32::NAN;
        }
    }
    let paint = Paint::Scalars(Scalars::new("height", &heights).over([-0.2, 0.9]));
    compare("values", &of(Surface { paint, ..Surface::new(&mesh) }, &Settings::new(256, 160)));
}

#[test]
fn spheres_beside_their_surface() {
    let (scene, mesh) = splash();
    let speeds: Vec<f32> = scene.velocities.iter().map(|v| v[1]).collect();
    let paint = Paint::Scalars(Scalars::new("up", &speeds));
    let spheres = Spheres { paint, ..Spheres::new(&scene.positions, f64::from(scene.radius)) };
    let left = taken(&Scene { layers: vec![Layer::Spheres(spheres)] }, &small());
    let caption = Some("surface".to_string());
    let right = of(Surface::new(&mesh), &Settings { caption, height: 90, ..small() });
    compare("beside", &left.beside(&right).unwrap());
}
