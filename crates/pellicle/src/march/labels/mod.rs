//! Boundaries between labels: one mesh whose triangles each lie between two labels, straight from a volume's samples.
//!
//! ```text
//! codes      samples ─► 0 outside, 1.. the labels, row by row; nothing is kept                              codes
//! crossings  edges whose ends differ, faces where three labels or more meet: 64 nodes of a row in a word    count
//! count      vertices of edges along x, y, z, of xy, xz, yz faces, of cells; triangles                      count
//! cell       eight labels ─► triangles between them, by rule                                                cell
//! emit       rows again ─► the same words ─► numbers by rank ─► vertices, triangles, their sides            emit
//! ```
//!
//! Every vertex lies in the middle of what it belongs to: labels have no values to interpolate. What is kept between counting
//! and writing is a few numbers a row, so memory follows the mesh; samples are read again in each pass.
//!
//! Source: see [`cell`]; counting before writing is that of [`super::rows`].

pub(crate) mod cell;
pub(crate) mod codes;
pub(crate) mod count;
pub(crate) mod emit;
