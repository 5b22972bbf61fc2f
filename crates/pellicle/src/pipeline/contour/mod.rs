//! Road C: volume view → signs (one pass over the samples) → counts → sums → vertices, normals, triangles.

mod sinks;
mod stream;
mod window;

pub use sinks::PoolUse;
pub use stream::{ContourPiece, ContourStream, StreamSample, StreamShape};

use crate::{
    Control, Error, Lanes, Mesh, Stage, Volume,
    field::volume::with_samples,
    march::{
        resolve::Level,
        rows::{Grid, Iso, Rows},
    },
    math::{memory::filled, simd::Unit},
    mesh::face_normals,
};
use window::Window;

/// Where the vertices' normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VertexNormals {
    /// No normals.
    #[default]
    Off,
    /// The samples' gradient, by central differences, through the volume's directions.
    Gradient,
    /// The triangles around a vertex, by their area.
    Faces,
}

/// What the caller of [`contour`] chooses.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContourParams {
    /// What cells with ambiguous signs become.
    pub level: Level,
    /// Normals of vertices.
    pub normals: VertexNormals,
    /// Vector unit.
    pub lanes: Lanes,
}

impl ContourParams {
    fn unit(&self) -> Result<Unit, Error> {
        let must = "a vector unit that this machine has";
        Unit::new(self.lanes).ok_or(Error::Parameter { name: "lanes", value: f64::NAN, must })
    }

    fn isos(&self, isos: &[f64]) -> Result<Vec<Iso>, Error> {
        if let Some(&value) = isos.iter().find(|iso| !iso.is_finite()) {
            return Err(Error::Parameter { name: "iso", value, must: "finite" });
        }
        Ok(isos.iter().enumerate().map(|(number, &value)| Iso { number, value, level: self.level }).collect())
    }
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
    window: Window<'a>,
    origin: [f64; 3],
    normals: VertexNormals,
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
        let (unit, isos) = (params.unit()?, params.isos(isos)?);
        let grid: Box<dyn Rows + 'a> = with_samples!(volume.samples(), s => Box::new(Grid::new(volume, s)));
        control.begin(Stage::Active)?;
        let rows = 0..grid.shape().rows();
        let window = Window::new(grid, rows, unit, isos, control)?;
        Ok(Self { window, origin: volume.origin(), normals: params.normals })
    }

    /// Number of surfaces: one for each isovalue.
    pub fn surfaces(&self) -> usize {
        self.window.surfaces()
    }

    /// World position that vertices count from: the volume's origin.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Vertices of one surface.
    ///
    /// # Panics
    /// If there is no such surface, as do all methods that name one.
    pub fn vertices(&self, surface: usize) -> usize {
        self.window.vertices(surface)
    }

    /// Triangles of one surface.
    pub fn triangles(&self, surface: usize) -> usize {
        self.window.triangles(surface)
    }

    /// One surface as a mesh, with the normals that the parameters ask for.
    pub fn mesh(&self, surface: usize) -> Mesh {
        let mut vertices = filled([0.0; 3], self.vertices(surface));
        let mut triangles = filled([0; 3], self.triangles(surface));
        self.window.emit_vertices(surface, &mut vertices);
        self.window.emit_triangles(surface, &mut triangles);
        let mut normals = Vec::new();
        if self.normals != VertexNormals::Off {
            normals = filled([0.0; 3], vertices.len());
            self.emit_normals(surface, self.normals, &vertices, &triangles, &mut normals);
        }
        Mesh { origin: self.origin, vertices, normals, triangles, ..Mesh::default() }
    }

    fn emit_normals(
        &self,
        surface: usize,
        kind: VertexNormals,
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        to: &mut [[f32; 3]],
    ) {
        match kind {
            VertexNormals::Off => {}
            VertexNormals::Gradient => self.window.emit_normals(surface, to),
            VertexNormals::Faces => face_normals(vertices, triangles, to),
        }
    }
}
