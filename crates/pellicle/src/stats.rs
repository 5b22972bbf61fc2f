//! What the work amounted to: counts only, no clocks.

/// Counts of one surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Stats {
    /// Particles handed in.
    pub particles: u64,
    /// Bricks of 4×4×4 nodes whose values were computed.
    pub bricks_filled: u64,
    /// Those of them that own a crossed edge.
    pub bricks_crossed: u64,
    /// Surface particles, with [`Band::Paper`](crate::Band::Paper); else 0.
    pub surface_particles: u64,
    /// Nodes near them, with [`Band::Paper`](crate::Band::Paper); else 0. Those of the bricks filled that are not near are left out.
    pub surface_nodes: u64,
    /// Blocks whose values were computed apart to stay within the memory limit; 1 when all fitted at once.
    pub blocks: u64,
    /// Vertices of the surface.
    pub vertices: u64,
    /// Triangles of the surface.
    pub triangles: u64,
}
