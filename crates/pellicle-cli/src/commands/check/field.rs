//! `check --field`: how far a mesh is from the surface of the volume that it was made of.
//!
//! To first order |value - isovalue| / |gradient|, both of the trilinear interpolant. There is no distance beyond the volume, nor
//! on its border: walls that close a surface there are nowhere in the field.

use std::path::Path;

use pellicle::mesh::Deviation;
use pellicle::{Border, Interpolant, Mesh};
use serde_json::{Value, json};

use super::deviation_json;
use crate::args::CheckArgs;
use crate::commands::contour::view;
use crate::failure::Failure;
use crate::machine;
use crate::values::show_bytes;
use crate::volume::Selection;

/// Nearer to the border than this, in cells, is on it: positions of meshes are rounded.
const ON_BORDER: f64 = 1e-3;

/// Measures the mesh.
pub fn measure(args: &CheckArgs, path: &Path, mesh: &Mesh) -> Result<Deviation, Failure> {
    let selection = Selection::new(&args.from, args.array.as_ref(), args.step);
    let file = selection.open(path)?;
    let block = selection.block(file.header(), path)?;
    let (needed, available) = (file.header().bytes(), machine::available_memory());
    if let Some(available) = available.filter(|available| needed > *available) {
        let (path, needed, available) = (path.display(), show_bytes(needed), show_bytes(available));
        let what = format!(
            "{path}: the samples need {needed} of memory, {available} are free (measure against a smaller volume)"
        );
        return Err(Failure::Memory(what));
    }
    let data = file.read()?;
    let volume = view(&data, block, Border::Open).map_err(|error| Failure::core(path, error))?;
    let interpolant = Interpolant::of(&volume);
    let last = volume.dims().map(|n| (n - 1) as f64);
    let isovalue = data.header.scaling.sample(args.iso.unwrap_or_default());
    let field = |at| {
        let node = interpolant.node(at);
        let is_within = (0..3).all(|a| node[a] > ON_BORDER && node[a] < last[a] - ON_BORDER);
        // Without a gradient there is no distance.
        is_within.then(|| interpolant.at(at)).flatten().unwrap_or((f64::NAN, [0.0; 3]))
    };
    Ok(Deviation::from_field(mesh, args.samples, isovalue, field))
}

/// For machines.
pub fn as_json(args: &CheckArgs, found: &Deviation) -> Value {
    let mut json = deviation_json(found);
    json["volume"] = json!(args.field.as_ref().map(|path| path.to_string_lossy()));
    json["iso"] = json!(args.iso);
    json
}
