//! `convert` for volumes: samples to another format, or a part of them.

use std::path::Path;

use pellicle_io::{Samples, VolumeData, check_volume_format, holds_volume, write_volume};
use serde_json::json;

use super::tell_losses;
use crate::args::ConvertArgs;
use crate::batch::Made;
use crate::choose::crop::Crop;
use crate::console::Console;
use crate::failure::Failure;
use crate::interrupt;
use crate::machine;
use crate::plan::Frame;
use crate::values::show_bytes;
use crate::volume::{Block, Selection};

/// How volumes are converted.
pub struct Volumes {
    selection: Selection,
    /// Whether IN is read as raw samples, so that it is a volume whatever its name.
    is_raw: bool,
    /// An option that chooses among particles, if one was given.
    of_particles: Option<&'static str>,
}

impl Volumes {
    /// As meant.
    pub fn new(args: &ConvertArgs, crop: Option<Crop>) -> Self {
        let selection = Selection::new(&args.volume, args.from.array.as_ref(), args.from.step);
        let given = [
            ("--where", args.from.condition.is_some()),
            ("--raw", args.from.raw.is_some()),
            ("--drop-invalid", args.from.drop_invalid),
        ];
        Self {
            selection: Selection { crop, scale: args.from.scale, ..selection },
            is_raw: args.volume.dims.is_some(),
            of_particles: given.iter().find(|(_, is_given)| *is_given).map(|(name, _)| *name),
        }
    }

    /// Whether a frame is converted as a volume: it is one, and OUT can hold one.
    pub fn are_in(&self, frame: &Frame) -> Result<bool, Failure> {
        if check_volume_format(&frame.output).is_err() {
            let what = "--dims reads IN as raw samples, and OUT can hold no volume: name a .vti, .nrrd, .mha, .nii, .npy or .raw";
            return if self.is_raw { Err(Failure::file(&frame.output, what)) } else { Ok(false) };
        }
        Ok(self.is_raw || holds_volume(&frame.input)?)
    }

    /// Converts a frame.
    pub fn convert(&self, frame: &Frame, console: &Console) -> Result<Made, Failure> {
        let (input, output) = (&frame.input, &frame.output);
        if let Some(option) = self.of_particles {
            return Err(Failure::file(input, format!("this is a volume: {option} is about particles")));
        }
        let mut selection = self.selection.clone();
        selection.read.frame = frame.step.unwrap_or(selection.read.frame);
        let file = selection.open(input)?;
        let block = selection.block(file.header(), input)?;
        check_memory(file.header().bytes(), input)?;
        let data = part(file.read()?, block);
        interrupt::check()?;
        let written = write_volume(output, &data)?;
        tell_losses(&written, output, console);
        let bytes = std::fs::metadata(output).map_err(|error| Failure::file(output, error))?.len();
        let ([x, y, z], kind) = (data.header.dims, data.header.kind.name());
        let said = format!("volume of {x} × {y} × {z} samples of {kind}");
        let line = format!("{} -> {}: {said}, {}", input.display(), output.display(), show_bytes(bytes));
        let report = json!({
            "kind": "volume",
            "dims": data.header.dims,
            "type": kind,
            "array": data.header.name,
            "left_out": written.left_out,
            "narrowed": written.narrowed,
            "output_bytes": bytes,
        });
        Ok(Made { line, report })
    }
}

fn check_memory(needed: u64, input: &Path) -> Result<(), Failure> {
    match machine::available_memory() {
        Some(limit) if needed > limit => Err(Failure::Memory(format!(
            "{}: the samples need {} of memory, {} are there",
            input.display(),
            show_bytes(needed),
            show_bytes(limit)
        ))),
        _ => Ok(()),
    }
}

/// A part of a volume as a volume.
fn part(data: VolumeData, block: Block) -> VolumeData {
    if block.dims == data.header.dims {
        return data;
    }
    let VolumeData { mut header, samples } = data;
    let [sx, sy, sz] = header.strides();
    header.grid.origin = block.origin(&header.grid);
    header.dims = block.dims;
    // In the same order of axes.
    let [tx, ty, tz] = header.strides();
    let [x, y, z] = block.dims;
    let mut kept = Samples::with_capacity(samples.kind(), 0);
    macro_rules! copy {
        ($($kind:ident)*) => {
            match (&samples, &mut kept) {
                $((Samples::$kind(from), Samples::$kind(to)) => {
                    to.resize(x * y * z, Default::default());
                    for (i, j, k) in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| (i, j, k)))) {
                        let [a, b, c] = [block.first[0] + i, block.first[1] + j, block.first[2] + k];
                        to[i * tx + j * ty + k * tz] = from[a * sx + b * sy + c * sz];
                    }
                })*
                // Both have one type.
                _ => {}
            }
        };
    }
    copy!(I8 U8 I16 U16 I32 U32 I64 U64 F32 F64);
    VolumeData { header, samples: kept }
}
