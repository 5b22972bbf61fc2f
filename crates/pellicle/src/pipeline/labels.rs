//! Road C for labels: volume view → codes → counts → sums → vertices, triangles and the labels beside them.

use rustc_hash::FxHashSet;

use crate::{
    Control, Error, Stage, Volume,
    field::volume::with_samples,
    march::{
        labels::{
            codes::{Coded, Codes, labels},
            count::Counted,
            emit::Emit,
        },
        rows::Grid,
    },
    math::memory::filled,
    mesh::{LabelMesh, Mesh},
};

/// What the caller of [`contour_labels`] chooses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LabelParams {
    /// The labels whose boundaries are wanted; all others are outside, as one. `None`: all labels of the volume. Those that
    /// it does not have are left out.
    pub labels: Option<Vec<i128>>,
    /// A label that is outside whatever `labels` says, such as 0 by convention. `None`: no such label.
    pub background: Option<i128>,
    /// Most bytes that may be taken, the mesh with them; `None`: no limit.
    pub max_memory: Option<u64>,
}

/// The boundaries between the labels of a volume: samples are whole numbers, of any type, each the name of what it belongs to.
///
/// One mesh, whose triangles each lie between two labels, halfway between samples, and whose vertices neighbours share; so
/// along edges where three labels or more meet there are neither gaps nor overlaps. [`LabelMesh::surface`] is the closed
/// surface of one label. An absent node is outside; beyond a closed border all is. Same bytes for any number of threads.
///
/// ```
/// use pellicle::{Control, LabelParams, Volume, contour_labels};
/// // Three slabs of 8 × 8 × 8 samples, one on the other.
/// let samples: Vec<u8> = (0..8 * 8 * 24).map(|n| (n / (8 * 8 * 8)) as u8 + 1).collect();
/// let between = contour_labels(&Volume::new(&samples, [8, 8, 24])?, &LabelParams::default(), &Control::default())?;
/// assert_eq!(between.labels, [1, 2, 3]);
/// for (label, mesh) in between.surfaces() {
///     assert!(pellicle::mesh::Report::of(&mesh).closed_manifold(), "{label}");
/// }
/// # Ok::<(), pellicle::Error>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`] for a sample that is no whole number, [`Error::Count`] when the vertices exceed `u32`,
/// [`Error::Memory`] when the limit is too low, with the number needed, [`Error::Cancelled`].
pub fn contour_labels(volume: &Volume<'_>, params: &LabelParams, control: &Control<'_>) -> Result<LabelMesh, Error> {
    control.begin(Stage::Active)?;
    with_samples!(volume.samples(), samples => {
        let grid = Grid::new(volume, samples);
        let wanted = params.labels.as_ref().map(|labels| labels.iter().copied().collect::<FxHashSet<i128>>());
        let is_wanted = |label| {
            params.background != Some(label) && wanted.as_ref().is_none_or(|wanted| wanted.contains(&label))
        };
        let found = labels(&grid, &is_wanted, control)?;
        // Codes have 32 bits, and 0 is outside.
        if found.len() >= u32::MAX as usize {
            return Err(Error::Count { what: "labels", needed: found.len() as u64, available: u64::from(u32::MAX) - 1 });
        }
        between(&Coded::new(grid, &found), volume.origin(), found, params.max_memory, control)
    })
}

fn between(
    codes: &dyn Codes,
    origin: [f64; 3],
    labels: Vec<i128>,
    max_memory: Option<u64>,
    control: &Control<'_>,
) -> Result<LabelMesh, Error> {
    let check = |what, needed| match max_memory {
        Some(available) if needed > available => Err(Error::Memory { what, needed, available }),
        _ => Ok(()),
    };
    // Of each label its name, and its code.
    let held = Counted::bytes(codes.shape().rows()) + labels.len() as u64 * 64;
    check("the counts of a volume's rows", held)?;
    control.begin(Stage::Count)?;
    let counted = Counted::new(codes, control)?;
    let [vertices, triangles] = counted.totals();
    check("the boundaries of labels", held + 12 * vertices as u64 + 20 * triangles as u64)?;
    control.begin(Stage::Emit)?;
    let mut mesh = Mesh { origin, vertices: filled([0.0; 3], vertices), ..Mesh::default() };
    mesh.triangles = filled([0; 3], triangles);
    let mut sides = filled([0; 2], triangles);
    let emit = Emit { codes, counted: &counted };
    emit.vertices(&mut mesh.vertices);
    control.check()?;
    emit.triangles(&mut mesh.triangles, &mut sides);
    control.check()?;
    // Code 0, outside, becomes the greatest number.
    sides.as_flattened_mut().iter_mut().for_each(|side| *side = side.wrapping_sub(1));
    Ok(LabelMesh { mesh, labels, sides })
}
