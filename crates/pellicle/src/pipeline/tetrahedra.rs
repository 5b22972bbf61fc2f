//! Road C by tetrahedra: volume or function → signs → (snapped nodes) → counts → sums → vertices, triangles.

use rayon::prelude::*;

use crate::{
    Control, Domain, Error, Function, Mesh, Stage, Volume,
    field::{function::outward, volume::with_samples},
    march::tetrahedra::{
        Kind, Surface,
        boxed::Boxed,
        samples::{Evaluated, Nodes},
        sheared::Sheared,
        source::Source,
    },
    math::memory::filled,
};

/// How space is cut into tetrahedra.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Tetrahedra {
    /// Five in a cell (MT5): one in the middle, four at corners; cells alternate so that their faces agree.
    Five,
    /// Six in a cell (MT6), around its main diagonal.
    #[default]
    Six,
    /// Body-centred (CCL): twelve a cell, each between the middles of two cells and an edge of the face between them. All
    /// are alike, and nearly regular.
    BodyCentred,
    /// The same nodes on a sheared lattice, numbered with one site in place of two.
    Simplex,
    /// Body-centred, with the crossings near a node merged: about as many triangles as marching cubes makes, of good shape.
    Regularised,
}

impl Tetrahedra {
    /// All, in the order of their declaration.
    pub const ALL: [Self; 5] = [Self::Five, Self::Six, Self::BodyCentred, Self::Simplex, Self::Regularised];

    fn kind(self) -> Kind {
        match self {
            Self::Five => Kind::Five,
            Self::Six | Self::Simplex => Kind::Six,
            Self::BodyCentred => Kind::Bcc,
            Self::Regularised => Kind::Regularised,
        }
    }
}

/// What the caller of [`contour_function_tetrahedra`] and [`contour_tetrahedra`] chooses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TetrahedraParams {
    /// How space is cut.
    pub split: Tetrahedra,
    /// Whether vertices get normals from the function's gradient. Volumes have none. Default off.
    pub normals: bool,
}

/// Most bricks of 4³ cells: what is kept of each is a few dozen bytes.
const MOST_BRICKS: u64 = 1 << 28;

/// The surface of a volume where its samples pass `iso`, by tetrahedra: inside is *greater*, equal is outside.
///
/// Exactly the surface of the interpolant that is linear in each tetrahedron; where the split has nodes in the middles of
/// cells, their value is the mean of the cell's corners. Closed and manifold, or with its rim on the border of an open
/// volume. Same bytes for any number of threads.
///
/// # Errors
/// [`Error::Parameter`] for an isovalue that is not finite, [`Error::Count`] when vertices or bricks cannot be numbered,
/// [`Error::Cancelled`].
pub fn contour_tetrahedra(
    volume: &Volume<'_>,
    iso: f64,
    split: Tetrahedra,
    control: &Control<'_>,
) -> Result<Mesh, Error> {
    check_iso(iso)?;
    with_samples!(volume.samples(), samples => {
        let nodes = Nodes { volume, samples, iso };
        check_bricks(volume.dims(), split)?;
        let source: Box<dyn Source> = match split {
            Tetrahedra::Simplex => Box::new(Sheared::new(nodes)),
            _ => Box::new(Boxed::new(nodes)),
        };
        mesh(&*source, split.kind(), volume.origin(), control)
    })
}

/// The surface where a function passes `iso`, by tetrahedra, evaluated brick by brick: no dense array is made. Vertices lie
/// where the function itself passes `iso` on their edges, not where a line between two samples does.
///
/// ```
/// use pellicle::{Control, Domain, Tetrahedra, TetrahedraParams, contour_function_tetrahedra};
/// let torus = |p: [f64; 3]| 0.3 - ((p[0].hypot(p[1]) - 1.0).powi(2) + p[2] * p[2]).sqrt();
/// let domain = Domain::covering([[-1.5, -1.5, -0.5], [1.5, 1.5, 0.5]], 0.1);
/// let params = TetrahedraParams { split: Tetrahedra::Regularised, normals: true };
/// let mesh = contour_function_tetrahedra(&torus, &domain, 0.0, &params, &Control::default())?;
/// let report = pellicle::mesh::Report::of(&mesh);
/// assert!(report.closed_manifold() && report.genus() == 1.0);
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for an isovalue that is not finite or a domain out of range, [`Error::Dims`] and [`Error::Count`] for
/// too many cells or vertices, [`Error::Cancelled`].
pub fn contour_function_tetrahedra(
    function: &dyn Function,
    domain: &Domain<'_>,
    iso: f64,
    params: &TetrahedraParams,
    control: &Control<'_>,
) -> Result<Mesh, Error> {
    check_iso(iso)?;
    domain.check()?;
    check_bricks(domain.cells.map(|n| n + 1), params.split)?;
    let samples = Evaluated { function, domain, iso, is_left_handed: domain.is_left_handed() };
    let origin = domain.mesh_origin();
    let mut mesh = match params.split {
        Tetrahedra::Simplex => mesh(&Sheared::new(samples), Kind::Six, origin, control)?,
        split => mesh(&Boxed::new(samples), split.kind(), origin, control)?,
    };
    if params.normals {
        let step = domain.small_step();
        let normal = |v: &[f32; 3]| {
            let at = std::array::from_fn(|a| origin[a] + f64::from(v[a]));
            outward(function.gradient(at, step))
        };
        mesh.normals = mesh.vertices.par_iter().map(normal).collect();
    }
    Ok(mesh)
}

fn check_iso(iso: f64) -> Result<(), Error> {
    if iso.is_finite() { Ok(()) } else { Err(Error::Parameter { name: "iso", value: iso, must: "finite" }) }
}

fn check_bricks(nodes: [usize; 3], split: Tetrahedra) -> Result<(), Error> {
    let bricks = match split {
        Tetrahedra::Simplex => Sheared::<Evaluated<'_>>::brick_count(nodes),
        _ => Boxed::<Evaluated<'_>>::brick_count(nodes),
    };
    if bricks > u128::from(MOST_BRICKS) {
        let needed = u64::try_from(bricks).unwrap_or(u64::MAX);
        return Err(Error::Count { what: "bricks of 4 × 4 × 4 cells", needed, available: MOST_BRICKS });
    }
    Ok(())
}

fn mesh(source: &dyn Source, kind: Kind, origin: [f64; 3], control: &Control<'_>) -> Result<Mesh, Error> {
    let surface = Surface::new(source, kind, control)?;
    control.begin(Stage::Emit)?;
    let mut vertices = filled([0.0; 3], surface.vertices());
    let mut triangles = filled([0; 3], surface.triangles());
    surface.write_vertices(source, &mut vertices);
    surface.write_triangles(source, &mut triangles);
    control.check()?;
    Ok(Mesh { origin, vertices, triangles, ..Mesh::default() })
}
