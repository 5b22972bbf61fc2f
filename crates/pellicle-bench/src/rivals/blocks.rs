//! Approach 2: the surface followed block by block, with 3D arrays for corners and for the cells of particles.
//!
//! Where the surface leaves a block its cube is handed to the neighbour as a seed, as is a walk down from a particle. A
//! block that was done before is done again from a seed that it has not visited: along its faces it remembers where it was.
//! So nothing outside a block is evaluated, and blocks need no margin.
//!
//! What helps it: the array of corners holds numbers, not corners, and is cleared by the corners that were made; a cell's
//! particles are contiguous along x, so that a row of cells is one run, and runs around the last corner are kept for the next in the same cell; blocks come from the top, the way that walks go.
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7, approach 2.

use pellicle::internals::Unit;
use rustc_hash::FxHashMap;

use super::corner::{Corner, LEAVES, case_of, polygonize};
use super::near::{Particles, Sum};
use super::{Approach, Output, Task, held};

/// The approach with its memory.
pub struct Blocks {
    task: Task,
    /// Cubes along an edge of a block.
    size: i32,
    shares: Shares,
    grid: Grid,
    one: Block,
}

/// Which particles reach into which block.
#[derive(Default)]
struct Shares {
    numbers: FxHashMap<[i32; 3], u32>,
    blocks: Vec<Share>,
    particles: Vec<u32>,
    order: Vec<u32>,
}

struct Share {
    at: [i32; 3],
    /// Its particles among `particles`.
    first: u32,
    end: u32,
    /// Cubes to begin with, and nodes from which a walk goes down, relative to the block.
    seeds: Vec<Seed>,
    /// One bit a cube along the faces 2·axis + side, once the block is done.
    visited: Vec<u64>,
    is_done: bool,
}

#[derive(Clone, Copy)]
enum Seed {
    Cube { low: [i32; 3], face: usize },
    Walk { node: [i32; 3] },
}

/// Particles of one block sorted into a 3D array of cells, in units of the support and relative to the block's corner.
struct Grid {
    particles: Particles,
    /// The inverse of a cell's edge, and cells along an axis: the block and a support on each side.
    inverse: f32,
    count: i32,
    /// From a cell to those that can hold a neighbour.
    reach: i32,
    starts: Vec<u32>,
    cells: Vec<u32>,
    /// The cell asked for last, and the runs of particles around it.
    last: [i32; 3],
    runs: Vec<[u32; 2]>,
}

/// Corners of one block.
struct Block {
    unit: Unit,
    /// Nodes along an edge.
    nodes: usize,
    /// One more than the number of a node's corner, 0 for none.
    places: Vec<u32>,
    corners: Vec<Corner>,
    /// Lowest nodes of cubes.
    todo: Vec<[i32; 3]>,
}

impl Grid {
    fn new(cell: f64, block: f64) -> Self {
        let count = ((block + 2.0) / cell).ceil() as i32 + 1;
        Self {
            particles: Particles::default(),
            inverse: (1.0 / cell) as f32,
            count,
            reach: (1.0 / cell).ceil() as i32,
            starts: vec![0; (count * count * count) as usize + 1],
            cells: Vec::new(),
            last: [-1; 3],
            runs: Vec::new(),
        }
    }

    fn cell(&self, x: f32) -> i32 {
        (((x + 1.0) * self.inverse) as i32).clamp(0, self.count - 1)
    }

    fn build(&mut self, positions: impl Iterator<Item = [f32; 3]> + Clone) {
        let n = self.count;
        self.starts.fill(0);
        self.last = [-1; 3];
        self.cells.clear();
        for p in positions.clone() {
            let [x, y, z] = p.map(|x| self.cell(x));
            let cell = (x + n * (y + n * z)) as u32;
            self.cells.push(cell);
            self.starts[cell as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.particles.resize(self.cells.len());
        for (p, &cell) in positions.zip(&self.cells) {
            let start = &mut self.starts[cell as usize];
            *start -= 1;
            self.particles.set(*start as usize, p);
        }
    }

    /// Value and outward normal at a place.
    #[inline(always)]
    fn sum(&mut self, unit: Unit, at: [f32; 3]) -> [f32; 4] {
        let cell = [self.cell(at[0]), self.cell(at[1]), self.cell(at[2])];
        if cell != self.last {
            self.look_around(cell);
        }
        unit.run(Sum { particles: &self.particles, runs: &self.runs, at })
    }

    /// Finds the rows of cells that a place in `cell` can have neighbours in.
    #[inline(never)]
    fn look_around(&mut self, cell: [i32; 3]) {
        self.last = cell;
        self.runs.clear();
        let n = self.count;
        let around = |a: usize| [(cell[a] - self.reach).max(0), (cell[a] + self.reach).min(n - 1)];
        let [x, y, z] = [around(0), around(1), around(2)];
        for k in z[0]..=z[1] {
            for j in y[0]..=y[1] {
                let row = n * (j + n * k);
                let (first, end) = (self.starts[(row + x[0]) as usize], self.starts[(row + x[1]) as usize + 1]);
                if first < end {
                    self.runs.push([first, end]);
                }
            }
        }
    }
}

impl Shares {
    /// Hands every particle to the blocks that it reaches into, and its seed to the one it lies in.
    fn build(&mut self, positions: &[[f32; 3]], task: &Task, size: i32) {
        let block = task.spacing * f64::from(size);
        self.numbers.clear();
        self.blocks.clear();
        let block_of = |x: f64| (x / block).floor() as i32;
        let reached = |p: &[f32; 3]| {
            let [low, high] =
                [-1.0, 1.0].map(|side| p.map(|x| block_of(f64::from(x) + side * task.support * 1.000_001)));
            (low[2]..=high[2])
                .flat_map(move |z| (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| [x, y, z])))
        };
        for position in positions {
            for at in reached(position) {
                let number = *self.numbers.entry(at).or_insert(self.blocks.len() as u32) as usize;
                if number == self.blocks.len() {
                    self.blocks.push(Share {
                        at,
                        first: 0,
                        end: 0,
                        seeds: Vec::new(),
                        visited: Vec::new(),
                        is_done: false,
                    });
                }
                self.blocks[number].end += 1;
            }
            let node = position.map(|x| (f64::from(x) / task.spacing).floor() as i32);
            let at = node.map(|i| i.div_euclid(size));
            let number = self.numbers[&at] as usize;
            let node = std::array::from_fn(|a| node[a] - at[a] * size);
            self.blocks[number].seeds.push(Seed::Walk { node });
        }
        let mut first = 0;
        for share in &mut self.blocks {
            let count = share.end;
            (share.first, share.end) = (first, first);
            first += count;
        }
        self.particles.resize(first as usize, 0);
        for (i, position) in positions.iter().enumerate() {
            for at in reached(position) {
                let share = &mut self.blocks[self.numbers[&at] as usize];
                self.particles[share.end as usize] = i as u32;
                share.end += 1;
            }
        }
        self.order.clear();
        self.order.extend(0..self.blocks.len() as u32);
        // The last is taken first.
        self.order.sort_unstable_by_key(|&number| self.blocks[number as usize].at[2]);
    }

    /// Gives a seed to the block beyond a face. A block that is done and has not been there is taken up again.
    fn hand_over(&mut self, from: [i32; 3], size: i32, face: usize, seed: Seed) {
        let mut at = from;
        at[face / 2] += if face % 2 == 1 { 1 } else { -1 };
        // No block, no particle, no surface.
        let Some(&number) = self.numbers.get(&at) else { return };
        let share = &mut self.blocks[number as usize];
        if let Seed::Cube { low, face } = seed {
            let bit = face_bit(low, face, size);
            if share.visited.get(bit / 64).is_some_and(|bits| bits >> (bit % 64) & 1 == 1) {
                return;
            }
        }
        if share.is_done {
            share.is_done = false;
            self.order.push(number);
        }
        share.seeds.push(seed);
    }
}

/// The place of a cube among those along the faces.
fn face_bit(low: [i32; 3], face: usize, size: i32) -> usize {
    let (u, v) = (low[(face / 2 + 1) % 3], low[(face / 2 + 2) % 3]);
    face * (size * size) as usize + (u + v * size) as usize
}

impl Block {
    fn place(&self, [x, y, z]: [i32; 3]) -> usize {
        x as usize + self.nodes * (y as usize + self.nodes * z as usize)
    }

    fn corner(&mut self, grid: &mut Grid, place: usize, node: [i32; 3], step: f32) -> u32 {
        let known = self.places[place];
        if known != 0 {
            return known - 1;
        }
        self.corners.push(Corner::new(grid.sum(self.unit, node.map(|i| i as f32 * step)), place as u32));
        self.places[place] = self.corners.len() as u32;
        self.corners.len() as u32 - 1
    }

    fn corners_of(&mut self, grid: &mut Grid, low: [i32; 3], step: f32) -> [u32; 8] {
        let place = self.place(low);
        let mut ids = [0; 8];
        for (c, id) in ids.iter_mut().enumerate() {
            let [x, y, z] = [c & 1, c >> 1 & 1, c >> 2];
            let place = place + x + self.nodes * (y + self.nodes * z);
            *id = self.corner(grid, place, [low[0] + x as i32, low[1] + y as i32, low[2] + z as i32], step);
        }
        ids
    }

    fn clear(&mut self) {
        for corner in &self.corners {
            self.places[corner.place as usize] = 0;
        }
        self.corners.clear();
    }
}

impl Blocks {
    /// Of blocks of `size` cubes along an edge, and particles in cells of `cell` supports.
    pub fn new(task: Task, unit: Unit, size: usize, cell: f64) -> Self {
        let nodes = size + 1;
        Self {
            task,
            size: size as i32,
            shares: Shares::default(),
            grid: Grid::new(cell, size as f64 * task.spacing / task.support),
            one: Block { unit, nodes, places: vec![0; nodes * nodes * nodes], corners: Vec::new(), todo: Vec::new() },
        }
    }

    /// Turns the block's seeds into cubes to visit.
    fn seed(&mut self, number: usize, step: f32) {
        let seeds = std::mem::take(&mut self.shares.blocks[number].seeds);
        let at = self.shares.blocks[number].at;
        for seed in seeds {
            match seed {
                Seed::Cube { low, .. } => self.one.todo.push(low),
                Seed::Walk { node } => self.walk(at, node, step),
            }
        }
    }

    /// From a node down to the first that is outside; where that is at once, the cube above the node may still be crossed.
    fn walk(&mut self, at: [i32; 3], mut node: [i32; 3], step: f32) {
        let iso = self.task.iso;
        let mut id = self.one.corner(&mut self.grid, self.one.place(node), node, step);
        if self.one.corners[id as usize].value <= iso {
            let ids = self.one.corners_of(&mut self.grid, node, step);
            if case_of(&self.one.corners, &ids, iso) != 0 {
                self.one.todo.push(node);
            }
            return;
        }
        loop {
            if std::mem::replace(&mut self.one.corners[id as usize].walked, true) {
                return;
            }
            if node[2] == 0 {
                let seed = Seed::Walk { node: [node[0], node[1], self.size - 1] };
                // The node at the face is inside; the walk goes on one below it, where the cube has it as a corner.
                self.shares.hand_over(at, self.size, 4, seed);
                return;
            }
            node[2] -= 1;
            id = self.one.corner(&mut self.grid, self.one.place(node), node, step);
            if self.one.corners[id as usize].value <= iso {
                self.one.todo.push(node);
                return;
            }
        }
    }

    fn drain(&mut self, number: usize, step: f32, out: &mut Output) {
        let (spacing, iso, size) = (self.task.spacing as f32, self.task.iso, self.size);
        let at = self.shares.blocks[number].at;
        let mut visited = std::mem::take(&mut self.shares.blocks[number].visited);
        visited.resize((6 * size * size) as usize / 64 + 1, 0);
        while let Some(low) = self.one.todo.pop() {
            let known = self.one.places[self.one.place(low)];
            if known != 0 && self.one.corners[known as usize - 1].done {
                continue;
            }
            let ids = self.one.corners_of(&mut self.grid, low, step);
            self.one.corners[ids[0] as usize].done = true;
            for face in 0..6 {
                if low[face / 2] == if face % 2 == 1 { size - 1 } else { 0 } {
                    let bit = face_bit(low, face, size);
                    visited[bit / 64] |= 1 << (bit % 64);
                }
            }
            let case = case_of(&self.one.corners, &ids, iso);
            if LEAVES[case] == 0 {
                continue;
            }
            let world = std::array::from_fn(|a| (low[a] + at[a] * size) as f32 * spacing);
            polygonize(&mut self.one.corners, &ids, case, world, spacing, iso, out);
            let mut leaves = LEAVES[case];
            while leaves != 0 {
                let face = leaves.trailing_zeros() as usize;
                leaves &= leaves - 1;
                let (axis, up) = (face / 2, face % 2 == 1);
                let mut next = low;
                next[axis] += if up { 1 } else { -1 };
                if (0..size).contains(&next[axis]) {
                    let known = self.one.places[self.one.place(next)];
                    if known == 0 || !self.one.corners[known as usize - 1].done {
                        self.one.todo.push(next);
                    }
                } else {
                    next[axis] = if up { 0 } else { size - 1 };
                    self.shares.hand_over(at, size, face, Seed::Cube { low: next, face: face ^ 1 });
                }
            }
        }
        self.shares.blocks[number].visited = visited;
    }
}

impl Approach for Blocks {
    fn update(&mut self, positions: &[[f32; 3]], out: &mut Output) {
        out.start();
        let task = self.task;
        let (step, scale) = ((task.spacing / task.support) as f32, 1.0 / task.support);
        self.shares.build(positions, &task, self.size);
        while let Some(number) = self.shares.order.pop() {
            let number = number as usize;
            let share = &self.shares.blocks[number];
            let origin = share.at.map(|i| f64::from(i * self.size) * task.spacing);
            let members = &self.shares.particles[share.first as usize..share.end as usize];
            self.grid.build(members.iter().map(|&i| {
                let p = positions[i as usize];
                std::array::from_fn(|a| ((f64::from(p[a]) - origin[a]) * scale) as f32)
            }));
            self.seed(number, step);
            self.drain(number, step, out);
            out.corners += self.one.corners.len();
            self.one.clear();
            self.shares.blocks[number].is_done = true;
        }
    }

    fn cache_bytes(&self) -> usize {
        self.grid.particles.held() + held(&self.grid.starts) + held(&self.grid.cells) + held(&self.shares.particles)
    }
}
