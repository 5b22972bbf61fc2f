//! A stand-in for the reconstruction: an octahedron around every particle, through the interface of the real one.

use rayon::prelude::*;

use crate::{Attribute, Control, Error, Mesh, Params, Positions, Stage, VertexAttribute};

const BLOCK: usize = 1024;
const CORNERS: [[f32; 3]; 6] =
    [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
const FACES: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

/// Owns all scratch; reusable for the next frame.
#[derive(Debug, Default)]
pub struct Reconstructor {
    _scratch: Vec<u8>,
}

/// Counts of what was looked at; no clocks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Stats {
    /// Particles in.
    pub particles: usize,
}

/// A counted surface that is ready to be written.
pub struct Surface<'a> {
    positions: Positions<'a>,
    attributes: &'a [Attribute<'a>],
    params: &'a Params,
    control: &'a Control<'a>,
}

/// A part of the mesh that says where it goes.
#[derive(Debug, Clone, Default)]
pub struct Chunk {
    /// Index of the first vertex in the whole mesh.
    pub first_vertex: usize,
    /// Offsets from the origin.
    pub vertices: Vec<[f32; 3]>,
    /// Unit normals, or empty.
    pub normals: Vec<[f32; 3]>,
    /// One channel per attribute.
    pub attributes: Vec<Vec<f32>>,
    /// Index of the first triangle in the whole mesh.
    pub first_triangle: usize,
    /// Vertex indices in the whole mesh.
    pub triangles: Vec<[u32; 3]>,
}

impl Reconstructor {
    /// Without any scratch yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Particles to a counted surface. Runs in the current rayon pool.
    ///
    /// # Errors
    /// Invalid parameters and positions, cancellation.
    pub fn extract<'a>(
        &'a mut self,
        positions: Positions<'a>,
        attributes: &'a [Attribute<'a>],
        params: &'a Params,
        control: &'a Control<'a>,
    ) -> Result<Surface<'a>, Error> {
        params.check()?;
        control.begin(Stage::Sort)?;
        for index in 0..positions.len() {
            let position = positions.get(index);
            if !position.iter().all(|x| x.is_finite()) {
                return Err(Error::NotFinite { index, position });
            }
        }
        for stage in [Stage::Density, Stage::Active, Stage::Fill, Stage::Count] {
            control.begin(stage)?;
        }
        Ok(Surface { positions, attributes, params, control })
    }
}

impl Surface<'_> {
    /// Vertices in the whole mesh.
    pub fn vertex_count(&self) -> usize {
        6 * self.positions.len()
    }

    /// Triangles in the whole mesh.
    pub fn triangle_count(&self) -> usize {
        8 * self.positions.len()
    }

    /// What the vertices' offsets count from.
    pub fn origin(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// Counts.
    pub fn stats(&self) -> Stats {
        Stats { particles: self.positions.len() }
    }

    /// The whole mesh in memory.
    ///
    /// # Errors
    /// Cancellation.
    pub fn to_mesh(&self) -> Result<Mesh, Error> {
        let chunk = self.chunk(0, self.positions.len());
        let attributes = self.attributes.iter().zip(chunk.attributes).map(|(a, values)| VertexAttribute {
            name: a.name.into(),
            components: a.components,
            values,
        });
        self.control.begin(Stage::Emit)?;
        Ok(Mesh {
            origin: self.origin(),
            attributes: attributes.collect(),
            vertices: chunk.vertices,
            normals: chunk.normals,
            triangles: chunk.triangles,
        })
    }

    /// Calls `write` with every chunk, from many threads, in any order.
    ///
    /// # Errors
    /// Those of `write`, and cancellation.
    pub fn for_each_chunk<E: Send + From<Error>>(
        &self,
        write: impl Fn(&Chunk) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        self.control.begin(Stage::Emit)?;
        let count = self.positions.len();
        (0..count.div_ceil(BLOCK)).into_par_iter().try_for_each(|block| {
            self.control.check()?;
            write(&self.chunk(block * BLOCK, count.min((block + 1) * BLOCK)))
        })
    }

    fn chunk(&self, begin: usize, end: usize) -> Chunk {
        let mut chunk = Chunk { first_vertex: 6 * begin, first_triangle: 8 * begin, ..Chunk::default() };
        chunk.attributes.resize(self.attributes.len(), Vec::new());
        let radius = self.params.particle_radius as f32;
        for i in begin..end {
            let p = self.positions.get(i);
            for corner in CORNERS {
                chunk.vertices.push(std::array::from_fn(|a| p[a] as f32 + radius * corner[a]));
                if self.params.normals {
                    chunk.normals.push(corner);
                }
                for (out, attribute) in chunk.attributes.iter_mut().zip(self.attributes) {
                    out.extend(&attribute.values[i * attribute.components..][..attribute.components]);
                }
            }
            chunk.triangles.extend(FACES.map(|face| face.map(|v| v + 6 * i as u32)));
        }
        chunk
    }
}

/// Half of the median distance from a particle to its nearest neighbour, of a few particles; `None` with fewer than two
/// distinct ones.
pub fn infer_radius(positions: Positions<'_>) -> Option<f64> {
    let distance_sq = |i: usize, j: usize| {
        let (p, q) = (positions.get(i), positions.get(j));
        (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>()
    };
    let nearest = |i| (0..positions.len()).map(|j| distance_sq(i, j)).filter(|&d| d > 0.0).reduce(f64::min);
    let step = positions.len().div_ceil(50).max(1);
    let mut found: Vec<f64> = (0..positions.len()).step_by(step).filter_map(nearest).collect();
    found.sort_by(f64::total_cmp);
    Some(0.5 * found.get(found.len() / 2)?.sqrt())
}
