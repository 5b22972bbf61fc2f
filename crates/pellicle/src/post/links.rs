//! What lies around merged vertices, told by directions of the lattice without gathering anybody's neighbors.
//!
//! ```text
//! word of a group    bits 0 to 26: the directions in which neighbors' nodes lie, as triangles go around it
//!                    bit 27: doubt, two neighbors in one direction or one farther away
//!                    above: a sum that is 0 where triangles close up around it and no more than a disc vanishes in it
//! ```
//!
//! Groups have the same nearest node, so a neighbor is known by the direction to its node, as long as no two share it. The sum
//! is made of mixed numbers: neighbors that follow, less those that precede, less twice the merged and plus the vanished
//! triangles by weight, which is 0 for vertices − edges + triangles = 1. That it is 0 by chance has the probability 2⁻³⁶, and
//! a vertex of a border would then move. What is in doubt is [looked at](super::undo) closely.
//!
//! Source: this project.

use super::node::{DIRECTIONS, direction};
use crate::math::memory::filled;

const DOUBT: u64 = 1 << DIRECTIONS;

/// What each vertex that merges and each triangle that vanishes counts for.
const WEIGHT: u64 = 0x9_e377_9b9b << (DIRECTIONS + 1);

/// See the module. Groups are named by their lowest vertices at first, then by number.
pub(super) struct Links {
    words: Vec<u64>,
}

impl Links {
    /// Of merged vertices: `target` is the lowest of each one's group.
    pub(super) fn of(triangles: &[[u32; 3]], nodes: &[u64], target: &[u32]) -> Self {
        let mut words = filled(0u64, target.len());
        for (_, &lowest) in target.iter().enumerate().filter(|(v, t)| *v != **t as usize) {
            add(&mut words[lowest as usize], WEIGHT.wrapping_mul(2));
        }
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| target[v as usize]);
            if a == b || b == c || c == a {
                let within = if b == c { b } else { a };
                add(&mut words[within as usize], WEIGHT.wrapping_neg());
                continue;
            }
            let at = triangle.map(|v| nodes[v as usize]);
            let mixed = [a, b, c].map(mixed);
            for (i, next, previous) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                let word = &mut words[[a, b, c][i] as usize];
                let bit = direction(at[i], at[next]).map_or(DOUBT, |d| 1 << d);
                *word |= bit | if *word & bit != 0 { DOUBT } else { 0 };
                add(word, mixed[next].wrapping_sub(mixed[previous]));
            }
        }
        Self { words }
    }

    /// Whether a group is a vertex of a manifold, all around which triangles go.
    #[inline(always)]
    pub(super) fn is_sure(&self, group: u32) -> bool {
        let word = self.words[group as usize];
        word & !(DOUBT - 1) == 0 && word.count_ones() >= 3
    }

    /// Marks what must not count as sure.
    pub(super) fn doubt(&mut self, group: u32) {
        self.words[group as usize] |= DOUBT;
    }

    /// The same with groups named by number: `lowest` tells those, in order.
    pub(super) fn numbered(&self, lowest: impl Iterator<Item = u32>) -> Self {
        Self { words: lowest.map(|v| self.words[v as usize]).collect() }
    }

    /// How many neighbors a sure group had at first.
    #[inline(always)]
    pub(super) fn valence(&self, group: u32) -> u32 {
        (self.words[group as usize] & (DOUBT - 1)).count_ones()
    }

    /// Whether a sure group may have a neighbor in a direction.
    #[inline(always)]
    pub(super) fn may_lead(&self, group: u32, direction: u32) -> bool {
        self.words[group as usize] >> direction & 1 != 0
    }

    /// Gives a group a neighbor in a direction.
    pub(super) fn lead(&mut self, group: u32, direction: u32) {
        self.words[group as usize] |= 1 << direction;
    }
}

/// Adds to the sum of a word, of which the lower bits must be 0 in `more`.
#[inline(always)]
fn add(word: &mut u64, more: u64) {
    *word = word.wrapping_add(more);
}

/// The number of a group, mixed so that different neighbors have different sums, in the bits of the sum.
#[inline(always)]
fn mixed(group: u32) -> u64 {
    let mixed = u64::from(group).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 31) << (DIRECTIONS + 1)
}
