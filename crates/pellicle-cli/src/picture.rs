//! Meshes and particles as pictures: what `render`, `mesh --png` and `demo` share.

use std::path::Path;

use pellicle::{Mesh, Positions, infer_radius};
use pellicle_io::{Content, Up, write_file};
use pellicle_render::{
    Background, Bounds, Camera, Color, Framing, Image, Layer, Lens, Paint, Radius, Scalars, Scene, Settings, Spheres,
    Surface, Wireframe, draw,
};

use crate::args::{CameraArgs, LookArgs};
use crate::failure::Failure;

/// Width and height of pictures that nobody asked a size for.
const SIZE: (u32, u32) = (1920, 1080);

/// Draws a mesh from where it is seen as a whole, and writes the picture.
pub fn of_mesh(mesh: &Mesh, up: Up, path: &Path) -> Result<(), Failure> {
    let scene = Scene::of_mesh(mesh);
    let settings = Settings::new(SIZE.0, SIZE.1);
    let framing = Framing { up: up_axis(up), ..Framing::default() };
    let image = framing.fit(&scene.bounds(), settings.aspect()).and_then(|camera| draw(&scene, &camera, &settings));
    save(&image.map_err(|error| Failure::file(path, error))?, path)
}

/// The direction of an axis.
pub fn up_axis(up: Up) -> [f64; 3] {
    match up {
        Up::Y => [0.0, 1.0, 0.0],
        Up::Z => [0.0, 0.0, 1.0],
    }
}

/// Writes a picture, whole or not at all.
pub fn save(image: &Image, path: &Path) -> Result<(), Failure> {
    let bytes = image.encode_png().map_err(|error| Failure::file(path, error))?;
    Ok(write_file(path, &bytes)?)
}

/// Content of a file, with what is needed to draw it.
#[derive(Debug)]
pub struct Subject {
    content: Content,
    /// One per particle, or one for all.
    radius: f64,
    radii: Option<Vec<f32>>,
    /// Name and values of what is shown by colour.
    scalars: Option<Scalars<'static>>,
}

impl Subject {
    /// Prepares the content of `input` to be drawn.
    pub fn new(content: Content, look: &LookArgs, input: &Path) -> Result<Self, Failure> {
        let (mut radius, mut radii) = (look.radius.unwrap_or(1.0), None);
        if let (Content::Particles(particles), None) = (&content, look.radius) {
            match particles.attribute("radius") {
                Some(attribute) if attribute.components == 1 => radii = Some(attribute.to_f32().into_owned()),
                _ => radius = inferred_radius(particles.positions.view()),
            }
        }
        let scalars = look.color_by.as_ref().map(|name| scalars(&content, name, input)).transpose()?;
        let scalars = match (scalars, look.range) {
            (Some(scalars), Some(range)) => Some(scalars.over(range)),
            (scalars, _) => scalars,
        };
        Ok(Self { content, radius, radii, scalars })
    }

    /// The content as a scene.
    pub fn scene(&self, look: &LookArgs) -> Scene<'_> {
        let paint = |plain| match &self.scalars {
            Some(scalars) => Paint::Scalars(scalars.clone()),
            None if look.sides => Paint::CHECK,
            None => Paint::Plain(plain),
        };
        let layer = match &self.content {
            Content::Mesh(mesh) => {
                let wireframe = look.wireframe.then(Wireframe::default);
                Layer::Mesh(Surface { paint: paint(Color::WATER), wireframe, ..Surface::new(mesh) })
            }
            Content::Particles(particles) => {
                let radius = match &self.radii {
                    Some(radii) => Radius::Each(radii),
                    None => Radius::All(self.radius),
                };
                let spheres = Spheres::new(particles.positions.view(), self.radius);
                Layer::Spheres(Spheres { radius, paint: paint(Color::GRAIN), ..spheres })
            }
        };
        Scene { layers: vec![layer] }
    }
}

/// Half the spacing, or something that shows a single particle.
fn inferred_radius(positions: Positions<'_>) -> f64 {
    let is_finite = (0..positions.len()).all(|i| positions.get(i).iter().all(|x| x.is_finite()));
    if is_finite { infer_radius(positions).unwrap_or(1.0) } else { 1.0 }
}

fn scalars(content: &Content, name: &str, input: &Path) -> Result<Scalars<'static>, Failure> {
    let (found, names): (_, Vec<&str>) = match content {
        Content::Mesh(mesh) => (
            mesh.attributes.iter().find(|a| a.name == name).map(Scalars::of_mesh),
            mesh.attributes.iter().map(|a| a.name.as_str()).collect(),
        ),
        Content::Particles(particles) => (
            particles.attribute(name).map(|a| {
                let values = a.to_f32();
                let view = pellicle::Attribute::new(&a.name, a.components, &values);
                owned(Scalars::of_particles(&view))
            }),
            particles.attributes.iter().map(|a| a.name.as_str()).collect(),
        ),
    };
    let names = if names.is_empty() { "no attributes".into() } else { names.join(", ") };
    let missing = || Failure::file(input, format_args!("no attribute is named '{name}'; it has: {names}"));
    found.map(owned).ok_or_else(missing)
}

fn owned(scalars: Scalars<'_>) -> Scalars<'static> {
    Scalars { name: scalars.name.into_owned().into(), values: scalars.values.into_owned().into(), range: scalars.range }
}

/// The picture's size and surroundings.
pub fn settings(size: (u32, u32), look: &LookArgs) -> Settings {
    Settings {
        background: if look.dark { Background::DARK } else { Background::LIGHT },
        caption: look.caption.clone(),
        ..Settings::new(size.0, size.1)
    }
}

/// The camera for content within `bounds`, turned by `angle` degrees on a turntable.
pub fn camera(
    args: &CameraArgs,
    up: Up,
    bounds: &Bounds,
    aspect: f64,
    angle: Option<f64>,
) -> Result<Camera, pellicle_render::Error> {
    let up = up_axis(up);
    let framing =
        Framing { up, azimuth: args.azimuth, elevation: args.elevation, angle: Some(args.fov), ..Framing::default() };
    match (args.eye, angle) {
        (Some(eye), _) => {
            let middle = || std::array::from_fn(|axis| 0.5 * (bounds.min[axis] + bounds.max[axis]));
            let target = args.look_at.unwrap_or_else(middle);
            Ok(Camera { eye, target, up, lens: Lens::Perspective { angle: args.fov } })
        }
        (None, Some(angle)) => framing.orbit(bounds, aspect, angle),
        (None, None) => framing.fit(bounds, aspect),
    }
}
