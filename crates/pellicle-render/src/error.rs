//! Why a picture cannot be made, by cause: its size, the camera, a number, arrays that do not fit each other.

/// What went wrong. Nothing here comes from files: those are `pellicle-io`'s.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The picture has no pixel, or more than can be drawn.
    #[error("a picture of {width} x {height} pixels: both must be between 1 and {most}")]
    Size {
        /// Width asked for, in pixels.
        width: u64,
        /// Height asked for, in pixels.
        height: u64,
        /// The largest allowed.
        most: u32,
    },
    /// The camera cannot look: a number is not finite, the eye is at the target, the angle is no angle.
    #[error("camera: {what}: {must}")]
    Camera {
        /// What is wrong.
        what: String,
        /// What is allowed.
        must: &'static str,
    },
    /// A parameter is outside its range.
    #[error("{name} = {value}: must be {must}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range allowed.
        must: &'static str,
    },
    /// Two arrays that belong together have different lengths.
    #[error("{what} has {found} values, {expected} were expected")]
    Length {
        /// What was measured.
        what: String,
        /// Values found.
        found: usize,
        /// Values expected.
        expected: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, the mesh has {vertices}")]
    Vertex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More triangles and spheres than can be numbered.
    #[error("{found} triangles and spheres in one picture, {most} can be drawn: draw fewer layers, or a coarser mesh")]
    Count {
        /// How many there are.
        found: u64,
        /// How many can be.
        most: u64,
    },
    /// The PNG encoder refused.
    #[error("the picture could not be encoded as PNG: {0}")]
    Encoding(String),
}
