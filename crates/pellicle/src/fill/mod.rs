//! Field values of bricks: the hot stage. `simd` is what runs, [`scalar`] what it must equal, bit for bit.
//!
//! Source: this project; see `simd`.

pub(crate) mod above;
pub(crate) mod any;
pub(crate) mod eighths;
pub(crate) mod points;
pub(crate) mod prove;
#[cfg(test)]
mod scalar;
pub(crate) mod simd;
#[cfg(test)]
mod tests;
pub(crate) mod walled;

use crate::{
    lattice::{BRICK, Coord, OCTET},
    lookup::gather::{Box3, Candidates},
};

/// Values of a brick's nodes, x fastest.
pub(crate) type Values = [f32; 64];

/// Candidates of the octet, the brick and the pair of eighths at work: what one thread needs, kept between octets.
#[derive(Default)]
pub(crate) struct Scratch {
    octet: Candidates,
    brick: Candidates,
    pair: Candidates,
}

/// Corner of an octet in support units: the origin of its frame.
pub(crate) fn corner(octet: Coord, step: f64) -> [f64; 3] {
    octet.map(|o| f64::from(o) * f64::from(OCTET) * step)
}

/// Coordinate of the node `node` steps from an octet's corner, in its frame.
#[inline(always)]
pub(crate) fn node_offset(node: i32, step: f64) -> f32 {
    (f64::from(node) * step) as f32
}

/// The box of an octet's nodes, in its frame.
#[inline(always)]
pub(crate) fn octet_box(step: f64) -> Box3 {
    Box3 { low: [0.0; 3], high: [node_offset(OCTET - 1, step); 3] }
}

/// First node of brick `brick` (0..8, x lowest bit) of an octet, along each axis.
#[inline(always)]
pub(crate) fn brick_origin(brick: usize) -> [i32; 3] {
    std::array::from_fn(|a| BRICK * (brick >> a & 1) as i32)
}

/// The box of a brick's nodes, in its octet's frame.
#[inline(always)]
pub(crate) fn brick_box(brick: usize, step: f64) -> Box3 {
    let first = brick_origin(brick);
    Box3 { low: first.map(|n| node_offset(n, step)), high: first.map(|n| node_offset(n + BRICK - 1, step)) }
}
