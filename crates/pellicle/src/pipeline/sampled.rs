//! Road A by tetrahedra: the samples near the surface of particles, cut into tetrahedra.

use std::cell::RefCell;

use super::{Job, Reconstructor, Sampled, chosen};
use crate::{
    Attribute, Band, Error, Mesh, Params, Stage, Stats, Tetrahedra, VertexAttribute,
    bricks::{self, store::Store},
    fill::{Scratch, points::OctetVertices},
    lattice::{Coord, Lattice, OCTET},
    lookup::cells::Cells,
    march::tetrahedra::{Kind, Surface, filled::Filled, source::Source},
    math::{memory::filled, ranges::for_each_part},
};

impl Sampled<'_> {
    /// The surface by tetrahedra in place of marching cubes, with the normals and attributes that were asked for, and what the
    /// work amounted to.
    ///
    /// Where the split has nodes in the middles of cells their value is the mean of the cell's corners, and a few more bricks are
    /// filled. [`Tetrahedra::Simplex`], which has the nodes and the tetrahedra of [`Tetrahedra::BodyCentred`], gives the same
    /// mesh as that.
    ///
    /// ```
    /// # use pellicle::{Control, Params, Reconstructor, Tetrahedra};
    /// let positions: Vec<[f32; 3]> = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|v| v as f32 * 0.1)).collect();
    /// let (params, control, mut reconstructor) = (Params::new(0.05), Control::default(), Reconstructor::new());
    /// let sampled = reconstructor.sort((&positions).into(), &[], &params, &control)?.weigh()?.sample()?;
    /// let (mesh, stats) = sampled.tetrahedra(Tetrahedra::Six)?;
    /// assert_eq!(stats.triangles, mesh.triangles.len() as u64);
    /// assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Parameter`] where there are walls and with [`Band::Paper`], [`Error::Memory`] when a limit kept the samples from being
    /// kept,
    /// [`Error::Count`] when the vertices exceed `u32`, [`Error::Cancelled`].
    pub fn tetrahedra(self, split: Tetrahedra) -> Result<(Mesh, Stats), Error> {
        let Self(Job { from, unit, field, lattice, budget, params, attributes, control, .. }) = self;
        let kind = match split {
            Tetrahedra::Five => Kind::Five,
            Tetrahedra::Six => Kind::Six,
            Tetrahedra::BodyCentred | Tetrahedra::Simplex => Kind::Bcc,
            Tetrahedra::Regularised => Kind::Regularised,
        };
        if params.band == Band::Paper {
            let must = "auto or full with tetrahedra: the paper's band knows whole cells only";
            return Err(Error::Parameter { name: "band", value: f64::NAN, must });
        }
        if from.walls.is_some() {
            let must = "marching cubes where there are walls: the others know of no edge that a wall cuts";
            return Err(Error::Parameter { name: "tetrahedra", value: f64::NAN, must });
        }
        let (iso, has_middles) = (f64::from(field.iso()), matches!(kind, Kind::Bcc | Kind::Regularised));
        let Reconstructor { cells, columns, band, .. } = &mut *from;
        let columns = chosen::slices(columns);
        loop {
            if !band.has_values {
                let needed = size_of::<[f32; 64]>() as u64 * band.fine.len() as u64;
                let what = "keeping all samples near the surface, as tetrahedra ask,";
                return Err(Error::Memory { what, needed, available: params.max_memory.unwrap_or(0) });
            }
            let missing = match has_middles {
                true => Filled::new(&band.fine, iso, lattice.spacing, [0; 3]).missing(),
                false => Vec::new(),
            };
            if missing.is_empty() {
                break;
            }
            let source = bricks::store::Source { unit, field: &*field, cells, columns: &columns, control };
            band.fill_more(&missing, &source, lattice.step(), budget)?;
        }
        let origin = near_node(band.fine.octets.iter().map(|octet| octet.at));
        let source = Filled::new(&band.fine, iso, lattice.spacing, origin);
        let surface = Surface::new(&source, kind, control)?;
        check_memory(&band.fine, &surface, params, attributes)?;
        control.begin(Stage::Emit)?;
        let mut mesh = Mesh {
            origin: origin.map(|n| f64::from(n) * lattice.spacing),
            vertices: filled([0.0; 3], surface.vertices()),
            triangles: filled([0; 3], surface.triangles()),
            ..Mesh::default()
        };
        surface.write_vertices(&source, &mut mesh.vertices);
        surface.write_triangles(&source, &mut mesh.triangles);

        let beyond = i32::from(has_middles);
        let points = Points { beyond, ..Points::new(&source, &surface, cells, lattice, origin) };
        if params.normals {
            mesh.normals = filled([0.0; 3], mesh.vertices.len());
            points.write(&mesh.vertices, 1, &mut mesh.normals, |of, to| field.normals(unit, of, &columns, to));
        }
        for attribute in attributes {
            let components = attribute.width();
            let mut values = vec![0.0; mesh.vertices.len() * components];
            let interpolate =
                |of: OctetVertices<'_>, to: &mut [f32]| field.interpolate(unit, of, &columns, attribute, to);
            points.write(&mesh.vertices, components, &mut values, interpolate);
            mesh.attributes.push(VertexAttribute {
                carry: attribute.carry_on(),
                ..VertexAttribute::new(attribute.name, components, values)
            });
        }
        control.check()?;
        let stats = Stats {
            particles: cells.len() as u64,
            surface_particles: 0,
            surface_nodes: 0,
            bricks_filled: source.bricks() as u64,
            bricks_crossed: surface.crossed_bricks() as u64,
            blocks: 1,
            vertices: mesh.vertices.len() as u64,
            triangles: mesh.triangles.len() as u64,
        };
        Ok((mesh, stats))
    }
}

/// Whether samples and mesh fit the limit together.
fn check_memory(
    store: &Store<1>,
    surface: &Surface,
    params: &Params,
    attributes: &[Attribute<'_>],
) -> Result<(), Error> {
    // Values, and what numbering keeps of a brick.
    const BYTES_PER_BRICK: u64 = 256 + 128;
    let per_vertex =
        12 * (1 + usize::from(params.normals)) + 4 * attributes.iter().map(Attribute::width).sum::<usize>();
    let mesh = surface.vertices() * per_vertex + surface.triangles() * 12;
    let held = Store::<1>::bytes(store.octet_count(), store.len()) + BYTES_PER_BRICK * store.len() as u64;
    match params.max_memory {
        Some(available) if held + mesh as u64 > available => {
            Err(Error::Memory { what: "the mesh in memory", needed: held + mesh as u64, available })
        }
        _ => Ok(()),
    }
}

/// The node that vertices count from: the world's origin unless all lies far from it, as for marching cubes.
fn near_node(octets: impl Iterator<Item = Coord> + Clone) -> Coord {
    const NEAR: i64 = 1 << 14;
    std::array::from_fn(|a| {
        let nodes = octets.clone().map(|at| i64::from(at[a]) * i64::from(OCTET));
        let (low, high) = nodes.fold((i64::MAX, i64::MIN), |(low, high), n| (low.min(n), high.max(n)));
        if low > high || (low > -NEAR && high < NEAR) { 0 } else { (((low + high) / 2).div_euclid(NEAR) * NEAR) as i32 }
    })
}

/// The vertices of a surface, octet by octet: who is near them is looked up for all at once.
struct Points<'a> {
    cells: &'a Cells,
    lattice: Lattice,
    origin: Coord,
    /// See [`OctetVertices`].
    beyond: i32,
    /// Where it lies, its first vertex, and the vertices of each of its bricks; with an end.
    octets: Vec<(Coord, usize, [u32; 8])>,
}

impl<'a> Points<'a> {
    fn new(source: &Filled<'_>, surface: &Surface, cells: &'a Cells, lattice: Lattice, origin: Coord) -> Self {
        let mut octets: Vec<(Coord, usize, [u32; 8])> = Vec::new();
        let mut first = 0;
        // Bricks come in Morton order, so those of an octet together.
        surface.for_each_brick(|brick, vertices| {
            let node = source.first(brick);
            let at = node.map(|n| n.div_euclid(OCTET));
            let index = (0..3).fold(0, |index, a| index | usize::from(node[a].rem_euclid(OCTET) != 0) << a);
            if octets.last().is_none_or(|octet| octet.0 != at) {
                octets.push((at, first, [0; 8]));
            }
            if let Some(octet) = octets.last_mut() {
                octet.2[index] = vertices;
            }
            first += vertices as usize;
        });
        octets.push(([0; 3], first, [0; 8]));
        Self { cells, lattice, origin, beyond: 0, octets }
    }

    /// Calls `work` with the vertices of each octet, in parallel, and with their part of `to`, which has `components` numbers a
    /// vertex.
    fn write<T: Send>(
        &self,
        vertices: &[[f32; 3]],
        components: usize,
        to: &mut [T],
        work: impl Fn(OctetVertices<'_>, &mut [T]) + Sync,
    ) {
        let first = |octet: usize| self.octets[octet].1;
        let start = |octet: usize| first(octet) * components;
        for_each_part(0..self.octets.len() - 1, to, &start, &|i, to: &mut [T]| {
            let (octet, _, counts) = self.octets[i];
            POINTS.with_borrow_mut(|scratch| {
                let of = OctetVertices {
                    cells: self.cells,
                    step: self.lattice.step(),
                    octet,
                    counts,
                    beyond: self.beyond,
                    origin: self.origin,
                    per_unit: 1.0 / self.lattice.support,
                    vertices: &vertices[first(i)..first(i + 1)],
                    scratch,
                };
                work(of, to);
            });
        });
    }
}

thread_local! {
    /// Candidates of the octet at work.
    static POINTS: RefCell<Scratch> = RefCell::default();
}
