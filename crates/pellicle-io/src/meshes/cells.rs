//! VTK's cells as triangles: which kinds bound a surface, and what to say about those that do not.

use std::collections::BTreeMap;

use super::assemble::push_polygon;

/// Triangles in the making, from cells of VTK's kinds.
pub(super) struct Cells {
    pub(super) triangles: Vec<[u32; 3]>,
    /// How many cells of which kind were found that cannot be read.
    refused: BTreeMap<i64, u64>,
}

/// The numbers of `vtkCellType.h`.
pub(super) const POLYGON: i64 = 7;
pub(super) const STRIP: i64 = 6;
const PIXEL: i64 = 8;

impl Cells {
    pub(super) fn new() -> Cells {
        Cells { triangles: Vec::new(), refused: BTreeMap::new() }
    }

    /// Takes in a cell, whose corners are counted among `vertices`. The error says what is wrong with it.
    pub(super) fn push(&mut self, kind: i64, corners: &[i64], vertices: u64) -> Result<(), String> {
        match kind {
            // Nothing, points and lines bound no surface.
            0..=4 => Ok(()),
            5 if corners.len() != 3 => Err(format!("a triangle has {} corners", corners.len())),
            9 | PIXEL if corners.len() != 4 => Err(format!("a quad has {} corners", corners.len())),
            5 | POLYGON | 9 => push_polygon(&mut self.triangles, corners, vertices),
            // Row by row instead of around.
            PIXEL => {
                let around = [corners[0], corners[1], corners[3], corners[2]];
                push_polygon(&mut self.triangles, &around, vertices)
            }
            STRIP => self.push_strip(corners, vertices),
            other => {
                *self.refused.entry(other).or_default() += 1;
                Ok(())
            }
        }
    }

    /// Every triangle of a strip shares an edge with the one before; every second one runs the other way round.
    fn push_strip(&mut self, corners: &[i64], vertices: u64) -> Result<(), String> {
        if corners.len() < 3 {
            return Err(format!("a triangle strip has {} corners, not three or more", corners.len()));
        }
        for (i, triangle) in corners.windows(3).enumerate() {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
            let triangle = if i % 2 == 0 { [a, b, c] } else { [b, a, c] };
            push_polygon(&mut self.triangles, &triangle, vertices)?;
        }
        Ok(())
    }

    /// What cannot be read, if there is any of it.
    pub(super) fn refusal(&self) -> Option<String> {
        if self.refused.is_empty() {
            return None;
        }
        let list: Vec<String> = self.refused.iter().map(|(&kind, count)| describe(kind, *count)).collect();
        Some(format!(
            "there are {}: of cells, triangles, quads, pixels, polygons and triangle strips are read. Save the surface \
             alone, in ParaView by Filters > Extract Surface",
            list.join(", ")
        ))
    }
}

fn describe(kind: i64, count: u64) -> String {
    let name = match kind {
        10 => "tetrahedra",
        11 => "voxels",
        12 => "hexahedra",
        13 => "wedges",
        14 => "pyramids",
        15 => "pentagonal prisms",
        16 => "hexagonal prisms",
        21 => "quadratic edges",
        22 => "quadratic triangles",
        23 => "quadratic quads",
        24 => "quadratic tetrahedra",
        25 => "quadratic hexahedra",
        36 => "quadratic polygons",
        42 => "polyhedra",
        68..=74 => "Lagrange cells",
        75..=81 => "Bézier cells",
        _ => "cells",
    };
    format!("{count} {name} (type {kind})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_pixels_keep_their_orientation() {
        let mut cells = Cells::new();
        cells.push(STRIP, &[0, 1, 2, 3, 4], 5).expect("a strip");
        assert_eq!(cells.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
        let mut cells = Cells::new();
        cells.push(PIXEL, &[0, 1, 2, 3], 4).expect("a pixel");
        assert_eq!(cells.triangles, [[0, 1, 3], [0, 3, 2]]);
        for (kind, corners) in [(5, &[0, 1][..]), (5, &[0, 1, 2, 3]), (PIXEL, &[0, 1, 2]), (STRIP, &[0, 1, 9])] {
            assert!(cells.push(kind, corners, 4).is_err());
        }
    }

    #[test]
    fn solids_are_counted_by_kind() {
        let mut cells = Cells::new();
        assert_eq!(cells.refusal(), None);
        for kind in [12, 10, 12, 3, 99] {
            cells.push(kind, &[0, 1], 2).expect("counted");
        }
        let said = cells.refusal().expect("there are solids");
        assert!(said.contains("1 tetrahedra (type 10), 2 hexahedra (type 12), 1 cells (type 99)"), "{said}");
    }
}
