//! Road C: volume view → signs (one pass over the samples) → counts → sums → vertices, triangles.

use rayon::prelude::*;

use crate::{
    Control, Error, Lanes, Mesh, Stage, Volume,
    field::volume::with_samples,
    march::rows::{
        Grid, Rows, Shape,
        classify::{Classify, Signs},
        count::{Counted, GROUP},
        triangles::Triangles,
        vertices::Vertices,
    },
    math::{ranges::for_each_part, simd::Unit},
};

/// What the caller of [`contour`] chooses.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContourParams {
    /// Vector unit.
    pub lanes: Lanes,
}

/// The surface of a volume where its samples pass `iso`: inside is *greater*, equal is outside.
///
/// The mesh counts from the volume's origin. Runs in the current rayon pool; same bytes for any number of threads.
/// A volume whose samples are all on one side gives an empty mesh, unless the border is closed and all are inside.
///
/// ```
/// use pellicle::{ContourParams, Volume, contour};
/// // A ball in a cube of 20³ samples.
/// let at = |i: usize| (i as f32 - 9.5).powi(2);
/// let samples: Vec<f32> = (0..8000).map(|n| 50.0 - at(n % 20) - at(n / 20 % 20) - at(n / 400)).collect();
/// let mesh = contour(&Volume::new(&samples, [20, 20, 20])?, 0.0, &ContourParams::default())?;
/// assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for an isovalue that is not finite or a vector unit that the machine lacks, [`Error::Count`] when
/// the vertices exceed `u32`.
pub fn contour(volume: &Volume<'_>, iso: f64, params: &ContourParams) -> Result<Mesh, Error> {
    let surfaces = Contour::extract(volume, &[iso], params, &Control::default())?;
    Ok(surfaces.mesh(0))
}

/// Counted surfaces of a volume, one for each isovalue. The samples stay borrowed: vertices are read from them.
pub struct Contour<'a> {
    grid: Box<dyn Rows + 'a>,
    origin: [f64; 3],
    unit: Unit,
    isos: Vec<f64>,
    signs: Signs,
    counted: Vec<Counted>,
}

impl<'a> Contour<'a> {
    /// Finds and counts the surfaces of all isovalues in one pass over the samples.
    ///
    /// # Errors
    /// As [`contour`], and [`Error::Cancelled`].
    pub fn extract(
        volume: &Volume<'a>,
        isos: &[f64],
        params: &ContourParams,
        control: &Control<'_>,
    ) -> Result<Self, Error> {
        if let Some(&value) = isos.iter().find(|iso| !iso.is_finite()) {
            return Err(Error::Parameter { name: "iso", value, must: "finite" });
        }
        let must = "a vector unit that this machine has";
        let unit = Unit::new(params.lanes).ok_or(Error::Parameter { name: "lanes", value: f64::NAN, must })?;
        let grid: Box<dyn Rows + 'a> = with_samples!(volume.samples(), s => Box::new(Grid::new(volume, s)));
        control.begin(Stage::Active)?;
        let signs = classify(&*grid, unit, isos, control);
        control.begin(Stage::Count)?;
        let counted =
            (0..isos.len()).map(|iso| Counted::new(unit, grid.shape(), &signs, iso)).collect::<Result<_, _>>()?;
        control.check()?;
        Ok(Self { grid, origin: volume.origin(), unit, isos: isos.to_vec(), signs, counted })
    }

    /// Number of surfaces: one for each isovalue.
    pub fn surfaces(&self) -> usize {
        self.counted.len()
    }

    /// Vertices of one surface.
    ///
    /// # Panics
    /// If there is no such surface, as do all methods that name one.
    pub fn vertices(&self, surface: usize) -> usize {
        self.counted[surface].vertices()
    }

    /// Triangles of one surface.
    pub fn triangles(&self, surface: usize) -> usize {
        self.counted[surface].triangles()
    }

    /// One surface as a mesh.
    pub fn mesh(&self, surface: usize) -> Mesh {
        let mut vertices = vec![[0.0; 3]; self.vertices(surface)];
        let mut triangles = vec![[0; 3]; self.triangles(surface)];
        self.emit_vertices(surface, &mut vertices);
        self.emit_triangles(surface, &mut triangles);
        Mesh { origin: self.origin, vertices, triangles, ..Mesh::default() }
    }

    fn shape(&self) -> &Shape {
        self.grid.shape()
    }

    fn emit_vertices(&self, surface: usize, to: &mut [[f32; 3]]) {
        let (counted, rows) = (&self.counted[surface], self.shape().rows());
        let start = |group: usize| counted.place((group * GROUP).min(rows)).vertices[0] as usize;
        for_each_part(0..rows.div_ceil(GROUP), to, &start, &|group, to: &mut [[f32; 3]]| {
            let rows = group * GROUP..rows.min((group + 1) * GROUP);
            let iso = (surface, self.isos[surface]);
            if !to.is_empty() {
                self.grid.vertices(Vertices { unit: self.unit, signs: &self.signs, iso, rows, to });
            }
        });
    }

    fn emit_triangles(&self, surface: usize, to: &mut [[u32; 3]]) {
        let (counted, rows) = (&self.counted[surface], self.shape().rows());
        let start = |group: usize| counted.place((group * GROUP).min(rows)).triangles as usize;
        for_each_part(0..rows.div_ceil(GROUP), to, &start, &|group, to: &mut [[u32; 3]]| {
            let rows = group * GROUP..rows.min((group + 1) * GROUP);
            let (shape, signs) = (self.shape(), &self.signs);
            if !to.is_empty() {
                self.unit.run(Triangles { shape, signs, counted, iso: surface, rows, to });
            }
        });
    }
}

/// Signs of all rows; cut short when cancelled, which the caller must check.
fn classify(grid: &dyn Rows, unit: Unit, isos: &[f64], control: &Control<'_>) -> Signs {
    let shape = grid.shape();
    let mut signs = Signs::new(shape, isos.len());
    let words = signs.words_per_row();
    if words == 0 {
        return signs;
    }
    signs.bits_mut().par_chunks_mut(GROUP * words).enumerate().for_each(|(group, to)| {
        let rows = group * GROUP..group * GROUP + to.len() / words;
        if control.check().is_ok() {
            grid.classify(Classify { unit, isos, rows, to });
        }
    });
    signs
}
