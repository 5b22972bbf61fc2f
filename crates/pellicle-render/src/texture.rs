//! Pictures on surfaces, placed by two coordinates at every vertex.
//!
//! Coordinates are interpolated on the triangle itself, not in the picture, so perspective does not bend them. Where many
//! texels fall into one pixel their mean is shown: the picture is halved again and again, and the halves that match the
//! pixel's footprint are mixed (Williams, "Pyramidal parametrics", 1983).

use std::borrow::Cow;

use crate::Error;
use crate::color::{Color, Light, mix};
use crate::image::Image;

/// A picture, and where each vertex lies in it.
///
/// It repeats in both directions, and so may coordinates: of a triangle's corners each is taken a whole number of pictures
/// away, as near to the first as it gets. So 0.95 and 0.05 are a tenth apart, and a texture closes around a tube. A triangle
/// that spans half a picture or more cannot be told from one that spans less.
#[derive(Debug, Clone)]
pub struct Texture<'a> {
    /// The picture.
    pub image: &'a Image,
    /// One for each vertex or sphere: 0 and 1 are opposite borders, from left to right and from top to bottom. What is not
    /// a finite number is drawn grey.
    pub coordinates: Cow<'a, [[f32; 2]]>,
}

/// A texture made ready: the picture in linear light, at full size and halved until one texel is left.
pub(crate) struct Pyramid<'a> {
    levels: Vec<Level>,
    coordinates: &'a [[f32; 2]],
}

struct Level {
    width: usize,
    height: usize,
    texels: Vec<Light>,
}

impl<'a> Pyramid<'a> {
    pub fn new(texture: &'a Texture<'_>, vertices: usize) -> Result<Self, Error> {
        let found = texture.coordinates.len();
        if found != vertices {
            return Err(Error::Length { what: "texture coordinates".into(), found, expected: vertices });
        }
        let (image, light) = (texture.image, |p: &[u8; 3]| Color(*p).light());
        let texels = image.pixels().as_chunks().0.iter().map(light).collect();
        let mut levels = vec![Level { width: image.width() as usize, height: image.height() as usize, texels }];
        while let Some(half) = levels.last().and_then(Level::half) {
            levels.push(half);
        }
        Ok(Self { levels, coordinates: &texture.coordinates })
    }

    /// What a sphere shows.
    pub fn of_vertex(&self, vertex: usize) -> Light {
        self.sample(self.coordinates[vertex], 0.0)
    }

    /// What is at a place of a triangle, from its corners' weights there and a pixel to the right and below.
    pub fn of_triangle(&self, triangle: [u32; 3], here: [f32; 3], right: [f32; 3], below: [f32; 3]) -> Light {
        let [first, second, third] = triangle.map(|v| self.coordinates[v as usize]);
        let near = |c: [f32; 2]| std::array::from_fn(|k| c[k] - (c[k] - first[k]).round());
        let corners: [[f32; 2]; 3] = [first, near(second), near(third)];
        let at = |weights: [f32; 3]| -> [f32; 2] {
            std::array::from_fn(|k| {
                weights[0] * corners[0][k] + weights[1] * corners[1][k] + weights[2] * corners[2][k]
            })
        };
        let (place, right, below) = (at(here), at(right), at(below));
        let size = [self.levels[0].width as f32, self.levels[0].height as f32];
        let step = |to: [f32; 2]| (0..2).map(|k| ((to[k] - place[k]) * size[k]).abs()).fold(0.0, f32::max);
        self.sample(place, step(right).max(step(below)))
    }

    /// The mean over about `footprint` texels.
    fn sample(&self, place: [f32; 2], footprint: f32) -> Light {
        if !place.iter().all(|x| x.is_finite()) {
            return Color::NAN.light();
        }
        let (mut level, mut left) = (0, footprint);
        while left > 1.0 && level + 1 < self.levels.len() {
            (level, left) = (level + 1, left / 2.0);
        }
        if level == 0 {
            return self.levels[0].at(place);
        }
        // From a half to one, however often it was halved.
        mix(self.levels[level - 1].at(place), self.levels[level].at(place), ((left - 0.5) * 2.0).clamp(0.0, 1.0))
    }
}

impl Level {
    /// Half as wide and high, or nothing if this is one texel.
    fn half(&self) -> Option<Self> {
        if self.texels.len() <= 1 {
            return None;
        }
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let get = |dx: usize, dy: usize| {
                    self.texels[(2 * x + dx).min(self.width - 1) + self.width * (2 * y + dy).min(self.height - 1)]
                };
                let four = [get(0, 0), get(1, 0), get(0, 1), get(1, 1)];
                texels.push(std::array::from_fn(|c| four.iter().map(|t| t[c]).sum::<f32>() / 4.0));
            }
        }
        Some(Self { width, height, texels })
    }

    /// Between the four nearest texels.
    fn at(&self, [u, v]: [f32; 2]) -> Light {
        let split = |x: f32, n: usize| {
            let x = (x - x.floor()) * n as f32 - 0.5;
            let low = x.floor();
            let first = (low as i64).rem_euclid(n as i64) as usize;
            (first, (first + 1) % n, x - low)
        };
        let (left, right, tx) = split(u, self.width);
        let (top, bottom, ty) = split(v, self.height);
        let get = |x: usize, y: usize| self.texels[x + self.width * y];
        mix(mix(get(left, top), get(right, top), tx), mix(get(left, bottom), get(right, bottom), tx), ty)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Lens};
    use crate::scene::{Layer, Paint, Scene, Shading, Surface};
    use crate::settings::Settings;
    use pellicle::Mesh;

    /// Red and green over four stripes.
    fn stripes() -> Image {
        Image::from_fn(64, 2, |x, _| Color(if x / 16 % 2 == 0 { [255, 0, 0] } else { [0, 255, 0] })).unwrap()
    }

    fn drawn(mesh: &Mesh, coordinates: Vec<[f32; 2]>, camera: &Camera) -> Image {
        let image = stripes();
        let paint = Paint::Texture(Texture { image: &image, coordinates: coordinates.into() });
        let surface = Surface { paint, shading: Shading::Flat, ..Surface::new(mesh) };
        let settings = Settings::new(200, 200);
        crate::draw(&Scene { layers: vec![Layer::Mesh(surface)] }, camera, &settings).unwrap()
    }

    fn is_red(image: &Image, x: u32, y: u32) -> bool {
        let Color([red, green, _]) = image.pixel(x, y).unwrap();
        assert!(red.abs_diff(green) > 40, "neither red nor green at {x}, {y}: {red} {green}");
        red > green
    }

    #[test]
    fn a_floor_seen_at_a_slant_has_its_stripes_where_they_lie() {
        // From z = -1 to z = -17, with the eye one above: what lies at depth d is seen 1/d below the horizon.
        let mesh = Mesh {
            vertices: vec![[-9.0, -1.0, -1.0], [9.0, -1.0, -1.0], [9.0, -1.0, -17.0], [-9.0, -1.0, -17.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let camera = Camera {
            eye: [0.0; 3],
            target: [0.0, 0.0, -1.0],
            up: [0.0, 1.0, 0.0],
            lens: Lens::Perspective { angle: 90.0 },
        };
        // Kept below half a picture a triangle: a quarter of it over the whole floor, one stripe.
        let image = drawn(&mesh, vec![[0.125, 0.0], [0.125, 0.0], [0.375, 0.0], [0.375, 0.0]], &camera);
        // The border between the stripes is at the middle of the floor, 9 away: 100/9 pixels below the horizon.
        assert!(is_red(&image, 100, 100 + 14) && is_red(&image, 60, 100 + 14));
        assert!(!is_red(&image, 100, 100 + 8) && !is_red(&image, 140, 100 + 8));
    }

    #[test]
    fn the_short_way_round_is_taken() {
        let mesh = Mesh {
            vertices: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let lens = Lens::Orthographic { height: 2.0 };
        let camera = Camera { eye: [0.0, 0.0, 5.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], lens };
        let image = drawn(&mesh, vec![[0.9, 0.0], [0.1, 0.0], [0.1, 0.0], [0.9, 0.0]], &camera);
        // 0.9 to 1 is the last, green stripe, 0 to 0.1 the first, red one; the long way would show all four.
        for x in [10, 50, 90] {
            assert!(!is_red(&image, x, 100) && is_red(&image, 199 - x, 100), "at {x}");
        }
    }

    #[test]
    fn far_stripes_melt_into_their_mean() {
        let image = stripes();
        let texture = Texture { image: &image, coordinates: vec![[0.0, 0.0]].into() };
        let pyramid = Pyramid::new(&texture, 1).unwrap();
        for u in [0.1, 0.3, 0.6, 0.9] {
            let far = pyramid.sample([u, 0.5], 1e9);
            assert!((far[0] - 0.5).abs() < 1e-3 && (far[1] - 0.5).abs() < 1e-3, "{far:?}");
        }
        assert!(pyramid.sample([0.125, 0.5], 1.0)[0] > 0.99);
        assert!(Pyramid::new(&texture, 2).is_err());
        assert_eq!(pyramid.sample([f32::NAN, 0.0], 0.0), Color::NAN.light());
    }
}
