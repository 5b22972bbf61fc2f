//! The stages on one window of slabs: the whole volume, or as much of it as is in memory.

use std::ops::Range;

use rayon::prelude::*;

use crate::{
    Control, Error, Stage,
    march::rows::{
        Iso, Rows, Shape,
        classify::{Classify, Signs},
        count::{Counted, GROUP},
        normals::Normals,
        soup::Soup,
        triangles::Triangles,
        vertices::Vertices,
    },
    math::{ranges::for_each_part, simd::Unit},
};

/// Counted surfaces of some rows.
pub(super) struct Window<'a> {
    grid: Box<dyn Rows + 'a>,
    /// The rows whose vertices and triangles are wanted; the others are there for their neighbours.
    rows: Range<usize>,
    unit: Unit,
    isos: Vec<Iso>,
    signs: Signs,
    counted: Vec<Counted>,
}

impl<'a> Window<'a> {
    /// Classifies all rows, counts those wanted.
    pub(super) fn new(
        grid: Box<dyn Rows + 'a>,
        rows: Range<usize>,
        unit: Unit,
        isos: Vec<Iso>,
        control: &Control<'_>,
    ) -> Result<Self, Error> {
        let mut signs = Signs::new(grid.shape(), isos.len());
        classify(&*grid, unit, &isos, 0..grid.shape().rows(), &mut signs, control);
        control.begin(Stage::Count)?;
        let count = |&iso: &Iso| Counted::new(unit, &*grid, &signs, iso, rows.start, 0);
        let counted = isos.iter().map(count).collect::<Result<_, _>>()?;
        control.check()?;
        Ok(Self { grid, rows, unit, isos, signs, counted })
    }

    /// One surface whose rows were classified before; its vertices are numbered from `first_vertex` on.
    pub(super) fn of_signs(
        grid: Box<dyn Rows + 'a>,
        rows: Range<usize>,
        unit: Unit,
        iso: Iso,
        signs: Signs,
        first_vertex: u32,
    ) -> Result<Self, Error> {
        let iso = Iso { number: 0, ..iso };
        let counted = vec![Counted::new(unit, &*grid, &signs, iso, rows.start, first_vertex)?];
        Ok(Self { grid, rows, unit, isos: vec![iso], signs, counted })
    }

    /// Bytes of the signs and places of a lattice for so many isovalues.
    pub(super) fn bytes(shape: &Shape, isos: usize) -> u64 {
        let signs = 8 * shape.rows() as u64 * shape.words() as u64;
        (signs + Counted::bytes(shape.rows())) * isos as u64
    }

    /// Bytes of its signs and places.
    pub(super) fn held(&self) -> u64 {
        Self::bytes(self.grid.shape(), self.isos.len())
    }

    pub(super) fn surfaces(&self) -> usize {
        self.counted.len()
    }

    pub(super) fn vertices(&self, surface: usize) -> usize {
        let place = |row| self.counted[surface].place(row).vertices[0] as usize;
        place(self.rows.end) - place(self.rows.start)
    }

    pub(super) fn triangles(&self, surface: usize) -> usize {
        self.counted[surface].place(self.rows.end).triangles as usize
    }

    /// Groups of rows that tasks take one by one.
    pub(super) fn groups(&self) -> usize {
        self.rows.len().div_ceil(GROUP)
    }

    /// First row of a group, or the end.
    fn group_start(&self, group: usize) -> usize {
        (self.rows.start + group * GROUP).min(self.rows.end)
    }

    fn group(&self, group: usize) -> Range<usize> {
        self.group_start(group)..self.group_start(group + 1)
    }

    /// Calls `work` in parallel with every group of rows that has vertices, and their part of `to`.
    fn for_vertices(&self, surface: usize, to: &mut [[f32; 3]], work: impl Fn(Range<usize>, &mut [[f32; 3]]) + Sync) {
        let counted = &self.counted[surface];
        let start = |group: usize| counted.place(self.group_start(group)).vertices[0] as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [[f32; 3]]| {
            if !to.is_empty() {
                work(self.group(group), to);
            }
        });
    }

    pub(super) fn emit_vertices(&self, surface: usize, to: &mut [[f32; 3]]) {
        let (unit, signs, counted) = (self.unit, &self.signs, &self.counted[surface]);
        let iso = self.isos[surface];
        self.for_vertices(surface, to, |rows, to| self.grid.vertices(Vertices { unit, signs, counted, iso, rows, to }));
    }

    pub(super) fn emit_normals(&self, surface: usize, to: &mut [[f32; 3]]) {
        let (signs, iso) = (&self.signs, self.isos[surface]);
        self.for_vertices(surface, to, |rows, to| self.grid.normals(Normals { signs, iso, rows, to }));
    }

    /// Calls `work` in parallel with every group of rows that has triangles, and their part of `to`; `each` elements a
    /// triangle.
    pub(super) fn for_triangles<T: Send>(
        &self,
        surface: usize,
        each: usize,
        to: &mut [T],
        work: impl Fn(usize, &mut [T]) + Sync,
    ) {
        let counted = &self.counted[surface];
        let start = |group: usize| each * counted.place(self.group_start(group)).triangles as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [T]| {
            if !to.is_empty() {
                work(group, to);
            }
        });
    }

    pub(super) fn emit_triangles(&self, surface: usize, to: &mut [[u32; 3]]) {
        self.for_triangles(surface, 1, to, |group, to| {
            let (grid, signs, counted) = (&*self.grid, &self.signs, &self.counted[surface]);
            let (iso, rows) = (self.isos[surface], self.group(group));
            self.unit.run(Triangles { grid, signs, counted, iso, rows, to });
        });
    }

    /// Hands out the triangles of one group of rows as positions.
    pub(super) fn soup(&self, surface: usize, group: usize, to: &mut dyn FnMut([[f32; 3]; 3])) {
        let (signs, iso, rows) = (&self.signs, self.isos[surface], self.group(group));
        let counted = &self.counted[surface];
        if counted.place(rows.start).triangles != counted.place(rows.end).triangles {
            Soup { signs, iso, rows, to }.run(&*self.grid);
        }
    }
}

/// Finds the signs of some rows; cut short when cancelled, which the caller must check.
pub(super) fn classify(
    grid: &dyn Rows,
    unit: Unit,
    isos: &[Iso],
    rows: Range<usize>,
    signs: &mut Signs,
    control: &Control<'_>,
) {
    let words = signs.words_per_row();
    if words == 0 {
        return;
    }
    let isos: Vec<f64> = isos.iter().map(|iso| iso.value).collect();
    let to = &mut signs.bits_mut()[rows.start * words..rows.end * words];
    to.par_chunks_mut(GROUP * words).enumerate().for_each(|(group, to)| {
        let first = rows.start + group * GROUP;
        if control.check().is_ok() {
            grid.classify(Classify { unit, isos: &isos, rows: first..first + to.len() / words, to });
        }
    });
}
