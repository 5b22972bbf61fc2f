//! Where each row's vertices and triangles go: counts, summed up row after row.
//!
//! Source: this project; see [`super`].

use crate::Error;

/// Where a row's vertices and triangles begin, or, before they are summed up, how many it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place<const KINDS: usize> {
    /// Of each kind.
    pub(crate) vertices: [u32; KINDS],
    pub(crate) triangles: u64,
}

impl<const KINDS: usize> Default for Place<KINDS> {
    fn default() -> Self {
        Self { vertices: [0; KINDS], triangles: 0 }
    }
}

/// The places of all rows of a lattice, and the end.
pub(crate) struct Places<const KINDS: usize> {
    places: Vec<Place<KINDS>>,
}

impl<const KINDS: usize> Places<KINDS> {
    /// Of the counts of all rows, and of one more for the end. Vertices are numbered from `first_vertex` on, row by row,
    /// kind by kind.
    ///
    /// # Errors
    /// [`Error::Count`] when the vertices exceed `u32`.
    pub(crate) fn of(mut counts: Vec<Place<KINDS>>, first_vertex: u32) -> Result<Self, Error> {
        let (mut vertices, mut triangles) = (u64::from(first_vertex), 0u64);
        for place in &mut counts {
            let counts = std::mem::take(place);
            for (start, count) in place.vertices.iter_mut().zip(counts.vertices) {
                // Beyond u32 the numbers are not used: an error follows.
                *start = vertices as u32;
                vertices += u64::from(count);
            }
            place.triangles = triangles;
            triangles += counts.triangles;
        }
        if vertices > u64::from(u32::MAX) {
            return Err(Error::Count { what: "vertices", needed: vertices, available: u32::MAX.into() });
        }
        Ok(Self { places: counts })
    }

    /// Bytes of the places of so many rows.
    pub(crate) fn bytes(rows: usize) -> u64 {
        (rows as u64 + 1) * size_of::<Place<KINDS>>() as u64
    }

    /// Where a row begins; `rows` is the end.
    #[inline(always)]
    pub(crate) fn place(&self, row: usize) -> &Place<KINDS> {
        &self.places[row]
    }

    /// Vertices and triangles, numbers before the first vertex with them.
    pub(crate) fn totals(&self) -> [usize; 2] {
        self.places.last().map_or([0; 2], |end| [end.vertices[0] as usize, end.triangles as usize])
    }
}
