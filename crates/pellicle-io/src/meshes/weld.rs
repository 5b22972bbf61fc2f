//! Corners of triangles that each bring their own position become shared vertices: those whose positions are equal, number
//! by number. Nothing is moved and no distance is chosen, so a mesh that is closed in the file is closed in memory.
//!
//! Vertices are numbered as they first occur. The table holds vertex numbers only, 4 to 16 bytes a vertex.

/// A coordinate whose equality is that of its bits: 0 and -0 are one, NaN equals itself.
pub(super) trait Coordinate: Copy {
    /// Minus zero as zero.
    fn plain(self) -> Self;
    fn bits(self) -> u64;
}

impl Coordinate for f32 {
    fn plain(self) -> f32 {
        self + 0.0
    }

    fn bits(self) -> u64 {
        self.to_bits().into()
    }
}

impl Coordinate for f64 {
    fn plain(self) -> f64 {
        self + 0.0
    }

    fn bits(self) -> u64 {
        self.to_bits()
    }
}

/// A place in the table that is free.
const FREE: u32 = u32::MAX;

/// Vertices so far, and an open table to find one by its position.
pub(super) struct Welder<T> {
    pub(super) vertices: Vec<[T; 3]>,
    /// A power of two of places, at most half of them taken.
    table: Vec<u32>,
}

impl<T: Coordinate> Welder<T> {
    pub(super) fn new() -> Welder<T> {
        Welder { vertices: Vec::new(), table: vec![FREE; 64] }
    }

    /// The vertex at this position; `None` if there are more than 32 bits can number.
    pub(super) fn vertex(&mut self, position: [T; 3]) -> Option<u32> {
        let position = position.map(T::plain);
        if 2 * (self.vertices.len() + 1) > self.table.len() {
            self.grow();
        }
        let at = self.find(position);
        if self.table[at] == FREE {
            let number = u32::try_from(self.vertices.len()).ok().filter(|&number| number != FREE)?;
            self.table[at] = number;
            self.vertices.push(position);
        }
        Some(self.table[at])
    }

    /// The place of this position, or the free one where it belongs.
    fn find(&self, position: [T; 3]) -> usize {
        let bits = position.map(T::bits);
        let mask = self.table.len() - 1;
        let mut at = hash(bits) as usize & mask;
        loop {
            match self.table[at] {
                FREE => return at,
                number if self.vertices[number as usize].map(T::bits) == bits => return at,
                _ => at = (at + 1) & mask,
            }
        }
    }

    fn grow(&mut self) {
        self.table = vec![FREE; 2 * self.table.len()];
        for number in 0..self.vertices.len() {
            let at = self.find(self.vertices[number]);
            // It was numbered in 32 bits when it was pushed.
            self.table[at] = number as u32;
        }
    }
}

/// Mixes three numbers; the constants are those of splitmix64, by Sebastiano Vigna.
fn hash(bits: [u64; 3]) -> u64 {
    bits.into_iter().fold(0x9e37_79b9_7f4a_7c15, |state: u64, bits| {
        let mixed = (state ^ bits).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ (mixed >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb) ^ (mixed >> 32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_are_one_vertex_and_no_others() {
        let mut welder = Welder::new();
        for round in 0..2 {
            for i in 0..1000u32 {
                assert_eq!(welder.vertex([i as f32, -0.5, 0.0]), Some(i), "{round}");
            }
        }
        assert_eq!(welder.vertex([1.0, -0.5, -0.0]), Some(1));
        assert_eq!(welder.vertex([f32::NAN, 0.0, 0.0]), Some(1000));
        assert_eq!(welder.vertex([f32::NAN, 0.0, 0.0]), Some(1000));
        assert_eq!(welder.vertices.len(), 1001);
    }
}
