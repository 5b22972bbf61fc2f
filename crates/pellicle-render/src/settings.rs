//! The picture's size and quality, and what surrounds the scene in it.

use crate::Error;
use crate::color::Color;

/// The picture around the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// In pixels: 1 to [`Settings::MOST`]. Default 1920.
    pub width: u32,
    /// In pixels: 1 to [`Settings::MOST`]. Default 1080.
    pub height: u32,
    /// Default four.
    pub samples: Samples,
    /// Default a light gradient.
    pub background: Background,
    /// A line of text in the lower left corner. Letters of Latin-1 and Latin Extended-A; others become `?`.
    pub caption: Option<String>,
    /// Whether layers painted by values get their color bars. Where the picture is too small for one there is none.
    /// Default shown.
    pub bars: Bars,
}

/// How many places within each pixel are tested: borders get as many steps plus one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Samples {
    /// The pixel's middle only: fast, with stairs.
    One,
    /// A rotated grid.
    #[default]
    Four,
    /// For finer borders.
    Eight,
    /// For pictures that are looked at for long.
    Sixteen,
}

/// What is behind the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Background {
    /// One color.
    Plain(Color),
    /// From the picture's upper border to its lower one.
    Gradient {
        /// Color at the upper border.
        top: Color,
        /// Color at the lower border.
        bottom: Color,
    },
}

impl Background {
    /// Nearly white above, a cool light grey below.
    pub const LIGHT: Self = Self::Gradient { top: Color([250, 251, 252]), bottom: Color([214, 221, 229]) };
    /// A dark blue grey.
    pub const DARK: Self = Self::Gradient { top: Color([46, 52, 62]), bottom: Color([22, 25, 31]) };

    pub(crate) fn ends(self) -> (Color, Color) {
        match self {
            Self::Plain(color) => (color, color),
            Self::Gradient { top, bottom } => (top, bottom),
        }
    }
}

/// Whether color bars are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bars {
    /// One for each name that layers show.
    #[default]
    Shown,
    /// None.
    Hidden,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1920,
            height: 1080,
            samples: Samples::Four,
            background: Background::LIGHT,
            caption: None,
            bars: Bars::Shown,
        }
    }
}

impl Settings {
    /// The longest side of a picture in pixels.
    pub const MOST: u32 = 16_384;

    /// The defaults for a picture of this size in pixels.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// Width over height, for [`Framing`](crate::Framing).
    pub fn aspect(&self) -> f64 {
        f64::from(self.width.max(1)) / f64::from(self.height.max(1))
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        check_size(u64::from(self.width), u64::from(self.height))
    }
}

pub(crate) fn check_size(width: u64, height: u64) -> Result<(), Error> {
    let sides = 1..=u64::from(Settings::MOST);
    if sides.contains(&width) && sides.contains(&height) {
        Ok(())
    } else {
        Err(Error::Size { width, height, most: Settings::MOST })
    }
}
