//! What lies around a block: who owns the vertices of its border, and where its border nodes move.
//!
//! The border of a block is 6 faces, 12 edges and 8 corners; with the inside these are 27 *places*. All depends on the
//! place and on the levels of the blocks around it alone, so it is told in tables of a few bytes a block. Hidden blocks own
//! nothing, and no transition cells lead to them; all else of their neighbours is as if they were shown.
//!
//! **Copies.** Where fine and coarse blocks meet, nodes and lattice edges of the coarse level exist beside those of the
//! fine level, and transition cells lie between. Around a point of a block's edge there are four blocks. Coarse ones share
//! the coarse lattice edge, whether or not they are neighbours through a face. Fine ones share the fine lattice edges if
//! they hang together through faces around the edge. If they do not (coarse, fine, coarse, fine), the fine edges exist
//! twice, at one place: then each edge has one ring of cells around it, and each transition cell's side meets exactly one
//! other, which lies on the same fine block. One copy of the fine edges and two of the coarse one would not do: two sides
//! would hold the same two fine edges, and might both draw the segment between them.
//!
//! **Room.** Transition cells are given room by moving the coarse nodes away from the fine blocks, by a quarter of a coarse
//! cell along each axis: towards where most of the coarse blocks are that hang together at this node.
//!
//! Source: the shape of the cells and their width are Lengyel 2010 (see [`super`]); the rules for edges and corners are
//! this project's.

use crate::bricks::levels::{AROUND, Levels, SELF, offset, offset_index};

/// Along an axis: 0 at the low border, 1 within, 2 at the high border.
#[inline(always)]
pub(crate) fn side(at: usize, n: usize) -> usize {
    usize::from(at > 0) + usize::from(at == n)
}

/// The other two axes, ascending.
pub(crate) const OTHER: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

/// Tables of one block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// Who owns lattice edges: for an axis and the sides (see [`side`]) along the other two, an offset's index. The offset
    /// along the axis itself is 0.
    owners: [[u8; 9]; 3],
    /// Where the nodes of a place move, in quarters of a cell; places are numbered as offsets.
    moves: [[i8; 3]; AROUND],
    /// Bit of each place whose nodes touch an absent block.
    open: u32,
    /// Bit 2·axis + side of each face beyond which cells are finer, and shown.
    pub(crate) finer: u8,
}

impl Around {
    /// Tables of block `block`.
    pub(crate) fn new(blocks: &Levels, block: usize) -> Self {
        // Levels relative to the block's own.
        let relative: [Option<i32>; AROUND] = std::array::from_fn(|o| {
            blocks.neighbour(block, o).map(|n| i32::from(blocks.level[n]) - i32::from(blocks.level[block]))
        });
        let shown = |o: usize| blocks.neighbour(block, o).is_some_and(|n| !blocks.hidden[n]);
        let finer = (0..6usize).filter(|&face| {
            let mut d = [0; 3];
            d[face / 2] = 2 * (face as i32 % 2) - 1;
            relative[offset_index(d)] == Some(-1) && shown(offset_index(d))
        });
        Self {
            owners: std::array::from_fn(|axis| {
                std::array::from_fn(|sides| owner(&relative, &shown, axis, sides) as u8)
            }),
            moves: std::array::from_fn(|place| node_move(&relative, place)),
            open: (0..AROUND).fold(0, |set, p| set | u32::from(octants(p).any(|o| relative[o].is_none())) << p),
            finer: finer.fold(0, |set, face| set | 1 << face),
        }
    }

    /// Owner of the lattice edges along `axis` with these sides along the other two axes, ascending.
    #[inline(always)]
    pub(crate) fn owner(&self, axis: usize, sides: [usize; 2]) -> usize {
        usize::from(self.owners[axis][sides[0] + 3 * sides[1]])
    }

    /// Where a node with these sides moves, in quarters of a cell.
    #[inline(always)]
    pub(crate) fn node_move(&self, sides: [usize; 3]) -> [i8; 3] {
        self.moves[sides[0] + 3 * sides[1] + 9 * sides[2]]
    }

    /// Whether a node with these sides touches an absent block.
    #[inline(always)]
    pub(crate) fn is_open(&self, sides: [usize; 3]) -> bool {
        self.open >> (sides[0] + 3 * sides[1] + 9 * sides[2]) & 1 == 1
    }

    /// Whether any border node touches an absent block.
    pub(crate) fn any_open(&self) -> bool {
        self.open != 0
    }
}

/// Offsets of the blocks in the eight octants around a node of a place, x lowest bit of the octant.
fn octants(place: usize) -> impl Iterator<Item = usize> {
    let sides = offset(place);
    (0..8).map(move |octant| {
        offset_index(std::array::from_fn(|a| match (sides[a], octant >> a & 1) {
            (-1, 0) => -1,
            (1, 1) => 1,
            _ => 0,
        }))
    })
}

/// The owner among the blocks around a lattice edge: the one with the largest offset of those shown that share it.
fn owner(relative: &[Option<i32>; AROUND], shown: &impl Fn(usize) -> bool, axis: usize, sides: usize) -> usize {
    let step = [sides as i32 % 3 - 1, sides as i32 / 3 - 1];
    // Around the edge, in a ring that begins with the block itself.
    let ring = [[0, 0], [step[0], 0], step, [0, step[1]]].map(|d| {
        let mut offset = [0; 3];
        (offset[OTHER[axis][0]], offset[OTHER[axis][1]]) = (d[0], d[1]);
        offset_index(offset)
    });
    let level = ring.map(|o| relative[o]);
    // On a face the ring names two blocks twice, which does no harm.
    let meets_coarser = level.contains(&Some(1));
    let shares = |place: usize| {
        let next_to_self = level[1] == Some(0) || level[3] == Some(0);
        level[place] == Some(0) && shown(ring[place]) && (!meets_coarser || place != 2 || next_to_self)
    };
    (0..4).filter(|&place| shares(place)).map(|place| ring[place]).max().unwrap_or(SELF)
}

/// The sum of the directions to the coarse octants that hang together with the block around a node, through faces and
/// edges; nothing where no octant is finer. An absent block counts as one of the same level: there is no crossing in it.
fn node_move(relative: &[Option<i32>; AROUND], place: usize) -> [i8; 3] {
    let mut level = [0; 8];
    let mut reached = 0u8;
    for (octant, o) in octants(place).enumerate() {
        level[octant] = relative[o].unwrap_or(0);
        reached |= u8::from(o == SELF) << octant;
    }
    if !level.contains(&-1) {
        return [0; 3];
    }
    // Only opposite octants do not touch: two steps lead to all that hang together.
    for _ in 0..2 {
        let before = reached;
        for octant in (0..8).filter(|octant| before >> octant & 1 == 1) {
            for next in [1, 2, 4, 3, 5, 6].map(|step| octant ^ step) {
                reached |= u8::from(level[next] == 0) << next;
            }
        }
    }
    std::array::from_fn(|a| {
        let sum: i32 = (0..8).filter(|o| reached >> o & 1 == 1).map(|o| if o >> a & 1 == 1 { 1 } else { -1 }).sum();
        sum.signum() as i8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2×2×2 blocks around the origin's corner, block `c` at level `pattern >> c & 1`.
    fn corner(pattern: u32) -> Levels {
        let mut blocks = Levels::default();
        let wish = |b: [i32; 3]| (pattern >> (b[0] + 2 * b[1] + 4 * b[2]) & 1) as u8;
        blocks.list((0..8).map(|c| [c & 1, c >> 1 & 1, c >> 2]), 1, wish);
        blocks
    }

    #[test]
    fn all_sharers_of_an_edge_name_the_same_owner() {
        for pattern in 0..256 {
            let blocks = corner(pattern);
            for block in 0..8 {
                let around = Around::new(&blocks, block);
                for axis in 0..3 {
                    for sides in 0..9 {
                        let owner = around.owner(axis, [sides % 3, sides / 3]);
                        let at = offset(owner);
                        let there = blocks.neighbour(block, owner).expect("an owner is listed");
                        assert_eq!(blocks.level[there], blocks.level[block]);
                        // Seen from the owner, the sides along which it differs are the opposite ones.
                        let seen: [usize; 2] = std::array::from_fn(|i| {
                            let side = [sides % 3, sides / 3][i];
                            if at[OTHER[axis][i]] == 0 { side } else { 2 - side }
                        });
                        assert_eq!(Around::new(&blocks, there).owner(axis, seen), SELF, "pattern {pattern:b}");
                    }
                }
            }
        }
    }

    #[test]
    fn nodes_move_away_from_finer_blocks_only() {
        // Fine beyond the high x face: nodes there move back along x.
        let half = Around::new(&corner(0b0101_0101), 0);
        assert_eq!(half.node_move([2, 1, 1]), [-1, 0, 0]);
        assert_eq!(half.node_move([2, 2, 2]), [-1, 0, 0]);
        assert_eq!(half.node_move([1, 2, 1]), [0, 0, 0]);
        assert_eq!(half.finer, 1 << 1);
        // Coarse and fine alternate around the edge along z: the coarse blocks share their edge, the fine ones do not.
        let blocks = corner(0b1001_1001);
        assert_eq!(Around::new(&blocks, 0).node_move([2, 2, 1]), [0, 0, 0]);
        assert_eq!(Around::new(&blocks, 0).owner(2, [2, 2]), offset_index([1, 1, 0]));
        assert_eq!(Around::new(&blocks, 1).owner(2, [0, 2]), SELF);
        assert_eq!(Around::new(&blocks, 2).owner(2, [2, 0]), SELF);
    }
}
