//! Surfaces of volumes into memory of the caller's: welded, as a soup, or through a pool.

use rayon::prelude::*;

use super::{Contour, VertexNormals};
use crate::{
    Error,
    sink::{
        pool::{VertexPool, Writer},
        soup::face_normal,
    },
};

/// What a surface took of a pool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoolUse {
    /// Triangles of the surface.
    pub triangles: usize,
    /// Vertices to draw, from the buffer's beginning on: those of the triangles, and of degenerate ones between them.
    pub vertices: usize,
}

fn fits(what: &'static str, needed: usize, available: usize) -> Result<(), Error> {
    if available < needed {
        return Err(Error::Capacity { what, needed: needed as u64, available: available as u64 });
    }
    Ok(())
}

impl Contour<'_> {
    /// Writes one surface welded and indexed: each vertex once, at the beginning of slices that may be longer than needed
    /// ([`vertices`](Self::vertices), [`triangles`](Self::triangles)). Without `normals` none are made; with
    /// [`VertexNormals::Off`] among the parameters they come from the gradient.
    ///
    /// # Errors
    /// [`Error::Capacity`] before anything is written, when a slice is too short.
    pub fn write_welded(
        &self,
        surface: usize,
        vertices: &mut [[f32; 3]],
        normals: Option<&mut [[f32; 3]]>,
        triangles: &mut [[u32; 3]],
    ) -> Result<(), Error> {
        let (n, t) = (self.vertices(surface), self.triangles(surface));
        fits("vertices", n, vertices.len())?;
        fits("normals", n, normals.as_ref().map_or(n, |normals| normals.len()))?;
        fits("triangles", t, triangles.len())?;
        let kind = if self.normals == VertexNormals::Off { VertexNormals::Gradient } else { self.normals };
        let normals = normals.map(|normals| (kind, &mut normals[..n]));
        self.emit(surface, &mut vertices[..n], normals, &mut triangles[..t]);
        Ok(())
    }

    /// Writes one surface as a soup: three positions a triangle, in the mesh's order, and as many times the face's normal.
    /// Counted before it is written, so that the same surface gives the same bytes and every place is known.
    ///
    /// # Errors
    /// [`Error::Capacity`] before anything is written, when a slice is shorter than 3 · [`triangles`](Self::triangles).
    pub fn write_soup(
        &self,
        surface: usize,
        positions: &mut [[f32; 3]],
        normals: Option<&mut [[f32; 3]]>,
    ) -> Result<(), Error> {
        let n = 3 * self.triangles(surface);
        fits("positions", n, positions.len())?;
        fits("normals", n, normals.as_ref().map_or(n, |normals| normals.len()))?;
        self.for_windows(surface, &mut |window, surface, to| {
            let to = &mut positions[3 * to.triangles.start..3 * to.triangles.end];
            window.for_triangles(surface, 3, to, |group, to| {
                let mut to = to.as_chunks_mut::<3>().0.iter_mut();
                window.soup(surface, group, &mut |triangle| {
                    if let Some(to) = to.next() {
                        *to = triangle;
                    }
                });
            });
        });
        if let Some(normals) = normals {
            let (triangles, normals) = (positions[..n].as_chunks::<3>().0, normals[..n].as_chunks_mut::<3>().0);
            normals.par_iter_mut().zip(triangles).for_each(|(to, triangle)| *to = [face_normal(triangle); 3]);
        }
        Ok(())
    }

    /// Writes one surface through a pool, each thread block by block. The set of triangles is always the same, their order
    /// is not.
    ///
    /// # Errors
    /// [`Error::Capacity`] when the pool is too small: it holds a part of the surface then, and nothing was overrun.
    pub fn write_pool(&self, surface: usize, pool: &VertexPool<'_>) -> Result<PoolUse, Error> {
        self.for_windows(surface, &mut |window, surface, _| {
            let groups = window.groups();
            // A block's tail is lost whenever a task ends: few tasks a thread.
            let least = groups.div_ceil(4 * rayon::current_num_threads()).max(1);
            (0..groups).into_par_iter().with_min_len(least).for_each_init(
                || Writer::new(pool),
                |writer, group| window.soup(surface, group, &mut |triangle| writer.push(&triangle)),
            );
        });
        pool.finish()?;
        Ok(PoolUse { triangles: self.triangles(surface), vertices: pool.vertices() })
    }
}
