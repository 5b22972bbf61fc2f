//! Marching cubes on bricks of 4×4×4 nodes, by bit masks and ranks.
//!
//! ```text
//! signs      8 sets: a brick and its neighbours above  ──► corner sets: cell n's corner c is bit n of set c
//! crossings  corner 0 xor corner 1, 2, 4               ──► crossed edges along x, y, z, owned by their lower node
//! number     base of the brick + crossings of lower axes + rank of the node among the set bits before it
//! case       one bit of each corner set                ──► table
//! ```
//!
//! A vertex *is* a crossed edge; its number comes from counting, so vertices are shared without a search. [`count`]
//! classifies and counts, sums give every octet its place, [`emit`] writes there. Bricks come octet by octet in Morton
//! order, vertices by axis and node, triangles by cell.
//!
//! Where only some cells may take part ([`Marks`](crate::bricks::marks::Marks)), the others' bits are cleared, and those of edges
//! that none of their cells has; the rest is the same.
//!
//! Source: Lorensen & Cline 1987; counting before writing is Schroeder, Maynard, Geveci, Flying Edges, 2015, with one
//! word of bits in place of a row.

pub(crate) mod count;
pub(crate) mod emit;

use crate::{
    bricks::store::{Octet, Store},
    lookup::directory::Cursor,
    math::bits::side_mask,
};

/// An octet and the seven above it: offset (c & 1, c >> 1 & 1, c >> 2).
pub(crate) type Above<'a> = [Option<&'a Octet>; 8];

/// The octet and those above it.
pub(crate) fn above<'a>(store: &'a Store<1>, octet: &'a Octet) -> Above<'a> {
    let mut cursor = Cursor::default();
    std::array::from_fn(|c| {
        if c == 0 {
            Some(octet)
        } else {
            store.find(&mut cursor, std::array::from_fn(|a| octet.at[a] + (c >> a & 1) as i32))
        }
    })
}

/// Where the brick at offset `c` from a brick lies: its place in [`Above`], and its index there.
#[inline(always)]
pub(crate) fn brick_above(brick: usize, c: usize) -> (usize, usize) {
    // Where both bits are set along an axis the sum is 2: the lower brick of the octet above.
    (brick & c, brick ^ c)
}

/// The nodes that touch the brick at offset `c`.
const TOUCHING: [u64; 8] = {
    let mut table = [0; 8];
    let mut c = 0;
    while c < 8 {
        table[c] = side_mask([(c & 1) as i32, (c >> 1 & 1) as i32, (c >> 2) as i32]);
        c += 1;
    }
    table
};

/// Signs of a filled brick and of the seven bricks above it. One without values has the sign of the nodes that touch it:
/// the band sees to it that they agree.
#[inline(always)]
pub(crate) fn signs(store: &Store<1>, above: &Above<'_>, brick: usize) -> Option<[u64; 8]> {
    let own = store.set(above[0]?, brick, 0)?;
    Some(std::array::from_fn(|c| {
        let (octet, index) = brick_above(brick, c);
        let touching = if own & TOUCHING[c] != 0 { u64::MAX } else { 0 };
        above[octet].and_then(|o| store.set(o, index, 0)).unwrap_or(touching)
    }))
}
