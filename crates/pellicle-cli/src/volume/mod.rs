//! Volumes on the command line: which one of a file, where it lies, and which part of it.

pub mod statistics;

use std::path::Path;

use pellicle_io::{Grid, RawVolume, SampleType, VolumeFile, VolumeHeader, VolumeOptions, open_volume};

use crate::args::{EndianArg, VolumeArgs};
use crate::choose::crop::Crop;
use crate::failure::Failure;

/// How volumes are read, and what is kept of them.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// What the reader is told.
    pub read: VolumeOptions,
    /// Instead of the file's.
    pub spacing: Option<[f64; 3]>,
    /// Instead of the file's.
    pub origin: Option<[f64; 3]>,
    /// Factor of all lengths.
    pub scale: Option<f64>,
    /// A box in the world.
    pub crop: Option<Crop>,
}

impl Selection {
    /// As meant.
    pub fn new(args: &VolumeArgs, array: Option<&String>, step: Option<usize>) -> Self {
        let raw = args.dims.map(|[x, y, z, components]| RawVolume {
            dims: [x, y, z],
            kind: args.kind.unwrap_or(SampleType::F32),
            components: components as usize,
            big_endian: args.endian == Some(EndianArg::Big),
            skip: args.skip.unwrap_or(0),
        });
        let read = VolumeOptions {
            array: array.cloned(),
            component: args.component,
            frame: step.unwrap_or(0),
            axes: args.axes.map(Into::into).unwrap_or_default(),
            raw,
            // Memory is limited elsewhere, by what there is; a mask may shrink a thousandfold.
            inflated_limit: Some(crate::machine::available_memory().unwrap_or(u64::MAX)),
        };
        Self { read, spacing: args.spacing, origin: args.origin, scale: None, crop: None }
    }

    /// Opens a file; its header tells the grid as it is meant.
    pub fn open(&self, path: &Path) -> Result<VolumeFile, Failure> {
        let mut file = open_volume(path, &self.read)?;
        file.set_grid(self.grid(file.header().grid))?;
        Ok(file)
    }

    fn grid(&self, mut grid: Grid) -> Grid {
        if let Some(wanted) = self.spacing {
            let found = grid.spacing();
            for axis in 0..3 {
                grid.steps[axis] = grid.steps[axis].map(|x| x / found[axis] * wanted[axis]);
            }
        }
        grid.origin = self.origin.unwrap_or(grid.origin);
        if let Some(factor) = self.scale {
            grid.origin = grid.origin.map(|x| x * factor);
            grid.steps = grid.steps.map(|step| step.map(|x| x * factor));
        }
        grid
    }

    /// The part of a volume that is kept.
    pub fn block(&self, header: &VolumeHeader, path: &Path) -> Result<Block, Failure> {
        let whole = Block { first: [0; 3], dims: header.dims };
        match &self.crop {
            None => Ok(whole),
            Some(crop) => whole.within(&header.grid, crop).map_err(|what| Failure::file(path, what)),
        }
    }
}

/// A part of a volume: samples from `first` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    /// The first sample.
    pub first: [usize; 3],
    /// How many along each axis.
    pub dims: [usize; 3],
}

impl Block {
    /// Where the block begins in the world.
    pub fn origin(&self, grid: &Grid) -> [f64; 3] {
        grid.point(self.first.map(|n| n as f64))
    }

    /// The samples in a box of the world. Where the axes are oblique it is the smallest block with all of those samples.
    fn within(self, grid: &Grid, crop: &Crop) -> Result<Self, String> {
        let last = self.dims.map(|n| n as f64 - 1.0);
        let corner = |n: usize, low: [f64; 3], high: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|axis| if n >> axis & 1 == 0 { low[axis] } else { high[axis] })
        };
        // The box of the volume, so that open sides end somewhere.
        let corners = (0..8).map(|n| grid.point(corner(n, [0.0; 3], last)));
        let [mut low, mut high] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for point in corners {
            low = std::array::from_fn(|axis| low[axis].min(point[axis]));
            high = std::array::from_fn(|axis| high[axis].max(point[axis]));
        }
        let [min, max] = crop.corners();
        let shown = format!("the volume reaches from {low:?} to {high:?}");
        let (low, high): ([f64; 3], [f64; 3]) = (
            std::array::from_fn(|axis| low[axis].max(min[axis])),
            std::array::from_fn(|axis| high[axis].min(max[axis])),
        );
        let mut indices = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        if (0..3).all(|axis| low[axis] <= high[axis]) {
            for n in 0..8 {
                let at = index(grid, corner(n, low, high));
                for axis in 0..3 {
                    indices[axis] = [indices[axis][0].min(at[axis]), indices[axis][1].max(at[axis])];
                }
            }
        }
        let mut block = self;
        for axis in 0..3 {
            // Samples on the faces of the box stay, whatever rounding makes of them.
            const ROUNDING: f64 = 1e-6;
            let first = (indices[axis][0] - ROUNDING).ceil().max(0.0);
            let end = (indices[axis][1] + ROUNDING).floor().min(last[axis]) + 1.0;
            if end - first < 2.0 || end.is_nan() {
                return Err(format!("--crop leaves fewer than 2 samples along an axis: {shown}"));
            }
            (block.first[axis], block.dims[axis]) = (first as usize, (end - first) as usize);
        }
        Ok(block)
    }
}

/// The index of a point, in fractions, by Cramer's rule.
fn index(grid: &Grid, point: [f64; 3]) -> [f64; 3] {
    let from: [f64; 3] = std::array::from_fn(|axis| point[axis] - grid.origin[axis]);
    std::array::from_fn(|axis| {
        let mut replaced = *grid;
        replaced.steps[axis] = from;
        replaced.determinant() / grid.determinant()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crop(min: &str, max: &str) -> Crop {
        Crop::parse(&[min, max]).unwrap()
    }

    #[test]
    fn boxes_become_blocks_along_flipped_and_swapped_axes() {
        let whole = Block { first: [0; 3], dims: [11, 21, 31] };
        let straight = Grid::new([0.0; 3], [0.1, 1.0, 1.0]);
        let block = whole.within(&straight, &crop("0.3,5,-", "0.7,-,12.5")).unwrap();
        assert_eq!(block, Block { first: [3, 5, 0], dims: [5, 16, 13] });
        // x runs backwards along the world's z, z along its x.
        let turned = Grid { origin: [0.0, 0.0, 10.0], steps: [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]] };
        let block = whole.within(&turned, &crop("2,-,7", "4,-,9")).unwrap();
        assert_eq!(block, Block { first: [1, 0, 2], dims: [3, 21, 3] });
        assert_eq!(block.origin(&turned), [2.0, 0.0, 9.0]);
        assert!(whole.within(&straight, &crop("0.3,5,-", "0.35,-,-")).unwrap_err().contains("fewer than 2"));
        assert!(whole.within(&straight, &crop("5,-,-", "6,-,-")).unwrap_err().contains("reaches from"));
    }

    #[test]
    fn an_oblique_block_holds_all_samples_of_the_box() {
        let whole = Block { first: [0; 3], dims: [20, 20, 20] };
        let grid = Grid { origin: [1.0, 2.0, 3.0], steps: [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.1, 1.0]] };
        let crop = crop("-2,8,6", "4,14,12");
        let block = whole.within(&grid, &crop).unwrap();
        assert!(block.dims.iter().any(|&n| n < 20));
        for n in 0..8000usize {
            let node = [n % 20, n / 20 % 20, n / 400];
            let is_kept = (0..3).all(|a| (block.first[a]..block.first[a] + block.dims[a]).contains(&node[a]));
            assert!(is_kept || !crop.contains(grid.point(node.map(|n| n as f64))), "{node:?}");
        }
    }

    #[test]
    fn the_grid_is_the_files_unless_told_otherwise_and_scales() {
        let file = Grid { origin: [1.0, 2.0, 3.0], steps: [[0.0, 2.0, 0.0], [-4.0, 0.0, 0.0], [0.0, 0.0, 1.0]] };
        let all = Selection {
            spacing: Some([1.0, 1.0, 0.5]),
            origin: Some([0.0, 0.0, 1.0]),
            scale: Some(10.0),
            ..Selection::default()
        };
        let expected = Grid { origin: [0.0, 0.0, 10.0], steps: [[0.0, 10.0, 0.0], [-10.0, 0.0, 0.0], [0.0, 0.0, 5.0]] };
        assert_eq!(all.grid(file), expected);
        assert_eq!(Selection::default().grid(file), file);
    }
}
