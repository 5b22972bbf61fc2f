//! Finishing a mesh: one verb a file. Each takes a mesh and gives one: the same bytes for any number of threads, attributes
//! and normals kept in step with the vertices, each attribute by its own rule ([`Carry`](crate::Carry)).
//!
//! What they do to closed, oriented 2-manifolds is said with each; all but those that cut keep them so. Open meshes are
//! welcome: the vertices of a border, and those where more than two triangles share an edge, stay where they are.
//!
//! Source: this project; each verb names its own.

mod cap;
pub mod clamp;
pub mod components;
pub mod cut;
pub mod decimate;
mod finish;
mod flip;
pub mod largest;
mod links;
mod node;
pub mod normals;
pub mod quads;
mod rebuild;
pub mod settle;
pub mod smooth;
pub mod snap;
mod undo;
mod zigzag;

pub use finish::Finish;

use crate::{Error, Mesh};

/// Checks what every verb relies on: indices name vertices, normals and attributes match them.
pub(crate) fn check(mesh: &Mesh) -> Result<(), Error> {
    let n = mesh.vertices.len();
    let most = mesh.triangles.as_flattened().iter().fold(0, |most, &v| most.max(v));
    if most as usize >= n && !mesh.triangles.is_empty() {
        return Err(Error::Count {
            what: "vertices named by triangles",
            needed: u64::from(most) + 1,
            available: n as u64,
        });
    }
    if !mesh.normals.is_empty() && mesh.normals.len() != n {
        return Err(Error::Length { what: "normals".into(), found: mesh.normals.len(), expected: n });
    }
    for attribute in &mesh.attributes {
        let expected = n * attribute.components;
        if attribute.values.len() != expected {
            let what = format!("attribute {} with {} components", attribute.name, attribute.components);
            return Err(Error::Length { what, found: attribute.values.len(), expected });
        }
    }
    Ok(())
}
