//! Which scalar field the surface is a level set of, and each field's own parameters.

use super::Params;
use crate::Error;

/// A scalar field of the literature. The surface is where it equals the isovalue ([`Params::iso`]).
///
/// Every field sums over the particles within its support radius, [`Params::smoothing_length`] spacings. Where particles
/// [bring radii](crate::Positions::with_radii), each says what they do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum ScalarField {
    /// The SPH colour field Σ V_j W, about 1 inside and 0 outside (Müller, Charypar, Gross 2003); splashsurf's. Bumpy, fast.
    /// Own radii scale a particle's mass and its support.
    #[default]
    Sph,
    /// The distance to the weighted centre of the particles around (Zhu, Bridson 2005). Flat, with blobs in hollows and between
    /// splashes. Isovalue in spacings. Own radii take the place of the common one.
    ZhuBridson(ZhuBridsonParams),
    /// As Zhu–Bridson, with blobs taken away where the centre moves fast (Solenthaler, Schläfli, Pajarola 2007): the field of
    /// Akinci et al. 2012. Isovalue in spacings. Own radii take the place of the common one.
    Solenthaler(SolenthalerParams),
    /// As Zhu–Bridson, with each particle's distance to the surface in place of its radius (Adams, Pauly, Keiser, Guibas 2007);
    /// the distances are estimated from the particles around. Isovalue in spacings. Own radii are the least distances.
    Adams,
    /// As Zhu–Bridson, with a radius that shrinks where the fluid around is thin (Onderik, Chládek, Ďurikovič 2011). Isovalue in
    /// spacings. Own radii take the place of the common one.
    Onderik(OnderikParams),
    /// The colour field with kernels that lie along the fluid, around smoothed places (Yu, Turk 2010): about 1 inside and 0 outside.
    /// The smoothest, and the slowest. The kernel's support is [`Params::smoothing_length`] spacings. Own radii scale a particle's
    /// mass and support.
    Anisotropic(AnisotropicParams),
    /// A sum of one function for each particle, volumes left aside. Bumpy. Own radii scale a particle's support.
    Metaball(MetaballParams),
}

/// Parameters of [`ScalarField::ZhuBridson`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZhuBridsonParams {
    /// Radius r̄ of the particles, in spacings: how far from the weighted centre the surface lies. > 0, default 1. Of particles
    /// that bring their own radius it is a factor of twice that.
    pub radius: f64,
}

impl Default for ZhuBridsonParams {
    fn default() -> Self {
        Self { radius: 1.0 }
    }
}

/// Parameters of [`ScalarField::Solenthaler`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolenthalerParams {
    /// As [`ZhuBridsonParams::radius`].
    pub radius: f64,
    /// Largest eigenvalue of the centre's Jacobian below which the radius counts in full. Finite, default 0.4.
    pub t_low: f64,
    /// Largest eigenvalue from which on the radius is 0. Above `t_low`, default 3.5; 2 in the original paper, which takes more
    /// blobs away and makes rougher surfaces.
    pub t_high: f64,
}

impl Default for SolenthalerParams {
    fn default() -> Self {
        Self { radius: 1.0, t_low: 0.4, t_high: 3.5 }
    }
}

/// Parameters of [`ScalarField::Onderik`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnderikParams {
    /// As [`ZhuBridsonParams::radius`].
    pub radius: f64,
    /// Sum of the volume-weighted kernels, about 1 in a fluid and ½ at its surface, up to which the radius is 0. Default 0.
    pub w_min: f64,
    /// The sum from which on the radius counts in full. Above `w_min`, default 1.05.
    pub w_max: f64,
}

impl Default for OnderikParams {
    fn default() -> Self {
        Self { radius: 1.0, w_min: 0.0, w_max: 1.05 }
    }
}

/// Parameters of [`ScalarField::Anisotropic`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnisotropicParams {
    /// How far particles are moved to the mean of their neighbours, λ: 0 to 1, default 0.9. More is smoother and shrinks more.
    pub smoothing: f64,
    /// Largest ratio of an ellipsoid's half axes, k_r. 1 to 100, default 4.
    pub max_stretch: f64,
    /// Size of particles with few neighbours, k_n, as a part of the support. > 0, at most 1, default 0.5.
    pub isolated_scale: f64,
    /// Those with so many neighbours or fewer, N_ε, stay balls. 0 or more, default 25.
    pub min_neighbors: f64,
}

impl Default for AnisotropicParams {
    fn default() -> Self {
        Self { smoothing: 0.9, max_stretch: 4.0, isolated_scale: 0.5, min_neighbors: 25.0 }
    }
}

/// Parameters of [`ScalarField::Metaball`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MetaballParams {
    /// The function.
    pub kernel: MetaballKernel,
}

/// The function that metaballs sum, of the distance s in support radii.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum MetaballKernel {
    /// (1 − s²)²/4, of Triquet et al. 2001, as Rosenberg & Birdwell 2008 have it. Isovalue 0.2.
    #[default]
    Triquet,
    /// 1 − 4/9 s⁶ + 17/9 s⁴ − 22/9 s², of Wyvill, McPheeters, Wyvill 1986. Isovalue 0.5.
    Wyvill,
    /// ρ² (1/s² − 1), of Uralsky 2006 with a cut-off. Isovalue 1.
    InverseSquare {
        /// Radius ρ of a lone particle's ball without the cut-off, in spacings. > 0, default ½.
        radius: f64,
    },
}

/// A parameter of a field's own, by name.
#[derive(Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldParameter<'a> {
    /// As on the command line.
    pub name: &'static str,
    /// Its value, to read or to set; [`Params::check`] judges it.
    pub value: &'a mut f64,
    /// What it counts in; empty for a bare number.
    pub unit: &'static str,
    /// What it does, in a few words.
    pub what: &'static str,
}

impl ScalarField {
    /// The names of all fields, in the order of the enumeration.
    pub const NAMES: [&'static str; 9] = [
        "sph",
        "zhu-bridson",
        "solenthaler",
        "adams",
        "onderik",
        "anisotropic",
        "metaball",
        "metaball-wyvill",
        "metaball-inverse-square",
    ];

    /// The field of this name, with default parameters.
    ///
    /// ```
    /// use pellicle::ScalarField;
    ///
    /// let mut field = ScalarField::from_name("solenthaler").expect("a name");
    /// for parameter in field.parameters().into_iter().filter(|p| p.name == "t-high") {
    ///     *parameter.value = 2.0;
    /// }
    /// assert!(matches!(field, ScalarField::Solenthaler(p) if p.t_high == 2.0));
    /// ```
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [
            Self::Sph,
            Self::ZhuBridson(Default::default()),
            Self::Solenthaler(Default::default()),
            Self::Adams,
            Self::Onderik(Default::default()),
            Self::Anisotropic(Default::default()),
            Self::Metaball(MetaballParams { kernel: MetaballKernel::Triquet }),
            Self::Metaball(MetaballParams { kernel: MetaballKernel::Wyvill }),
            Self::Metaball(MetaballParams { kernel: MetaballKernel::InverseSquare { radius: 0.5 } }),
        ];
        all.into_iter().find(|field| field.name() == name)
    }

    /// The name, as on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sph => "sph",
            Self::ZhuBridson(_) => "zhu-bridson",
            Self::Solenthaler(_) => "solenthaler",
            Self::Adams => "adams",
            Self::Onderik(_) => "onderik",
            Self::Anisotropic(_) => "anisotropic",
            Self::Metaball(own) => match own.kernel {
                MetaballKernel::Triquet => "metaball",
                MetaballKernel::Wyvill => "metaball-wyvill",
                MetaballKernel::InverseSquare { .. } => "metaball-inverse-square",
            },
        }
    }

    /// The field's own parameters, by name.
    pub fn parameters(&mut self) -> Vec<FieldParameter<'_>> {
        let entry = |name, value, unit, what| FieldParameter { name, value, unit, what };
        let radius = |value| entry("radius", value, "spacings", "from the weighted centre to the surface");
        match self {
            Self::Sph | Self::Adams => Vec::new(),
            Self::ZhuBridson(own) => vec![radius(&mut own.radius)],
            Self::Solenthaler(own) => vec![
                radius(&mut own.radius),
                entry("t-low", &mut own.t_low, "", "eigenvalue from which on the radius shrinks"),
                entry("t-high", &mut own.t_high, "", "eigenvalue from which on it is 0"),
            ],
            Self::Onderik(own) => vec![
                radius(&mut own.radius),
                entry("w-min", &mut own.w_min, "", "sum of kernels up to which the radius is 0"),
                entry("w-max", &mut own.w_max, "", "sum of kernels from which on it is full"),
            ],
            Self::Anisotropic(own) => vec![
                entry("smoothing", &mut own.smoothing, "", "how far particles move to their neighbours' mean, 0 to 1"),
                entry("max-stretch", &mut own.max_stretch, "", "largest ratio of an ellipsoid's axes"),
                entry("isolated-scale", &mut own.isolated_scale, "supports", "size of particles with few neighbours"),
                entry("min-neighbors", &mut own.min_neighbors, "particles", "so many, or fewer, are few"),
            ],
            Self::Metaball(own) => match &mut own.kernel {
                MetaballKernel::InverseSquare { radius } => vec![entry("radius", radius, "spacings", "of a lone ball")],
                MetaballKernel::Triquet | MetaballKernel::Wyvill => Vec::new(),
            },
        }
    }

    /// Default of [`Params::smoothing_length`]: the support radius in spacings.
    pub fn smoothing_length(&self) -> f64 {
        match self {
            Self::Sph | Self::Anisotropic(_) => 2.0,
            Self::ZhuBridson(_) | Self::Solenthaler(_) | Self::Adams | Self::Onderik(_) => 4.0,
            Self::Metaball(_) => 1.5,
        }
    }

    /// Default of [`Params::iso`].
    pub fn iso(&self) -> f64 {
        match self {
            Self::Sph => 0.6,
            Self::Anisotropic(_) => 0.5,
            Self::ZhuBridson(_) | Self::Solenthaler(_) | Self::Adams | Self::Onderik(_) => 0.0,
            Self::Metaball(own) => match own.kernel {
                MetaballKernel::Triquet => 0.2,
                MetaballKernel::Wyvill => 0.5,
                MetaballKernel::InverseSquare { .. } => 1.0,
            },
        }
    }

    /// Checks the field's own parameters, the isovalue and the support.
    pub(super) fn check(&self, params: &Params) -> Result<(), Error> {
        match self {
            Self::Sph => positive("iso", params.iso),
            Self::ZhuBridson(own) => check_distance(own.radius, params),
            Self::Solenthaler(own) => {
                check_distance(own.radius, params)?;
                within("t_low", own.t_low, -1e3..=1e3, "between -1000 and 1000")?;
                let least = own.t_low + 1e-3;
                within("t_high", own.t_high, least..=1e6, "greater than t_low by 0.001 or more, and at most 1e6")
            }
            Self::Adams => check_distance(0.5, params),
            Self::Onderik(own) => {
                check_distance(own.radius, params)?;
                within("w_min", own.w_min, -1e3..=1e3, "between -1000 and 1000")?;
                let least = own.w_min + 1e-3;
                within("w_max", own.w_max, least..=1e6, "greater than w_min by 0.001 or more, and at most 1e6")
            }
            Self::Anisotropic(own) => {
                positive("iso", params.iso)?;
                within("smoothing", own.smoothing, 0.0..=1.0, "between 0 and 1")?;
                within("max_stretch", own.max_stretch, 1.0..=100.0, "between 1 and 100")?;
                within("isolated_scale", own.isolated_scale, 1e-3..=1.0, "between 0.001 and 1")?;
                within("min_neighbors", own.min_neighbors, 0.0..=1e9, "between 0 and 1e9")
            }
            Self::Metaball(own) => {
                positive("iso", params.iso)?;
                match own.kernel {
                    MetaballKernel::InverseSquare { radius } => {
                        within("radius", radius, 1e-3..=1e3, "between 0.001 and 1000 spacings")
                    }
                    MetaballKernel::Triquet | MetaballKernel::Wyvill => Ok(()),
                }
            }
        }
    }
}

/// Radius, isovalue and support of a field that measures distance.
fn check_distance(radius: f64, params: &Params) -> Result<(), Error> {
    within("radius", radius, 1e-3..=1e3, "between 0.001 and 1000 spacings")?;
    within("iso", params.iso, -1e3..=radius, "a number of spacings, at most the field's radius")?;
    // A lone particle's ball would be cut off by its support.
    let must = "more than the field's radius less the isovalue, both in spacings";
    within("smoothing_length", params.smoothing_length, (radius - params.iso).next_up()..=f64::MAX, must)
}

fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    within(name, value, f64::MIN_POSITIVE..=f64::MAX, "a finite number greater than 0")
}

fn within(
    name: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    must: &'static str,
) -> Result<(), Error> {
    if range.contains(&value) { Ok(()) } else { Err(Error::Parameter { name, value, must }) }
}
