//! Clusters of every node by itself: which crossings belong to it, and where their common vertex lies.
//!
//! A crossing belongs to the end of its edge that is nearer, the inside one where it is half way. Of the crossings of a
//! node those are its cluster that are one piece without holes, the largest if there are several.
//!
//! The vertex is the mean of the cluster's crossings, moved along the gradient that fits the 14 differences best, so that it
//! lies on the surface of plain tetrahedra again, from which the mean of points of a curved surface has strayed.
//!
//! At a closed border, and beside absent samples, only crossings that lie on the border share a vertex, so that it stays
//! there. Nodes on an open border have no clusters.
//!
//! Source: Treece, Prager, Gee, Regularised marching tetrahedra: improved iso-surface extraction, 1999, who take the mean;
//! the move is this project's.

use rayon::prelude::*;

use super::{
    count::{GROUP, NONE, Signs},
    crossing::{Crossing, refine},
    source::{ABSENT, Source},
    star::{ALL, BLOCK, IN_BLOCK, NEIGHBOURS, SIDE, STEPS, block_index, is_connected, neighbour_at, piece, step},
};
use crate::{Control, math::bits::ones};

/// Longest move onto the surface of plain tetrahedra, in units of cells; the mean of a longer one stays where it is.
const LONGEST_MOVE: f64 = 0.25;

/// For each node of a brick, by site: the neighbours to which it claims the crossing. A node with one has a cluster.
pub(super) type Masks = [[u16; 64]; 2];

/// Bricks where something is crossed, or near one.
pub(super) struct Mixed {
    /// For each brick of the source its number here, or [`NONE`].
    pub(super) slots: Vec<u32>,
    pub(super) bricks: Vec<usize>,
    pub(super) masks: Vec<Masks>,
    /// Of each brick the nodes that had a cluster at first, and the places of their vertices, by site and cell.
    pub(super) places: Vec<Places>,
}

pub(super) type Places = ([u64; 2], Vec<[f64; 3]>);

impl Mixed {
    /// The numbers of a brick and of all around it: index 1 + d along each axis.
    pub(super) fn around(&self, source: &dyn Source, brick: usize) -> [Option<u32>; 27] {
        around(source, brick).map(|other| other.map(|other| self.slots[other]).filter(|&slot| slot != NONE))
    }
}

/// A brick and all around it: index 1 + d along each axis.
pub(super) fn around(source: &dyn Source, brick: usize) -> [Option<usize>; 27] {
    std::array::from_fn(|i| {
        let d = [i % 3, i / 3 % 3, i / 9].map(|v| v as i32 - 1);
        if d == [0; 3] { Some(brick) } else { source.neighbour(brick, d) }
    })
}

/// Which brick around a brick a node lies in, given by its cell counted from the brick's first, and its number there.
#[inline(always)]
pub(super) fn locate(at: [i32; 3]) -> (usize, usize) {
    let [x, y, z] = at.map(|v| ((v >> 2) + 1) as usize);
    let [i, j, k] = at.map(|v| (v & 3) as usize);
    (x + 3 * (y + 3 * z), i + 4 * (j + 4 * k))
}

/// The cell with this number in a brick.
#[inline(always)]
pub(super) fn cell_at(cell: usize) -> [i32; 3] {
    [cell & 3, cell >> 2 & 3, cell >> 4].map(|v| v as i32)
}

/// The cluster of every node by itself.
pub(super) fn choose(source: &dyn Source, signs: &Signs<2>, control: &Control<'_>) -> Mixed {
    let groups = (0..source.bricks().div_ceil(GROUP)).into_par_iter();
    let found: Vec<Vec<(usize, Masks, Places)>> = groups
        .map(|group| {
            let mut blocks = [[0.0; BLOCK]; 2];
            (group * GROUP..source.bricks().min((group + 1) * GROUP))
                .filter(|&brick| control.check().is_ok() && is_mixed(source, signs, brick))
                .map(|brick| {
                    let (masks, places) = clusters_of(source, signs, brick, &mut blocks);
                    (brick, masks, places)
                })
                .collect()
        })
        .collect();
    let mut mixed =
        Mixed { slots: vec![NONE; source.bricks()], bricks: Vec::new(), masks: Vec::new(), places: Vec::new() };
    for (brick, masks, places) in found.into_iter().flatten() {
        mixed.slots[brick] = mixed.bricks.len() as u32;
        mixed.bricks.push(brick);
        mixed.masks.push(masks);
        mixed.places.push(places);
    }
    mixed
}

/// Whether a brick or any around it has both signs.
fn is_mixed(source: &dyn Source, signs: &Signs<2>, brick: usize) -> bool {
    let sets = around(source, brick).into_iter().flatten().flat_map(|other| signs.inside[other]);
    let (any, all) = sets.fold((0, u64::MAX), |(any, all), set| (any | set, all & set));
    any != 0 && all != u64::MAX
}

/// Signs of a brick's nodes and their neighbours, as [`SIDE`] has them: 0 outside, 1 inside, [`UNKNOWN`] where there is no
/// brick. There all is of the sign of what touches it.
fn sign_blocks(signs: &Signs<2>, around: &[Option<usize>; 27]) -> [[u8; BLOCK]; 2] {
    let mut blocks = [[UNKNOWN; BLOCK]; 2];
    for n in 0..BLOCK {
        let (index, cell) = locate([n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)].map(|v| v as i32 - 1));
        if let Some(brick) = around[index] {
            for site in 0..2 {
                blocks[site][n] = (signs.inside[brick][site] >> cell & 1) as u8;
            }
        }
    }
    blocks
}

const UNKNOWN: u8 = 2;

fn clusters_of(source: &dyn Source, signs: &Signs<2>, brick: usize, blocks: &mut [[f64; BLOCK]; 2]) -> (Masks, Places) {
    let (mut masks, mut nodes, mut clusters, mut crossings) = ([[0; 64]; 2], [0; 2], Vec::new(), Vec::new());
    let (first, signs) = (source.first(brick), sign_blocks(signs, &around(source, brick)));
    let is_any = |sign: u8| signs.iter().flatten().any(|&s| s == sign);
    if !(is_any(0) && is_any(1)) {
        return (masks, (nodes, Vec::new()));
    }
    for (site, block) in blocks.iter_mut().enumerate() {
        source.values(brick, site, -1, SIDE, block);
    }
    for site in 0..2 {
        for cell in 0..64 {
            let at = cell_at(cell);
            let world = std::array::from_fn(|a| first[a] + at[a]);
            let index = block_index(at);
            let (mut own, mut other) = (Own { value: blocks[site][index], values: [0.0; NEIGHBOURS] }, 0);
            for (k, (site_there, further)) in IN_BLOCK[site].into_iter().enumerate() {
                let there = index.wrapping_add_signed(further);
                own.values[k] = blocks[site_there][there];
                // 0 and 1 make 1; nothing is the other of what is not known.
                other |= u32::from(signs[site][index] ^ signs[site_there][there] == 1) << k;
            }
            if other != 0
                && source.is_inner(site, world)
                && let Some(mask) = own.cluster(source, (site, world), other, &mut crossings)
            {
                masks[site][cell] = mask as u16;
                nodes[site] |= 1 << cell;
                clusters.push((own, source.position(site, world), mask.count_ones() as usize));
            }
        }
    }
    refine(source, &mut crossings);
    let mut places = Vec::with_capacity(clusters.len());
    let mut rest = &crossings[..];
    for (_, _, count) in &clusters {
        let (of_cluster, others) = rest.split_at(*count);
        places.push(mean(of_cluster));
        rest = others;
    }
    onto_surface(source, &clusters, &mut places);
    (masks, (nodes, places))
}

fn mean(crossings: &[Crossing]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for place in crossings.iter().map(Crossing::place) {
        for a in 0..3 {
            sum[a] += place[a];
        }
    }
    sum.map(|v| v / crossings.len() as f64)
}

/// Moves the means of clusters, given with their nodes' values and places, onto the surface: the function's own where it can
/// be asked, else that of plain tetrahedra.
fn onto_surface(source: &dyn Source, clusters: &[(Own, [f64; 3], usize)], places: &mut [[f64; 3]]) {
    let from = |own: [f64; 3], place: [f64; 3]| std::array::from_fn(|a| place[a] - own[a]);
    if !source.is_anywhere() {
        for ((own, at, _), place) in clusters.iter().zip(places) {
            let by = own.newton(own.interpolated(from(*at, *place)));
            add(place, by);
        }
        return;
    }
    // A step along the gradient, and a second one by what the first has brought.
    let mut values = vec![0.0; places.len()];
    source.values_at(places, &mut values);
    let steps: Vec<[f64; 3]> = clusters.iter().zip(&values).map(|((own, ..), &value)| own.newton(value)).collect();
    let there: Vec<[f64; 3]> = places.iter().zip(&steps).map(|(p, by)| std::array::from_fn(|a| p[a] + by[a])).collect();
    let mut left = vec![0.0; places.len()];
    source.values_at(&there, &mut left);
    for ((place, by), (value, left)) in places.iter_mut().zip(steps).zip(values.into_iter().zip(left)) {
        let part = value / (value - left);
        add(place, if (0.0..=2.0).contains(&part) { by.map(|v| part * v) } else { by });
    }
}

fn add(to: &mut [f64; 3], by: [f64; 3]) {
    for a in 0..3 {
        to[a] += by[a];
    }
}

/// Values of a node and of its neighbours.
struct Own {
    value: f64,
    values: [f64; NEIGHBOURS],
}

impl Own {
    /// Chooses the crossings of a node's cluster among those of its edges, to its `other` neighbours, and appends them.
    fn cluster(
        &self,
        source: &dyn Source,
        (site, cell): (usize, [i32; 3]),
        other: u32,
        crossings: &mut Vec<Crossing>,
    ) -> Option<u32> {
        let own = (site, source.position(site, cell), self.value);
        if own.2 == ABSENT {
            return None;
        }
        let crossing = |k: usize| {
            let (site, d) = step(site, k);
            let place = source.position(site, std::array::from_fn(|a| cell[a] + d[a]));
            Crossing::between(source, own, (site, place, self.values[k]))
        };
        let (mut near, mut absent) = (0, 0);
        for k in ones(other.into()) {
            absent |= u32::from(self.values[k] == ABSENT) << k;
            // Both ends decide from the same number.
            near |= u32::from((crossing(k).along() <= 0.5) == (self.value > 0.0)) << k;
        }
        let mask = largest_disc(if absent == 0 { near } else { absent & near })?;
        crossings.extend(ones(mask.into()).map(crossing));
        Some(mask)
    }

    /// The step along the gradient from a place with this value to where it is 0; none where that cannot be told, or is far.
    fn newton(&self, value: f64) -> [f64; 3] {
        // Least squares: the sum of the steps' outer products is 4 times the unit matrix.
        let mut gradient = [0.0; 3];
        for (step, v) in STEPS.iter().zip(self.values) {
            for a in 0..3 {
                gradient[a] += 0.125 * f64::from(step[a]) * (v - self.value);
            }
        }
        let size = gradient.iter().map(|g| g * g).sum::<f64>();
        let by = gradient.map(|g| -value * g / size);
        let length_sq = by.iter().map(|v| v * v).sum::<f64>();
        // Written so that what is not a number fails.
        if length_sq <= LONGEST_MOVE * LONGEST_MOVE { by } else { [0.0; 3] }
    }

    /// Value at a place, counted from the node, of the interpolant that is linear in each tetrahedron around it; not a number
    /// beyond these.
    fn interpolated(&self, [x, y, z]: [f64; 3]) -> f64 {
        // On these axes tetrahedra are the orders of the fractional parts, see `sheared`.
        let sheared = [y + z, x + z, x + y];
        let mut node = sheared.map(f64::floor);
        let mut parts: [(f64, usize); 3] = std::array::from_fn(|a| (sheared[a] - node[a], a));
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let [f, g, h] = parts.map(|part| part.0);
        let (mut sum, mut next) = (0.0, parts.iter());
        for weight in [1.0 - f, f - g, g - h, h] {
            let [i, j, k] = node.map(|v| v as i32);
            let value = match neighbour_at([j + k - i, i + k - j, i + j - k]) {
                Some(k) => self.values[k],
                None if node == [0.0; 3] => self.value,
                None => f64::NAN,
            };
            sum += if weight == 0.0 { 0.0 } else { weight * value };
            if let Some(&(_, axis)) = next.next() {
                node[axis] += 1.0;
            }
        }
        sum
    }
}

/// The largest piece of a set of neighbours that has no hole; of several the first.
fn largest_disc(mut set: u32) -> Option<u32> {
    let mut best: Option<u32> = None;
    while set != 0 {
        let piece = piece(set);
        set &= !piece;
        if is_connected(!piece & ALL) && best.is_none_or(|best| best.count_ones() < piece.count_ones()) {
            best = Some(piece);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A node with the values of a function of the place, counted from it.
    fn node(f: impl Fn([f64; 3]) -> f64) -> Own {
        Own { value: f([0.0; 3]), values: STEPS.map(|s| f(s.map(|v| 0.5 * f64::from(v)))) }
    }

    /// Neighbours whose value is above 0.
    fn inside(own: &Own) -> u32 {
        (0..NEIGHBOURS).fold(0, |set, k| set | u32::from(own.values[k] > 0.0) << k)
    }

    #[test]
    fn between_nodes_it_is_linear() {
        let linear = |p: [f64; 3]| 0.3 - 0.7 * p[0] + 0.2 * p[1] - 0.45 * p[2];
        let own = node(linear);
        for p in [[0.1, 0.2, -0.3], [0.25, -0.25, 0.4], [-0.4, 0.0, 0.0], [0.0, 0.0, 0.5], [0.5, 0.5, 0.5]] {
            assert!((own.interpolated(p) - linear(p)).abs() < 1e-15, "{p:?}");
        }
        assert!(own.interpolated([0.9, 0.9, 0.9]).is_nan(), "beyond its tetrahedra");
        // One neighbour alone has a value: what is left of it half way to it.
        for (k, step) in STEPS.iter().enumerate() {
            let mut values = [0.0; NEIGHBOURS];
            values[k] = 2.0;
            let own = Own { value: 0.0, values };
            assert!((own.interpolated(step.map(|v| 0.25 * f64::from(v))) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_step_leads_to_the_surface_of_plain_tetrahedra() {
        let own = node(|p| 0.2 - p[2] - 0.3 * (p[0] * p[0] + p[1] * p[1]));
        let mean = [0.05, -0.02, 0.1];
        let by = own.newton(own.interpolated(mean));
        let moved = std::array::from_fn(|a| mean[a] + by[a]);
        assert!(own.interpolated(moved).abs() < 0.1 * own.interpolated(mean).abs());
        let far = node(|p| 5.0 - p[2]);
        assert_eq!(far.newton(5.0), [0.0; 3], "not that far");
        assert_eq!(far.newton(f64::NAN), [0.0; 3]);
    }

    #[test]
    fn of_several_pieces_the_largest_is_taken_and_none_with_a_hole() {
        assert_eq!(largest_disc(0), None);
        assert_eq!(largest_disc(ALL), None, "a sphere");
        assert_eq!(largest_disc(0b11), Some(0b01));
        let ring = !inside(&node(|p| 0.4 - p[0].hypot(p[1]))) & ALL;
        assert_eq!(largest_disc(ring), None, "a ring");
        let sheet = inside(&node(|p| p[2] - 0.1));
        assert_eq!(largest_disc(sheet), Some(sheet));
    }
}
