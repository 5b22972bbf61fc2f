//! Volumes of labels: the closed surface of each label, in a file of its own.
//!
//! One mesh between all labels is made first, so that what neighbours share is the same in both files, vertex for vertex. What
//! finishes a mesh works on each label by itself: smoothing moves neighbours apart.

use pellicle::{Control, LabelParams, contour_labels};
use pellicle_io::{Scaling, VolumeFile};

use super::output::Surface;
use super::whole::view;
use super::{Part, Task};
use crate::failure::Failure;
use crate::interrupt;
use crate::target::Target;
use crate::values::Labels;

impl Task<'_> {
    /// Makes and writes the surfaces.
    ///
    /// # Errors
    /// What does not fit into memory, a volume whose samples are no labels, labels that it does not have.
    pub fn labels(&self, file: VolumeFile, wanted: &Labels) -> Result<Vec<Surface>, Failure> {
        let (job, header, input) = (self.job, &self.header, &self.frame.input);
        if header.scaling != Scaling::default() {
            let Scaling { slope, intercept } = header.scaling;
            let what =
                format!("its values are {slope} times the samples plus {intercept}: labels are samples as they are");
            return Err(Failure::file(input, what));
        }
        self.budget.claim(header.bytes(), "the samples", "labels want the whole volume")?;
        let data = file.read()?;
        interrupt::check()?;
        let core = |error| Failure::core(input, error);
        let volume = view(&data, self.block, job.border).map_err(core)?;
        let on_stage = |stage| self.clock.begin_core(stage);
        let control = Control { cancel: Some(&interrupt::TOKEN), on_stage: Some(&on_stage) };
        let (labels, background) = match wanted {
            Labels::All => (None, Some(0)),
            Labels::Some(labels) => (Some(labels.clone()), None),
        };
        let params = LabelParams { labels, background, max_memory: self.budget.left(header.bytes()) };
        let between = contour_labels(&volume, &params, &control).map_err(core)?;
        if let Labels::Some(labels) = wanted {
            for label in labels.iter().filter(|label| between.labels.binary_search(label).is_err()) {
                job.console.warn(format!("{}: no sample is labelled {label}", input.display()));
            }
        }
        let all = &between.mesh;
        let held = header.bytes() + 12 * all.vertices.len() as u64 + 20 * all.triangles.len() as u64;
        let mut surfaces = Vec::new();
        for (label, mesh) in between.surfaces() {
            interrupt::check()?;
            let output = Target::new(job.named(&self.frame.output, Part::Label(label)))?;
            output.check()?;
            surfaces.push(self.finish(mesh, held, Part::Label(label), &output)?);
        }
        Ok(surfaces)
    }
}
