//! `contour IN...`: volumes of files to surfaces in files.
//!
//! The samples stay in the type of the file. Of several isovalues each surface goes to a file of its own, whose name ends in
//! `_V`; the samples are looked at once for all of them.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use pellicle::post::largest::keep_largest;
use pellicle::{Border, Contour, ContourParams, Control, Mesh, Tetrahedra, VertexNormals, Volume, contour_tetrahedra};
use pellicle_io::{Up, VolumeData, VolumeHeader, WriteOptions, each_sample_type, write_mesh};
use serde_json::{Value, json};

use crate::args::ContourArgs;
use crate::batch::{self, Made};
use crate::choose::crop::Crop;
use crate::clock::StageClock;
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt;
use crate::machine;
use crate::picture;
use crate::plan::{Absent, Frame, Plan};
use crate::resolve::Files;
use crate::target::Target;
use crate::values::{IsoValue, show_argument, show_bytes, show_many, show_number, show_vertices};
use crate::volume::statistics::Statistics;
use crate::volume::{Block, Selection};

/// All that `contour` was asked to do, but for the list of frames.
struct Job<'a> {
    selection: Selection,
    isos: &'a [IsoValue],
    border: Border,
    keeps_largest: bool,
    up: Up,
    metres_per_unit: Option<f64>,
    params: ContourParams,
    tetrahedra: Option<Tetrahedra>,
    max_memory: Option<u64>,
    console: &'a Console,
}

/// Runs the verb.
pub fn run(args: &ContourArgs, console: &Console) -> Result<(), Failure> {
    interrupt::listen();
    let job = Job::resolve(args, console)?;
    let mut files = Files::resolve(&args.input, args.output.as_ref(), "ply", &args.frames)?;
    files.png.clone_from(&args.png);
    let plan = Plan::new(&files, Absent::Refuse, console)?;
    // What is wrong with the command line is known before the first file is read.
    for frame in plan.single.iter().chain(plan.frames.first()) {
        Target::new(frame.output.clone())?;
    }
    let first = plan.single.as_ref().or(plan.whole.first());
    if job.isos.is_empty()
        && let Some(frame) = first
    {
        return Err(job.without_isovalue(&frame.input));
    }
    let threads = args.threads.unwrap_or_else(machine::default_threads);
    machine::thread_pool(threads)?
        .install(|| batch::run(&plan, args.frames.skip_existing, console, |frame| job.contour(frame)))
}

impl<'a> Job<'a> {
    fn resolve(args: &'a ContourArgs, console: &'a Console) -> Result<Self, Failure> {
        let isos = args.surface.iso.as_ref().map_or(&[][..], |isos| &isos.0);
        if let Some(png) = &args.png
            && !png.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
        {
            return Err(Failure::Usage(format!("--png {}: pictures are written as .png", png.display())));
        }
        let crop = args.crop.as_deref().map(Crop::parse).transpose();
        let crop = crop.map_err(|error| Failure::Usage(format!("--crop: {error}")))?;
        let selection = Selection::new(&args.from, args.array.as_ref(), args.step);
        let tetrahedra = args.surface.method.tetrahedra();
        if tetrahedra.is_some() && VertexNormals::from(args.surface.normals) != VertexNormals::default() {
            return Err(Failure::Usage("--normals: only for the methods by marching cubes".into()));
        }
        Ok(Self {
            tetrahedra,
            selection: Selection { crop, scale: args.scale, ..selection },
            isos,
            border: if args.surface.open { Border::Open } else { Border::Closed },
            keeps_largest: args.surface.largest,
            up: args.up.into(),
            metres_per_unit: args.metres_per_unit,
            params: ContourParams {
                level: args.surface.method.into(),
                normals: args.surface.normals.into(),
                lanes: machine::lanes_from_environment()?,
            },
            max_memory: args.max_memory,
            console,
        })
    }

    /// An error that tells which isovalue to try.
    fn without_isovalue(&self, input: &Path) -> Failure {
        let open = || self.selection.open(input);
        let found = match Statistics::of_file(&open) {
            Ok(found) => found,
            Err(failure) => return failure,
        };
        let file = show_argument(input);
        Failure::Usage(match (found.range, found.suggestion) {
            (Some([low, high]), Some(value)) => format!(
                "no isovalue is given; the values go from {} to {} (try --iso {}; pellicle info {file} tells more)",
                show_number(low),
                show_number(high),
                show_number(value)
            ),
            (Some([low, _]), None) => {
                format!("no isovalue is given, and all values are {}: there is no surface", show_number(low))
            }
            (None, _) => "no isovalue is given, and there are no values but NaN".into(),
        })
    }

    /// Makes the surfaces of a frame.
    fn contour(&self, frame: &Frame) -> Result<Made, Failure> {
        let clock = StageClock::start();
        let outputs = self.outputs(&frame.output)?;
        for output in &outputs {
            output.check()?;
        }
        clock.begin("read");
        let file = self.selection.open(&frame.input)?;
        let block = self.selection.block(file.header(), &frame.input)?;
        let budget = Budget::new(self.max_memory, &frame.input);
        budget.claim("its samples", file.header().bytes())?;
        let data = file.read()?;
        interrupt::check()?;
        let volume = view(&data, block, self.border).map_err(|error| Failure::core(&frame.input, error))?;
        let isos: Vec<f64> = self.isos.iter().map(|iso| data.header.scaling.sample(iso.value)).collect();
        let on_stage = |stage| clock.begin_core(stage);
        let control = Control { cancel: Some(&interrupt::TOKEN), on_stage: Some(&on_stage) };
        let core = |error| Failure::core(&frame.input, error);
        let contour = match self.tetrahedra {
            Some(_) => None,
            None => Some(Contour::extract(&volume, &isos, &self.params, &control).map_err(core)?),
        };
        let mut surfaces = Vec::new();
        for (number, output) in outputs.iter().enumerate() {
            interrupt::check()?;
            clock.begin("emit");
            let claim = |vertices: usize, triangles: usize| {
                let size = 12 * (vertices as u64 + triangles as u64);
                budget.claim("its samples and the mesh", data.header.bytes() + size)
            };
            let mesh = match (self.nothing(&data, &volume, number, frame), &contour) {
                (true, _) => Mesh { origin: volume.origin(), ..Mesh::default() },
                (false, Some(contour)) => {
                    claim(contour.vertices(number), contour.triangles(number))?;
                    contour.mesh(number)
                }
                (false, None) => {
                    let split = self.tetrahedra.unwrap_or_default();
                    let mesh = contour_tetrahedra(&volume, isos[number], split, &control).map_err(core)?;
                    claim(mesh.vertices.len(), mesh.triangles.len())?;
                    mesh
                }
            };
            surfaces.push(self.finish(mesh, &data.header, number, output, frame, &clock)?);
        }
        Ok(self.made(frame, &data.header, block, &surfaces, &clock))
    }

    /// A file for each isovalue.
    fn outputs(&self, output: &Path) -> Result<Vec<Target>, Failure> {
        let name = |iso: &IsoValue| if self.isos.len() > 1 { suffixed(output, &iso.text) } else { output.to_owned() };
        self.isos.iter().map(|iso| Target::new(name(iso))).collect()
    }

    /// Whether all samples are on one side of the isovalue, which is told. Then there is no surface, not even at the border.
    fn nothing(&self, data: &VolumeData, volume: &Volume<'_>, number: usize, frame: &Frame) -> bool {
        let iso = data.header.scaling.sample(self.isos[number].value);
        if !is_one_sided(volume, iso) {
            return false;
        }
        let scaling = data.header.scaling;
        let range = match volume.range() {
            Some((low, high)) => {
                format!(
                    "its values go from {} to {}",
                    show_number(scaling.value(low)),
                    show_number(scaling.value(high))
                )
            }
            None => "it has no values but NaN".into(),
        };
        let iso = &self.isos[number].text;
        self.console.warn(format!("{}: no surface at {iso}: {range}", frame.input.display()));
        true
    }

    /// Writes a surface and its picture.
    fn finish(
        &self,
        mut mesh: Mesh,
        header: &VolumeHeader,
        number: usize,
        output: &Target,
        frame: &Frame,
        clock: &StageClock,
    ) -> Result<Surface, Failure> {
        let pieces = self.keeps_largest.then(|| keep_largest(&mut mesh)).transpose();
        let pieces = pieces.map_err(|error| Failure::core(&frame.input, error))?;
        interrupt::check()?;
        clock.begin("write");
        let unit = self.metres_per_unit.unwrap_or_else(|| metres(&header.unit) / self.selection.scale.unwrap_or(1.0));
        let options = WriteOptions {
            comments: self.record(&frame.input, header, number),
            up: self.up,
            metres_per_unit: unit,
            ..WriteOptions::default()
        };
        write_mesh(output.path(), &mesh, &options)?;
        let bytes = std::fs::metadata(output.path()).map_err(|error| Failure::file(output.path(), error))?.len();
        let mut png = None;
        if let Some(path) = &frame.png {
            clock.begin("draw");
            let path = if self.isos.len() > 1 { suffixed(path, &self.isos[number].text) } else { path.clone() };
            if mesh.triangles.is_empty() {
                self.console.warn(format!("{}: there is nothing to draw", path.display()));
            } else {
                picture::of_mesh(&mesh, self.up, &path)?;
                png = Some(path);
            }
        }
        let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
        Ok(Surface { number, output: output.path().to_owned(), png, vertices, triangles, pieces, bytes })
    }

    /// What decides the mesh, for the output's header.
    fn record(&self, input: &Path, header: &VolumeHeader, number: usize) -> Vec<String> {
        let source = input.file_name().unwrap_or_default().to_string_lossy();
        let mut lines = vec![format!("pellicle {}", env!("CARGO_PKG_VERSION")), format!("source {source}")];
        if !header.name.is_empty() {
            lines.push(format!("array {}", header.name));
        }
        if header.components > 1 {
            lines.push(format!("component {}", header.component));
        }
        if header.frames > 1 {
            lines.push(format!("step {}", self.selection.read.frame));
        }
        if let Some(crop) = &self.selection.crop {
            let [min, max] = crop.corners();
            lines.push(format!("crop {min:?} to {max:?}"));
        }
        let border = if self.border == Border::Open { "open" } else { "closed" };
        lines.push(format!("isovalue {}, {border}", self.isos[number].text));
        if self.keeps_largest {
            lines.push("largest piece".into());
        }
        lines
    }

    fn made(
        &self,
        frame: &Frame,
        header: &VolumeHeader,
        block: Block,
        surfaces: &[Surface],
        clock: &StageClock,
    ) -> Made {
        let [x, y, z] = block.dims;
        let stages = clock.stages();
        let seconds = clock.working().as_secs_f64();
        let mut line = format!("{}: {x} × {y} × {z} samples of {}", frame.input.display(), header.kind.name());
        for surface in surfaces {
            let iso = &self.isos[surface.number].text;
            let (vertices, triangles) = (show_vertices(surface.vertices), show_many(surface.triangles, "triangle"));
            let pieces =
                surface.pieces.map(|n| format!(", the largest of {}", show_many(n, "piece"))).unwrap_or_default();
            let (output, bytes) = (surface.output.display(), show_bytes(surface.bytes));
            line.push_str(&format!("\n  {iso}: {vertices}, {triangles}{pieces} -> {output}, {bytes}"));
        }
        line.push_str(&format!("\n  {seconds:.3} s"));
        for (name, time) in &stages {
            self.console.detail(format_args!("  {name:<8}{:9.1} ms", 1e3 * time.as_secs_f64()));
        }
        let stage = |(name, time): &(&str, std::time::Duration)| json!({"name": name, "seconds": time.as_secs_f64()});
        Made {
            line,
            report: json!({
                "dims": block.dims,
                "cells": block.dims.iter().map(|n| n - 1).product::<usize>(),
                "type": header.kind.name(),
                "array": header.name,
                "spacing": header.grid.spacing(),
                "unit": header.unit,
                "border": if self.border == Border::Open { "open" } else { "closed" },
                "surfaces": surfaces.iter().map(|surface| surface.as_json(self.isos)).collect::<Vec<_>>(),
                "stages": stages.iter().map(stage).collect::<Vec<_>>(),
                "seconds": seconds,
                "peak_memory_bytes": machine::peak_memory(),
            }),
        }
    }
}

/// A surface that has been written.
struct Surface {
    /// Of the isovalue.
    number: usize,
    output: PathBuf,
    png: Option<PathBuf>,
    vertices: usize,
    triangles: usize,
    /// How many there were, where only the largest was kept.
    pieces: Option<usize>,
    bytes: u64,
}

impl Surface {
    fn as_json(&self, isos: &[IsoValue]) -> Value {
        json!({
            "iso": isos[self.number].value,
            "output": self.output.to_string_lossy(),
            "output_bytes": self.bytes,
            "png": self.png.as_ref().map(|path| path.to_string_lossy()),
            "vertices": self.vertices,
            "triangles": self.triangles,
            "pieces": self.pieces,
        })
    }
}

/// Memory that may be taken.
struct Budget<'a> {
    limit: Option<u64>,
    input: &'a Path,
}

impl<'a> Budget<'a> {
    fn new(limit: Option<u64>, input: &'a Path) -> Self {
        Self { limit: limit.or_else(machine::available_memory), input }
    }

    fn claim(&self, what: &str, needed: u64) -> Result<(), Failure> {
        match self.limit {
            Some(limit) if needed > limit => Err(Failure::Memory(format!(
                "{}: {what} need {} of memory, {} are allowed (raise --max-memory, or take a part by --crop)",
                self.input.display(),
                show_bytes(needed),
                show_bytes(limit)
            ))),
            _ => Ok(()),
        }
    }
}

/// The core's view of what is kept of a volume.
fn view(data: &VolumeData, block: Block, border: Border) -> Result<Volume<'_>, pellicle::Error> {
    let (header, strides) = (&data.header, data.header.strides());
    let first = (0..3).map(|axis| block.first[axis] * strides[axis]).sum();
    let strides = strides.map(|stride| stride as isize);
    let volume = each_sample_type!(&data.samples, values => {
        Volume::strided(values.as_slice(), block.dims, first, strides)
    })?;
    let volume = volume.with_origin(block.origin(&header.grid))?.with_directions(header.grid.steps)?;
    Ok(volume.with_border(border))
}

/// Whether no sample, or every sample, is greater than the isovalue.
fn is_one_sided(volume: &Volume<'_>, iso: f64) -> bool {
    let [x, y, z] = volume.dims();
    // Absent samples are outside.
    let is_inside = |node| volume.value(node).is_some_and(|value| value > iso);
    let first = is_inside([0; 3]);
    let mut rows = (0..z).flat_map(|k| (0..y).map(move |j| [j, k]));
    rows.all(|[j, k]| (0..x).all(|i| is_inside([i, j, k]) == first))
}

/// `a.ply` as `a_V.ply`.
fn suffixed(path: &Path, text: &str) -> PathBuf {
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

    #[test]
    fn sides_are_told_with_absent_samples_outside() {
        let mut samples = vec![1.0f32; 8];
        let one_sided = |samples: &[f32], iso| is_one_sided(&Volume::new(samples, [2; 3]).unwrap(), iso);
        assert!(one_sided(&samples, 0.5) && one_sided(&samples, 1.0));
        samples[7] = f32::NAN;
        assert!(!one_sided(&samples, 0.5) && one_sided(&samples, 1.0));
    }
}
