//! What the work amounted to: counts only, no clocks.

/// Counts of one surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Stats {
    /// Particles handed in.
    pub particles: u64,
    /// Bricks of 4×4×4 nodes whose values were computed.
    pub bricks_filled: u64,
    /// Vertices of the surface.
    pub vertices: u64,
    /// Triangles of the surface.
    pub triangles: u64,
}
