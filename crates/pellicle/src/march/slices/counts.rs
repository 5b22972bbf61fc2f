//! What marching amounted to: counts, bytes, and times by the caller's clock.
//!
//! Source: this project; memory is split as in Rosenberg & Birdwell 2008, figure 7.

/// Counts of one block, or of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Counts {
    /// Crossed cubes that made triangles.
    pub cubes: u64,
    /// Cubes visited, those of margins included.
    pub visited: u64,
    /// Corners whose value was computed.
    pub corners: u64,
    /// Corners whose normal or user data was computed.
    pub shaded: u64,
    /// Particles that were summed at corners: exactly those within reach. Not counted by a complete search, whose lanes
    /// are corners: there particles out of reach of a corner are added to it as exactly zero.
    pub contributions: u64,
    /// Entries of columns that were looked at for that; for a complete search, pairs of a corner and an entry of its
    /// brick's list.
    pub looked_at: u64,
    /// Entries in columns, or in lists of bricks.
    pub entries: u64,
    /// Cubes that particles' seeds pointed at.
    pub seeds: u64,
    /// Most slices alive at once in a block.
    pub live_slices: u64,
    /// Most bytes of slices and lists of cubes in a block: what each thread needs of them, however many blocks there are. By
    /// a complete search of blocks of X × Y × Z cubes at most 2,304 bytes for each of the ⌈(X+1)/4⌉·⌈(Y+1)/4⌉ bricks of a
    /// layer, 20 for each of its (X+1)·(Y+1) nodes, and 16 KiB; 128 times the size of the user's data of a corner for each
    /// brick on top.
    pub render_bytes: u64,
    /// Most bytes of the particle look-up in a block, for each thread, too. It grows with the particles that reach the fullest
    /// block, not with all there are: by a complete search at most 100 bytes and 9 for each of the
    /// (⌊R/2S⌋ + 2)² bricks of a layer that a particle can reach, and 200 for each brick there is, and 2 KiB.
    pub cache_bytes: u64,
}

impl Counts {
    /// Adds another block's counts; of what is a maximum the larger is kept.
    pub(crate) fn add(&mut self, other: &Self) {
        self.cubes += other.cubes;
        self.visited += other.visited;
        self.corners += other.corners;
        self.shaded += other.shaded;
        self.contributions += other.contributions;
        self.looked_at += other.looked_at;
        self.entries += other.entries;
        self.seeds += other.seeds;
        self.live_slices = self.live_slices.max(other.live_slices);
        self.render_bytes = self.render_bytes.max(other.render_bytes);
        self.cache_bytes = self.cache_bytes.max(other.cache_bytes);
    }
}

/// Tells the time since some fixed moment in nanoseconds. The library has no clock of its own.
pub type Clock = fn() -> u64;

/// Nanoseconds of each stage; all zero without a clock. Stages of blocks are summed over all threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Times {
    /// Particles are put on the lattice, for the SPH field weighed as well.
    pub place: u64,
    /// The world is cut into blocks.
    pub cut: u64,
    /// Blocks enter their particles into columns, or into lists of bricks.
    pub enter: u64,
    /// Blocks find the sides of all corners, or step down from particles.
    pub seed: u64,
    /// Blocks are marched: vertices and triangles.
    pub march: u64,
    /// All of the blocks' work and the writing, as it passes for the caller.
    pub surface: u64,
}

impl Times {
    /// Adds a block's.
    pub(crate) fn add(&mut self, block: &Self) {
        self.enter += block.enter;
        self.seed += block.seed;
        self.march += block.march;
    }
}

/// Measures one stage after another.
pub(crate) struct Lap {
    clock: Option<Clock>,
    last: u64,
}

impl Lap {
    pub(crate) fn new(clock: Option<Clock>) -> Self {
        Self { clock, last: clock.map_or(0, |clock| clock()) }
    }

    /// Time since the last call.
    pub(crate) fn next(&mut self) -> u64 {
        let now = self.clock.map_or(0, |clock| clock());
        now.saturating_sub(std::mem::replace(&mut self.last, now))
    }
}
