//! Volumes larger than memory: layer by layer, once to count and once to write. The same bytes as in memory.
//!
//! A PLY file is written piece by piece, so that nothing grows with the surface; for other formats, pictures and the largest piece
//! the mesh must fit into memory, which is known after the counting.

use pellicle::{ContourPiece, ContourStream, Mesh, StreamSample, StreamShape};
use pellicle_io::{Samples, VolumeFile, each_sample_type};

use super::output::Surface;
use super::{Part, Task};
use crate::failure::Failure;
use crate::interrupt;
use crate::target::Target;
use crate::volume::statistics::Statistics;

/// A type of samples, as both the reader and the extractor know it.
trait Layer: StreamSample + Copy {
    /// The samples, which are of this type.
    fn of(samples: &Samples) -> &[Self];
    fn to_f64(self) -> f64;
}

macro_rules! layers {
    ($($type:ty: $kind:ident),*) => {$(
        impl Layer for $type {
            fn of(samples: &Samples) -> &[Self] {
                if let Samples::$kind(values) = samples { values } else { &[] }
            }
            #[allow(clippy::unnecessary_cast, clippy::cast_lossless, reason = "the same code serves every type")]
            fn to_f64(self) -> f64 {
                self as f64
            }
        }
    )*};
}
layers!(i8: I8, u8: U8, i16: I16, u16: U16, i32: I32, u32: U32, i64: I64, u64: U64, f32: F32, f64: F64);

/// What the counting found.
#[derive(Default)]
struct Found {
    vertices: u64,
    triangles: u64,
    has_inside: bool,
    has_outside: bool,
}

impl Task<'_> {
    /// Makes the surfaces one by one.
    pub fn stream(&self, outputs: &[Target]) -> Result<Vec<Surface>, Failure> {
        self.budget.claim(self.layers_at_hand(), "a few layers", "they are the least that must be at hand")?;
        outputs.iter().enumerate().map(|(number, output)| self.stream_one(number, output)).collect()
    }

    /// Bytes of the layers at hand: those read, and as many as the extractor collects, with their signs.
    fn layers_at_hand(&self) -> u64 {
        /// Samples that the extractor collects at least.
        const TOGETHER: u64 = 1 << 21;
        let [x, y, z] = self.header.dims.map(|n| n as u64);
        let samples = ((TOGETHER.div_ceil(x * y).max(4) + 4).min(z) + 1) * x * y;
        samples * (2 * self.header.kind.bytes() as u64 + 1)
    }

    fn stream_one(&self, number: usize, output: &Target) -> Result<Surface, Failure> {
        self.clock.begin("count");
        let found = self.count(number)?;
        if !(found.has_inside && found.has_outside) {
            let range = Statistics::of_file(&|| self.job.selection.open(&self.frame.input))?.range;
            self.job.tell_nothing(&self.frame.input, number, range);
            let origin = self.block.origin(&self.header.grid);
            return self.finish(Mesh { origin, ..Mesh::default() }, 0, Part::Iso(number), output);
        }
        self.clock.begin("write");
        if output.is_stream() && self.job.is_piecewise(self.frame) {
            return self.write_pieces(number, output, &found);
        }
        let per_vertex = if self.job.has_normals() { 24 } else { 12 };
        let needed = self.layers_at_hand() + per_vertex * found.vertices + 12 * found.triangles;
        self.budget.claim(
            needed,
            "a few layers and the mesh",
            "only PLY is written piece by piece, without a picture, --largest and finishing",
        )?;
        let mut mesh = Mesh { origin: self.block.origin(&self.header.grid), ..Mesh::default() };
        mesh.vertices.reserve_exact(found.vertices as usize);
        mesh.triangles.reserve_exact(found.triangles as usize);
        self.pieces(number, &mut |piece, _| {
            piece.append_to(&mut mesh).map_err(|error| Failure::core(&self.frame.input, error))
        })?;
        self.finish(mesh, self.layers_at_hand(), Part::Iso(number), output)
    }

    fn count(&self, number: usize) -> Result<Found, Failure> {
        let mut found = Found::default();
        let sides = self.pieces(number, &mut |piece, _| {
            found.vertices += piece.vertices.len() as u64;
            found.triangles += piece.triangles.len() as u64;
            Ok(())
        })?;
        [found.has_inside, found.has_outside] = sides;
        Ok(found)
    }

    fn write_pieces(&self, number: usize, output: &Target, found: &Found) -> Result<Surface, Failure> {
        let file = self.ply(Part::Iso(number), output, [found.vertices, found.triangles])?;
        let mut buffer = Vec::new();
        self.pieces(number, &mut |mut piece, first_triangle| {
            // No more vertices than 32 bits count, or the file would have been refused.
            let first = piece.first_vertex as u32;
            piece.triangles.as_flattened_mut().iter_mut().for_each(|corner| *corner = corner.wrapping_add(first));
            file.write_vertices(piece.first_vertex, &piece.vertices, &piece.normals, &[], &mut buffer)?;
            file.write_triangles(first_triangle, &piece.triangles, &mut buffer)?;
            Ok(())
        })?;
        interrupt::check()?;
        file.finish()?;
        self.written(Part::Iso(number), output, [found.vertices as usize, found.triangles as usize])
    }

    /// Reads the volume once and hands out its surface in pieces, each with the number of its first triangle. Tells whether samples
    /// were inside and outside.
    fn pieces(&self, number: usize, each: Each<'_>) -> Result<[bool; 2], Failure> {
        let file = self.job.selection.open(&self.frame.input)?;
        let iso = self.header.scaling.sample(self.job.isos[number].value);
        let none = Samples::with_capacity(self.header.kind, 0);
        each_sample_type!(none, buffer => self.march(file, buffer, iso, each))
    }

    /// `packed` takes the part of a layer that is kept.
    fn march<T: Layer>(
        &self,
        mut file: VolumeFile,
        mut packed: Vec<T>,
        iso: f64,
        each: Each<'_>,
    ) -> Result<[bool; 2], Failure> {
        let (block, grid) = (self.block, &self.header.grid);
        let core = |error| Failure::core(&self.frame.input, error);
        let (origin, border) = (block.origin(grid), self.job.border);
        let shape = StreamShape { dims: block.dims, origin, directions: grid.steps, border };
        let mut stream = ContourStream::<T>::new(&shape, iso, &self.job.params).map_err(core)?;
        let mut samples = Samples::with_capacity(self.header.kind, 0);
        let (mut sides, mut first_triangle) = ([false; 2], 0);
        let mut hand_out = |piece: ContourPiece| {
            let count = piece.triangles.len() as u64;
            each(piece, first_triangle)?;
            first_triangle += count;
            Ok::<(), Failure>(())
        };
        let [x, y, _] = self.header.dims;
        for k in 0..block.first[2] + block.dims[2] {
            interrupt::check()?;
            samples.clear();
            file.read_layers(1, &mut samples)?;
            if k < block.first[2] {
                continue;
            }
            let mut layer = T::of(&samples);
            if block.dims[..2] != [x, y] {
                packed.clear();
                let rows = layer.chunks_exact(x).skip(block.first[1]).take(block.dims[1]);
                rows.for_each(|row| packed.extend_from_slice(&row[block.first[0]..][..block.dims[0]]));
                layer = &packed;
            }
            sides[0] = sides[0] || layer.iter().any(|value| value.to_f64() > iso);
            // NaN is outside.
            sides[1] = sides[1] || !layer.iter().all(|value| value.to_f64() > iso);
            if let Some(piece) = stream.push(layer).map_err(core)? {
                hand_out(piece)?;
            }
        }
        hand_out(stream.finish().map_err(core)?)?;
        Ok(sides)
    }
}

/// What is done with a piece and the number of its first triangle.
type Each<'a> = &'a mut dyn FnMut(ContourPiece, u64) -> Result<(), Failure>;
