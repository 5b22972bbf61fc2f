//! Approach 3: the surface followed without bounds, with hash maps for corners and for the cells of particles.
//!
//! What helps it: a hash of one multiplication, particles stored contiguously cell by cell, the cells around the last corner
//! kept, so that the next corner in the same cell needs no lookup, and corners of a neighbour that are this cube's, too, are
//! not looked up again to know whether it was visited.
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7, approach 3.

use std::collections::hash_map::Entry;

use pellicle::internals::Unit;
use rustc_hash::FxHashMap;

use super::corner::{Corner, LEAVES, case_of, polygonize};
use super::near::{Particles, Sum};
use super::{Approach, Output, Task, held};

/// The approach with its memory.
pub struct Hashed {
    task: Task,
    unit: Unit,
    cells: Cells,
    places: FxHashMap<u64, u32>,
    corners: Vec<Corner>,
    todo: Vec<Cube>,
}

/// A cube to visit.
#[derive(Clone, Copy)]
struct Cube {
    low: [i32; 3],
    /// Its lowest corner where it is known, else [`UNKNOWN`].
    corner: u32,
}

const UNKNOWN: u32 = u32::MAX;

/// Particles sorted into cells that a hash map finds.
struct Cells {
    particles: Particles,
    /// The inverse of a cell's edge, and from a cell to those that can hold a neighbour, in each direction.
    inverse: f32,
    reach: i32,
    /// First particle of each cell, and the one after the last.
    ranges: FxHashMap<u64, [u32; 2]>,
    keys: Vec<u64>,
    /// What is around the last cell asked for.
    last: u64,
    around: Vec<[u32; 2]>,
}

/// A key for three coordinates of 21 bits each.
#[inline(always)]
fn key([x, y, z]: [i32; 3]) -> u64 {
    let part = |v: i32| (v as u64) & 0x1f_ffff;
    part(x) | part(y) << 21 | part(z) << 42
}

impl Cells {
    fn new(edge: f64, support: f64) -> Self {
        let reach = (support / edge).ceil() as i32;
        Self {
            particles: Particles::default(),
            inverse: (support / edge) as f32,
            reach,
            ranges: FxHashMap::default(),
            keys: Vec::new(),
            last: u64::MAX,
            around: Vec::new(),
        }
    }

    fn cell(&self, at: [f32; 3]) -> [i32; 3] {
        // Rounds down without a call: the baseline of x86-64 has no instruction for it.
        let down = |x: f32| {
            let part = (x * self.inverse) as i32;
            part - i32::from(part as f32 > x * self.inverse)
        };
        [down(at[0]), down(at[1]), down(at[2])]
    }

    fn build(&mut self, positions: &[[f32; 3]], scale: f32) {
        self.ranges.clear();
        self.keys.clear();
        self.last = u64::MAX;
        for position in positions {
            let key = key(self.cell(position.map(|x| x * scale)));
            self.keys.push(key);
            self.ranges.entry(key).or_insert([0; 2])[1] += 1;
        }
        let mut first = 0;
        for range in self.ranges.values_mut() {
            let count = range[1];
            *range = [first; 2];
            first += count;
        }
        self.particles.resize(positions.len());
        for (position, key) in positions.iter().zip(&self.keys) {
            if let Some(range) = self.ranges.get_mut(key) {
                self.particles.set(range[1] as usize, position.map(|x| x * scale));
                range[1] += 1;
            }
        }
    }

    /// Value and outward normal at a place, in units of the support.
    fn sum(&mut self, unit: Unit, at: [f32; 3]) -> [f32; 4] {
        let cell = self.cell(at);
        let asked = key(cell);
        if asked != self.last {
            self.last = asked;
            self.around.clear();
            for dz in -self.reach..=self.reach {
                for dy in -self.reach..=self.reach {
                    for dx in -self.reach..=self.reach {
                        if let Some(&range) = self.ranges.get(&key([cell[0] + dx, cell[1] + dy, cell[2] + dz])) {
                            self.around.push(range);
                        }
                    }
                }
            }
        }
        unit.run(Sum { particles: &self.particles, runs: &self.around, at })
    }
}

impl Hashed {
    /// Of particles in cells of `cell` supports.
    pub fn new(task: Task, unit: Unit, cell: f64) -> Self {
        Self {
            task,
            unit,
            cells: Cells::new(cell * task.support, task.support),
            places: FxHashMap::default(),
            corners: Vec::new(),
            todo: Vec::new(),
        }
    }

    fn corner(&mut self, node: [i32; 3]) -> u32 {
        let Self { places, corners, cells, task, unit, .. } = self;
        match places.entry(key(node)) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(place) => {
                let step = (task.spacing / task.support) as f32;
                corners.push(Corner::new(cells.sum(*unit, node.map(|i| i as f32 * step)), 0));
                *place.insert(corners.len() as u32 - 1)
            }
        }
    }

    /// The corners of a cube.
    fn corners_of(&mut self, cube: Cube) -> [u32; 8] {
        let mut ids = [cube.corner; 8];
        for (c, id) in ids.iter_mut().enumerate() {
            if c > 0 || cube.corner == UNKNOWN {
                *id = self.corner(std::array::from_fn(|a| cube.low[a] + (c >> a & 1) as i32));
            }
        }
        ids
    }

    /// For each particle a cube that the surface passes through: the particle's own, or the first below. A walk ends where
    /// another came through before.
    fn seed(&mut self, positions: &[[f32; 3]]) {
        for position in positions {
            let mut low = position.map(|x| (f64::from(x) / self.task.spacing).floor() as i32);
            let mut corner = self.corner(low);
            if self.corners[corner as usize].value > self.task.iso {
                while self.corners[corner as usize].value > self.task.iso {
                    if std::mem::replace(&mut self.corners[corner as usize].walked, true) {
                        break;
                    }
                    low[2] -= 1;
                    corner = self.corner(low);
                }
                if self.corners[corner as usize].value <= self.task.iso {
                    self.todo.push(Cube { low, corner });
                }
            } else {
                let ids = self.corners_of(Cube { low, corner });
                if case_of(&self.corners, &ids, self.task.iso) != 0 {
                    self.todo.push(Cube { low, corner });
                }
            }
        }
    }

    fn drain(&mut self, out: &mut Output) {
        let (spacing, iso) = (self.task.spacing as f32, self.task.iso);
        while let Some(cube) = self.todo.pop() {
            if cube.corner != UNKNOWN && self.corners[cube.corner as usize].done {
                continue;
            }
            let first = if cube.corner == UNKNOWN { self.corner(cube.low) } else { cube.corner };
            if std::mem::replace(&mut self.corners[first as usize].done, true) {
                continue;
            }
            let ids = self.corners_of(Cube { corner: first, ..cube });
            let case = case_of(&self.corners, &ids, iso);
            if LEAVES[case] == 0 {
                continue;
            }
            polygonize(&mut self.corners, &ids, case, cube.low.map(|i| i as f32 * spacing), spacing, iso, out);
            for axis in 0..3 {
                if LEAVES[case] >> (2 * axis) & 1 == 1 {
                    let mut low = cube.low;
                    low[axis] -= 1;
                    self.todo.push(Cube { low, corner: UNKNOWN });
                }
                let corner = ids[1 << axis];
                if LEAVES[case] >> (2 * axis + 1) & 1 == 1 && !self.corners[corner as usize].done {
                    let mut low = cube.low;
                    low[axis] += 1;
                    self.todo.push(Cube { low, corner });
                }
            }
        }
    }
}

impl Approach for Hashed {
    fn update(&mut self, positions: &[[f32; 3]], out: &mut Output) {
        out.start();
        self.places.clear();
        self.corners.clear();
        self.cells.build(positions, (1.0 / self.task.support) as f32);
        self.seed(positions);
        self.drain(out);
        out.corners = self.corners.len();
    }

    fn cache_bytes(&self) -> usize {
        let Cells { particles, ranges, keys, around, .. } = &self.cells;
        // A hash map of the standard library: a byte of control for each place beside the entry, 8/7 places an entry.
        let map = ranges.capacity() * 8 / 7 * (size_of::<(u64, [u32; 2])>() + 1);
        particles.held() + map + held(keys) + held(around)
    }
}
