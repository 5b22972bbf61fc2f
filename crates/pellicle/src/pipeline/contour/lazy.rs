//! Surfaces of functions: windows of a few slabs, one after the other, of which only the signs' runs are kept.
//!
//! ```text
//! classify   the next slabs: every node asked once; the last two slabs of the window before are kept, for neighbours
//! count      each isovalue's vertices and triangles in the window
//! keep       signs as runs of equal words, and what came before the window
//! emit       runs ─► signs ─► counts ─► vertices, triangles, normals, at their places in the whole
//! ```
//!
//! So memory follows the surface, and every way out that a volume has is there. Windows depend on the lattice alone, and
//! numbers do not depend on windows: the same bytes as from a volume that holds all samples.

use super::{ContourParams, check_memory, window::Window, window::classify};
use crate::{
    Control, Domain, Error, Function, Stage,
    march::rows::{Iso, Rows, classify::Signs, count::Counted, function::FunctionRows, runs::Runs},
    math::simd::Unit,
};

/// Nodes that a window has at least, unless the lattice has fewer.
const WINDOW_NODES: usize = 1 << 22;

/// Most words of signs of a slab.
const MOST_WORDS: u64 = 1 << 26;

/// Counted surfaces of a function.
pub(super) struct Lazy<'a> {
    rows: FunctionRows<'a>,
    unit: Unit,
    isos: Vec<Iso>,
    /// Slabs that a window is made for.
    batch: usize,
    /// What is kept of each window, isovalue after isovalue.
    kept: Vec<Kept>,
    /// Vertices and triangles of each surface.
    totals: Vec<[u64; 2]>,
    /// Most bytes of a window and of what is kept.
    bytes: u64,
}

/// One isovalue's part of a window.
struct Kept {
    runs: Runs,
    /// Those of the windows before.
    first_vertex: u64,
    first_triangle: u64,
}

impl<'a> Lazy<'a> {
    /// Asks the function at every node, and counts.
    ///
    /// # Errors
    /// As [`Contour::of_function`](super::Contour::of_function).
    pub(super) fn new(
        function: &'a dyn Function,
        domain: &Domain<'a>,
        isos: Vec<Iso>,
        params: &ContourParams,
        control: &Control<'_>,
    ) -> Result<Self, Error> {
        let (unit, rows) = (params.unit()?, FunctionRows::new(function, domain));
        let [nx, ny, slabs] = rows.shape().nodes;
        let needed = nx.div_ceil(64) as u64 * ny as u64;
        if needed > MOST_WORDS {
            let what = "nodes of a layer of the domain, 64 by 64";
            return Err(Error::Count { what, needed, available: MOST_WORDS });
        }
        let mut batch = WINDOW_NODES.div_ceil(nx * ny).clamp(4, slabs.max(4));
        let bytes = |batch: usize| Window::bytes(rows.window(0, slabs.min(batch + 2)).shape(), isos.len());
        // Most of the memory is for what is kept and for the mesh.
        while batch > 1 && params.max_memory.is_some_and(|limit| bytes(batch) > limit / 8) {
            batch = batch.div_ceil(2);
        }
        let window_bytes = bytes(batch);
        check_memory(params.max_memory, "the layers at hand of a function's lattice", window_bytes)?;
        let totals = vec![[0; 2]; isos.len()];
        let mut lazy = Self { rows, unit, isos, batch, kept: Vec::new(), totals, bytes: window_bytes };
        control.begin(Stage::Fill)?;
        lazy.read(params.max_memory, control)?;
        Ok(lazy)
    }

    fn read(&mut self, max_memory: Option<u64>, control: &Control<'_>) -> Result<(), Error> {
        let [_, ny, slabs] = self.rows.shape().nodes;
        let mut signs = Signs::new(self.rows.window(0, slabs.min(self.batch + 2)).shape(), self.isos.len());
        let slab_words = ny * signs.words_per_row();
        for first in (0..slabs).step_by(self.batch) {
            let (here, known) = (slabs - first, if first == 0 { 0 } else { (slabs - first).min(2) });
            let at_hand = here.min(self.batch + 2);
            let window = self.rows.window(first, at_hand);
            if first > 0 {
                let from = self.batch * slab_words;
                signs.bits_mut().copy_within(from..from + known * slab_words, 0);
            }
            classify(&window, self.unit, &self.isos, known * ny..at_hand * ny, &mut signs, control);
            control.check()?;
            let end = here.min(self.batch) * ny;
            for (iso, totals) in self.isos.iter().zip(&mut self.totals) {
                let counted = Counted::new(self.unit, &window, &signs, *iso, 0, 0)?;
                let [vertices, triangles] = [counted.place(end).vertices[0].into(), counted.place(end).triangles];
                let is_empty = vertices == 0 && triangles == 0;
                let mut runs = if is_empty { Runs::default() } else { Runs::of(&signs, at_hand * ny, iso.number) };
                self.bytes += runs.bytes();
                if max_memory.is_some_and(|limit| self.bytes > limit) {
                    // Too much: nothing is kept any more, but what is needed in all shall be told.
                    runs = Runs::default();
                    self.kept = Vec::new();
                }
                self.kept.push(Kept { runs, first_vertex: totals[0], first_triangle: totals[1] });
                totals[0] += vertices;
                totals[1] += triangles;
            }
        }
        check_memory(max_memory, "the signs along a function's surface", self.bytes)?;
        match self.totals.iter().map(|total| total[0]).max() {
            Some(needed) if needed > u64::from(u32::MAX) => {
                Err(Error::Count { what: "vertices", needed, available: u32::MAX.into() })
            }
            _ => Ok(()),
        }
    }

    pub(super) fn surfaces(&self) -> usize {
        self.isos.len()
    }

    /// Vertices and triangles of a surface.
    pub(super) fn totals(&self, surface: usize) -> [usize; 2] {
        self.totals[surface].map(|n| n as usize)
    }

    /// World position that vertices count from.
    pub(super) fn origin(&self) -> [f64; 3] {
        self.rows.origin()
    }

    /// Bytes of a window and of what is kept.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Calls `work` with every window that has a part of a surface, and the numbers of its first vertex and triangle.
    ///
    /// # Errors
    /// Those of `work`.
    pub(super) fn for_windows(&self, surface: usize, work: &mut dyn FnMut(&Window<'_>, [usize; 2])) {
        let [_, ny, slabs] = self.rows.shape().nodes;
        for (n, first) in (0..slabs).step_by(self.batch).enumerate() {
            let kept = &self.kept[n * self.isos.len() + surface];
            if kept.runs.bytes() == 0 {
                continue;
            }
            let rows = self.rows.window(first, (slabs - first).min(self.batch + 2));
            let signs = kept.runs.signs(rows.shape().words());
            let wanted = 0..(slabs - first).min(self.batch) * ny;
            let window = Window::of_signs(
                Box::new(rows),
                wanted,
                self.unit,
                self.isos[surface],
                signs,
                kept.first_vertex as u32,
            );
            let window = window.expect("no more vertices than were counted");
            work(&window, [kept.first_vertex as usize, kept.first_triangle as usize]);
        }
    }
}
