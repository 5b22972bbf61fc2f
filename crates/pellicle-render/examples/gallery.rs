//! Every look in one folder of pictures, from a splash that needs no data.
//!
//! `cargo run --release -p pellicle-render --example gallery -- FOLDER [PARTICLES] [WIDTH HEIGHT]`

use pellicle::{Attribute, Control, Mesh, Params, Reconstructor};
use pellicle_render::{Framing, Layer, Paint, Samples, Scalars, Scene, Settings, Spheres, Surface, Wireframe, draw};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = std::path::PathBuf::from(arguments.first().map_or("gallery", String::as_str));
    let number = |i: usize, default: usize| arguments.get(i).map_or(Ok(default), |text| text.parse());
    let particles = number(1, 100_000)?;
    let settings = Settings {
        samples: Samples::Sixteen,
        ..Settings::new(u32::try_from(number(2, 1920)?)?, u32::try_from(number(3, 1080)?)?)
    };
    std::fs::create_dir_all(&folder)?;

    let splash = pellicle_scenes::splash(particles, 1);
    let params = Params { normals: true, ..Params::new(f64::from(splash.radius)) };
    let velocities: Vec<f32> = splash.velocities.concat();
    let velocity = Attribute::new("velocity", 3, &velocities);
    let mesh = with_attributes(&splash.positions, &params, &[velocity])?;
    let spheres = Spheres::new(&splash.positions, f64::from(splash.radius));

    let surface = Surface::new(&mesh);
    let of = |surface: Surface<'_>| Scene { layers: vec![Layer::Mesh(surface)] }.take(&settings);
    let save = |name: &str, image: pellicle_render::Image| -> Result<(), Failure> {
        Ok(std::fs::write(folder.join(name), image.encode_png()?)?)
    };

    save("surface.png", of(surface.clone())?)?;
    save("wireframe.png", of(Surface { wireframe: Some(Wireframe::default()), ..surface.clone() })?)?;
    let speed = Paint::Scalars(Scalars::of_mesh(&mesh.attributes[0]));
    save("speed.png", of(Surface { paint: speed, ..surface.clone() })?)?;
    let holed = with_hole(&mesh);
    save("check.png", of(Surface { paint: Paint::CHECK, ..Surface::new(&holed) })?)?;

    let plain = Scene { layers: vec![Layer::Spheres(spheres.clone())] };
    save("spheres.png", plain.take(&settings)?)?;
    let fast = Paint::Scalars(Scalars::of_particles(&velocity));
    let fast = Scene { layers: vec![Layer::Spheres(Spheres { paint: fast, ..spheres.clone() })] };
    save("spheres-speed.png", fast.take(&settings)?)?;

    let half = Settings { width: settings.width / 2, ..settings.clone() };
    let left =
        plain.take(&Settings { caption: Some(format!("{} particles", splash.positions.len())), ..half.clone() })?;
    let caption = Some(format!("{} triangles", mesh.triangles.len()));
    let right = Scene::of_mesh(&mesh).take(&Settings { caption, ..half })?;
    save("beside.png", left.beside(&right)?)?;

    let coarse = with_attributes(&splash.positions, &Params { cell_size: 2.0, ..params }, &[])?;
    save("coarse-wireframe.png", of(Surface { wireframe: Some(Wireframe::default()), ..Surface::new(&coarse) })?)
}

trait Take {
    fn take(&self, settings: &Settings) -> Result<pellicle_render::Image, pellicle_render::Error>;
}

impl Take for Scene<'_> {
    fn take(&self, settings: &Settings) -> Result<pellicle_render::Image, pellicle_render::Error> {
        draw(self, &Framing::default().fit(&self.bounds(), settings.aspect())?, settings)
    }
}

fn with_attributes(positions: &[[f32; 3]], params: &Params, attributes: &[Attribute<'_>]) -> Result<Mesh, Failure> {
    let (mut reconstructor, control) = (Reconstructor::new(), Control::default());
    Ok(reconstructor.extract(positions.into(), attributes, params, &control)?.to_mesh()?)
}

/// Without the triangles within a ball, so that the inside shows.
fn with_hole(mesh: &Mesh) -> Mesh {
    let near = |v: &u32| {
        let [x, y, z] = mesh.vertices[*v as usize];
        let (x, z) = (x - 0.55, z - 0.75);
        x * x + y * y + z * z < 0.3 * 0.3
    };
    let triangles = mesh.triangles.iter().filter(|t| !t.iter().any(near)).copied().collect();
    Mesh { triangles, ..mesh.clone() }
}
