//! One way to make a mesh.

use std::sync::Mutex;

use pellicle::{
    Attribute, Band, Chunk, Control, Error, Lanes, Mesh, Params, Positions, Reconstructor, ScalarField, Stats, Surface,
};

use crate::Scene;

/// How the mesh leaves the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// By `write_mesh`.
    Whole,
    /// By `for_each_chunk`, put together here.
    Chunks,
}

/// How much memory may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Memory {
    /// All.
    Unlimited,
    /// About the least that is not refused: what the errors ask for, in steps of a sixteenth.
    Least,
}

/// Road A, with one field and on one backend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subject {
    /// Vector unit.
    pub lanes: Lanes,
    /// Threads of the pool.
    pub threads: usize,
    /// Where to evaluate.
    pub band: Band,
    /// How the mesh leaves.
    pub delivery: Delivery,
    /// How much memory.
    pub memory: Memory,
    /// The field, with its defaults, in place of the scene's; `None` leaves the scene alone.
    pub field: Option<ScalarField>,
}

impl Default for Subject {
    /// What a caller gets who chooses nothing, on two threads.
    fn default() -> Self {
        Self {
            lanes: Lanes::Auto,
            threads: 2,
            band: Band::Auto,
            delivery: Delivery::Whole,
            memory: Memory::Unlimited,
            field: None,
        }
    }
}

impl Subject {
    /// What all others must equal, byte for byte.
    pub fn reference() -> Self {
        Self { lanes: Lanes::Portable, threads: 1, band: Band::Full, ..Self::default() }
    }

    /// The default subject with a field of this name.
    ///
    /// # Panics
    /// When there is no such field.
    pub fn with_field(name: &str) -> Self {
        Self { field: Some(ScalarField::from_name(name).expect("a field of this name")), ..Self::default() }
    }

    /// Whether this machine has the vector unit.
    pub fn available(&self) -> bool {
        let params = Params { lanes: self.lanes, ..Params::new(1.0) };
        pellicle::reconstruct(&[] as &[[f64; 3]], &params).is_ok()
    }

    /// The scene's parameters as this subject uses them.
    pub fn params(&self, scene: &Scene) -> Params {
        let params = Params { lanes: self.lanes, band: self.band, ..scene.params.clone() };
        match self.field {
            Some(field) => Params { field, smoothing_length: field.smoothing_length(), iso: field.iso(), ..params },
            None => params,
        }
    }

    /// The scene's mesh, without attributes.
    ///
    /// # Errors
    /// Those of the library.
    pub fn mesh(&self, scene: &Scene) -> Result<Mesh, Error> {
        self.mesh_of((&scene.positions).into(), &[], &self.params(scene)).map(|(mesh, _)| mesh)
    }

    /// The mesh of any particles, and its counts. Vector unit and band are those of `params`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn mesh_of(
        &self,
        positions: Positions<'_>,
        attributes: &[Attribute<'_>],
        params: &Params,
    ) -> Result<(Mesh, Stats), Error> {
        let mut params = params.clone();
        if self.memory == Memory::Least {
            params.max_memory = Some(0);
        }
        // Each refusal names what is needed at least at its stage. Sixteenths bound the number of steps.
        for _ in 0..200 {
            match in_pool(self.threads, || self.attempt(positions, attributes, &params)) {
                Err(Error::Memory { needed, available, .. }) if self.memory == Memory::Least => {
                    let missing = needed.saturating_sub(available);
                    params.max_memory = params.max_memory.map(|limit| limit + missing.max(limit / 16));
                }
                result => return result,
            }
        }
        self.attempt(positions, attributes, &params)
    }

    fn attempt(
        &self,
        positions: Positions<'_>,
        attributes: &[Attribute<'_>],
        params: &Params,
    ) -> Result<(Mesh, Stats), Error> {
        let mut reconstructor = Reconstructor::new();
        let control = Control::default();
        let surface = reconstructor.extract(positions, attributes, params, &control)?;
        let mesh = match self.delivery {
            Delivery::Whole => surface.to_mesh()?,
            Delivery::Chunks => assemble(&surface, attributes)?,
        };
        Ok((mesh, surface.stats()))
    }
}

/// Puts the chunks of a surface together, each where it says that it belongs.
fn assemble(surface: &Surface<'_>, attributes: &[Attribute<'_>]) -> Result<Mesh, Error> {
    let chunks: Mutex<Vec<Chunk>> = Mutex::default();
    surface.for_each_chunk(|chunk| {
        chunks.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(chunk.clone());
        Ok::<(), Error>(())
    })?;
    let mut chunks = chunks.into_inner().unwrap_or_default();
    chunks.sort_by_key(|chunk| (chunk.first_vertex, chunk.first_triangle));
    let mut mesh = Mesh { origin: surface.origin(), ..Mesh::default() };
    mesh.attributes.extend(attributes.iter().map(|attribute| pellicle::VertexAttribute {
        name: attribute.name.into(),
        components: attribute.width(),
        values: Vec::new(),
        carry: attribute.carry_on(),
    }));
    for chunk in chunks {
        assert_eq!(chunk.first_vertex, mesh.vertices.len(), "chunks leave a gap or overlap");
        assert_eq!(chunk.first_triangle, mesh.triangles.len(), "chunks leave a gap or overlap");
        mesh.vertices.extend(chunk.vertices);
        mesh.normals.extend(chunk.normals);
        mesh.triangles.extend(chunk.triangles);
        for (to, from) in mesh.attributes.iter_mut().zip(chunk.attributes) {
            to.values.extend(from);
        }
    }
    assert_eq!(mesh.vertices.len(), surface.vertex_count());
    assert_eq!(mesh.triangles.len(), surface.triangle_count());
    Ok(mesh)
}

/// Runs work in a pool of so many threads.
///
/// # Panics
/// When the system refuses to start the threads.
pub fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started").install(work)
}
