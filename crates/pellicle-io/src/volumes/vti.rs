//! VTK XML images (`.vti`): arrays of points or of cells, of one piece or several.
//!
//! The value of a cell stands for its centre. Where pieces overlap the later one counts; together they must fill the image.
//! Lists of such files are [`super::pvti`]'s.
//!
//! Source: "VTK XML file formats", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

use std::ops::Range;
use std::path::Path;

use super::choose::{self, Candidate};
use super::file::VolumeFile;
use super::grid::Grid;
use super::header::{Placement, VolumeHeader, VolumeOptions, dims_of};
use super::samples::{SampleType, Samples};
use crate::each_sample_type;
use crate::error::Error;
use crate::formats::vtkxml::XmlFile;
use crate::formats::vtkxml::document::{DataArray, Image, Kind, Piece};

pub(crate) fn open(path: &Path, options: &VolumeOptions) -> Result<VolumeFile, Error> {
    options.check_frame(path, 1)?;
    let file = XmlFile::open(path)?;
    file.raise_budget(options.inflated_limit.unwrap_or(0));
    if file.document().kind == Kind::ParallelImage {
        return super::pvti::open(&file, path, options);
    }
    let document = file.document();
    let (Kind::ImageData, Some(image)) = (document.kind, document.image.as_ref()) else {
        let what = "this is no image: volumes are read from VTK XML files of type ImageData".into();
        return Err(Error::Unsupported { path: path.into(), what });
    };
    let pieces = document.pieces.iter().filter(|piece| piece.extent.is_none_or(|e| !is_empty(e)));
    let Some(first) = pieces.clone().next() else { return Err(file.fail("there is no Piece with samples")) };
    let Opened { header, chosen, part } = describe(&file, path, image, first, options)?;
    let component = header.component;
    let whole = move || {
        let reader = Reader { file: &file, chosen: &chosen, component };
        let mut image = Assembly::new(part, chosen.kind);
        reader.check_sum(&part)?;
        reader.read_into(&mut image, None)?;
        image.complete().map_err(|what| file.fail(what))
    };
    Ok(VolumeFile::of_whole(path, header, Box::new(whole)))
}

/// What the markup tells of the image that is asked for.
pub(super) struct Opened {
    pub(super) header: VolumeHeader,
    pub(super) chosen: Candidate,
    pub(super) part: Part,
}

/// Chooses an array of a piece, and tells where its samples lie.
pub(super) fn describe(
    file: &XmlFile,
    path: &Path,
    image: &Image,
    piece: &Piece,
    options: &VolumeOptions,
) -> Result<Opened, Error> {
    let candidates: Vec<Candidate> = candidates(piece).collect();
    let chosen = choose::array(path, &candidates, &file.document().active, options)?.clone();
    let part = Part::of(image.extent, chosen.placement).map_err(|what| file.fail(what))?;
    let dims = dims_of(part.counts).map_err(|what| file.fail(what))?;
    let mut header = VolumeHeader::new(dims, chosen.kind);
    header.grid = grid(image, part.first);
    if chosen.placement == Placement::Cells {
        header.grid = header.grid.at_centers();
    }
    if let Some(what) = header.grid.problem() {
        return Err(file.fail(what));
    }
    header.component = options.component(path, chosen.components)?;
    (header.components, header.placement) = (chosen.components, chosen.placement);
    header.arrays = candidates;
    header.name.clone_from(&chosen.name);
    Ok(Opened { header, chosen, part })
}

/// The arrays of numbers that a piece has.
fn candidates(piece: &Piece) -> impl Iterator<Item = Candidate> {
    let of = |arrays: &[DataArray], placement| {
        let usable = arrays.iter().filter_map(move |array| {
            let kind = SampleType::from(array.scalar?);
            Some(Candidate { name: array.name.clone(), kind, components: array.components, placement })
        });
        usable.collect::<Vec<_>>()
    };
    of(&piece.attributes, Placement::Points).into_iter().chain(of(&piece.of_cells, Placement::Cells))
}

/// Whether an extent has no points.
pub(super) fn is_empty([a, b, c, d, e, f]: [i64; 6]) -> bool {
    b < a || d < c || f < e
}

/// The place of samples that are counted from the image's point `first`.
fn grid(image: &Image, first: [i64; 3]) -> Grid {
    let column = |axis: usize| std::array::from_fn(|row| image.direction[3 * row + axis] * image.spacing[axis]);
    let grid = Grid { origin: image.origin, steps: [column(0), column(1), column(2)] };
    Grid { origin: grid.point(first.map(|n| n as f64)), ..grid }
}

/// A box of samples: the first and how many along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    first: [i64; 3],
    counts: [u64; 3],
}

impl Part {
    pub(super) fn of(extent: [i64; 6], placement: Placement) -> Result<Part, String> {
        let [a, b, c, d, e, f] = extent;
        let counts = [(a, b), (c, d), (e, f)].map(|(low, high)| {
            let points = high.checked_sub(low).and_then(|n| u64::try_from(n).ok())?.checked_add(1)?;
            Some(if placement == Placement::Cells { points - 1 } else { points })
        });
        match counts {
            [Some(x), Some(y), Some(z)] => Ok(Part { first: [a, c, e], counts: [x, y, z] }),
            _ => Err(format!("the extent {a} {b} {c} {d} {e} {f} is empty or too large")),
        }
    }

    pub(super) fn count(&self) -> Option<u64> {
        self.counts.iter().try_fold(1u64, |product, &n| product.checked_mul(n))
    }

    /// Whether another part lies in this one.
    fn holds(&self, part: &Part) -> bool {
        (0..3).all(|axis| self.range(part, axis).is_some_and(|range| range.end - range.start == part.counts[axis]))
    }

    /// Where along an axis a part overlaps this one, counted from this one's first.
    fn range(&self, part: &Part, axis: usize) -> Option<Range<u64>> {
        let end = |part: &Part| i128::from(part.first[axis]) + i128::from(part.counts[axis]);
        let own = i128::from(self.first[axis]);
        let (low, high) = (own.max(part.first[axis].into()), end(self).min(end(part)));
        (low < high).then_some((low - own) as u64..(high - own) as u64)
    }
}

/// Reads the pieces that a file holds.
pub(super) struct Reader<'a> {
    pub(super) file: &'a XmlFile,
    pub(super) chosen: &'a Candidate,
    pub(super) component: usize,
}

impl Reader<'_> {
    /// Parts with samples, and the chosen array of each.
    fn parts(&self) -> Result<Vec<(Part, &DataArray)>, Error> {
        let mut parts = Vec::new();
        for piece in &self.file.document().pieces {
            if piece.extent.is_some_and(is_empty) {
                continue;
            }
            let extent = piece.extent.or(self.file.document().image.as_ref().map(|image| image.extent));
            let part =
                Part::of(extent.unwrap_or_default(), self.chosen.placement).map_err(|what| self.file.fail(what))?;
            if part.count() != Some(0) {
                parts.push((part, self.array(piece)?));
            }
        }
        Ok(parts)
    }

    /// Whether the file's pieces can fill an image.
    fn check_sum(&self, whole: &Part) -> Result<(), Error> {
        let parts = self.parts()?;
        let sum = parts.iter().fold(0u64, |sum, (part, _)| sum.saturating_add(part.count().unwrap_or(u64::MAX)));
        let total = whole.count().unwrap_or(u64::MAX);
        if sum < total {
            let what = format!("the image has {total} samples, its pieces have {sum}: some are missing");
            return Err(self.file.fail(what));
        }
        if let Some(n) = parts.iter().position(|(part, _)| !whole.holds(part)) {
            return Err(self.file.fail(format!("Piece {n} lies beyond the WholeExtent")));
        }
        Ok(())
    }

    /// Puts the samples of all pieces in their places: of a part of the image, if one is given.
    pub(super) fn read_into(&self, image: &mut Assembly, only: Option<&Part>) -> Result<(), Error> {
        for (part, array) in self.parts()? {
            let samples = self.samples(&part, array)?;
            // What follows takes memory for the whole image; there is none yet that the file was not seen to hold.
            if image.needs_room(&part, only) && only.is_none() {
                self.file.claim(image.part.count().unwrap_or(u64::MAX), self.chosen.kind.bytes() + 1)?;
            }
            image.place(&part, only, samples);
        }
        Ok(())
    }

    /// The chosen array in a piece.
    fn array<'b>(&self, piece: &'b Piece) -> Result<&'b DataArray, Error> {
        let arrays = if self.chosen.placement == Placement::Cells { &piece.of_cells } else { &piece.attributes };
        let found = arrays.iter().find(|a| {
            a.name == self.chosen.name
                && a.components == self.chosen.components
                && a.scalar.map(SampleType::from) == Some(self.chosen.kind)
        });
        found.ok_or_else(|| {
            self.file.fail(format!("the array '{}' is not in every Piece with one type", self.chosen.name))
        })
    }

    /// The samples of a piece.
    fn samples(&self, part: &Part, array: &DataArray) -> Result<Samples, Error> {
        let (Some(count), Some(scalar)) = (part.count(), array.scalar) else {
            return Err(self.file.fail("a Piece is too large"));
        };
        let mut samples = Samples::with_capacity(self.chosen.kind, 0);
        each_sample_type!(&mut samples, values => {
            self.file.append_values(values, count, array, scalar)?;
            if array.components > 1 {
                for i in 0..values.len() / array.components {
                    values[i] = values[i * array.components + self.component];
                }
                values.truncate(values.len() / array.components);
                values.shrink_to_fit();
            }
        });
        Ok(samples)
    }
}

/// An image that is put together from pieces.
pub(super) struct Assembly {
    part: Part,
    kind: SampleType,
    all: Option<Samples>,
    /// Whether each sample was given; empty where one piece is the image.
    is_filled: Vec<bool>,
}

impl Assembly {
    pub(super) fn new(part: Part, kind: SampleType) -> Assembly {
        Assembly { part, kind, all: None, is_filled: Vec::new() }
    }

    /// Whether memory for the whole image has still to be taken to place this piece.
    fn needs_room(&self, part: &Part, only: Option<&Part>) -> bool {
        self.is_filled.is_empty() && !self.is_whole(part, only)
    }

    fn is_whole(&self, part: &Part, only: Option<&Part>) -> bool {
        *part == self.part && only.is_none_or(|only| *only == self.part) && self.all.is_none()
    }

    /// Puts the samples of a part in their place, but for those that lie beyond the image or are not in `only`.
    fn place(&mut self, part: &Part, only: Option<&Part>, samples: Samples) {
        if self.is_whole(part, only) {
            self.all = Some(samples);
            return;
        }
        let total = self.part.count().unwrap_or(0) as usize;
        if self.is_filled.is_empty() {
            // A piece that was the whole image has given all of them.
            self.is_filled = vec![self.all.is_some(); total];
        }
        let all = self.all.get_or_insert_with(|| {
            let mut all = Samples::with_capacity(self.kind, 0);
            each_sample_type!(&mut all, values => values.resize(total, Default::default()));
            all
        });
        let inside = |axis: usize| -> Option<Range<u64>> {
            let range = self.part.range(part, axis)?;
            let only = only.map_or(Some(0..u64::MAX), |only| self.part.range(only, axis))?;
            Some(range.start.max(only.start)..range.end.min(only.end)).filter(|range| !range.is_empty())
        };
        let (Some(x), Some(y), Some(z)) = (inside(0), inside(1), inside(2)) else { return };
        let [nx, ny, _] = self.part.counts;
        // From the image's coordinates to the piece's.
        let shift: [i64; 3] = std::array::from_fn(|axis| self.part.first[axis] - part.first[axis]);
        let width = (x.end - x.start) as usize;
        for k in z {
            for j in y.clone() {
                let [i, local_j, local_k] =
                    [(x.start, 0), (j, 1), (k, 2)].map(|(n, axis)| n.wrapping_add_signed(shift[axis]));
                let from = ((local_k * part.counts[1] + local_j) * part.counts[0] + i) as usize;
                let to = ((k * ny + j) * nx + x.start) as usize;
                copy(&samples, from..from + width, all, to..to + width);
                self.is_filled[to..to + width].fill(true);
            }
        }
    }

    /// All samples, if none is missing.
    pub(super) fn complete(self) -> Result<Samples, String> {
        match (self.all, self.is_filled.iter().position(|filled| !filled)) {
            (Some(all), None) => Ok(all),
            (_, missing) => {
                let [nx, ny, _] = self.part.counts;
                let n = missing.unwrap_or(0) as u64;
                let at = [n % nx, n / nx % ny, n / (nx * ny)];
                let at: [i128; 3] =
                    std::array::from_fn(|axis| i128::from(self.part.first[axis]) + i128::from(at[axis]));
                Err(format!("the pieces do not fill the image: none has sample {at:?}"))
            }
        }
    }
}

fn copy(from: &Samples, source: Range<usize>, to: &mut Samples, target: Range<usize>) {
    macro_rules! same {
        ($($kind:ident)*) => {
            match (from, to) {
                $((Samples::$kind(from), Samples::$kind(to)) => to[target].copy_from_slice(&from[source]),)*
                // All pieces were found to have one type.
                _ => {}
            }
        };
    }
    same!(I8 U8 I16 U16 I32 U32 I64 U64 F32 F64);
}
