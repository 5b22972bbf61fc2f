//! A picture, on one screen: vertices to corners, triangles to tiles, tiles to samples, samples to light, light to bytes.

use rayon::prelude::*;

use crate::bar;
use crate::camera::Camera;
use crate::color::{Light, encode, mix};
use crate::image::Image;
use crate::raster::{Bins, Grid, NOTHING, Pattern, SUBPIXELS, TILE, Tile};
use crate::scene::Scene;
use crate::settings::{Bars, Samples, Settings};
use crate::stage::{Kind, Stage, ball, shown};
use crate::surface::seen;
use crate::view::View;
use crate::{Color, Error};

/// Draws a scene. Runs in the current rayon pool; the bytes are the same for every number of threads.
///
/// # Errors
/// [`Error::Size`], [`Error::Camera`] and [`Error::Parameter`] for numbers out of range; [`Error::Length`] and
/// [`Error::Vertex`] for arrays that do not fit each other; [`Error::Count`] for 2³² triangles and spheres or more.
pub fn draw(scene: &Scene<'_>, camera: &Camera, settings: &Settings) -> Result<Image, Error> {
    settings.check()?;
    let view = View::new(camera, settings.width, settings.height)?;
    let stage = Stage::new(scene, view)?;
    let mut image = match settings.samples {
        Samples::One => paint::<1>(&stage, settings),
        Samples::Four => paint::<4>(&stage, settings),
        Samples::Eight => paint::<8>(&stage, settings),
        Samples::Sixteen => paint::<16>(&stage, settings),
    };
    if settings.bars == Bars::Shown {
        bar::draw(&mut image, &shown(scene)?);
    }
    if let Some(caption) = &settings.caption {
        image.write_caption(caption);
    }
    Ok(image)
}

fn paint<const N: usize>(stage: &Stage<'_>, settings: &Settings) -> Image {
    let grid = Grid { width: settings.width, height: settings.height, reach: Pattern::<N>::new().reach() };
    let bins = stage.bins(&grid);
    let behind = Backdrop::new(settings);
    let tiles: Vec<Vec<u8>> = (0..grid.tiles())
        .into_par_iter()
        .map_init(Tile::<N>::new, |tile, number| {
            tile.start(&grid, number);
            find_nearest(stage, &grid, &bins, number, tile);
            resolve(stage, &behind, tile)
        })
        .collect();
    assemble(&grid, &tiles)
}

/// Which triangle or sphere each sample of a tile sees.
fn find_nearest<const N: usize>(stage: &Stage<'_>, grid: &Grid, bins: &Bins, number: u32, tile: &mut Tile<N>) {
    let view = &stage.view;
    for id in bins.of_tile(number) {
        let (layer, index) = stage.find(id);
        match &layer.kind {
            Kind::Mesh(facets) => facets.pieces(view, index, |flat| tile.triangle(grid, id, flat)),
            Kind::Spheres(spheres) => tile.ball(view, grid, id, &ball(view, spheres, index)),
        }
    }
}

/// The bytes of a tile, row by row. What is seen in a pixel is shaded once, at the mean of the samples that see it.
fn resolve<const N: usize>(stage: &Stage<'_>, behind: &Backdrop, tile: &Tile<N>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity((tile.width * tile.height * 3) as usize);
    for row in 0..tile.height {
        let back = behind.row(tile.y + row);
        let back_color = encode(back);
        for column in 0..tile.width {
            let ids = tile.samples(column, row);
            let Color(color) = if ids.iter().all(|&id| id == NOTHING) {
                back_color
            } else {
                encode(pixel(stage, back, tile.pattern(), ids, tile.x + column, tile.y + row))
            };
            bytes.extend_from_slice(&color);
        }
    }
    bytes
}

fn pixel<const N: usize>(
    stage: &Stage<'_>,
    back: Light,
    pattern: &Pattern<N>,
    ids: &[u32; N],
    x: u32,
    y: u32,
) -> Light {
    let mut sum = [0.0f32; 3];
    for first in 0..N {
        let id = ids[first];
        if ids[..first].contains(&id) {
            continue;
        }
        let (mut count, mut sx, mut sy) = (0, 0, 0);
        for s in (first..N).filter(|&s| ids[s] == id) {
            (count, sx, sy) = (count + 1, sx + pattern.x[s], sy + pattern.y[s]);
        }
        let light = if id == NOTHING {
            back
        } else {
            let mean = |pixel: u32, sum: i32| f64::from(pixel) + f64::from(sum) / f64::from(count * SUBPIXELS);
            // Clipped: a highlight brighter than white would make the border of what it lies on jagged.
            seen(stage, id, mean(x, sx), mean(y, sy)).map(|x| x.clamp(0.0, 1.0))
        };
        for c in 0..3 {
            sum[c] += light[c] * count as f32;
        }
    }
    sum.map(|x| x / N as f32)
}

/// The background, row by row.
struct Backdrop {
    top: Light,
    bottom: Light,
    last: f32,
}

impl Backdrop {
    fn new(settings: &Settings) -> Self {
        let (top, bottom) = settings.background.ends();
        Self { top: top.light(), bottom: bottom.light(), last: settings.height.saturating_sub(1).max(1) as f32 }
    }

    fn row(&self, y: u32) -> Light {
        mix(self.top, self.bottom, y as f32 / self.last)
    }
}

fn assemble(grid: &Grid, tiles: &[Vec<u8>]) -> Image {
    let width = grid.width as usize * 3;
    let mut pixels = vec![0u8; width * grid.height as usize];
    for (number, bytes) in tiles.iter().enumerate() {
        let across = grid.tiles_across() as usize;
        let (x, y) = (number % across * TILE as usize, number / across * TILE as usize);
        let tile_width = (TILE as usize).min(grid.width as usize - x) * 3;
        for (row, line) in bytes.chunks(tile_width).enumerate() {
            let at = (y + row) * width + x * 3;
            pixels[at..at + tile_width].copy_from_slice(line);
        }
    }
    Image::of(grid.width, grid.height, pixels)
}
