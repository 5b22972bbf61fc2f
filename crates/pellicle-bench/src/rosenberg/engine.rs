//! Approach 1: pellicle's engine, as one of the approaches.

use pellicle::realtime::{Engine, Params};
use pellicle::sink::{Part, Sink};

use crate::rivals::{Approach, Output, Task};

/// The engine.
pub struct Slices {
    engine: Engine,
    cache_bytes: usize,
}

impl Slices {
    pub fn new(task: Task) -> Result<Self, String> {
        let params = Params { iso: task.iso.into(), ..Params::new(task.support, task.spacing) };
        let engine = Engine::new(params).map_err(|error| error.to_string())?;
        Ok(Self { engine, cache_bytes: 0 })
    }
}

/// Writes to the rivals' kind of output.
struct Into<'a>(&'a mut Output);

impl Sink for Into<'_> {
    fn begin(&mut self, _: [f64; 3]) {
        self.0.start();
    }

    fn append(&mut self, part: Part<'_>) {
        let interleaved = part.positions.iter().zip(part.normals).map(|(p, n)| [p[0], p[1], p[2], n[0], n[1], n[2]]);
        self.0.vertices.extend(interleaved);
        self.0.indices.extend(part.triangles.as_flattened());
    }

    fn end(&mut self) -> Result<(), pellicle::Error> {
        Ok(())
    }
}

impl Approach for Slices {
    fn update(&mut self, positions: &[[f32; 3]], out: &mut Output) {
        // A show's particles are finite and lie near the origin, so there is nothing to fail.
        let Ok(frame) = self.engine.update(positions, &mut Into(out)) else { return };
        (out.cubes, out.corners) = (frame.counts.cubes as usize, frame.counts.corners as usize);
        self.cache_bytes = self.cache_bytes.max(frame.counts.cache_bytes as usize + frame.particle_bytes);
    }

    fn cache_bytes(&self) -> usize {
        self.cache_bytes
    }
}
