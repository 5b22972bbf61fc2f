//! Particles sorted by the Z-index of their cells: the lookup of both rivals.
//!
//! The paper's *handlers*, pairs of particle and cell, are sorted by the cell's place on the Z-order curve; *startIndices* tell
//! where each cell begins. Here positions and columns move with them, so that a cell's particles are read in a row, and
//! the sort is a counting sort: cells are numbered anyway.
//!
//! Source: Akinci et al. 2012, section 4.1, equations 6 to 8; Ihmsen et al. 2011.

use pellicle::internals::{LANES, Particles};

/// Sorted particles. Sixteen beyond the last can be loaded.
#[derive(Debug, Default)]
pub struct Handlers {
    /// From the grid's first node, in supports.
    pub axes: [Vec<f32>; 3],
    pub columns: Vec<Vec<f32>>,
    /// Cells along each axis.
    pub cells: [usize; 3],
    /// Edge of a cell in supports.
    pub edge: f64,
    /// Where each cell begins, by Z-index; one more for the end.
    pub starts: Vec<u32>,
}

/// Place on the Z-order curve.
pub fn z_index(cell: [usize; 3]) -> usize {
    fn spread(v: usize) -> usize {
        let v = (v | v << 32) & 0x001f_0000_0000_ffff;
        let v = (v | v << 16) & 0x001f_0000_ff00_00ff;
        let v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
        let v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
        (v | v << 2) & 0x1249_2492_4924_9249
    }
    spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2
}

impl Handlers {
    /// Sorts particles, counted from `origin`, in supports, below all of them.
    pub fn new(particles: &Particles, origin: [f64; 3], edge: f64) -> Self {
        let n = particles.positions.len();
        let mut cells = [1; 3];
        let place = |p: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|a| p[a] - origin[a]) };
        let cell = |p: [f64; 3]| p.map(|v| (v / edge) as usize);
        for p in &particles.positions {
            let at = cell(place(p));
            (0..3).for_each(|a| cells[a] = cells[a].max(at[a] + 1));
        }
        let last = z_index(cells.map(|n| n - 1));
        let mut starts = vec![0u32; last + 2];
        let keys: Vec<u32> = particles.positions.iter().map(|p| z_index(cell(place(p))) as u32).collect();
        keys.iter().for_each(|&key| starts[key as usize + 1] += 1);
        (0..=last).for_each(|i| starts[i + 1] += starts[i]);
        let mut axes = [(); 3].map(|()| vec![0.0; n + LANES]);
        let mut columns: Vec<Vec<f32>> = particles.columns.iter().map(|_| vec![0.0; n + LANES]).collect();
        let mut next = starts.clone();
        for (i, (p, &key)) in particles.positions.iter().zip(&keys).enumerate() {
            let to = next[key as usize] as usize;
            next[key as usize] += 1;
            let p = place(p);
            (0..3).for_each(|a| axes[a][to] = p[a] as f32);
            for (column, from) in columns.iter_mut().zip(&particles.columns) {
                column[to] = from[i];
            }
        }
        Self { axes, columns, cells, edge, starts }
    }

    /// Particles of a cell.
    #[inline(always)]
    pub fn cell(&self, z_index: usize) -> std::ops::Range<usize> {
        self.starts[z_index] as usize..self.starts[z_index + 1] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_z_index_interleaves_bits() {
        for cell in [[0, 0, 0], [1, 2, 4], [7, 0, 5], [1000, 37, 513]] {
            let bits = (0..20).flat_map(|bit| (0..3).map(move |axis| (bit, axis)));
            let want = bits.fold(0, |z, (bit, axis)| z | (cell[axis] >> bit & 1) << (3 * bit + axis));
            assert_eq!(z_index(cell), want);
        }
    }

    #[test]
    fn every_particle_lies_in_its_cell() {
        let positions: Vec<[f64; 3]> =
            (0..500).map(|i| [i * 37 % 101, i * 53 % 97, i * i % 89].map(|v| f64::from(v) * 0.07 - 1.0)).collect();
        let columns = vec![(0..500).map(|i| i as f32).collect()];
        let particles = Particles { positions, columns, support: 1.0 };
        let handlers = Handlers::new(&particles, [-1.5; 3], 0.5);
        let mut seen = 0;
        for z in 0..handlers.cells[2] {
            for y in 0..handlers.cells[1] {
                for x in 0..handlers.cells[0] {
                    for i in handlers.cell(z_index([x, y, z])) {
                        let index = handlers.columns[0][i] as usize;
                        for a in 0..3 {
                            assert_eq!((handlers.axes[a][i] / 0.5) as usize, [x, y, z][a]);
                            let want = particles.positions[index][a] + 1.5;
                            assert!((f64::from(handlers.axes[a][i]) - want).abs() < 1e-6);
                        }
                        seen += 1;
                    }
                }
            }
        }
        assert_eq!(seen, 500);
    }
}
