//! Walls that the fluid touches: half-spaces and solids that nothing of the surface reaches into.
//!
//! Without them the surface ends where the field does: it bulges into a wall by the particles' size, or stops short of it, with
//! a bump for each particle. Two things together give a flat contact:
//!
//! * [`Walls::ghosts`]: particles near a wall are mirrored, in the plane 1.5 particle radii before it, so that the field goes
//!   on as if there was no wall, the surface meets it at a right angle, and densities and volumes next to it are those of a
//!   full neighbourhood. Solvers keep their outermost particles one radius to two and a half from a wall; the images carry
//!   the layers on at most a spacing and a half apart, and fluid counts as touching whose particles come within about 3 radii;
//! * the surface is cut at the wall while it is made ([`Reconstructor::set_walls`](crate::Reconstructor::set_walls)): what is in
//!   the wall is outside, and vertices on edges into it lie on the wall itself. So the mesh is closed and manifold by
//!   construction as any other.
//!
//! A cut of the finished mesh would need neither; but without the mirrored particles the contact is as ragged as their
//! outermost layer, and a mesh can only be cut at another through the intersection of both, which rounding may tear.
//!
//! Edges and corners of a solid are as sharp as the lattice is fine: they are cut off within a cell. Walls thinner than the
//! particles' reach have fluid on both sides and mirror nothing.
//!
//! Source: mirrored particles are those of Libersky & Petschek, Smooth particle hydrodynamics with strength of materials, 1991; the
//! rest is this project's.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::Positions;
use crate::{
    Error, Params,
    math::{
        tree::{Tree, Triangle, closest},
        vector::{add_scaled, cross, dot, length, subtract},
    },
};

/// Which side of a closed mesh is wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solid {
    /// Its inside: an obstacle.
    Inside,
    /// Its outside: the fluid is in a room.
    Outside,
}

/// Walls, all together.
#[derive(Debug, Clone, Default)]
pub struct Walls {
    /// The direction away from the wall, and where along it the wall begins.
    planes: Vec<([f64; 3], f64)>,
    solids: Vec<(Tree, Solid)>,
}

/// Particles mirrored in walls.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ghosts {
    /// World positions.
    pub positions: Vec<[f64; 3]>,
    /// Whose image each is: the index of a particle. Its attributes and radius are the ghost's.
    pub of: Vec<u32>,
}

impl Walls {
    /// As far as this from a wall, in cells, a vertex is on it: its place is rounded to single precision, from the mesh's origin.
    pub(crate) const ON: f64 = 4e-3;

    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// With a half-space: the wall is where `normal · x < offset`, so the normal points to the fluid. World units.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a normal without a direction, or an offset that is not finite.
    pub fn with_plane(mut self, normal: [f64; 3], offset: f64) -> Result<Self, Error> {
        let size = length(normal);
        if !(size.is_normal() && offset.is_finite()) {
            return Err(Error::Parameter { name: "normal", value: size, must: "a direction, and the offset finite" });
        }
        self.planes.push((normal.map(|n| n / size), offset / size));
        Ok(self)
    }

    /// With a closed mesh, given by the corners of its triangles in world units, one side of which is wall. Small holes do
    /// no harm; the orientation, as long as it is the same everywhere, does not matter. Triangles without area count for
    /// nothing: their neighbours cover them.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a corner that is not finite.
    pub fn with_mesh(mut self, mut triangles: Vec<[[f64; 3]; 3]>, solid: Solid) -> Result<Self, Error> {
        if let Some(&value) = triangles.as_flattened().as_flattened().iter().find(|x| !x.is_finite()) {
            return Err(Error::Parameter { name: "corner", value, must: "finite" });
        }
        // They have no direction, and a closed mesh is the same without them.
        triangles.retain(|[a, b, c]| length(cross(subtract(*b, *a), subtract(*c, *a))) > 0.0);
        self.solids.push((Tree::of(triangles), solid));
        Ok(self)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty() && self.solids.is_empty()
    }

    /// The half-spaces: normals of length 1 that point to the fluid, and offsets.
    pub fn planes(&self) -> &[([f64; 3], f64)] {
        &self.planes
    }

    /// Whether there are solids beside the half-spaces.
    pub fn has_solids(&self) -> bool {
        !self.solids.is_empty()
    }

    /// Whether a place is in no wall, nor on one.
    pub(crate) fn is_open(&self, at: [f64; 3]) -> bool {
        self.planes.iter().all(|(normal, offset)| dot(*normal, at) > *offset)
            && self.solids.iter().all(|(tree, solid)| tree.contains(at) == (*solid == Solid::Outside))
    }

    /// Distance to the walls, negative within; at most `limit` either way.
    pub(crate) fn height(&self, at: [f64; 3], limit: f64) -> f64 {
        let planes = self.planes.iter().map(|(normal, offset)| dot(*normal, at) - offset);
        let solids = self.solids.iter().map(|(tree, solid)| {
            let distance = tree.nearest(at, limit).map_or(limit, |(distance, _)| distance);
            if tree.contains(at) == (*solid == Solid::Outside) { distance } else { -distance }
        });
        planes.chain(solids).fold(limit, f64::min).max(-limit)
    }

    /// Which share of the way along an axis, from an open place to one in a wall, is open.
    pub(crate) fn open_share(&self, from: [f64; 3], axis: usize, way: f64) -> f64 {
        let planes = self.planes.iter().filter_map(|(normal, offset)| {
            let (here, there) = (dot(*normal, from) - offset, normal[axis] * way);
            (here + there <= 0.0).then(|| here / -there)
        });
        let solids = self.solids.iter().filter_map(|(tree, _)| tree.first_hit(from, axis, way));
        planes.chain(solids).fold(1.0, f64::min)
    }

    /// The nearest place on the nearest wall, if that is nearer than `within`, and on others that are nearer than a quarter of
    /// it or that the place is in. Exact where they meet at right angles.
    pub(crate) fn settled(&self, mut at: [f64; 3], within: f64) -> [f64; 3] {
        let nearest = self.height(at, within) * (1.0 + 1e-9);
        let is_met = |height: f64| height < 0.25 * within || (height < within && height <= nearest);
        for (normal, offset) in &self.planes {
            let height = dot(*normal, at) - offset;
            if is_met(height) {
                at = add_scaled(at, *normal, -height);
            }
        }
        for (tree, solid) in &self.solids {
            let is_wall = tree.contains(at) == (*solid == Solid::Inside);
            let found = tree.nearest(at, if is_wall { f64::INFINITY } else { within });
            if let Some((height, triangle)) = found
                && (is_wall || is_met(height))
            {
                at = closest(at, *triangle).0;
            }
        }
        at
    }

    /// The direction into the wall that a place touches, up to `within`.
    pub(crate) fn touched(&self, at: [f64; 3], within: f64) -> Option<[f64; 3]> {
        let on = |(normal, offset): &&([f64; 3], f64)| (dot(*normal, at) - offset).abs() <= within;
        if let Some((normal, _)) = self.planes.iter().find(on) {
            return Some(normal.map(|n| -n));
        }
        self.solids.iter().find_map(|(tree, solid)| {
            let (_, [a, b, c]) = tree.nearest(at, within)?;
            let normal = cross(subtract(*b, *a), subtract(*c, *a));
            let normal = normal.map(|n| n / length(normal));
            let is_solid = tree.contains(add_scaled(at, normal, 4.0 * within)) == (*solid == Solid::Inside);
            Some(if is_solid { normal } else { normal.map(|n| -n) })
        })
    }

    /// Images of the particles that a wall lacks: of those farther from it than two particle radii and nearer than their support
    /// and 1.5 radii, mirrored 1.5 radii before the wall. Where half-spaces meet there are images of images, up to three
    /// times. What is in a wall has none. The order depends on the particles alone.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use pellicle::{Control, Params, Reconstructor, Walls, mesh::Report};
    /// let mut positions: Vec<[f64; 3]> =
    ///     (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(|v| f64::from(v) * 0.1 + 0.05)).collect();
    /// let (params, control) = (Params::new(0.05), Control::default());
    /// let floor = Arc::new(Walls::new().with_plane([0.0, 0.0, 1.0], 0.0)?);
    /// positions.extend(floor.ghosts((&positions).into(), &params).positions);
    /// let mut reconstructor = Reconstructor::new();
    /// reconstructor.set_walls(Some(floor));
    /// let mesh = reconstructor.extract((&positions).into(), &[], &params, &control)?.to_mesh()?;
    /// assert!(Report::of(&mesh).closed_manifold());
    /// assert!(mesh.vertices.iter().all(|v| v[2] >= 0.0) && mesh.vertices.iter().any(|v| v[2] == 0.0));
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    pub fn ghosts(&self, positions: Positions<'_>, params: &Params) -> Ghosts {
        /// Images of images of images: a corner has no more, however many planes there are.
        const MOST: u8 = 3;
        let (n, mirror) = (positions.len(), Mirror::of(params));
        let mut images: Vec<([f64; 3], u32)> = Vec::new();
        let mut depths: Vec<u8> = Vec::new();
        for &(normal, offset) in &self.planes {
            let image = |at: [f64; 3], of: u32, depth: u8| {
                let shift = mirror.shift(dot(normal, at) - offset).filter(|_| depth < MOST)?;
                Some(((add_scaled(at, normal, -shift), of), depth + 1))
            };
            let first = (0..n).into_par_iter().filter_map(|i| image(positions.get(i), i as u32, 0));
            let second = images.par_iter().zip(&depths).filter_map(|(&(at, of), &depth)| image(at, of, depth));
            let (new, new_depths): (Vec<([f64; 3], u32)>, Vec<u8>) = first.chain(second).unzip();
            images.extend(new);
            depths.extend(new_depths);
        }
        let of_solids = (0..n).into_par_iter().flat_map_iter(|i| {
            let at = positions.get(i);
            let images = self.solids.iter().flat_map(move |(tree, solid)| mirror.images(tree, *solid, at));
            images.map(move |image| (image, i as u32))
        });
        let of_solids: Vec<([f64; 3], u32)> = of_solids.collect();
        images.extend(of_solids);
        let (positions, of) = images.into_iter().unzip();
        Ghosts { positions, of }
    }
}

/// How far from a wall particles are mirrored.
#[derive(Clone, Copy)]
struct Mirror {
    /// How far before the wall the mirror is. With a particle radius, half a layer, fluid that a solver keeps two and a half
    /// radii from the edges of a tank (SPlisHSPlasH's volume maps) would leave a groove along them.
    before: f64,
    /// Distance up to which nothing is mirrored: images would stand in the way, the next layer's do instead.
    from: f64,
    /// Distance from which on nothing is mirrored.
    reach: f64,
}

impl Mirror {
    fn of(params: &Params) -> Self {
        let radius = params.particle_radius;
        Self { before: 1.5 * radius, from: 2.0 * radius, reach: params.support() + 1.5 * radius }
    }

    /// How far the image of what is so far from a wall lies from it, towards the wall; `None` where there is none.
    fn shift(self, height: f64) -> Option<f64> {
        (height > self.from && height < self.reach).then_some(2.0 * (height - self.before))
    }

    /// Images of a place in a solid: in its nearest point, in the sides around that the place stands before, at angles of 60° and
    /// more, and across the edges between these.
    fn images(self, tree: &Tree, solid: Solid, at: [f64; 3]) -> Vec<[f64; 3]> {
        /// Cosine beyond which two ways to a wall count as one.
        const ONE_WAY: f64 = 0.5;
        let is_wall = |at: [f64; 3]| tree.contains(at) == (solid == Solid::Inside);
        let Some((_, nearest)) = tree.nearest(at, self.reach) else { return Vec::new() };
        if is_wall(at) {
            return Vec::new();
        }
        let way = |triangle: &Triangle| {
            let (foot, is_within) = closest(at, *triangle);
            let way = subtract(foot, at);
            (length(way), way, is_within)
        };
        let mut feet: Vec<(f64, [f64; 3])> = Vec::new();
        tree.for_each_near(at, self.reach, |triangle| {
            let (far, way, is_within) = way(triangle);
            if is_within {
                feet.push((far, way));
            }
        });
        let (far, first, _) = way(nearest);
        feet.push((far, first));
        // By distance, then by direction, so that the order of the tree does not show.
        feet.sort_by(|(f, v), (g, w)| f.total_cmp(g).then_with(|| v.partial_cmp(w).unwrap_or(Ordering::Equal)));
        let mut ways: Vec<(f64, [f64; 3])> = Vec::new();
        for (far, way) in feet {
            let is_new = |(size, other): &(f64, [f64; 3])| dot(way, *other) < ONE_WAY * far * size;
            if ways.len() < 3 && ways.iter().all(is_new) {
                ways.push((far, way));
            }
        }
        let shifts: Vec<(f64, [f64; 3])> =
            ways.iter().filter_map(|(far, way)| Some((self.shift(*far)? / far, *way))).collect();
        let chosen =
            |set: usize| shifts.iter().enumerate().filter(move |(i, _)| set >> i & 1 != 0).map(|(_, shift)| *shift);
        let images = (1..1usize << shifts.len()).filter_map(|set| {
            let image = chosen(set).fold(at, |at, (share, way)| add_scaled(at, way, share));
            // On this side of the wall, or in it, not beyond.
            (chosen(set).all(|(share, _)| share <= 1.0) || is_wall(image)).then_some(image)
        });
        images.collect()
    }
}

#[cfg(test)]
mod tests;
