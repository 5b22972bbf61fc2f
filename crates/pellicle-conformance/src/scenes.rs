//! Scenes with known answers. Particles are about 0.2 apart (radius 0.1), unless a scene says otherwise.

use pellicle::Params;

/// Radius of the particles.
pub const RADIUS: f64 = 0.1;
/// Rest spacing of the particles.
pub const SPACING: f64 = 2.0 * RADIUS;

/// Particles, parameters, and what is known of their surface.
#[derive(Debug, Clone)]
pub struct Scene {
    /// What is shown when a check fails.
    pub name: String,
    /// World positions.
    pub positions: Vec<[f64; 3]>,
    /// Parameters to use; a subject changes those that must not matter.
    pub params: Params,
    /// What is known of the surface.
    pub known: Known,
}

/// What is known of a surface, `None` where nothing is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    /// Number of pieces.
    pub components: Option<usize>,
    /// Euler characteristic of all pieces together.
    pub euler: Option<i64>,
    /// Volume and its relative tolerance.
    pub volume: Option<(f64, f64)>,
    /// Area and its relative tolerance.
    pub area: Option<(f64, f64)>,
}

impl Known {
    /// Pieces and Euler characteristic.
    pub fn topology(components: usize, euler: i64) -> Self {
        Self { components: Some(components), euler: Some(euler), ..Self::default() }
    }
}

impl Scene {
    /// A scene with the default parameters, of whose surface nothing is known but that it is closed.
    pub fn new(name: impl Into<String>, positions: Vec<[f64; 3]>) -> Self {
        Self { name: name.into(), positions, params: Params::new(RADIUS), known: Known::default() }
    }

    /// With something known.
    pub fn known(mut self, known: Known) -> Self {
        self.known = known;
        self
    }

    /// Moved as a whole.
    pub fn moved(mut self, by: [f64; 3]) -> Self {
        self.positions.iter_mut().for_each(|p| *p = std::array::from_fn(|a| p[a] + by[a]));
        self
    }

    /// With another cell size, in particle radii.
    pub fn cell_size(mut self, cell_size: f64) -> Self {
        self.params.cell_size = cell_size;
        self
    }
}

/// Points of the cubic lattice of rest spacing, shifted off the origin by a little, that satisfy a condition.
pub fn lattice_points(half_extent: f64, keep: impl Fn([f64; 3]) -> bool) -> Vec<[f64; 3]> {
    let n = (half_extent / SPACING).ceil() as i32 + 1;
    let mut points = Vec::new();
    for z in -n..=n {
        for y in -n..=n {
            for x in -n..=n {
                let p = [x, y, z].map(|v| (f64::from(v) + 0.5) * SPACING);
                if keep(p) {
                    points.push(p);
                }
            }
        }
    }
    points
}

fn length(p: [f64; 3]) -> f64 {
    p.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Distance where a lone particle's field, twice [`half_spline`], falls to `iso`, in support radii.
pub fn lone_radius(iso: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if 2.0 * half_spline(middle) > iso { &mut low } else { &mut high }) = middle;
    }
    low
}

/// Half of the cubic spline's bracket at distance `s` in support radii, by its two branches: independent of the core's
/// form of it.
pub fn half_spline(s: f64) -> f64 {
    if s < 0.5 { 0.5 - 3.0 * s * s + 3.0 * s * s * s } else { (1.0 - s).max(0.0).powi(3) }
}

/// No particle.
pub fn none() -> Scene {
    Scene::new("none", Vec::new()).known(Known { volume: Some((0.0, 0.0)), ..Known::topology(0, 0) })
}

/// One particle off the lattice's nodes: a sphere of known radius.
pub fn one() -> Scene {
    let scene = Scene::new("one particle", vec![[0.031, -0.012, 0.077]]);
    let radius = lone_radius(scene.params.iso) * scene.params.support();
    let (volume, area) =
        (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3), 4.0 * std::f64::consts::PI * radius.powi(2));
    // The radius is 2.5 cells, and a polyhedron with corners on a sphere lies within: some percent.
    scene.known(Known { volume: Some((volume, 0.12)), area: Some((area, 0.08)), ..Known::topology(1, 2) })
}

/// Two particles at rest spacing: one piece.
pub fn two_touching() -> Scene {
    Scene::new("two touching", vec![[0.0; 3], [SPACING, 0.0, 0.0]]).known(Known::topology(1, 2))
}

/// Two particles more than twice the support radius apart: two pieces, alike.
pub fn two_apart() -> Scene {
    let one = one();
    let (volume, tolerance) = one.known.volume.unwrap_or_default();
    let mut scene = Scene::new("two apart", vec![[0.031, -0.012, 0.077], [0.031, 0.988, 0.077]]);
    scene.known = Known { volume: Some((2.0 * volume, tolerance)), ..Known::topology(2, 4) };
    scene
}

/// Two particles at one point: the surface of one.
pub fn coincident_pair() -> Scene {
    coincident("two at one point", 2)
}

/// A hundred particles at one point: the surface of one.
pub fn coincident_hundred() -> Scene {
    coincident("a hundred at one point", 100)
}

fn coincident(name: &str, count: usize) -> Scene {
    let one = one();
    Scene { name: name.into(), positions: vec![one.positions[0]; count], ..one }
}

/// A ball of particles.
pub fn ball() -> Scene {
    let positions = lattice_points(1.0, |p| length(p) < 1.0);
    let volume = positions.len() as f64 * SPACING.powi(3);
    // The default isovalue puts the surface close to the outermost particles' own cubes.
    Scene::new("ball", positions).known(Known { volume: Some((volume, 0.03)), ..Known::topology(1, 2) })
}

/// A torus of particles: one handle.
pub fn torus() -> Scene {
    let positions = lattice_points(1.6, |[x, y, z]| (x.hypot(y) - 1.1).hypot(z) < 0.42);
    let volume = positions.len() as f64 * SPACING.powi(3);
    Scene::new("torus", positions).known(Known { volume: Some((volume, 0.05)), ..Known::topology(1, 0) })
}

/// A hollow ball, its skin two or three particles thick: an outer and an inner surface.
pub fn shell() -> Scene {
    let positions = lattice_points(1.3, |p| (length(p) - 1.05).abs() < 0.25);
    Scene::new("hollow ball", positions).known(Known::topology(2, 4))
}

/// A sheet one particle thick, in a slanting plane.
pub fn sheet() -> Scene {
    let point = |i: i32| [f64::from(i % 16) * SPACING, f64::from(i / 16) * SPACING];
    let positions = (0..256).map(point).map(|[u, v]| [u, v, 0.3 * u - 0.2 * v + 0.013]).collect();
    Scene::new("sheet", positions).known(Known::topology(1, 2))
}

/// A slab whose top and bottom lie close to planes of lattice nodes.
///
/// Above a plane of isolated columns the field depends on the height only up to ripples; the spacing is chosen such that
/// the surface over the particles passes within a thousandth of a cell of nodes.
pub fn slab_at_nodes() -> Scene {
    let positions: Vec<[f64; 3]> =
        (0..3 * 144).map(|i| [i % 12, i / 12 % 12, i / 144].map(|v| f64::from(v) * SPACING)).collect();
    let mut scene = Scene::new("slab with its surface at nodes", positions).known(Known::topology(1, 2));
    let top = 2.0 * SPACING + surface_height(&scene, [5.0 * SPACING, 5.0 * SPACING, 2.0 * SPACING]);
    // As many cells as come near the default size, exactly up to the top.
    let cells = (top / scene.params.spacing()).round();
    scene.params.cell_size = top / cells / RADIUS;
    scene
}

/// Height above `from` where the field, summed without any lookup, falls to the isovalue.
fn surface_height(scene: &Scene, from: [f64; 3]) -> f64 {
    let support = scene.params.support();
    let near = |a: [f64; 3], b: [f64; 3]| half_spline(length(std::array::from_fn(|i| a[i] - b[i])) / support);
    let sum = |at: [f64; 3]| scene.positions.iter().map(|&p| near(at, p)).sum::<f64>();
    let weights: Vec<f64> = scene.positions.iter().map(|&p| 1.0 / sum(p)).collect();
    let field = |at: [f64; 3]| -> f64 { scene.positions.iter().zip(&weights).map(|(&p, w)| w * near(at, p)).sum() };
    let (mut low, mut high) = (0.0, support);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let inside = field([from[0], from[1], from[2] + middle]) > scene.params.iso;
        *(if inside { &mut low } else { &mut high }) = middle;
    }
    low
}

/// The ball, a million units from the world's origin.
pub fn far_from_the_origin() -> Scene {
    Scene { name: "far from the origin".into(), ..ball().moved([1e6, -1e6, 1e6]) }
}

/// The ball, where all coordinates are negative.
pub fn negative_coordinates() -> Scene {
    Scene { name: "negative coordinates".into(), ..ball().moved([-3.71, -5.13, -2.97]) }
}

/// The ball, and one particle ten thousand spacings away.
pub fn stray_particle() -> Scene {
    let mut scene = ball();
    scene.name = "stray particle".into();
    scene.positions.push([2000.03, 0.01, -0.02]);
    scene.known(Known::topology(2, 4))
}
