//! Why a call failed, by cause: the caller's input, a limit, a cancellation.
//!
//! Every message names the element and the bound, and how to get past it. The core never panics on user data and never
//! prints; file errors live in `pellicle-io`.

/// What went wrong in the core.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is outside its range.
    #[error("{name} = {value}: must be {must}")]
    Parameter {
        /// The parameter, as named in [`Params`](crate::Params).
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range allowed.
        must: &'static str,
    },
    /// A particle's position is NaN or infinite.
    #[error("particle {index} has the position ({}, {}, {}), which is not finite: remove it, or let the reader drop invalid particles", .position[0], .position[1], .position[2])]
    NotFinite {
        /// Index of the particle in the caller's order, from 0.
        index: usize,
        /// The position as given.
        position: [f64; 3],
    },
    /// A particle lies outside the lattice: its node indices would not fit.
    #[error("particle {index} at ({}, {}, {}) lies {cells:.3e} cells from the lattice's origin, the limit is {limit:.3e}: use a larger cell, crop, or remove the stray particle", .position[0], .position[1], .position[2])]
    OutsideLattice {
        /// Index of the particle in the caller's order, from 0.
        index: usize,
        /// The position as given.
        position: [f64; 3],
        /// Its largest distance from the origin along an axis, in cells.
        cells: f64,
        /// The largest allowed.
        limit: f64,
    },
    /// A particle's own radius is no length.
    #[error("particle {index} has the radius {radius}: must be a finite number greater than 0")]
    Radius {
        /// Index of the particle in the caller's order, from 0.
        index: usize,
        /// The radius as given.
        radius: f32,
    },
    /// Two inputs that belong together have different lengths.
    #[error("{what} has {found} values, {expected} were expected")]
    Length {
        /// What was measured.
        what: String,
        /// Values found.
        found: usize,
        /// Values expected.
        expected: usize,
    },
    /// A volume has an axis with too few or too many nodes.
    #[error("a volume of {} × {} × {} nodes: every axis needs at least 2 nodes, at most 2147483644, and all together must be addressable", .dims[0], .dims[1], .dims[2])]
    Dims {
        /// Nodes along each axis as given.
        dims: [usize; 3],
    },
    /// A volume's dims and strides lead outside of its samples.
    #[error(
        "the volume reaches from element {lowest} to element {highest}, there are {len} elements: dims, strides and first element do not fit the samples"
    )]
    Strides {
        /// Lowest element that a node would have.
        lowest: i128,
        /// Highest element that a node would have.
        highest: i128,
        /// Elements there are.
        len: usize,
    },
    /// The work needs more memory than the caller allows.
    #[error(
        "{what} needs {needed} bytes, {available} are allowed: raise the memory limit to at least {needed} bytes, or use a larger cell"
    )]
    Memory {
        /// What the memory is for.
        what: &'static str,
        /// Bytes needed at least.
        needed: u64,
        /// Bytes allowed.
        available: u64,
    },
    /// A count exceeds what its index type can hold.
    #[error("{what}: {needed} are needed, {available} can be indexed: use a larger cell or fewer particles")]
    Count {
        /// What was counted.
        what: &'static str,
        /// The count.
        needed: u64,
        /// The largest count possible.
        available: u64,
    },
    /// Memory that the caller handed in is too small. Nothing was written beyond it.
    #[error("{what}: {needed} are needed, there is room for {available}: hand in more")]
    Capacity {
        /// What there is no room for.
        what: &'static str,
        /// How many are needed.
        needed: u64,
        /// How many there is room for.
        available: u64,
    },
    /// The caller cancelled the work by its token.
    #[error("cancelled")]
    Cancelled,
}
