//! Any field behind one pointer: what is called once an octet, so that nothing else need know which field it is, and only the
//! hot loops are compiled once for each.
//!
//! Source: this project.

use super::{
    above::{Above, Points},
    points::{Interpolate, Normals, OctetVertices},
    prove::{Prove, ProveOctet},
    simd::{self, Fill, FillOctet, Filled},
};
use crate::{
    Attribute,
    field::{Bounds, Field},
    math::simd::Unit,
};

/// A field whose type is forgotten.
pub(crate) trait AnyField: Send + Sync {
    /// See [`Field::iso`].
    fn iso(&self) -> f32;

    /// See [`Field::bounds`].
    fn bounds(&self) -> Option<Bounds>;

    /// Whether [`prove`](Self::prove) is worth a call.
    fn proves(&self) -> bool;

    /// Whether [`fill`](Self::fill) fills eighths of bricks at this distance of nodes, else whole ones.
    fn fills_eighths(&self, step: f64) -> bool;

    /// The eighths of an octet that are proven to be outside.
    fn prove(&self, unit: Unit, octet: ProveOctet<'_>) -> u64;

    /// Tells where a field is dense and above a threshold.
    fn above(&self, _unit: Unit, _of: Points<'_>) {}

    /// Fills eighths of an octet.
    fn fill(&self, unit: Unit, octet: FillOctet<'_>) -> Filled;

    /// Writes unit normals of an octet's vertices.
    fn normals(&self, unit: Unit, of: OctetVertices<'_>, columns: &[&[f32]], to: &mut [[f32; 3]]);

    /// Writes an attribute of an octet's vertices.
    fn interpolate(
        &self,
        unit: Unit,
        of: OctetVertices<'_>,
        columns: &[&[f32]],
        attribute: &Attribute<'_>,
        to: &mut [f32],
    );
}

impl<F: Field> AnyField for F {
    fn iso(&self) -> f32 {
        Field::iso(self)
    }

    fn bounds(&self) -> Option<Bounds> {
        Field::bounds(self)
    }

    fn proves(&self) -> bool {
        F::PROVES
    }

    fn fills_eighths(&self, step: f64) -> bool {
        simd::fills_eighths::<F>(step)
    }

    fn prove(&self, unit: Unit, octet: ProveOctet<'_>) -> u64 {
        unit.run(Prove { field: self, octet })
    }

    fn above(&self, unit: Unit, of: Points<'_>) {
        unit.run(Above { field: self, of });
    }

    fn fill(&self, unit: Unit, octet: FillOctet<'_>) -> Filled {
        unit.run(Fill { field: self, octet })
    }

    fn normals(&self, unit: Unit, of: OctetVertices<'_>, columns: &[&[f32]], to: &mut [[f32; 3]]) {
        unit.run(Normals { of, field: self, columns, to });
    }

    fn interpolate(
        &self,
        unit: Unit,
        of: OctetVertices<'_>,
        columns: &[&[f32]],
        attribute: &Attribute<'_>,
        to: &mut [f32],
    ) {
        unit.run(Interpolate { of, field: self, columns, attribute, to });
    }
}
