//! From the field that was asked for to the one that is computed: its type, its support, and the columns of its particles.

use rayon::prelude::*;

use super::Reconstructor;
use crate::{
    AnisotropicParams, Control, Error, MetaballKernel, Params, Positions, ScalarField, SolenthalerParams,
    field::{
        adams::Depths,
        anisotropic::{self, Anisotropic, RECORD, Shapes, Surroundings},
        density,
        falloff::{Falloff, InverseSquare, Triquet, Wyvill},
        metaball::Metaballs,
        onderik::{self, Onderik},
        solenthaler::Solenthaler,
        sph::{Sph, SphOfRadii},
        zhu_bridson::ZhuBridson,
    },
    fill::any::AnyField,
    lattice::Lattice,
    lookup::cells::Cells,
    math::simd::{LANES, Unit},
};

/// A field, ready for its particles.
pub(super) struct Chosen {
    pub(super) field: Box<dyn AnyField>,
    /// What is sampled in its place on the coarse lattice, if another does it for less.
    pub(super) sampler: Option<Box<dyn AnyField>>,
    /// Support radius in world units: the farthest that any particle reaches.
    pub(super) support: f64,
    /// Columns that the particles will have.
    pub(super) columns: usize,
}

/// One type where particles bring radii, another where they don't.
macro_rules! of_radii {
    ($has_radii:expr, $field:ident { $($entry:ident),* }) => {
        if $has_radii {
            Box::new($field::<true> { $($entry),* }) as Box<dyn AnyField>
        } else {
            Box::new($field::<false> { $($entry),* })
        }
    };
}

/// The field of these parameters.
pub(super) fn choose(params: &Params, positions: Positions<'_>) -> Result<Chosen, Error> {
    let radii = positions.radii();
    let [smallest, largest] = check_radii(radii, positions.len())?.unwrap_or([1.0; 2]);
    let has_radii = radii.is_some();
    let (iso, particles_per_support) = (params.iso as f32, params.smoothing_length as f32);
    let in_support_units = |spacings: f64| (spacings / params.smoothing_length) as f32;
    let mut support = params.support();
    let mut sampler = None;
    let (field, columns): (Box<dyn AnyField>, usize) = match params.field {
        ScalarField::Sph if has_radii => {
            // The largest particle's.
            support = 2.0 * params.smoothing_length * largest;
            let smallest = (smallest / largest) as f32;
            (Box::new(SphOfRadii { iso, particles_per_support, smallest }), 3)
        }
        ScalarField::Sph => (Box::new(Sph { iso, particles_per_support }), 1),
        ScalarField::ZhuBridson(own) => {
            let radius = in_support_units(own.radius);
            (of_radii!(has_radii, ZhuBridson { iso, radius, particles_per_support }), usize::from(has_radii))
        }
        ScalarField::Solenthaler(own) => {
            let (radius, t_low, t_high) = (in_support_units(own.radius), own.t_low as f32, own.t_high as f32);
            let field = of_radii!(has_radii, Solenthaler { iso, radius, t_low, t_high, particles_per_support });
            // Where particles are as dense as samples that count ask for, and the centre as slow, the two are nearly one: it moves
            // as fast as x, EV = 1. Thresholds below the defaults take more of the radius there.
            let default = SolenthalerParams::default();
            if own.t_low >= default.t_low && own.t_high >= default.t_high {
                sampler = Some(of_radii!(has_radii, ZhuBridson { iso, radius, particles_per_support }));
            }
            (field, usize::from(has_radii))
        }
        ScalarField::Adams => {
            let radius = in_support_units(1.0);
            (Box::new(ZhuBridson::<true> { iso, radius, particles_per_support }), 1)
        }
        ScalarField::Onderik(own) => {
            let (radius, w_min, w_max) = (in_support_units(own.radius), own.w_min as f32, own.w_max as f32);
            let field = of_radii!(has_radii, Onderik { iso, radius, w_min, w_max, particles_per_support });
            (field, 1 + usize::from(has_radii))
        }
        ScalarField::Anisotropic(own) => {
            // Neighbourhoods are looked up first, twice as wide as the largest particle's kernel.
            let share = if has_radii { largest / params.particle_radius } else { 1.0 };
            support *= 2.0 * share;
            let particles_per_support = (params.smoothing_length * shapes(own).longest()) as f32;
            let smallest = (smallest / largest) as f32;
            let field = Anisotropic { iso, particles_per_support, smallest };
            // Beside the columns, what they are made of: records, rows, places and moved positions.
            (Box::new(field), 2 * anisotropic::COLUMNS + RECORD + 7)
        }
        ScalarField::Metaball(own) => {
            support *= largest / if has_radii { params.particle_radius } else { 1.0 };
            let smallest = (smallest / largest) as f32;
            let balls = Balls { iso, particles_per_support, smallest, has_radii };
            let radius_sq = |radius: f64| in_support_units(radius).powi(2);
            // Four pi times the integral of s² w.
            let field = match own.kernel {
                MetaballKernel::Triquet => balls.of(Triquet, 0.2394),
                MetaballKernel::Wyvill => balls.of(Wyvill, 0.8155),
                MetaballKernel::InverseSquare { radius } => {
                    let radius_sq = radius_sq(radius);
                    balls.of(InverseSquare { radius_sq }, 8.378 * radius_sq)
                }
            };
            (field, if has_radii { 3 } else { 0 })
        }
    };
    if support.is_normal() && (1.0 / support).is_normal() {
        Ok(Chosen { field, sampler, support, columns })
    } else {
        let must = "not so large that supports overflow";
        Err(Error::Parameter { name: "radii", value: largest, must })
    }
}

/// Metaballs, but for their function.
struct Balls {
    iso: f32,
    particles_per_support: f32,
    smallest: f32,
    has_radii: bool,
}

impl Balls {
    /// With a function, and its integral over all of its support.
    fn of<W: Falloff + 'static>(&self, falloff: W, integral: f32) -> Box<dyn AnyField> {
        let Self { iso, particles_per_support, smallest, has_radii } = *self;
        let bulk = integral * particles_per_support.powi(3);
        if has_radii {
            Box::new(Metaballs::<W, true> { falloff, iso, particles_per_support, smallest, bulk })
        } else {
            Box::new(Metaballs::<W, false> { falloff, iso, particles_per_support, smallest, bulk })
        }
    }
}

/// Computes the columns of the sorted particles.
pub(super) fn weigh(
    from: &mut Reconstructor,
    unit: Unit,
    lattice: Lattice,
    params: &Params,
    positions: Positions<'_>,
    control: &Control<'_>,
) -> Result<Lattice, Error> {
    let Reconstructor { cells, columns, moved, .. } = from;
    let radii = positions.radii();
    let (n, order) = (cells.len(), cells.order());
    // A column of each particle's radius, made by a rule, in canonical order.
    let of_radii = |rule: &dyn Fn(f64) -> f64| -> Option<Vec<f32>> {
        let radii = radii?;
        Some(order.iter().map(|&i| rule(f64::from(radii[i as usize])) as f32).chain([0.0; LANES]).collect())
    };
    // A particle's spacing is twice its radius.
    let spacings = |factor: f64| of_radii(&|r| 2.0 * factor * r / lattice.support);
    // Its support over the largest one.
    let share = |r: f64| r * 2.0 * params.smoothing_length / lattice.support;
    // A little rounded up, so that rounding of distances loses nobody.
    let reaches =
        |per_support_sq: &[f32]| per_support_sq.iter().map(|v| if *v > 0.0 { 1.000_01 / v } else { 0.0 }).collect();
    match params.field {
        ScalarField::Sph => {
            let own = of_radii(&|r| share(r).powi(3)).zip(of_radii(&|r| share(r).powi(-2)));
            if let Some((masses, per_support_sq)) = own {
                columns.resize_with(3, Vec::new);
                let own = density::Own { masses: &masses, per_support_sq: &per_support_sq };
                own.weights(unit, cells, control, &mut columns[0]);
                columns[2] = reaches(&per_support_sq);
                columns[1] = per_support_sq;
            } else {
                columns.resize_with(1, Vec::new);
                density::weights(unit, cells, control, &mut columns[0]);
            }
        }
        ScalarField::ZhuBridson(own) => {
            columns.clear();
            columns.extend(spacings(own.radius));
        }
        ScalarField::Solenthaler(own) => {
            columns.clear();
            columns.extend(spacings(own.radius));
        }
        ScalarField::Adams => {
            columns.resize_with(1, Vec::new);
            Depths::new(params.smoothing_length, spacings(0.5)).write(unit, cells, control, &mut columns[0]);
        }
        ScalarField::Onderik(own) => {
            columns.resize_with(1, Vec::new);
            onderik::volumes(unit, cells, control, &mut columns[0]);
            columns.extend(spacings(own.radius));
        }
        ScalarField::Anisotropic(own) => {
            // Half of the looked-up neighbourhood is the largest particle's support.
            let largest = |r: f64| r * 4.0 * params.smoothing_length / lattice.support;
            let sizes = of_radii(&largest).unwrap_or_else(|| vec![1.0; n + LANES]);
            return moved.columns(&shapes(own), unit, cells, &sizes, lattice, positions, columns, control);
        }
        ScalarField::Metaball(_) => {
            columns.clear();
            if let Some(per_support_sq) = of_radii(&|r| share(r).powi(-2)) {
                let reaches = reaches(&per_support_sq);
                columns.extend([per_support_sq, vec![1.0; n + LANES], reaches]);
            }
        }
    }
    debug_assert!(columns.iter().all(|column| column.len() >= n + LANES));
    Ok(lattice)
}

fn shapes(own: AnisotropicParams) -> Shapes {
    let AnisotropicParams { smoothing, max_stretch, isolated_scale, min_neighbors } = own;
    Shapes { smoothing, max_stretch, isolated_scale, min_neighbors }
}

/// Particles that a field moves, and what it takes to move them. Reused from frame to frame.
#[derive(Default)]
pub(super) struct Moved {
    records: Vec<f32>,
    positions: Vec<[f64; 3]>,
    /// Place of each of the caller's particles in the records.
    places: Vec<u32>,
}

impl Moved {
    /// Looks at the particles' surroundings, moves them, sorts them again for the field's own lookup, and writes its columns. Sizes
    /// are h over the largest one.
    #[expect(clippy::too_many_arguments, reason = "the whole of a stage")]
    fn columns(
        &mut self,
        shapes: &Shapes,
        unit: Unit,
        cells: &mut Cells,
        sizes: &[f32],
        lattice: Lattice,
        positions: Positions<'_>,
        to: &mut Vec<Vec<f32>>,
        control: &Control<'_>,
    ) -> Result<Lattice, Error> {
        let masses: Vec<f32> = sizes.iter().map(|h| h * h * h).collect();
        let per_support_sq: Vec<f32> = sizes.iter().map(|h| 4.0 / (h * h)).collect();
        let surroundings = Surroundings { masses: &masses, per_support_sq: &per_support_sq };
        surroundings.write(unit, cells, control, &mut self.records);
        control.check()?;
        let records = &self.records;
        let record = |place: usize| &records[place * RECORD..][..RECORD];
        self.places.resize(cells.len(), 0);
        for (place, &index) in cells.order().iter().enumerate() {
            self.places[index as usize] = place as u32;
        }
        let places = &self.places;
        let moved = (0..cells.len()).into_par_iter().map(|index| {
            let shift = shapes.shift(record(places[index] as usize));
            let at = positions.get(index);
            std::array::from_fn(|a| at[a] + shift[a] * lattice.support)
        });
        moved.collect_into_vec(&mut self.positions);
        let lattice = Lattice { support: 0.5 * lattice.support * shapes.longest(), ..lattice };
        cells.build((&self.positions).into(), lattice)?;
        let rows = cells.order().par_iter().map(|&index| {
            let place = places[index as usize] as usize;
            shapes.columns(record(place), f64::from(sizes[place]) / shapes.longest())
        });
        let rows: Vec<[f32; anisotropic::COLUMNS]> = rows.collect();
        to.resize_with(anisotropic::COLUMNS, Vec::new);
        for (c, column) in to.iter_mut().enumerate() {
            column.clear();
            column.extend(rows.iter().map(|row| row[c]).chain([0.0; LANES]));
        }
        Ok(lattice)
    }
}

/// The particles' volumes in cubic world units, in canonical order, if the field computes them.
pub(super) fn volumes<'a>(
    field: ScalarField,
    lattice: Lattice,
    columns: &'a [Vec<f32>],
    count: usize,
) -> Option<impl Iterator<Item = f64> + 'a> {
    match field {
        ScalarField::Sph => {
            // The kernel's factor is 16/(π h³), see `field::kernel`; a support of its own stands in a second column.
            let unit = std::f64::consts::PI / 16.0 * lattice.support.powi(3);
            let own = move |i: usize| columns.get(1).map_or(1.0, |column| f64::from(column[i]).powf(-1.5));
            Some(columns.first()?[..count].iter().enumerate().map(move |(i, &w)| unit * own(i) * f64::from(w)))
        }
        _ => None,
    }
}

/// The columns as slices.
pub(super) fn slices(columns: &[Vec<f32>]) -> Vec<&[f32]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// As many radii as particles, each a length. The smallest and the largest.
fn check_radii(radii: Option<&[f32]>, particles: usize) -> Result<Option<[f64; 2]>, Error> {
    let Some(radii) = radii else { return Ok(None) };
    if radii.len() != particles {
        return Err(Error::Length { what: "radii".into(), found: radii.len(), expected: particles });
    }
    if let Some(index) = radii.iter().position(|r| !(r.is_normal() && *r > 0.0)) {
        return Err(Error::Radius { index, radius: radii[index] });
    }
    let fold = |start, pick: fn(f32, f32) -> f32| f64::from(radii.iter().copied().fold(start, pick));
    Ok((particles > 0).then(|| [fold(f32::MAX, f32::min), fold(0.0, f32::max)]))
}
