//! Approaches 2 and 3 of Rosenberg & Birdwell 2008: what marching slices is measured against.
//!
//! Both follow the surface from cube to cube. They use pellicle's own field, lanes and tables, so that what is compared is
//! the way of looking particles up and of keeping corners, and nothing else.
//!
//! ```text
//!                 corners                                particles
//! [`blocks`]   2  a 3D array of numbers for each block   sorted into a 3D array of cells for each block
//! [`hashed`]   3  a hash map                             sorted into cells that a hash map finds
//! ```
//!
//! Source: Rosenberg & Birdwell, "Real-time particle isosurface extraction", 2008, section 7; the surface is followed as in
//! Wyvill, McPheeters, Wyvill, "Data structure for soft objects", 1986.

pub mod blocks;
mod corner;
pub mod hashed;
mod near;
#[cfg(test)]
mod tests;

/// What the rivals are asked for: the mean of what a frame has in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// Edge of a cube.
    pub spacing: f64,
    /// Radius beyond which a particle's field is 0.
    pub support: f64,
    /// Isovalue.
    pub iso: f32,
}

/// Where a frame's mesh goes: memory that is there before the clock starts.
#[derive(Debug, Default)]
pub struct Output {
    /// Position and outward unit normal.
    pub vertices: Vec<[f32; 6]>,
    /// Three a triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
    /// Cubes that the surface passes through.
    pub cubes: usize,
    /// Corners whose field was evaluated.
    pub corners: usize,
}

impl Output {
    /// Empties it for the next frame; the memory stays.
    pub fn start(&mut self) {
        self.vertices.clear();
        self.indices.clear();
        (self.cubes, self.corners) = (0, 0);
    }
}

/// One of the approaches.
pub trait Approach {
    /// Makes the surface of a frame; every particle's strength is 1.
    fn update(&mut self, positions: &[[f32; 3]], out: &mut Output);

    /// Bytes that the lookup of particles holds.
    fn cache_bytes(&self) -> usize;
}

/// Bytes that a vector holds.
fn held<T>(v: &Vec<T>) -> usize {
    v.capacity() * size_of::<T>()
}
