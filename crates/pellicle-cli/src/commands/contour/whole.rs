//! Volumes that memory holds: all isovalues in one pass over the samples.

use pellicle::{Border, Contour, Control, Mesh, VertexNormals, Volume, contour_tetrahedra};
use pellicle_io::{VolumeData, VolumeFile, each_sample_type};

use super::output::Surface;
use super::{Method, Part, Task};
use crate::failure::Failure;
use crate::interrupt;
use crate::target::Target;
use crate::volume::Block;

impl Task<'_> {
    /// Makes the surfaces, or gives `None` where the work must go layer by layer to fit into memory.
    ///
    /// # Errors
    /// What cannot fit, because it cannot go layer by layer; all that goes wrong.
    pub fn whole(&self, file: VolumeFile, outputs: &[Target]) -> Result<Option<Vec<Surface>>, Failure> {
        let (job, header, budget) = (self.job, &self.header, &self.budget);
        // A bit for each sample and isovalue tells its side.
        let needed = header.bytes() + header.count() as u64 / 8 * job.isos.len() as u64;
        let why_not = file.why_no_layers().or(match job.method {
            Method::Cubes(_) if job.params.normals == VertexNormals::Faces => {
                Some("normals by faces want the whole mesh (use --normals gradient)")
            }
            Method::Cubes(_) => None,
            Method::Tetrahedra(_) => Some("marching tetrahedra want the whole volume (use another --method)"),
        });
        if !budget.has(needed) {
            let Some(why_not) = why_not else { return Ok(None) };
            budget.claim(needed, "the samples", why_not)?;
        }
        let data = file.read()?;
        interrupt::check()?;
        let core = |error| Failure::core(&self.frame.input, error);
        let volume = view(&data, self.block, job.border).map_err(core)?;
        let on_stage = |stage| self.clock.begin_core(stage);
        let control = Control { cancel: Some(&interrupt::TOKEN), on_stage: Some(&on_stage) };
        let isos: Vec<f64> = job.isos.iter().map(|iso| header.scaling.sample(iso.value)).collect();
        let mut surfaces = Vec::new();
        match job.method {
            Method::Cubes(_) => {
                let contour = Contour::extract(&volume, &isos, &job.params, &control).map_err(core)?;
                let largest = (0..isos.len()).map(|n| contour.mesh_bytes(n)).max().unwrap_or(0);
                if !budget.has(needed + largest) {
                    let Some(why_not) = why_not else { return Ok(None) };
                    budget.claim(needed + largest, "the samples and a mesh", why_not)?;
                }
                for (number, output) in outputs.iter().enumerate() {
                    self.clock.begin("emit");
                    let mesh = match self.is_nothing(&data, &volume, number) {
                        true => Mesh { origin: volume.origin(), ..Mesh::default() },
                        false => contour.mesh(number),
                    };
                    surfaces.push(self.finish(mesh, needed, Part::Iso(number), output)?);
                }
            }
            Method::Tetrahedra(split) => {
                for (number, output) in outputs.iter().enumerate() {
                    self.clock.begin("emit");
                    let mesh = match self.is_nothing(&data, &volume, number) {
                        true => Mesh { origin: volume.origin(), ..Mesh::default() },
                        false => contour_tetrahedra(&volume, isos[number], split, &control).map_err(core)?,
                    };
                    surfaces.push(self.finish(mesh, needed, Part::Iso(number), output)?);
                }
            }
        }
        Ok(Some(surfaces))
    }

    /// Whether all samples are on one side of the isovalue, which is told.
    fn is_nothing(&self, data: &VolumeData, volume: &Volume<'_>, number: usize) -> bool {
        let scaling = data.header.scaling;
        let is_nothing = is_one_sided(volume, scaling.sample(self.job.isos[number].value));
        if is_nothing {
            let range = volume.range().map(|(low, high)| [scaling.value(low), scaling.value(high)]);
            self.job.tell_nothing(&self.frame.input, number, range);
        }
        is_nothing
    }
}

/// The core's view of what is kept of a volume.
pub fn view(data: &VolumeData, block: Block, border: Border) -> Result<Volume<'_>, pellicle::Error> {
    let (header, strides) = (&data.header, data.header.strides());
    let first = (0..3).map(|axis| block.first[axis] * strides[axis]).sum();
    let strides = strides.map(|stride| stride as isize);
    let volume = each_sample_type!(&data.samples, values => {
        Volume::strided(values.as_slice(), block.dims, first, strides)
    })?;
    let volume = volume.with_origin(block.origin(&header.grid))?.with_directions(header.grid.steps)?;
    Ok(volume.with_border(border))
}

/// Whether no sample, or every sample, is greater than the isovalue.
fn is_one_sided(volume: &Volume<'_>, iso: f64) -> bool {
    let [x, y, z] = volume.dims();
    // Absent samples are outside.
    let is_inside = |node| volume.value(node).is_some_and(|value| value > iso);
    let first = is_inside([0; 3]);
    let mut rows = (0..z).flat_map(|k| (0..y).map(move |j| [j, k]));
    rows.all(|[j, k]| (0..x).all(|i| is_inside([i, j, k]) == first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_told_with_absent_samples_outside() {
        let mut samples = vec![1.0f32; 8];
        let one_sided = |samples: &[f32], iso| is_one_sided(&Volume::new(samples, [2; 3]).unwrap(), iso);
        assert!(one_sided(&samples, 0.5) && one_sided(&samples, 1.0));
        samples[7] = f32::NAN;
        assert!(!one_sided(&samples, 0.5) && one_sided(&samples, 1.0));
    }
}
