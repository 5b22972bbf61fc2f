//! Parts that rivals in `pellicle-bench` share with the roads, so that what is compared is the method and not the code
//! around it. No part of the interface: it changes without notice.

pub use crate::{
    field::falloff::{Falloff, Triquet},
    march::tables::{CASES, Case, edge_corner},
    math::simd::{Kernel, LANES, Simd, Unit},
};

use crate::{
    Params, SolenthalerParams, Weighed,
    field::{Field, Row, anisotropic::Anisotropic, solenthaler::Solenthaler},
    lattice::CHUNK,
    lookup::gather::MAX_COLUMNS,
};

/// Zeros that come from the system untouched, on large pages where it grants them: as the roads allocate.
pub fn zeros(len: usize) -> Vec<f32> {
    crate::math::memory::filled(0.0, len)
}

/// What particles bring to a field besides their positions: at most nine numbers, a slice for each.
#[derive(Clone, Copy)]
pub struct Brought<'a>([&'a [f32]; MAX_COLUMNS]);

impl<'a> Brought<'a> {
    /// The columns of particles, in their order.
    pub fn new(columns: &'a [Vec<f32>]) -> Self {
        let mut brought = [&[][..]; MAX_COLUMNS];
        brought.iter_mut().zip(columns).for_each(|(to, from)| *to = from);
        Self(brought)
    }
}

/// A field of road A whose sums of 16 nodes are `C` vectors, to be kept anywhere.
pub trait Summed<const C: usize>: Copy + Send + Sync {
    /// Numbers that a particle brings.
    const COLUMNS: usize;
    /// The column with the square of a particle's own reach, in supports, if it has one.
    const REACH: Option<usize>;

    /// What [`add`](Self::add) takes of particle `particle`, to be computed ahead; `dist_sq` as there.
    fn kernels<S: Simd>(&self, s: S, dist_sq: S::F, brought: &Brought<'_>, particle: usize) -> [S::F; 2];

    /// Adds particle `particle` of these [`kernels`](Self::kernels): `d` is node minus particle in supports, its square `dist_sq`.
    fn add<S: Simd>(
        &self,
        s: S,
        sums: &mut [S::F; C],
        d: [S::F; 3],
        kernels: [S::F; 2],
        brought: &Brought<'_>,
        particle: usize,
    );

    /// The values of 16 nodes.
    fn value<S: Simd>(&self, s: S, sums: &[S::F; C]) -> S::F;

    /// The value at the surface.
    fn iso(&self) -> f32;
}

/// Solenthaler's field of particles of one radius.
#[derive(Debug, Clone, Copy)]
pub struct SolenthalerSums(Solenthaler<false>);

impl SolenthalerSums {
    /// With these parameters, `own` among them.
    pub fn new(params: &Params, own: SolenthalerParams) -> Self {
        Self(Solenthaler {
            iso: params.iso as f32,
            radius: (own.radius / params.smoothing_length) as f32,
            t_low: own.t_low as f32,
            t_high: own.t_high as f32,
            particles_per_support: params.smoothing_length as f32,
        })
    }
}

impl Summed<13> for SolenthalerSums {
    const COLUMNS: usize = 0;
    const REACH: Option<usize> = None;

    #[inline(always)]
    fn kernels<S: Simd>(&self, s: S, dist_sq: S::F, brought: &Brought<'_>, particle: usize) -> [S::F; 2] {
        self.0.kernels(s, dist_sq, Row { columns: &brought.0, particle })
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        s: S,
        sums: &mut [S::F; 13],
        d: [S::F; 3],
        kernels: [S::F; 2],
        brought: &Brought<'_>,
        particle: usize,
    ) {
        let mut spread = crate::field::centre::Spread::from_channels(s, sums);
        self.0.add_kernels(s, &mut spread, d, kernels, Row { columns: &brought.0, particle });
        *sums = spread.channels();
    }

    #[inline(always)]
    fn value<S: Simd>(&self, s: S, sums: &[S::F; 13]) -> S::F {
        self.0.value(s, crate::field::centre::Spread::from_channels(s, sums))
    }

    fn iso(&self) -> f32 {
        self.0.iso
    }
}

/// The field of anisotropic kernels; its columns come from [`weighed`].
#[derive(Debug, Clone, Copy)]
pub struct AnisotropicSums(Anisotropic);

impl AnisotropicSums {
    /// With these parameters.
    pub fn new(params: &Params) -> Self {
        // The other numbers serve the narrow band.
        Self(Anisotropic { iso: params.iso as f32, particles_per_support: 1.0, smallest: 1.0 })
    }
}

impl Summed<1> for AnisotropicSums {
    const COLUMNS: usize = 8;
    const REACH: Option<usize> = Anisotropic::REACH;

    #[inline(always)]
    fn kernels<S: Simd>(&self, s: S, dist_sq: S::F, brought: &Brought<'_>, particle: usize) -> [S::F; 2] {
        self.0.kernels(s, dist_sq, Row { columns: &brought.0, particle })
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        s: S,
        sums: &mut [S::F; 1],
        d: [S::F; 3],
        kernels: [S::F; 2],
        brought: &Brought<'_>,
        particle: usize,
    ) {
        self.0.add_kernels(s, &mut sums[0], d, kernels, Row { columns: &brought.0, particle });
    }

    #[inline(always)]
    fn value<S: Simd>(&self, s: S, sums: &[S::F; 1]) -> S::F {
        self.0.value(s, sums[0])
    }

    fn iso(&self) -> f32 {
        self.0.iso
    }
}

/// Particles as road A has them once they are weighed.
#[derive(Debug, Clone, Default)]
pub struct Particles {
    /// In supports, from the world's origin.
    pub positions: Vec<[f64; 3]>,
    /// What each brings besides.
    pub columns: Vec<Vec<f32>>,
    /// The support in world units.
    pub support: f64,
}

/// What road A knows of particles before it samples their field.
pub fn weighed(from: &Weighed<'_>) -> Particles {
    let (cells, columns, support) = from.parts();
    let mut positions = Vec::with_capacity(cells.len());
    for (chunk, at) in cells.chunks.iter().enumerate() {
        let corner = at.map(|v| f64::from(v * CHUNK));
        let place = |i: usize| -> [f64; 3] {
            let offset = [cells.x[i], cells.y[i], cells.z[i]];
            std::array::from_fn(|a| corner[a] + f64::from(offset[a]))
        };
        positions.extend(cells.chunk_range(chunk).map(place));
    }
    let columns = columns.iter().map(|column| column[..cells.len()].to_vec()).collect();
    Particles { positions, columns, support }
}
