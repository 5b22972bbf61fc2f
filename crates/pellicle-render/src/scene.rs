//! What is drawn: layers of meshes and spheres, and how each is painted.

use std::borrow::Cow;

use pellicle::{Attribute, Mesh, Positions, VertexAttribute};

use crate::bounds::Bounds;
use crate::color::Color;
use crate::texture::Texture;

/// Layers that share one space: each hides what is behind it, also of other layers. Of two at exactly the same depth the
/// one that comes first is seen.
#[derive(Debug, Clone, Default)]
pub struct Scene<'a> {
    /// In any number and order.
    pub layers: Vec<Layer<'a>>,
}

/// Something to draw.
#[derive(Debug, Clone)]
pub enum Layer<'a> {
    /// Triangles.
    Mesh(Surface<'a>),
    /// Balls, such as particles.
    Spheres(Spheres<'a>),
}

/// A mesh and its looks.
#[derive(Debug, Clone)]
pub struct Surface<'a> {
    /// Vertices that are not finite take their triangles with them. Normals, if any, must be one per vertex.
    pub mesh: &'a Mesh,
    /// Its colors. Default plain.
    pub paint: Paint<'a>,
    /// Default smooth.
    pub shading: Shading,
    /// Lines along the triangles' edges. Default none.
    pub wireframe: Option<Wireframe>,
}

/// Balls and their looks.
#[derive(Debug, Clone)]
pub struct Spheres<'a> {
    /// Centres in world units. Those that are not finite are left out.
    pub positions: Positions<'a>,
    /// Radii in world units.
    pub radius: Radius<'a>,
    /// Their colors. Default plain.
    pub paint: Paint<'a>,
}

/// How large spheres are, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Radius<'a> {
    /// All the same; > 0.
    All(f64),
    /// One each, as many as positions. What is not finite or not above 0 is left out.
    Each(&'a [f32]),
}

/// Colors of a layer.
#[derive(Debug, Clone)]
pub enum Paint<'a> {
    /// One, on both sides.
    Plain(Color),
    /// To check a mesh: the inside, where it is seen from behind, has its own color, so that holes and flipped triangles
    /// show. [`Paint::CHECK`] has the colors for this.
    Sides {
        /// Seen from where triangles wind counter-clockwise.
        outside: Color,
        /// Seen from behind.
        inside: Color,
    },
    /// A value per vertex or sphere, shown by color with a color bar.
    Scalars(Scalars<'a>),
    /// A picture, placed by coordinates at every vertex; a sphere has the color at its own.
    Texture(Texture<'a>),
}

impl Paint<'_> {
    /// Grey outside, glaring red inside.
    pub const CHECK: Self = Self::Sides { outside: Color::OUTSIDE, inside: Color::INSIDE };
}

/// How light falls on a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shading {
    /// By the mesh's normals, or where it has none by its triangles' normals, averaged at each vertex by area.
    #[default]
    Smooth,
    /// Each triangle by its own.
    Flat,
}

/// Lines along edges. Hidden lines are hidden by the surface itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wireframe {
    /// Their color. Default nearly black.
    pub color: Color,
    /// Their width in pixels; > 0. Default 1.
    pub width: f64,
    /// Where a triangle is this many pixels high or less its lines are gone, at three times that they are full: they
    /// would run together. 0 draws all. Default 3.
    pub fade: f64,
}

impl Default for Wireframe {
    fn default() -> Self {
        Self { color: Color::WIRE, width: 1.0, fade: 3.0 }
    }
}

/// A number per vertex or sphere.
#[derive(Debug, Clone)]
pub struct Scalars<'a> {
    /// Stands at the color bar.
    pub name: Cow<'a, str>,
    /// One per vertex or sphere. What is not a number is drawn grey.
    pub values: Cow<'a, [f32]>,
    /// The values at the ends of the color map; beyond them the ends' colors. `None`: the least and largest finite values,
    /// of all layers that show this name.
    pub range: Option<[f64; 2]>,
}

impl<'a> Scalars<'a> {
    /// Values to show over their own range.
    pub fn new(name: &'a str, values: &'a [f32]) -> Self {
        Self { name: name.into(), values: values.into(), range: None }
    }

    /// A mesh's attribute; of a vector the length.
    pub fn of_mesh(attribute: &'a VertexAttribute) -> Self {
        Self::of(&attribute.name, attribute.components, &attribute.values)
    }

    /// A particle attribute; of a vector the length.
    pub fn of_particles(attribute: &Attribute<'a>) -> Self {
        Self::of(attribute.name, attribute.components, attribute.values)
    }

    fn of(name: &'a str, components: usize, values: &'a [f32]) -> Self {
        if components <= 1 {
            return Self::new(name, values);
        }
        // In double precision: the square of a large number is no number in single.
        let length = |v: &[f32]| v.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt() as f32;
        let lengths = values.chunks(components).map(length).collect::<Vec<_>>();
        Self { name: format!("|{name}|").into(), values: lengths.into(), range: None }
    }

    /// The same with a given range.
    #[must_use]
    pub fn over(self, range: [f64; 2]) -> Self {
        Self { range: Some(range), ..self }
    }
}

impl<'a> Surface<'a> {
    /// A mesh in the default looks.
    pub fn new(mesh: &'a Mesh) -> Self {
        Self { mesh, paint: Paint::Plain(Color::WATER), shading: Shading::Smooth, wireframe: None }
    }
}

impl<'a> Spheres<'a> {
    /// Spheres of one radius in the default looks.
    pub fn new(positions: impl Into<Positions<'a>>, radius: f64) -> Self {
        Self { positions: positions.into(), radius: Radius::All(radius), paint: Paint::Plain(Color::GRAIN) }
    }

    /// Radius of one sphere, 0 if it has none.
    pub(crate) fn radius_of(&self, i: usize) -> f64 {
        let radius = match self.radius {
            Radius::All(radius) => radius,
            Radius::Each(radii) => radii.get(i).map_or(0.0, |&r| f64::from(r)),
        };
        if radius.is_finite() && radius > 0.0 { radius } else { 0.0 }
    }
}

impl<'a> Scene<'a> {
    /// One mesh in the default looks.
    pub fn of_mesh(mesh: &'a Mesh) -> Self {
        Self { layers: vec![Layer::Mesh(Surface::new(mesh))] }
    }

    /// Spheres of one radius in the default looks.
    pub fn of_spheres(positions: impl Into<Positions<'a>>, radius: f64) -> Self {
        Self { layers: vec![Layer::Spheres(Spheres::new(positions, radius))] }
    }

    /// The box around all layers: vertices that a triangle uses or not, and whole spheres. What is not finite is left out.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for layer in &self.layers {
            bounds = bounds.union(&layer.bounds());
        }
        bounds
    }
}

impl Layer<'_> {
    fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        match self {
            Self::Mesh(surface) => {
                for v in &surface.mesh.vertices {
                    bounds.add(std::array::from_fn(|a| surface.mesh.origin[a] + f64::from(v[a])));
                }
            }
            Self::Spheres(spheres) => {
                for i in 0..spheres.positions.len() {
                    bounds.add_ball(spheres.positions.get(i), spheres.radius_of(i));
                }
            }
        }
        bounds
    }

    pub(crate) fn paint(&self) -> &Paint<'_> {
        match self {
            Self::Mesh(surface) => &surface.paint,
            Self::Spheres(spheres) => &spheres.paint,
        }
    }
}
