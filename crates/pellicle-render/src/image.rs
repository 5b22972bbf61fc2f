//! The finished picture: rows of RGB bytes, a PNG file's bytes, two pictures side by side.

use crate::Error;
use crate::color::{Color, encode, mix};
use crate::settings::check_size;
use crate::text::Font;

/// A picture in sRGB, 8 bits a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

impl Image {
    /// `pixels` has `3 · width · height` bytes.
    pub(crate) const fn of(width: u32, height: u32, pixels: Vec<u8>) -> Self {
        Self { width, height, pixels }
    }

    /// A picture in one color.
    ///
    /// # Errors
    /// [`Error::Size`] as for [`draw`](crate::draw).
    pub fn filled(width: u32, height: u32, color: Color) -> Result<Self, Error> {
        check_size(u64::from(width), u64::from(height))?;
        Ok(Self::of(width, height, color.0.repeat(width as usize * height as usize)))
    }

    /// A picture made pixel by pixel: `color` of x from the left and y from the top.
    ///
    /// # Errors
    /// As [`filled`](Self::filled).
    pub fn from_fn(width: u32, height: u32, mut color: impl FnMut(u32, u32) -> Color) -> Result<Self, Error> {
        check_size(u64::from(width), u64::from(height))?;
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Ok(Self::of(width, height, places.flat_map(|(x, y)| color(x, y).0).collect()))
    }

    /// In pixels.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// In pixels.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Red, green and blue of each pixel, from left to right, row after row from the top: `3 · width · height` bytes.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// One pixel, or nothing outside of the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Color> {
        let at = self.offset(x, y)?;
        Some(Color([self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]))
    }

    fn offset(&self, x: u32, y: u32) -> Option<usize> {
        let inside = x < self.width && y < self.height;
        inside.then(|| (y as usize * self.width as usize + x as usize) * 3)
    }

    /// Mixes a color into a pixel in linear light; `share` is 0 to 1. Outside of the picture nothing happens.
    pub(crate) fn blend(&mut self, x: i64, y: i64, color: Color, share: f32) {
        let at = u32::try_from(x).ok().zip(u32::try_from(y).ok()).and_then(|(x, y)| Some((x, y, self.offset(x, y)?)));
        if let Some((x, y, at)) = at
            && let Some(old) = self.pixel(x, y)
        {
            let Color(new) = encode(mix(old.light(), color.light(), share));
            self.pixels[at..at + 3].copy_from_slice(&new);
        }
    }

    /// Fills a rectangle, as far as it lies in the picture.
    pub(crate) fn fill(&mut self, x: i64, y: i64, width: i64, height: i64, color: Color) {
        for row in y..y + height {
            for column in x..x + width {
                self.blend(column, row, color, 1.0);
            }
        }
    }

    /// Writes a line of text into the lower left corner, dark on light and light on dark. What does not fit is cut off.
    pub fn write_caption(&mut self, text: &str) {
        let font = Font::for_height(self.height);
        let margin = i64::from(font.height()) * 3 / 4;
        let (x, y) = (margin, i64::from(self.height) - margin - i64::from(font.height()));
        let ink = self.ink(x, y, font.width_of(text), font.height());
        font.write(self, x, y, text, ink);
    }

    /// The color of text that reads best on a rectangle of the picture.
    pub(crate) fn ink(&self, x: i64, y: i64, width: u32, height: u32) -> Color {
        let (mut light, mut dark) = (0u32, 0u32);
        for row in (y..y + i64::from(height)).step_by(4) {
            for column in (x..x + i64::from(width)).step_by(4) {
                let place = u32::try_from(column).ok().zip(u32::try_from(row).ok());
                match place.and_then(|(x, y)| self.pixel(x, y)) {
                    Some(color) if color.is_light() => light += 1,
                    Some(_) => dark += 1,
                    None => {}
                }
            }
        }
        if light >= dark { Color::INK } else { Color::WHITE }
    }

    /// Both pictures in one, this one on the left, with a thin white gap; the lower one in the middle of the height.
    ///
    /// # Errors
    /// [`Error::Size`] when the two together are too wide.
    pub fn beside(&self, other: &Self) -> Result<Self, Error> {
        let height = self.height.max(other.height);
        let gap = (height / 180).max(2);
        let width = u64::from(self.width) + u64::from(gap) + u64::from(other.width);
        check_size(width, u64::from(height))?;
        let total = self.width + gap + other.width;
        let mut both = Self::filled(total, height, Color::WHITE)?;
        for (image, left) in [(self, 0), (other, self.width + gap)] {
            let top = (height - image.height) / 2;
            let line = image.width as usize * 3;
            for (row, bytes) in image.pixels.chunks(line).enumerate() {
                let at = ((top as usize + row) * total as usize + left as usize) * 3;
                both.pixels[at..at + line].copy_from_slice(bytes);
            }
        }
        Ok(both)
    }

    /// The bytes of a PNG file: RGB, 8 bits, marked as sRGB, with the gamma that older readers look for.
    ///
    /// # Errors
    /// [`Error::Encoding`] with the encoder's message.
    pub fn encode_png(&self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        // The encoder writes this beside sRGB where it is the value that stands for it.
        encoder.set_source_gamma(png::ScaledFloat::from_scaled(45_455));
        // A tenth of the default's time for 1 % more bytes.
        encoder.set_compression(png::Compression::Fast);
        let fail = |e: png::EncodingError| Error::Encoding(e.to_string());
        let mut writer = encoder.write_header().map_err(fail)?;
        writer.write_image_data(&self.pixels).map_err(fail)?;
        writer.finish().map_err(fail)?;
        Ok(bytes)
    }
}
