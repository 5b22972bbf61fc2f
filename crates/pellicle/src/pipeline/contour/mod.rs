//! Road C: volume view → signs (one pass over the samples) → counts → sums → vertices, normals, triangles. A function in place
//! of the volume goes the same way, window by window: [`lazy`].

mod lazy;
mod sinks;
mod stream;
mod window;

pub use sinks::PoolUse;
pub use stream::{ContourPiece, ContourStream, StreamSample, StreamShape};

use std::ops::Range;

use crate::{
    Control, Domain, Error, Function, Lanes, Mesh, Stage, Volume,
    field::volume::with_samples,
    march::{
        resolve::Level,
        rows::{Grid, Iso, Rows},
    },
    math::{memory::filled, simd::Unit},
    mesh::face_normals,
};
use lazy::Lazy;
use window::Window;

/// Where the vertices' normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VertexNormals {
    /// No normals.
    #[default]
    Off,
    /// The samples' gradient, by central differences, through the volume's directions; a function's own gradient.
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
    /// Most bytes that may be taken besides the caller's samples, at least; `None`: no limit. [`contour`] and
    /// [`contour_function`] count the mesh, [`Contour`] only what it works with (see [`Contour::mesh_bytes`]), a
    /// [`ContourStream`] the slabs and the piece at hand.
    pub max_memory: Option<u64>,
}

/// An error when more bytes are needed than the caller allows.
fn check_memory(limit: Option<u64>, what: &'static str, needed: u64) -> Result<(), Error> {
    match limit {
        Some(available) if needed > available => Err(Error::Memory { what, needed, available }),
        _ => Ok(()),
    }
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
/// the vertices exceed `u32`, [`Error::Memory`] when the limit is too low, with the number needed.
pub fn contour(volume: &Volume<'_>, iso: f64, params: &ContourParams) -> Result<Mesh, Error> {
    Contour::extract(volume, &[iso], params, &Control::default())?.only_mesh(params)
}

/// The surface where a function passes `iso`: [`contour`] without an array. The function is asked once at every node of the
/// domain, tile by tile, and again along the surface; memory follows the surface.
///
/// The mesh is, byte for byte, that of a volume of `f64` with the function's values at the domain's nodes; only normals by
/// gradient are better, since they are the function's own. In a domain that is warped vertices are placed through the warp.
///
/// ```
/// use pellicle::{ContourParams, Domain, VertexNormals, contour_function};
/// let gyroid = |p: [f64; 3]| p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos();
/// let domain = Domain::covering([[-6.0; 3], [6.0; 3]], 0.25);
/// let params = ContourParams { normals: VertexNormals::Gradient, ..Default::default() };
/// let mesh = contour_function(&gyroid, &domain, 0.0, &params)?;
/// assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// As [`Contour::of_function`], and [`Error::Memory`] when the mesh does not fit the limit.
pub fn contour_function(
    function: &dyn Function,
    domain: &Domain<'_>,
    iso: f64,
    params: &ContourParams,
) -> Result<Mesh, Error> {
    Contour::of_function(function, domain, &[iso], params, &Control::default())?.only_mesh(params)
}

/// Counted surfaces of a volume or a function, one for each isovalue. The samples stay borrowed: vertices are read from
/// them, or asked of the function.
pub struct Contour<'a> {
    source: Source<'a>,
    origin: [f64; 3],
    normals: VertexNormals,
}

enum Source<'a> {
    Volume(Window<'a>),
    Function(Box<Lazy<'a>>),
}

/// Where a window's part of a surface goes.
struct Places {
    vertices: Range<usize>,
    triangles: Range<usize>,
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
        let needed = Window::bytes(grid.shape(), isos.len());
        check_memory(params.max_memory, "the signs of a volume's samples", needed)?;
        control.begin(Stage::Active)?;
        let rows = 0..grid.shape().rows();
        // What is kept early costs memory that nobody has to give.
        let makes_fresh = params.max_memory.is_none() && params.level == Level::Classic;
        let window = Window::new(grid, rows, unit, isos, makes_fresh, control)?;
        Ok(Self { source: Source::Volume(window), origin: volume.origin(), normals: params.normals })
    }

    /// Finds and counts the surfaces of a function for all isovalues, asking it once at every node. It must always give the
    /// same value at the same place.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an isovalue that is not finite, a domain out of range or a vector unit that the machine lacks,
    /// [`Error::Dims`] and [`Error::Count`] for too many cells or vertices, [`Error::Memory`] when the limit is too low,
    /// with the number needed, [`Error::Cancelled`].
    pub fn of_function(
        function: &'a dyn Function,
        domain: &Domain<'a>,
        isos: &[f64],
        params: &ContourParams,
        control: &Control<'_>,
    ) -> Result<Self, Error> {
        domain.check()?;
        let lazy = Lazy::new(function, domain, params.isos(isos)?, params, control)?;
        Ok(Self { origin: lazy.origin(), source: Source::Function(Box::new(lazy)), normals: params.normals })
    }

    /// Number of surfaces: one for each isovalue.
    pub fn surfaces(&self) -> usize {
        match &self.source {
            Source::Volume(window) => window.surfaces(),
            Source::Function(lazy) => lazy.surfaces(),
        }
    }

    /// World position that vertices count from: the volume's origin, or the lowest corner of the function's domain.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Vertices of one surface.
    ///
    /// # Panics
    /// If there is no such surface, as do all methods that name one.
    pub fn vertices(&self, surface: usize) -> usize {
        match &self.source {
            Source::Volume(window) => window.vertices(surface),
            Source::Function(lazy) => lazy.totals(surface)[0],
        }
    }

    /// Triangles of one surface.
    pub fn triangles(&self, surface: usize) -> usize {
        match &self.source {
            Source::Volume(window) => window.triangles(surface),
            Source::Function(lazy) => lazy.totals(surface)[1],
        }
    }

    /// Bytes that are held until the surfaces are written: signs and counts.
    pub fn working_bytes(&self) -> u64 {
        match &self.source {
            Source::Volume(window) => window.held(),
            Source::Function(lazy) => lazy.bytes(),
        }
    }

    /// Bytes of one surface as a mesh, with the normals that the parameters ask for.
    pub fn mesh_bytes(&self, surface: usize) -> u64 {
        let per_vertex = if self.normals == VertexNormals::Off { 12 } else { 24 };
        per_vertex * self.vertices(surface) as u64 + 12 * self.triangles(surface) as u64
    }

    /// One surface as a mesh, with the normals that the parameters ask for.
    pub fn mesh(&self, surface: usize) -> Mesh {
        let mut vertices = filled([0.0; 3], self.vertices(surface));
        let mut triangles = filled([0; 3], self.triangles(surface));
        let mut normals = Vec::new();
        if self.normals != VertexNormals::Off {
            normals = filled([0.0; 3], vertices.len());
        }
        let with_normals = (self.normals != VertexNormals::Off).then_some((self.normals, &mut normals[..]));
        self.emit(surface, &mut vertices, with_normals, &mut triangles);
        Mesh { origin: self.origin, vertices, normals, triangles, ..Mesh::default() }
    }

    /// The mesh of the first surface, if it fits the limit.
    fn only_mesh(&self, params: &ContourParams) -> Result<Mesh, Error> {
        let needed = self.working_bytes() + self.mesh_bytes(0);
        check_memory(params.max_memory, "the surface and its mesh", needed)?;
        Ok(self.mesh(0))
    }

    /// Writes one surface into slices of exact size.
    fn emit(
        &self,
        surface: usize,
        vertices: &mut [[f32; 3]],
        mut normals: Option<(VertexNormals, &mut [[f32; 3]])>,
        triangles: &mut [[u32; 3]],
    ) {
        self.for_windows(surface, &mut |window, surface, to| {
            window.emit_vertices(surface, &mut vertices[to.vertices.clone()]);
            window.emit_triangles(surface, &mut triangles[to.triangles]);
            if let Some((VertexNormals::Gradient, normals)) = &mut normals {
                window.emit_normals(surface, &mut normals[to.vertices]);
            }
        });
        if let Some((VertexNormals::Faces, normals)) = normals {
            face_normals(vertices, triangles, normals);
        }
    }

    /// Calls `work` with each window that has a part of a surface, the surface's number there, and the part's place.
    fn for_windows(&self, surface: usize, work: &mut dyn FnMut(&Window<'_>, usize, Places)) {
        let mut place = |window: &Window<'_>, surface: usize, [v, t]: [usize; 2]| {
            let [vertices, triangles] = [window.vertices(surface), window.triangles(surface)];
            work(window, surface, Places { vertices: v..v + vertices, triangles: t..t + triangles });
        };
        match &self.source {
            Source::Volume(window) => place(window, surface, [0; 2]),
            Source::Function(lazy) => lazy.for_windows(surface, &mut |window, first| place(window, 0, first)),
        }
    }
}
