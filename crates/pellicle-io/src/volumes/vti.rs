//! VTK XML images (`.vti`): arrays of points or of cells, of one piece or several.
//!
//! The value of a cell stands for its centre. Where pieces overlap the later one counts; together they must fill the image.
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
    let document = file.document();
    let (Kind::ImageData, Some(image)) = (document.kind, document.image.as_ref()) else {
        let what = "this is no image: volumes are read from VTK XML files of type ImageData".into();
        return Err(Error::Unsupported { path: path.into(), what });
    };
    let pieces = document.pieces.iter().filter(|piece| piece.extent.is_none_or(|e| !is_empty(e)));
    let Some(first) = pieces.clone().next() else { return Err(file.fail("there is no Piece with samples")) };
    let candidates: Vec<Candidate> = candidates(first).collect();
    let chosen = choose::array(path, &candidates, &document.active, options)?.clone();
    let part = Part::whole(image, chosen.placement).map_err(|what| file.fail(what))?;
    let dims = dims_of(part.dims()).map_err(|what| file.fail(what))?;
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
    let told = header.clone();
    let whole = move || Reader { file: &file, chosen: &chosen, part, component: told.component }.read();
    Ok(VolumeFile::of_whole(path, header, Box::new(whole)))
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

fn is_empty([a, b, c, d, e, f]: [i64; 6]) -> bool {
    b < a || d < c || f < e
}

/// The place of samples that are counted from the image's point `first`.
fn grid(image: &Image, first: [i64; 3]) -> Grid {
    let column = |axis: usize| std::array::from_fn(|row| image.direction[3 * row + axis] * image.spacing[axis]);
    let grid = Grid { origin: image.origin, steps: [column(0), column(1), column(2)] };
    Grid { origin: grid.point(first.map(|n| n as f64)), ..grid }
}

/// A box of samples: the first and how many along each axis.
#[derive(Debug, Clone, Copy)]
struct Part {
    first: [i64; 3],
    counts: [u64; 3],
}

impl Part {
    fn of(extent: [i64; 6], placement: Placement) -> Result<Part, String> {
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

    fn whole(image: &Image, placement: Placement) -> Result<Part, String> {
        Part::of(image.extent, placement)
    }

    fn dims(&self) -> [u64; 3] {
        self.counts
    }

    fn count(&self) -> Option<u64> {
        self.counts.iter().try_fold(1u64, |product, &n| product.checked_mul(n))
    }

    /// Where along an axis a part of this one lies.
    fn range(&self, part: &Part, axis: usize) -> Option<Range<usize>> {
        let start = u64::try_from(part.first[axis].checked_sub(self.first[axis])?).ok()?;
        let end = start.checked_add(part.counts[axis])?;
        (end <= self.counts[axis]).then_some(start as usize..end as usize)
    }
}

struct Reader<'a> {
    file: &'a XmlFile,
    chosen: &'a Candidate,
    part: Part,
    component: usize,
}

impl Reader<'_> {
    fn read(&self) -> Result<Samples, Error> {
        let mut parts = Vec::new();
        for piece in &self.file.document().pieces {
            if piece.extent.is_some_and(is_empty) {
                continue;
            }
            let extent = piece.extent.or(self.file.document().image.as_ref().map(|image| image.extent));
            let part =
                Part::of(extent.unwrap_or_default(), self.chosen.placement).map_err(|what| self.file.fail(what))?;
            if part.count() == Some(0) {
                continue;
            }
            parts.push((part, self.array(piece)?));
        }
        match parts.as_slice() {
            [(part, array)] if part.counts == self.part.counts && part.first == self.part.first => {
                self.samples(part, array)
            }
            _ => self.join(&parts),
        }
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

    /// The samples of several pieces, each in its place.
    fn join(&self, parts: &[(Part, &DataArray)]) -> Result<Samples, Error> {
        let total = self.part.count().unwrap_or(u64::MAX);
        let sum = parts.iter().fold(0u64, |sum, (part, _)| sum.saturating_add(part.count().unwrap_or(u64::MAX)));
        if sum < total {
            return Err(self
                .file
                .fail(format!("the image has {total} samples, its pieces have {sum}: some are missing")));
        }
        let mut all: Option<Samples> = None;
        let mut is_filled = Vec::new();
        for (part, array) in parts {
            let samples = self.samples(part, array)?;
            let [x, y, z] = [0, 1, 2].map(|axis| self.part.range(part, axis));
            let (Some(x), Some(y), Some(z)) = (x, y, z) else {
                return Err(self.file.fail("a Piece lies beyond the WholeExtent"));
            };
            let all = match &mut all {
                Some(all) => all,
                // The first piece was found in the file; so are the others, or their sum would not have been trusted.
                none => none.insert(self.nothing(total, parts)?),
            };
            if is_filled.is_empty() {
                is_filled = vec![false; total as usize];
            }
            let [nx, ny, _] = self.part.counts.map(|n| n as usize);
            let rows = z.clone().flat_map(|k| y.clone().map(move |j| (k * ny + j) * nx));
            for (row, start) in rows.enumerate() {
                let (from, to) = (row * x.len()..(row + 1) * x.len(), start + x.start..start + x.end);
                copy(&samples, from, all, to.clone());
                is_filled[to].fill(true);
            }
        }
        match (all, is_filled.iter().position(|filled| !filled)) {
            (Some(all), None) => Ok(all),
            _ => Err(self.file.fail("the pieces do not fill the image")),
        }
    }

    /// Room for all samples, when the pieces are seen to fit into the file.
    fn nothing(&self, total: u64, parts: &[(Part, &DataArray)]) -> Result<Samples, Error> {
        let total = self.file.claim(total, self.chosen.kind.bytes() + 1)?;
        debug_assert!(!parts.is_empty());
        let mut samples = Samples::with_capacity(self.chosen.kind, 0);
        each_sample_type!(&mut samples, values => values.resize(total, Default::default()));
        Ok(samples)
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
