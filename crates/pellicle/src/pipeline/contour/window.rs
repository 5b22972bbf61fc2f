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
        vertices::{Fresh, Vertices},
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
    /// For each group and surface, vertices that are made already; none where they are not.
    fresh: Vec<Vec<[f32; 3]>>,
}

impl<'a> Window<'a> {
    /// Classifies all rows, counts those wanted. With `makes_fresh`, vertices of sparse surfaces are made at once.
    pub(super) fn new(
        grid: Box<dyn Rows + 'a>,
        rows: Range<usize>,
        unit: Unit,
        isos: Vec<Iso>,
        makes_fresh: bool,
        control: &Control<'_>,
    ) -> Result<Self, Error> {
        let (mut signs, mut fresh) = (Signs::new(grid.shape(), isos.len()), Vec::new());
        let all = 0..grid.shape().rows();
        if makes_fresh {
            fresh = classify_fresh(&*grid, unit, &isos, all, &mut signs, control);
        } else {
            classify(&*grid, unit, &isos, all, &mut signs, control);
        }
        control.begin(Stage::Count)?;
        let count = |&iso: &Iso| Counted::new(unit, &*grid, &signs, iso, rows.start, 0);
        let counted = isos.iter().map(count).collect::<Result<_, _>>()?;
        control.check()?;
        Ok(Self { grid, rows, unit, isos, signs, counted, fresh })
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
        Ok(Self { grid, rows, unit, isos: vec![iso], signs, counted, fresh: Vec::new() })
    }

    /// Bytes of the signs and places of a lattice for so many isovalues.
    pub(super) fn bytes(shape: &Shape, isos: usize) -> u64 {
        let signs = 8 * shape.rows() as u64 * shape.words() as u64;
        (signs + Counted::bytes(shape.rows())) * isos as u64
    }

    /// Bytes of its signs and places, and of the vertices that are made already.
    pub(super) fn held(&self) -> u64 {
        let fresh = self.fresh.iter().map(|made| size_of_val(made) + size_of_val(&made[..])).sum::<usize>();
        Self::bytes(self.grid.shape(), self.isos.len()) + fresh as u64
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
    fn for_vertices(&self, surface: usize, to: &mut [[f32; 3]], work: impl Fn(usize, &mut [[f32; 3]]) + Sync) {
        let counted = &self.counted[surface];
        let start = |group: usize| counted.place(self.group_start(group)).vertices[0] as usize;
        for_each_part(0..self.groups(), to, &start, &|group, to: &mut [[f32; 3]]| {
            if !to.is_empty() {
                work(group, to);
            }
        });
    }

    pub(super) fn emit_vertices(&self, surface: usize, to: &mut [[f32; 3]]) {
        let (unit, signs, counted) = (self.unit, &self.signs, &self.counted[surface]);
        let iso = self.isos[surface];
        self.for_vertices(surface, to, |group, to| match self.fresh.get(group * self.isos.len() + surface) {
            Some(made) if !made.is_empty() => to.copy_from_slice(made),
            _ => self.grid.vertices(Vertices { unit, signs, counted, iso, rows: self.group(group), to }),
        });
    }

    pub(super) fn emit_normals(&self, surface: usize, to: &mut [[f32; 3]]) {
        let (signs, iso) = (&self.signs, self.isos[surface]);
        self.for_vertices(surface, to, |group, to| {
            self.grid.normals(Normals { signs, iso, rows: self.group(group), to });
        });
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

/// Finds the signs of all rows, and the vertices of sparse surfaces. Cut short when cancelled, which the caller must check.
fn classify_fresh(
    grid: &dyn Rows,
    unit: Unit,
    isos: &[Iso],
    all: Range<usize>,
    signs: &mut Signs,
    control: &Control<'_>,
) -> Vec<Vec<[f32; 3]>> {
    let (ny, words) = (grid.shape().nodes[1], signs.words_per_row());
    if words == 0 {
        return Vec::new();
    }
    let values: Vec<f64> = isos.iter().map(|iso| iso.value).collect();
    let groups = all.len().div_ceil(GROUP);
    // Of each task the last plane has no fresh vertices: those beyond it are another task's.
    let task = (groups / (TASKS * rayon::current_num_threads())).max(1);
    let mut fresh = vec![Vec::new(); groups * isos.len()];
    let tasks = signs.bits_mut().par_chunks_mut(task * GROUP * words).zip(fresh.par_chunks_mut(task * isos.len()));
    tasks.enumerate().for_each(|(number, (bits, fresh))| {
        let first = number * task * GROUP;
        let end = first + bits.len() / words;
        let mut made = fresh.chunks_exact_mut(isos.len()).zip((first..).step_by(GROUP)).peekable();
        for start in (first..end).step_by(GROUP) {
            if control.check().is_err() {
                return;
            }
            let rows = start..end.min(start + GROUP);
            let to = &mut bits[(start - first) * words..(rows.end - first) * words];
            grid.classify(Classify { unit, isos: &values, rows: rows.clone(), to });
            let has_signs = |start: usize| start + GROUP + ny <= rows.end;
            while let Some((to, start)) = made.next_if(|(_, start)| has_signs(*start)) {
                for (&iso, to) in isos.iter().zip(to) {
                    let rows = start..start + GROUP;
                    *to = grid.fresh(Fresh { unit, bits, first, isos: isos.len(), iso, rows });
                }
            }
        }
    });
    fresh
}

/// Tasks for each thread.
const TASKS: usize = 4;

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
