//! The scene made ready for one view: vertices in the picture, normals, ranges of values, and numbers for everything.
//!
//! Triangles and spheres of all layers share one numbering, layer after layer: the id that a sample keeps.

use std::borrow::Cow;

use pellicle::Mesh;
use rayon::prelude::*;

use crate::Error;
use crate::color::{Color, Light};
use crate::raster::{Ball, Bins, Corner, Grid, NOTHING, pieces};
use crate::scene::{Layer, Paint, Radius, Scalars, Scene, Shading, Spheres, Surface};
use crate::texture::Pyramid;
use crate::vector::{Vec3, add, sub};
use crate::view::View;

/// All that tiles need.
pub(crate) struct Stage<'a> {
    pub view: View,
    /// In the order of their ids.
    pub layers: Vec<Ready<'a>>,
}

/// A layer made ready.
pub(crate) struct Ready<'a> {
    /// Id of its first triangle or sphere.
    pub first: u32,
    count: usize,
    pub coat: Coat<'a>,
    pub kind: Kind<'a>,
}

pub(crate) enum Kind<'a> {
    Mesh(Facets<'a>),
    Spheres(&'a Spheres<'a>),
}

/// A mesh in view coordinates.
pub(crate) struct Facets<'a> {
    pub surface: &'a Surface<'a>,
    /// The mesh's origin relative to the eye.
    base: Vec3,
    corners: Vec<Corner>,
    /// One per vertex, in world coordinates, of any length; empty for flat shading.
    pub normals: Cow<'a, [[f32; 3]]>,
}

/// A paint in linear light.
pub(crate) enum Coat<'a> {
    Plain(Light),
    Sides { outside: Light, inside: Light },
    Scalars { values: &'a [f32], range: [f64; 2] },
    Texture(Pyramid<'a>),
}

/// What a color bar shows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shown<'a> {
    pub name: &'a str,
    pub range: [f64; 2],
}

impl<'a> Stage<'a> {
    pub fn new(scene: &'a Scene<'a>, view: View) -> Result<Self, Error> {
        let mut layers = Vec::with_capacity(scene.layers.len());
        let mut first = 0u64;
        for layer in &scene.layers {
            let vertices = match layer {
                Layer::Mesh(surface) => surface.mesh.vertices.len(),
                Layer::Spheres(spheres) => spheres.positions.len(),
            };
            let coat = Coat::of(layer.paint(), vertices, scene)?;
            let (count, kind) = match layer {
                Layer::Mesh(surface) => (surface.mesh.triangles.len(), Kind::Mesh(Facets::new(surface, &view)?)),
                Layer::Spheres(spheres) => {
                    check_radius(spheres)?;
                    (spheres.positions.len(), Kind::Spheres(spheres))
                }
            };
            let most = u64::from(NOTHING);
            let found = first + count as u64;
            let Some(start) = u32::try_from(first).ok().filter(|_| found <= most) else {
                return Err(Error::Count { found, most });
            };
            layers.push(Ready { first: start, count, coat, kind });
            first = found;
        }
        Ok(Self { view, layers })
    }

    /// Which tile has to look at what.
    pub fn bins(&self, grid: &Grid) -> Bins {
        let mut bins = Bins::new();
        let view = &self.view;
        for layer in &self.layers {
            let first = layer.first;
            bins.extend(grid, layer.count, |range, binner| match &layer.kind {
                Kind::Mesh(facets) => {
                    for i in range {
                        facets.pieces(view, i, |flat| {
                            if let Some(span) = grid.span_of(flat) {
                                binner.add(first + i as u32, span);
                            }
                        });
                    }
                }
                Kind::Spheres(spheres) => {
                    for i in range {
                        let extent = ball(view, spheres, i).extent(view);
                        if let Some(span) = extent.and_then(|extent| grid.span_of_rectangle(extent)) {
                            binner.add(first + i as u32, span);
                        }
                    }
                }
            });
        }
        bins
    }

    /// The layer that an id belongs to, and its number there.
    #[inline(always)]
    pub fn find(&self, id: u32) -> (&Ready<'a>, usize) {
        // Layers are few.
        let at = self.layers.iter().rposition(|layer| layer.first <= id).unwrap_or(0);
        let layer = &self.layers[at];
        (layer, (id - layer.first) as usize)
    }
}

/// A sphere in view coordinates.
pub(crate) fn ball(view: &View, spheres: &Spheres<'_>, i: usize) -> Ball {
    Ball { centre: view.point(sub(spheres.positions.get(i), view.eye)), radius: spheres.radius_of(i) }
}

fn check_radius(spheres: &Spheres<'_>) -> Result<(), Error> {
    match spheres.radius {
        Radius::All(radius) if !(radius.is_finite() && radius > 0.0) => {
            Err(Error::Parameter { name: "radius", value: radius, must: "a finite number greater than 0" })
        }
        Radius::Each(radii) if radii.len() != spheres.positions.len() => {
            Err(Error::Length { what: "radius".into(), found: radii.len(), expected: spheres.positions.len() })
        }
        _ => Ok(()),
    }
}

impl<'a> Facets<'a> {
    fn new(surface: &'a Surface<'a>, view: &View) -> Result<Self, Error> {
        let mesh = surface.mesh;
        check_mesh(mesh)?;
        if let Some(wire) = surface.wireframe {
            let must = "a finite number greater than 0";
            check_number("wireframe width", wire.width, wire.width.is_finite() && wire.width > 0.0, must)?;
            let must = "a finite number, 0 or more";
            check_number("wireframe fade", wire.fade, wire.fade.is_finite() && wire.fade >= 0.0, must)?;
        }
        let base = sub(mesh.origin, view.eye);
        // The sum over triangles runs in their order, so it is one thread's work; corners keep the others busy.
        let (corners, normals) = rayon::join(
            || mesh.vertices.par_iter().map(|&v| Corner::of(view, view.point(offset(base, v)))).collect(),
            || match surface.shading {
                Shading::Flat => Cow::Borrowed(&[][..]),
                Shading::Smooth if mesh.normals.is_empty() => Cow::Owned(averaged(mesh)),
                Shading::Smooth => Cow::Borrowed(&mesh.normals[..]),
            },
        );
        Ok(Self { surface, base, corners, normals })
    }

    /// View coordinates of a vertex.
    #[inline(always)]
    pub fn at(&self, view: &View, vertex: u32) -> Vec3 {
        view.point(offset(self.base, self.surface.mesh.vertices[vertex as usize]))
    }

    /// A triangle as it is in the picture.
    #[inline(always)]
    pub fn pieces(&self, view: &View, triangle: usize, emit: impl FnMut([Corner; 3])) {
        pieces(view, &self.corners, self.surface.mesh.triangles[triangle], |v| self.at(view, v), emit);
    }
}

#[inline(always)]
fn offset(base: Vec3, v: [f32; 3]) -> Vec3 {
    add(base, v.map(f64::from))
}

fn check_number(name: &'static str, value: f64, holds: bool, must: &'static str) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Parameter { name, value, must }) }
}

/// Whether triangles name vertices that exist, and normals are one per vertex or none.
pub(crate) fn check_mesh(mesh: &Mesh) -> Result<(), Error> {
    let vertices = mesh.vertices.len();
    let beyond = |t: &[u32; 3]| t.iter().copied().find(|&v| v as usize >= vertices);
    if let Some(triangle) = mesh.triangles.par_iter().position_first(|t| beyond(t).is_some()) {
        let vertex = beyond(&mesh.triangles[triangle]).unwrap_or_default();
        return Err(Error::Vertex { triangle, vertex, vertices });
    }
    if !mesh.normals.is_empty() && mesh.normals.len() != vertices {
        return Err(Error::Length { what: "normals".into(), found: mesh.normals.len(), expected: vertices });
    }
    Ok(())
}

/// Normals of the triangles around each vertex, each as long as its triangle is large.
pub(crate) fn averaged(mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut normals = vec![[0.0f32; 3]; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for &vertex in triangle {
            let sum = &mut normals[vertex as usize];
            *sum = [sum[0] + n[0], sum[1] + n[1], sum[2] + n[2]];
        }
    }
    normals
}

impl<'a> Coat<'a> {
    fn of(paint: &'a Paint<'a>, vertices: usize, scene: &'a Scene<'a>) -> Result<Self, Error> {
        Ok(match paint {
            Paint::Plain(color) => Self::Plain(color.light()),
            Paint::Sides { outside, inside } => Self::Sides { outside: outside.light(), inside: inside.light() },
            Paint::Scalars(scalars) => {
                if scalars.values.len() != vertices {
                    let (what, found) = (scalars.name.to_string(), scalars.values.len());
                    return Err(Error::Length { what, found, expected: vertices });
                }
                Self::Scalars { values: &scalars.values, range: range_of(scalars, scene)? }
            }
            Paint::Texture(texture) => Self::Texture(Pyramid::new(texture, vertices)?),
        })
    }
}

/// The values at the ends of the map: as given, or from all layers that show this name without a range of their own.
fn range_of(scalars: &Scalars<'_>, scene: &Scene<'_>) -> Result<[f64; 2], Error> {
    if let Some([low, high]) = scalars.range {
        check_number("low end of the range", low, low.is_finite() && low < high, "finite and below the high end")?;
        check_number("high end of the range", high, high.is_finite(), "finite")?;
        return Ok([low, high]);
    }
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for other in values_shown(scene).filter(|other| other.range.is_none() && other.name == scalars.name) {
        for &value in other.values.iter().filter(|value| value.is_finite()) {
            (low, high) = (low.min(value), high.max(value));
        }
    }
    let (low, high) = (f64::from(low), f64::from(high));
    Ok(if low < high {
        [low, high]
    } else if low == high {
        // All the same: the middle of the map.
        let around = if low == 0.0 { 0.5 } else { low.abs() / 2.0 };
        [low - around, low + around]
    } else {
        [0.0, 1.0]
    })
}

fn values_shown<'a>(scene: &'a Scene<'a>) -> impl Iterator<Item = &'a Scalars<'a>> {
    scene.layers.iter().filter_map(|layer| match layer.paint() {
        Paint::Scalars(scalars) => Some(scalars),
        _ => None,
    })
}

/// What the color bars show, each once, in the order of the layers.
pub(crate) fn shown<'a>(scene: &'a Scene<'a>) -> Result<Vec<Shown<'a>>, Error> {
    let mut all = Vec::new();
    for scalars in values_shown(scene) {
        let shown = Shown { name: &scalars.name, range: range_of(scalars, scene)? };
        if !all.contains(&shown) {
            all.push(shown);
        }
    }
    Ok(all)
}

/// The color of a value; grey where it is none.
pub(crate) fn colored(value: f32, [low, high]: [f64; 2]) -> Light {
    if value.is_nan() {
        return Color::NAN.light();
    }
    crate::ramp::ramp(((f64::from(value) - low) / (high - low)) as f32)
}
