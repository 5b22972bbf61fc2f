//! Where the picture is taken from: given by hand, or found so that a box fits.
//!
//! A camera that is found is exact, not searched for. Let `b` point from the scene to the eye, `r` to the right, `k` be the
//! tangent of half the angle of view. A point `p` is left of the frame's right border when `(p − eye)·(r + k b) ≤ 0`. So
//! what counts is how far the content reaches along `r + k b` (its support), and likewise to the left, up and down: four
//! numbers give the nearest eye that sees all. For a turntable the content is not the box but the cylinder that the box
//! sweeps about the up axis: its supports do not change with the angle, so the picture does not breathe.

use crate::Error;
use crate::bounds::Bounds;
use crate::vector::{Vec3, add_scaled, cross, dot, length, normalized, scale, sin_cos, sub};

/// How the picture is projected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Near things are larger.
    Perspective {
        /// Vertical angle of view in degrees: above 0, below 170.
        angle: f64,
    },
    /// Sizes stay the same at all distances; also what lies behind the eye is drawn.
    Orthographic {
        /// What the picture's height shows, in world units. > 0.
        height: f64,
    },
}

/// A camera in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub eye: [f64; 3],
    /// What is in the middle of the picture. Elsewhere than `eye`.
    pub target: [f64; 3],
    /// What points up in the picture, of any length. Along the line of sight it is replaced by another axis.
    pub up: [f64; 3],
    /// How it projects.
    pub lens: Lens,
}

/// Which side an automatic camera looks from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// The world's up axis, of any length but 0. Default y.
    pub up: [f64; 3],
    /// Degrees around the up axis. 0 looks from the front, which is +z (−y where up is z); 90 from the right. Default 30.
    pub azimuth: f64,
    /// Degrees above the horizon, −90 to 90. Default 22.
    pub elevation: f64,
    /// Vertical angle of view in degrees, or `None` for an orthographic picture. Default 30.
    pub angle: Option<f64>,
    /// Share of the picture's half width and height that stays free at each border, 0 to below 1. Default 0.06.
    pub margin: f64,
}

impl Default for Framing {
    fn default() -> Self {
        Self { up: [0.0, 1.0, 0.0], azimuth: 30.0, elevation: 22.0, angle: Some(30.0), margin: 0.06 }
    }
}

impl Framing {
    /// The camera that sees all of `bounds` in a picture of `aspect` (width over height). Any box will do: empty, flat, one
    /// point.
    ///
    /// # Errors
    /// [`Error::Camera`] names what is out of range.
    pub fn fit(&self, bounds: &Bounds, aspect: f64) -> Result<Camera, Error> {
        let (centre, half) = bounds.framed();
        let reach = |d: Vec3| (0..3).map(|a| half[a] * d[a].abs()).sum();
        self.around(centre, &reach, aspect, self.azimuth)
    }

    /// The camera of a turntable, `angle` degrees further than [`azimuth`](Self::azimuth): for every angle the same
    /// distance and the same frame.
    ///
    /// # Errors
    /// As [`fit`](Self::fit).
    pub fn orbit(&self, bounds: &Bounds, aspect: f64, angle: f64) -> Result<Camera, Error> {
        let (centre, half) = bounds.framed();
        let up = self.axis()?;
        let corners = (0..8).map(|c: usize| std::array::from_fn(|a| if c >> a & 1 == 1 { half[a] } else { -half[a] }));
        let (mut radius, mut height) = (0.0f64, 0.0f64);
        for corner in corners {
            let along = dot(corner, up);
            height = height.max(along.abs());
            radius = radius.max(length(add_scaled(corner, -along, up)));
        }
        let reach = |d: Vec3| {
            let along = dot(d, up);
            height * along.abs() + radius * length(add_scaled(d, -along, up))
        };
        self.around(centre, &reach, aspect, self.azimuth + angle)
    }

    fn axis(&self) -> Result<Vec3, Error> {
        normalized(self.up)
            .ok_or(Error::Camera { what: format!("the up axis is {:?}", self.up), must: "it must be finite and not 0" })
    }

    /// `reach` is the support of the content about `centre`; the same in opposite directions.
    fn around(&self, centre: Vec3, reach: &dyn Fn(Vec3) -> f64, aspect: f64, azimuth: f64) -> Result<Camera, Error> {
        let up = self.axis()?;
        check("azimuth", azimuth, azimuth.is_finite(), "it must be finite")?;
        check("elevation", self.elevation, self.elevation.abs() <= 90.0, "it must be between -90 and 90 degrees")?;
        check("margin", self.margin, (0.0..1.0).contains(&self.margin), "it must be from 0 to below 1")?;
        check("aspect", aspect, aspect.is_finite() && aspect > 0.0, "width over height must be finite and above 0")?;

        let (front, side) = horizontal(up);
        let ((sin_a, cos_a), (sin_e, cos_e)) = (sin_cos(azimuth), sin_cos(self.elevation));
        let level = add_scaled(scale(front, cos_a), sin_a, side);
        let back = add_scaled(scale(level, cos_e), sin_e, up);
        let right = add_scaled(scale(side, cos_a), -sin_a, front);
        let above = cross(back, right);

        let free = 1.0 - self.margin;
        let Some(angle) = self.angle else {
            let half_height = reach(above).max(reach(right) / aspect) / free;
            let eye = add_scaled(centre, 2.0 * reach(back) + half_height, back);
            let lens = Lens::Orthographic { height: 2.0 * half_height };
            return Ok(Camera { eye, target: centre, up: above, lens });
        };
        check("angle of view", angle, angle > 0.0 && angle < 170.0, ANGLE)?;
        let tangent = half_tangent(angle) * free;
        // How far to go back for one pair of borders, and how far aside to have both at equal distances.
        let pair = |across: Vec3, k: f64| {
            let (plus, minus) = (reach(add_scaled(across, k, back)), reach(add_scaled(scale(across, -1.0), k, back)));
            ((plus + minus) / (2.0 * k), (plus - minus) / 2.0)
        };
        // A wide angle would see all from the nearest corner itself: not that near.
        let apart = 1.1 * reach(back);
        let distance = pair(right, tangent * aspect).0.max(pair(above, tangent).0).max(apart);
        // The pair that has room to spare is centred too: by the narrower angle that would need this distance.
        let aside = |across: Vec3, k: f64| {
            let (mut narrow, mut wide) = (0.0, k);
            for _ in 0..60 {
                let k = (narrow + wide) / 2.0;
                if pair(across, k).0 > distance { narrow = k } else { wide = k }
            }
            pair(across, wide).1
        };
        let (x, y) = (aside(right, tangent * aspect), aside(above, tangent));
        let target = add_scaled(add_scaled(centre, x, right), y, above);
        Ok(Camera { eye: add_scaled(target, distance, back), target, up: above, lens: Lens::Perspective { angle } })
    }
}

const ANGLE: &str = "it must be above 0 and below 170 degrees";

fn check(name: &str, value: f64, holds: bool, must: &'static str) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Camera { what: format!("{name} = {value}"), must }) }
}

/// Tangent of half an angle in degrees.
pub(crate) fn half_tangent(angle: f64) -> f64 {
    let (sin, cos) = sin_cos(angle / 2.0);
    sin / cos
}

/// The front of a world with this up axis, and its right as seen from there.
pub(crate) fn horizontal(up: Vec3) -> (Vec3, Vec3) {
    let toward = if up[2].abs() > 0.9 { [0.0, -1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let front = add_scaled(toward, -dot(toward, up), up);
    let front = normalized(front).unwrap_or([1.0, 0.0, 0.0]);
    (front, cross(up, front))
}

impl Camera {
    /// Right, up and forward, of length 1 and at right angles, and the distance to the target.
    pub(crate) fn axes(&self) -> Result<([Vec3; 3], f64), Error> {
        let fail = |what, must| Err(Error::Camera { what, must });
        let sight = sub(self.target, self.eye);
        let distance = length(sight);
        let Some(forward) = normalized(sight).filter(|_| distance.is_normal()) else {
            let must = "they must be finite and apart";
            return fail(format!("the eye is at {:?}, the target at {:?}", self.eye, self.target), must);
        };
        let Some(up) = normalized(self.up) else {
            return fail(format!("the up axis is {:?}", self.up), "it must be finite and not 0");
        };
        match self.lens {
            Lens::Perspective { angle } => check("angle of view", angle, angle > 0.0 && angle < 170.0, ANGLE)?,
            Lens::Orthographic { height } => {
                check("height", height, height.is_normal() && height > 0.0, "it must be an ordinary number above 0")?;
            }
        }
        let across = cross(forward, up);
        let right = if length(across) > 1e-9 { normalized(across) } else { None };
        // Straight down or up: north is up in the picture.
        let right = right.unwrap_or_else(|| horizontal(up).1);
        Ok(([right, cross(right, forward), forward], distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::View;

    fn boxed(half: Vec3) -> Bounds {
        let centre = [5.0, -3.0, 1.0];
        Bounds { min: sub(centre, half), max: std::array::from_fn(|a| centre[a] + half[a]) }
    }

    /// How far the box's corners reach towards the borders: 1 is the border.
    fn reach(camera: &Camera, bounds: &Bounds, width: u32, height: u32) -> [f64; 4] {
        let view = View::new(camera, width, height).unwrap();
        let mut most = [f64::NEG_INFINITY; 4];
        for c in 0..8usize {
            let p = std::array::from_fn(|a| if c >> a & 1 == 1 { bounds.max[a] } else { bounds.min[a] });
            let [x, y] = view.screen(view.point(sub(p, camera.eye)));
            let (x, y) = (x / f64::from(width) * 2.0 - 1.0, y / f64::from(height) * 2.0 - 1.0);
            most = [most[0].max(x), most[1].max(-x), most[2].max(y), most[3].max(-y)];
        }
        most
    }

    #[test]
    fn the_box_fits_and_touches_the_margin() {
        for half in [[1.0, 2.0, 3.0], [1e-5, 1.0, 1e-5], [4.0, 0.0, 4.0], [1e8, 1.0, 1e8]] {
            for up in [[0.0, 1.0, 0.0], [0.0, 0.0, 2.0], [1.0, 1.0, 1.0], [1.0, 0.0, 0.0]] {
                for angle in [Some(30.0), Some(100.0), None] {
                    for (width, height) in [(200, 100), (100, 300)] {
                        let bounds = boxed(half);
                        let framing = Framing { up, angle, ..Framing::default() };
                        let camera = framing.fit(&bounds, f64::from(width) / f64::from(height)).unwrap();
                        let reach = reach(&camera, &bounds, width, height);
                        let most = reach.iter().fold(0.0f64, |m, &r| m.max(r));
                        assert!(
                            most < 0.94 + 1e-6 && (most > 0.94 - 1e-6 || angle == Some(100.0)),
                            "{half:?} {up:?} {angle:?} {reach:?}"
                        );
                        assert!((reach[0] - reach[1]).abs() < 1e-6 && (reach[2] - reach[3]).abs() < 1e-6, "{reach:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_turntable_does_not_breathe_and_cuts_nothing() {
        let bounds = boxed([1.0, 0.5, 3.0]);
        let at = |turn: f64| Framing::default().orbit(&bounds, 1.5, turn).unwrap();
        let distance = length(sub(at(0.0).eye, at(0.0).target));
        for turn in (0..360).step_by(15) {
            let camera = at(f64::from(turn));
            assert!((length(sub(camera.eye, camera.target)) - distance).abs() < 1e-9 * distance);
            assert!(reach(&camera, &bounds, 300, 200).iter().all(|&r| r <= 0.9400001), "{turn}");
        }
    }

    #[test]
    fn what_cannot_look_is_refused() {
        let camera = Framing::default().fit(&Bounds::EMPTY, 1.0).unwrap();
        assert!(camera.axes().is_ok());
        assert!(Camera { eye: camera.target, ..camera }.axes().is_err());
        assert!(Camera { eye: [f64::NAN; 3], ..camera }.axes().is_err());
        assert!(Camera { up: [0.0; 3], ..camera }.axes().is_err());
        assert!(Camera { lens: Lens::Perspective { angle: 180.0 }, ..camera }.axes().is_err());
        assert!(Camera { lens: Lens::Orthographic { height: 0.0 }, ..camera }.axes().is_err());
        assert!(Framing { angle: Some(f64::NAN), ..Framing::default() }.fit(&Bounds::EMPTY, 1.0).is_err());
        assert!(Framing { margin: 1.0, ..Framing::default() }.fit(&Bounds::EMPTY, 1.0).is_err());
    }

    #[test]
    fn straight_down_has_an_up() {
        let camera = Camera {
            eye: [0.0, 5.0, 0.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            lens: Lens::Perspective { angle: 30.0 },
        };
        let ([right, up, forward], _) = camera.axes().unwrap();
        assert_eq!(forward, [0.0, -1.0, 0.0]);
        assert!(dot(right, up).abs() < 1e-12 && (length(up) - 1.0).abs() < 1e-12);
    }
}
