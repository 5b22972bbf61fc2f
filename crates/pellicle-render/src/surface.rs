//! The color of what is seen at one place: where the ray meets it, its normal there, its paint, its wires.

use crate::color::{Light, mix};
use crate::lighting::{Finish, lit, unit};
use crate::scene::Wireframe;
use crate::stage::{Coat, Facets, Kind, Stage, ball, colored};
use crate::vector::{Vec3, cross, dot, sub};
use crate::view::{Ray, View};

/// Light from what has this id, seen at a place in the picture (pixels).
pub(crate) fn seen(stage: &Stage<'_>, id: u32, x: f64, y: f64) -> Light {
    let view = &stage.view;
    let (layer, index) = stage.find(id);
    let ray = view.ray(x, y);
    match &layer.kind {
        Kind::Spheres(spheres) => {
            let (normal, hit) = ball(view, spheres, index).normal(&ray, view.near);
            let inside = hit.is_some_and(|hit| hit.inside);
            let normal = if inside { normal.map(|x| -x) } else { normal };
            let albedo = match &layer.coat {
                Coat::Plain(light) => *light,
                Coat::Sides { outside, inside: within } => *if inside { within } else { outside },
                Coat::Scalars { values, range } => colored(values[index], *range),
                Coat::Texture(pyramid) => pyramid.of_vertex(index),
            };
            // Towards the outline spheres darken a little: touching ones stay apart.
            let viewer = towards_viewer(ray.back());
            let normal = towards_viewer(normal);
            let facing = crate::lighting::dot(normal, viewer).clamp(0.0, 1.0);
            lit(albedo, Finish::GRAIN, normal, viewer, view.sky).map(|x| x * (0.55 + 0.45 * facing))
        }
        Kind::Mesh(facets) => facet(facets, &layer.coat, view, index, [x, y]),
    }
}

/// View coordinates have z forward, light has it towards the viewer.
fn towards_viewer(v: Vec3) -> [f32; 3] {
    [v[0] as f32, v[1] as f32, -v[2] as f32]
}

fn facet(facets: &Facets<'_>, coat: &Coat<'_>, view: &View, index: usize, place: [f64; 2]) -> Light {
    let triangle = facets.surface.mesh.triangles[index];
    let plane = Plane::new(triangle.map(|v| facets.at(view, v)));
    let ray = view.ray(place[0], place[1]);
    let raw = plane.weights(&ray);
    let (weights, front) = (within(raw), plane.faces(&ray));
    let sum = |values: [f32; 3]| values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2];

    let step = |x: f64, y: f64| plane.weights(&view.ray(place[0] + x, place[1] + y));
    let (mut albedo, finish) = match coat {
        Coat::Plain(light) => (*light, Finish::WET),
        Coat::Sides { outside, inside } => (*if front { outside } else { inside }, Finish::DULL),
        Coat::Scalars { values, range } => (colored(sum(triangle.map(|v| values[v as usize])), *range), Finish::DULL),
        Coat::Texture(pyramid) => (pyramid.of_triangle(triangle, weights, step(1.0, 0.0), step(0.0, 1.0)), Finish::WET),
    };
    if let Some(wire) = &facets.surface.wireframe {
        albedo = mix(albedo, wire.color.light(), covered(wire, raw, step(1.0, 0.0), step(0.0, 1.0)));
    }

    let own = plane.outward();
    let normal = if facets.normals.is_empty() {
        towards_viewer(own)
    } else {
        let world = triangle.map(|v| unit_or_zero(facets.normals[v as usize]));
        let world: Vec3 = std::array::from_fn(|a| f64::from(sum(world.map(|n| n[a]))));
        let smooth = view.point(world);
        // Where normals cancel out, or are none, the triangle's own.
        if dot(smooth, smooth) > 1e-6 { towards_viewer(smooth) } else { towards_viewer(own) }
    };
    let normal = if front { normal } else { normal.map(|x| -x) };
    lit(albedo, finish, unit(normal), towards_viewer(ray.back()), view.sky)
}

/// How much of this place a triangle's lines cover, from its corners' weights here and a pixel to the right and below.
///
/// A weight is 0 on its edge and grows evenly, so weight over gradient is the distance to the edge in pixels, and one over
/// the gradient the triangle's height over that edge. Each triangle draws its half of a line.
fn covered(wire: &Wireframe, here: [f32; 3], right: [f32; 3], below: [f32; 3]) -> f32 {
    let mut most = 0.0f32;
    for k in 0..3 {
        let (dx, dy) = (right[k] - here[k], below[k] - here[k]);
        let height = 1.0 / (dx * dx + dy * dy).sqrt();
        let distance = here[k].max(0.0) * height;
        let line = (0.5 * wire.width as f32 + 0.5 - distance).clamp(0.0, 1.0);
        let fade = wire.fade as f32;
        let strength = if fade > 0.0 { ((height - fade) / (2.0 * fade)).clamp(0.0, 1.0) } else { 1.0 };
        most = most.max(line * strength);
    }
    // The gradient of a triangle that is seen edge-on is no number.
    if most.is_nan() { 0.0 } else { most }
}

fn unit_or_zero(n: [f32; 3]) -> [f32; 3] {
    let length = crate::lighting::dot(n, n).sqrt();
    if length > 0.0 && length.is_finite() { n.map(|x| x / length) } else { [0.0; 3] }
}

/// Weights that a place beside the triangle can have: a pixel's samples may have their mean there.
fn within(weights: [f32; 3]) -> [f32; 3] {
    let positive = weights.map(|w| if w > 0.0 { w } else { 0.0 });
    let sum: f32 = positive.iter().sum();
    if sum > 0.0 && sum.is_finite() { positive.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
}

/// A triangle in view coordinates.
struct Plane {
    first: Vec3,
    u: Vec3,
    v: Vec3,
}

impl Plane {
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        Self { first: a, u: sub(b, a), v: sub(c, a) }
    }

    /// Weights of the corners where the ray meets the plane. Source: Möller and Trumbore, "Fast, minimum storage
    /// ray/triangle intersection", 1997.
    fn weights(&self, ray: &Ray) -> [f32; 3] {
        let p = cross(ray.direction, self.v);
        let share = 1.0 / dot(self.u, p);
        let from = sub(ray.origin, self.first);
        let second = dot(from, p) * share;
        let third = dot(ray.direction, cross(from, self.u)) * share;
        [(1.0 - second - third) as f32, second as f32, third as f32]
    }

    /// Whether the ray comes from where the corners run counter-clockwise. Orders are mirrored in view coordinates.
    fn faces(&self, ray: &Ray) -> bool {
        dot(ray.direction, cross(self.u, self.v)) > 0.0
    }

    /// Outward normal: mirrored, too. Of any size that `f32` holds.
    fn outward(&self) -> Vec3 {
        crate::vector::normalized(cross(self.v, self.u)).unwrap_or([0.0, 0.0, -1.0])
    }
}
