//! Letters in a picture: Noto Sans Mono in four sizes, smooth, from a crate that carries it.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::color::Color;
use crate::image::Image;

/// A size of text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Font {
    raster: RasterHeight,
    /// Each point of the letters becomes a square of this edge.
    zoom: u32,
}

const WEIGHT: FontWeight = FontWeight::Regular;
/// Stands for letters that the font lacks.
const UNKNOWN: char = '?';

impl Font {
    /// The size that suits a picture of this height.
    pub fn for_height(height: u32) -> Self {
        let (raster, zoom) = match height {
            0..600 => (RasterHeight::Size16, 1),
            600..900 => (RasterHeight::Size20, 1),
            900..1400 => (RasterHeight::Size24, 1),
            1400..2800 => (RasterHeight::Size32, 1),
            _ => (RasterHeight::Size32, height / 1400),
        };
        Self { raster, zoom }
    }

    /// Of a line, in pixels.
    pub fn height(self) -> u32 {
        self.raster.val() as u32 * self.zoom
    }

    /// Of a text, in pixels.
    pub fn width_of(self, text: &str) -> u32 {
        let letters = text.chars().count().min(10_000) as u32;
        letters * get_raster_width(WEIGHT, self.raster) as u32 * self.zoom
    }

    /// Writes a line with its upper left corner at a place.
    pub fn write(self, image: &mut Image, x: i64, y: i64, text: &str, color: Color) {
        let advance = i64::from(self.width_of("0"));
        let zoom = i64::from(self.zoom);
        for (i, letter) in (0i64..).zip(text.chars()) {
            if x + i * advance > i64::from(image.width()) {
                return;
            }
            let glyph = get_raster(letter, WEIGHT, self.raster).or_else(|| get_raster(UNKNOWN, WEIGHT, self.raster));
            let Some(glyph) = glyph else { continue };
            for (gy, row) in (0i64..).zip(glyph.rows()) {
                for (gx, &ink) in (0i64..).zip(row.iter()) {
                    for step in (0..zoom * zoom).filter(|_| ink > 0) {
                        let (px, py) = (gx * zoom + step % zoom, gy * zoom + step / zoom);
                        image.blend(x + i * advance + px, y + py, color, f32::from(ink) / 255.0);
                    }
                }
            }
        }
    }
}
