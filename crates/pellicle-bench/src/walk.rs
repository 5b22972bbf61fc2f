//! The order in which cells are walked, and what a cache of samples makes of it: the talk's swizzled walk against our bricks.
//!
//! A lattice of 64³ cells is walked tetrahedron by tetrahedron, four samples each, as the talk's geometry shader does; a
//! first-in first-out cache of samples holds so many. Printed are samples evaluated a node of the lattice: 1 is the best,
//! and a walk without a cache has 24 for six tetrahedra a cell.
//!
//! Then the same with one request a cell for its eight corners, which is what our tables ask for.

/// Cells along an axis; a power of two.
const SIDE: usize = 64;
/// Sizes of the cache, in samples.
const CACHES: [usize; 7] = [16, 32, 64, 128, 512, 2048, 8192];

/// Coordinates of the cell at a place of the walk.
type Walk = fn(usize) -> [usize; 3];

/// See the module.
pub fn run(_: &[String]) -> Result<(), String> {
    let walks: [(&str, Walk); 3] =
        [("linear", linear), ("swizzled", swizzled), ("bricks of 4³, in Morton order", bricks)];
    for (what, corners) in [("tetrahedra, six a cell", &SIX[..]), ("cells", &CELL[..])] {
        println!("\n| {what}: walk | {} |", CACHES.map(|n| n.to_string()).join(" | "));
        println!("|---|{}", "--:|".repeat(CACHES.len()));
        for (name, walk) in walks {
            let misses = CACHES.map(|size| format!("{:.2}", misses_per_node(walk, corners, size)));
            println!("| {name} | {} |", misses.join(" | "));
        }
    }
    Ok(())
}

/// Corners of six tetrahedra around the main diagonal; bits are x, y, z.
const SIX: [usize; 24] = [0, 1, 3, 7, 0, 1, 5, 7, 0, 2, 3, 7, 0, 2, 6, 7, 0, 4, 5, 7, 0, 4, 6, 7];
const CELL: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

fn linear(n: usize) -> [usize; 3] {
    [n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)]
}

/// Every third bit of a number, from bit `first` on.
fn third(n: usize, first: usize) -> usize {
    (0..SIDE.ilog2() as usize).fold(0, |v, bit| v | (n >> (3 * bit + first) & 1) << bit)
}

fn swizzled(n: usize) -> [usize; 3] {
    [third(n, 0), third(n, 1), third(n, 2)]
}

fn bricks(n: usize) -> [usize; 3] {
    let (brick, cell) = (n / 64, n % 64);
    let inner = [cell % 4, cell / 4 % 4, cell / 16];
    [0, 1, 2].map(|a| 4 * third(brick, a) + inner[a])
}

fn misses_per_node(walk: fn(usize) -> [usize; 3], corners: &[usize], size: usize) -> f64 {
    let nodes = (SIDE + 1).pow(3);
    // When each node came in, counted in misses; it is out once `size` others have come.
    let mut came = vec![usize::MAX; nodes];
    let mut misses = 0usize;
    for n in 0..SIDE * SIDE * SIDE {
        let at = walk(n);
        for &c in corners {
            let [x, y, z] = [0, 1, 2].map(|a| at[a] + (c >> a & 1));
            let node = x + (SIDE + 1) * (y + (SIDE + 1) * z);
            if came[node] == usize::MAX || misses - came[node] > size {
                misses += 1;
                came[node] = misses;
            }
        }
    }
    misses as f64 / nodes as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_walk_visits_every_cell_once() {
        for walk in [linear, swizzled, bricks] {
            let mut seen = vec![false; SIDE * SIDE * SIDE];
            for n in 0..seen.len() {
                let [x, y, z] = walk(n);
                assert!(!std::mem::replace(&mut seen[x + SIDE * (y + SIDE * z)], true));
            }
        }
    }

    #[test]
    fn a_cache_of_everything_evaluates_every_node_once() {
        for walk in [linear, swizzled, bricks] {
            assert_eq!(misses_per_node(walk, &CELL, usize::MAX / 2), 1.0);
        }
    }
}
