//! A field with walls in it: what is in a wall is outside, whatever the particles say.
//!
//! Values stay those of the field, so that a crossing that no wall has a part in stays where it is; only the sets of nodes that
//! are inside change. Where an edge into a wall is crossed, [`WallLattice::share`] says where.
//!
//! On a coarse lattice a node that lies within a cell's diagonal of a wall is unsure, so that the band is filled along walls
//! even where fluid is on both sides.
//!
//! Source: this project.

use std::sync::Arc;

use super::{
    any::AnyField,
    brick_origin,
    eighths::bricks_with,
    points::OctetVertices,
    prove::ProveOctet,
    simd::{FillOctet, Filled},
};
use crate::{
    Attribute,
    field::Bounds,
    lattice::{BRICK, Coord, OCTET},
    math::{bits::ones, simd::Unit},
    particles::walls::Walls,
};

/// Diagonal of a cube.
const DIAGONAL: f64 = 1.732_050_9;

/// Walls, as the nodes of a lattice see them.
#[derive(Clone)]
pub(crate) struct WallLattice {
    pub(crate) walls: Arc<Walls>,
    /// Distance of neighbouring nodes in world units.
    pub(crate) spacing: f64,
}

impl WallLattice {
    fn place(&self, node: Coord) -> [f64; 3] {
        node.map(|n| f64::from(n) * self.spacing)
    }

    /// Distance from walls of a cube of `side` nodes' middle, if the cube comes nearer to a wall than `margin`; else whether it
    /// is in one.
    fn side_of_cube(&self, first: Coord, side: i32, margin: f64) -> Side {
        let half = 0.5 * f64::from(side - 1);
        let middle = first.map(|n| (f64::from(n) + half) * self.spacing);
        let limit = half * DIAGONAL * self.spacing + margin;
        match self.walls.height(middle, limit) {
            height if height >= limit => Side::Open,
            height if height <= -limit => Side::Wall,
            _ => Side::Both,
        }
    }

    /// Whether a cube of `side` nodes comes nearer to a wall than `margin`, or is in one.
    pub(crate) fn is_near(&self, first: Coord, side: i32, margin: f64) -> bool {
        self.side_of_cube(first, side, margin) != Side::Open
    }

    /// Turns the normals of vertices that lie on walls into these.
    pub(crate) fn face(&self, octet: Coord, origin: [f64; 3], vertices: &[[f32; 3]], normals: &mut [[f32; 3]]) {
        let within = Walls::ON * self.spacing;
        if !self.is_near(octet.map(|o| o * OCTET), OCTET + 1, within) {
            return;
        }
        for (vertex, normal) in vertices.iter().zip(normals) {
            let at = [0, 1, 2].map(|a| origin[a] + f64::from(vertex[a]));
            if let Some(into) = self.walls.touched(at, within) {
                *normal = into.map(|n| n as f32);
            }
        }
    }

    /// Where the edge up an axis from a node is crossed. `share` is where the field says, and `inside` what it says of both ends.
    pub(crate) fn share(&self, node: Coord, axis: usize, share: f64, inside: [bool; 2]) -> f64 {
        let mut above = node;
        above[axis] += 1;
        let ends = [self.place(node), self.place(above)];
        match ends.map(|end| self.walls.is_open(end)) {
            [true, false] => {
                let open = self.walls.open_share(ends[0], axis, self.spacing);
                if inside[1] { open } else { open.min(share) }
            }
            [false, true] => {
                let open = 1.0 - self.walls.open_share(ends[1], axis, -self.spacing);
                if inside[0] { open } else { open.max(share) }
            }
            _ => share,
        }
    }
}

/// Where a cube lies.
#[derive(PartialEq)]
enum Side {
    Open,
    Wall,
    Both,
}

/// A field, and the walls in it.
pub(crate) struct Walled {
    pub(crate) field: Box<dyn AnyField>,
    pub(crate) lattice: WallLattice,
    /// Support radius in world units.
    pub(crate) support: f64,
}

impl AnyField for Walled {
    fn iso(&self) -> f32 {
        self.field.iso()
    }

    fn bounds(&self) -> Option<Bounds> {
        self.field.bounds()
    }

    fn proves(&self) -> bool {
        self.field.proves()
    }

    fn fills_eighths(&self, step: f64) -> bool {
        self.field.fills_eighths(step)
    }

    /// What is outside stays so, with walls or without.
    fn prove(&self, unit: Unit, octet: ProveOctet<'_>) -> u64 {
        self.field.prove(unit, octet)
    }

    fn fill(&self, unit: Unit, octet: FillOctet<'_>) -> Filled {
        let FillOctet { step, octet: at, thresholds, sampling, .. } = octet;
        let above = &mut *octet.above;
        let filled = self.field.fill(unit, FillOctet { above, ..octet });
        let above = octet.above;
        // The fine lattice's own spacing, so that its nodes are judged alike here and where they are written.
        let spacing = if sampling.is_some() { step * self.support } else { self.lattice.spacing };
        let lattice = WallLattice { spacing, ..self.lattice.clone() };
        let margin = if sampling.is_some() { 1.001 * DIAGONAL * spacing } else { 0.0 };
        let first = at.map(|o| o * OCTET);
        match lattice.side_of_cube(first, OCTET, margin) {
            Side::Open => return filled,
            Side::Wall => {
                above.fill(0);
                return filled;
            }
            Side::Both => {}
        }
        for brick in ones(bricks_with(filled.eighths).into()) {
            let above = &mut above[thresholds.len() * brick..][..thresholds.len()];
            let offset = brick_origin(brick);
            let first = [0, 1, 2].map(|a| first[a] + offset[a]);
            match lattice.side_of_cube(first, BRICK, margin) {
                Side::Open => {}
                Side::Wall => above.fill(0),
                Side::Both if sampling.is_none() => {
                    let open = nodes_where(&lattice, first, |at| lattice.walls.is_open(at));
                    above.iter_mut().for_each(|set| *set &= open);
                }
                Side::Both => {
                    let height = |at| lattice.walls.height(at, 2.0 * margin);
                    // May be inside, is, and surely is.
                    for (set, bound) in above.iter_mut().zip([-margin, 0.0, margin]) {
                        *set &= nodes_where(&lattice, first, |at| height(at) > bound);
                    }
                }
            }
        }
        filled
    }

    fn normals(&self, unit: Unit, of: OctetVertices<'_>, columns: &[&[f32]], to: &mut [[f32; 3]]) {
        self.field.normals(unit, of, columns, to);
    }

    fn interpolate(
        &self,
        unit: Unit,
        of: OctetVertices<'_>,
        columns: &[&[f32]],
        attribute: &Attribute<'_>,
        to: &mut [f32],
    ) {
        self.field.interpolate(unit, of, columns, attribute, to);
    }
}

/// The set of a brick's nodes for whose places `holds`.
fn nodes_where(lattice: &WallLattice, first: Coord, holds: impl Fn([f64; 3]) -> bool) -> u64 {
    (0..64i32).fold(0, |set, node| {
        let at = [first[0] + (node & 3), first[1] + (node >> 2 & 3), first[2] + (node >> 4)];
        set | u64::from(holds(lattice.place(at))) << node
    })
}
