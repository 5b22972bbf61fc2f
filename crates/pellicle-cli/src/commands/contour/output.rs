//! What `contour` writes of each surface, and what it says of it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use pellicle::post::cut::{self, Plane, cut};
use pellicle::post::largest::keep_largest;
use pellicle::post::quads::{Pairing, pair};
use pellicle::{Border, Control, Mesh};
use pellicle_io::{PlyFile, PlyLayout, WriteOptions, write_mesh, write_quad_mesh};
use serde_json::{Value, json};

use super::{Job, Part, Task};
use crate::failure::Failure;
use crate::interrupt;
use crate::picture;
use crate::target::Target;
use crate::values::{show_bytes, show_faces, show_many, show_vertices};

/// A surface that has been written.
pub struct Surface {
    part: Part,
    output: PathBuf,
    png: Option<PathBuf>,
    vertices: usize,
    triangles: usize,
    quads: Option<usize>,
    /// How many pieces there were, where only the largest was kept.
    pieces: Option<usize>,
    bytes: u64,
}

impl Surface {
    /// For people, after the isovalue or the label.
    fn line(&self, job: &Job<'_>) -> String {
        let (vertices, faces) = (show_vertices(self.vertices), show_faces(self.triangles, self.quads));
        let pieces = self.pieces.map(|n| format!(", the largest of {}", show_many(n, "piece"))).unwrap_or_default();
        let (name, output, bytes) = (job.text(self.part), self.output.display(), show_bytes(self.bytes));
        format!("{name}: {vertices}, {faces}{pieces} -> {output}, {bytes}")
    }

    /// For machines.
    fn as_json(&self, job: &Job<'_>) -> Value {
        let (iso, label) = match self.part {
            Part::Iso(number) => (Some(job.isos[number].value), None),
            // Numbers beyond 64 bits as text.
            Part::Label(label) => (None, Some(serde_json::from_str::<Value>(&label.to_string()).unwrap_or_default())),
        };
        json!({
            "iso": iso,
            "label": label,
            "output": self.output.to_string_lossy(),
            "output_bytes": self.bytes,
            "png": self.png.as_ref().map(|path| path.to_string_lossy()),
            "vertices": self.vertices,
            "triangles": self.triangles,
            "quads": self.quads,
            "pieces": self.pieces,
        })
    }
}

impl Task<'_> {
    /// Finishes a surface, writes it and its picture. So many bytes are `held` beside the mesh.
    pub fn finish(&self, mut mesh: Mesh, held: u64, part: Part, output: &Target) -> Result<Surface, Failure> {
        let job = self.job;
        let core = |error| Failure::core(&self.frame.input, error);
        let pieces = job.keeps_largest.then(|| keep_largest(&mut mesh)).transpose().map_err(core)?;
        interrupt::check()?;
        let finish = job.finishing.finish;
        let control = Control { cancel: Some(&interrupt::TOKEN), ..Control::default() };
        if !job.finishing.is_nothing() || job.walls.is_some() {
            let at_walls = if job.walls.is_some() { cut::memory(&mesh) } else { 0 };
            let needed = held + mesh.bytes() + job.finishing.memory(&mesh).max(at_walls);
            self.budget.claim(needed, "the mesh and its finishing", "it is finished as a whole")?;
        }
        if !finish.is_nothing() {
            self.clock.begin("finish");
            finish.apply(&mut mesh, &self.nodes(), None, &control).map_err(core)?;
        }
        // Planes: a volume has no particles to be mirrored, so the surface is cut where it is.
        for (normal, offset) in job.walls.iter().flat_map(|walls| walls.planes()) {
            cut(&mut mesh, &Plane { normal: normal.map(|n| -n), offset: -offset }, &control).map_err(core)?;
        }
        self.clock.begin("write");
        let unit =
            job.metres_per_unit.unwrap_or_else(|| metres(&self.header.unit) / job.selection.scale.unwrap_or(1.0));
        let options = WriteOptions { comments: self.record(part), up: job.up, metres_per_unit: unit };
        let mut counts = [mesh.vertices.len(), mesh.triangles.len()];
        let mut quads = None;
        if job.finishing.quads {
            let paired = pair(mesh, &Pairing::default(), &control).map_err(core)?;
            write_quad_mesh(output.path(), &paired, &options)?;
            (counts[1], quads) = (paired.mesh.triangles.len(), Some(paired.quads.len()));
            mesh = if self.frame.png.is_some() { paired.triangulated() } else { Mesh::default() };
        } else {
            write_mesh(output.path(), &mesh, &options)?;
        }
        let mut png = None;
        if let Some(path) = &self.frame.png {
            self.clock.begin("draw");
            let path = job.named(path, part);
            if mesh.triangles.is_empty() {
                job.console.warn(format!("{}: there is nothing to draw", path.display()));
            } else {
                picture::of_mesh(&mesh, job.up, &path)?;
                png = Some(path);
            }
        }
        let surface = self.written(part, output, counts)?;
        Ok(Surface { png, pieces, quads, ..surface })
    }

    /// What has been written of so many vertices and triangles.
    pub fn written(&self, part: Part, output: &Target, [vertices, triangles]: [usize; 2]) -> Result<Surface, Failure> {
        let bytes = std::fs::metadata(output.path()).map_err(|error| Failure::file(output.path(), error))?.len();
        let output = output.path().to_owned();
        Ok(Surface { part, output, png: None, vertices, triangles, quads: None, pieces: None, bytes })
    }

    /// A PLY file that is written piece by piece; the same bytes as [`finish`](Self::finish) makes.
    pub fn ply(&self, part: Part, output: &Target, counts: [u64; 2]) -> Result<PlyFile, Failure> {
        let origin = self.block.origin(&self.header.grid);
        let layout = PlyLayout {
            quad_count: 0,
            vertex_count: counts[0],
            triangle_count: counts[1],
            normals: self.job.has_normals(),
            attributes: Vec::new(),
            double: origin != [0.0; 3],
            origin,
            comments: self.record(part),
        };
        Ok(PlyFile::create(output.path(), &layout)?)
    }

    /// What decides the mesh, for the output's header.
    fn record(&self, part: Part) -> Vec<String> {
        let (job, header) = (self.job, &self.header);
        let source = self.frame.input.file_name().unwrap_or_default().to_string_lossy();
        let mut lines = vec![format!("pellicle {}", env!("CARGO_PKG_VERSION")), format!("source {source}")];
        if !header.name.is_empty() {
            lines.push(format!("array {}", header.name));
        }
        if header.components > 1 {
            lines.push(format!("component {}", header.component));
        }
        if header.frames > 1 {
            lines.push(format!("step {}", job.selection.read.frame));
        }
        if let Some(crop) = &job.selection.crop {
            let [min, max] = crop.corners();
            lines.push(format!("crop {min:?} to {max:?}"));
        }
        let border = if job.border == Border::Open { "open" } else { "closed" };
        lines.push(match part {
            Part::Iso(_) => format!("isovalue {}, {}, {border}", job.text(part), job.method.name()),
            Part::Label(label) => format!("label {label}, {border}"),
        });
        if job.keeps_largest {
            lines.push("largest piece".into());
        }
        lines.extend(job.finishing.record());
        lines.extend(job.walls_record.iter().cloned());
        lines
    }

    /// The report of all surfaces.
    pub fn report(&self, surfaces: &[Surface], is_streamed: bool) -> Value {
        let (job, header) = (self.job, &self.header);
        let stage = |(name, time): &(&str, std::time::Duration)| json!({"name": name, "seconds": time.as_secs_f64()});
        json!({
            "dims": self.block.dims,
            "cells": self.block.dims.iter().map(|n| n - 1).product::<usize>(),
            "type": header.kind.name(),
            "array": header.name,
            "spacing": header.grid.spacing(),
            "unit": header.unit,
            "method": if job.labels.is_some() { "labels" } else { job.method.name() },
            "border": if job.border == Border::Open { "open" } else { "closed" },
            "streamed": is_streamed,
            "surfaces": surfaces.iter().map(|surface| surface.as_json(job)).collect::<Vec<_>>(),
            "stages": self.clock.stages().iter().map(stage).collect::<Vec<_>>(),
            "seconds": self.clock.working().as_secs_f64(),
            "peak_memory_bytes": crate::machine::peak_memory(),
        })
    }

    /// The line for people.
    pub fn line(&self, surfaces: &[Surface], is_streamed: bool) -> String {
        let ([x, y, z], kind) = (self.block.dims, self.header.kind.name());
        let how = if is_streamed { ", layer by layer" } else { "" };
        let mut line = format!("{}: {x} × {y} × {z} samples of {kind}{how}", self.frame.input.display());
        for surface in surfaces {
            line.push_str("\n  ");
            line.push_str(&surface.line(self.job));
        }
        line.push_str(&format!("\n  {:.3} s", self.clock.working().as_secs_f64()));
        line
    }
}

/// `a.ply` as `a_V.ply`.
pub fn suffixed(path: &Path, text: &str) -> PathBuf {
    let mut name = OsString::from(path.file_stem().unwrap_or_default());
    name.push(format!("_{text}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Metres in a unit that a file names.
fn metres(unit: &str) -> f64 {
    match unit.trim() {
        "mm" | "millimeter" | "millimetre" => 1e-3,
        "cm" | "centimeter" | "centimetre" => 1e-2,
        "µm" | "um" | "micron" | "micrometer" | "micrometre" => 1e-6,
        "nm" | "nanometer" | "nanometre" => 1e-9,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_several_isovalues_end_in_them() {
        assert_eq!(suffixed(Path::new("a/b.c.ply"), "-0.5"), Path::new("a/b.c_-0.5.ply"));
        assert_eq!(suffixed(Path::new("b"), "1e3"), Path::new("b_1e3"));
    }
}
