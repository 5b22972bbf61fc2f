//! The rivals' grid: every node within reach of the particles' bounding box, on pellicle's lattice.

use pellicle::internals::Particles;
use pellicle::{ContourParams, Control, Mesh, Volume};

/// Nodes of a tile along x and y: with one plane of them a vector is filled.
pub const TILE: usize = 4;

/// Which nodes there are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Index of the first node on the lattice.
    pub first: [i64; 3],
    /// Nodes along each axis; whole tiles along x and y, and along z as many as along whole tiles.
    pub nodes: [usize; 3],
    /// Distance of nodes in supports.
    pub step: f64,
}

impl Grid {
    /// All nodes that a particle reaches, and the cells around them.
    pub fn around(particles: &Particles, step: f64) -> Self {
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        for p in &particles.positions {
            for a in 0..3 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
        }
        let first = low.map(|v| ((v - 1.0) / step).floor() as i64);
        let nodes = std::array::from_fn(|a| {
            let last = ((high[a] + 1.0) / step).ceil() as i64;
            ((last - first[a]) as usize + 1).next_multiple_of(TILE)
        });
        Self { first, nodes, step }
    }

    /// The first node's place in supports.
    pub fn origin(&self) -> [f64; 3] {
        self.first.map(|v| v as f64 * self.step)
    }

    pub fn len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// Coordinate of a node along an axis, from the first one, in supports.
    #[inline(always)]
    pub fn at(&self, node: usize) -> f32 {
        (node as f64 * self.step) as f32
    }

    /// First and one past the last node along an axis within `reach` of a range of coordinates.
    #[inline(always)]
    pub fn within(&self, axis: usize, low: f32, high: f32, reach: f32) -> [usize; 2] {
        // A little wider: rounding must lose none, and one too many adds nothing.
        let first = (f64::from(low - reach) / self.step - 1e-3).ceil().max(0.0) as usize;
        let end = (f64::from(high + reach) / self.step + 1e-3).floor().max(-1.0) + 1.0;
        [first, (end as usize).min(self.nodes[axis])]
    }

    /// The surface: by marching cubes of pellicle's road for volumes, the fastest that there is. In world units.
    pub fn triangulate(&self, values: &[f32], iso: f32, support: f64) -> Result<Mesh, String> {
        let spacing = self.step * support;
        let says = |error: pellicle::Error| error.to_string();
        let volume = Volume::new(values, self.nodes).map_err(says)?.with_spacing([spacing; 3]).map_err(says)?;
        let volume = volume.with_origin(self.first.map(|v| v as f64 * spacing)).map_err(says)?;
        let surface =
            pellicle::Contour::extract(&volume, &[iso.into()], &ContourParams::default(), &Control::default());
        Ok(surface.map_err(says)?.mesh(0))
    }
}
