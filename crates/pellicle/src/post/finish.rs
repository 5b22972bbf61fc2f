//! All verbs in the order in which they help each other: what goes is dropped first, slivers before smoothing, then fewer
//! triangles and normals; cuts come last, so that nothing bends what they made flat.
//!
//! Source: the order is splashsurf's, Löschner et al. 2023, section 5.

use super::{
    check,
    clamp::{self, clamp},
    components::{Dropped, Keep, keep},
    cut,
    decimate::{self, decimate},
    normals,
    smooth::{self, Smoothing},
    snap::{self, Nodes},
};
use crate::{
    Control, Error, Mesh, VertexAttribute,
    mesh::{
        rings::{Rings, Values},
        stars::Stars,
    },
};

/// What is done to a mesh once it is there. The default does nothing; [`Finish::good_looking`] is what to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Finish {
    /// Which components stay. Default: all.
    pub keep: Keep,
    /// Whether vertices with the same nearest lattice node are merged. Default: no.
    pub snap: bool,
    /// Whether, when they are, diagonals of level parts alternate from row to row, so that smoothing makes triangles there
    /// equilateral. Without, they keep right angles, which is better where triangles are paired to quads. Default: no.
    pub zigzag: bool,
    /// How much is smoothed. Default: not at all.
    pub smoothing: Option<Smoothing>,
    /// Where decimation ends, after smoothing. Default: all triangles stay.
    pub decimate: Option<decimate::Target>,
    /// Normals from the triangles, averaged so many times. Default: those that the mesh has, unless it is smoothed, when
    /// those no longer fit and 0 is taken.
    pub normals: Option<usize>,
    /// The box that the surface is cut at, last of all, so that its faces are flat. Default: none.
    pub clamp: Option<clamp::Bounds>,
}

impl Finish {
    /// No slivers, 25 steps of smoothing, normals averaged 10 times: smooth water from a frame of SPH particles.
    pub fn good_looking() -> Self {
        Self { snap: true, zigzag: true, smoothing: Some(Smoothing::default()), normals: Some(10), ..Self::default() }
    }

    /// Whether it does nothing.
    pub fn is_nothing(&self) -> bool {
        *self == Self::default()
    }

    /// Bytes needed besides the mesh, at the most, with the threads that are there where it is called: stars, neighbors, positions
    /// twice, and what the vertices have again where these are merged.
    pub fn memory(&self, mesh: &Mesh) -> u64 {
        let (v, t, copy) = (mesh.vertices.len() as u64, mesh.triangles.len() as u64, mesh.bytes());
        // Of the diagonals of level parts, at most a quarter of the triangles, what is turned and how.
        let turned = if self.zigzag { 26 * t } else { 0 };
        let again = if self.snap || self.keep != Keep::default() { copy + 64 * v + turned } else { 0 };
        // The mesh twice, quadrics and candidates, and the triangles of a round.
        let fewer = if self.decimate.is_some() { 2 * copy + 250 * v + 12 * t } else { 0 };
        let cut = if self.clamp.is_some() { cut::memory(mesh) } else { 0 };
        // Each thread numbers the neighbors that it meets.
        let numbers = 4 * v * (rayon::current_num_threads() as u64).min(1 + v / 10_000);
        20 * v + 24 * t + (60 * v + 16 * t + numbers).max(again).max(fewer).max(cut)
    }

    fn check(&self, mesh: &Mesh, nodes: &Nodes, crowding: Option<&[f32]>) -> Result<(), Error> {
        if let Some(values) = crowding.filter(|values| values.len() != mesh.vertices.len()) {
            return Err(Error::Length { what: "crowding".into(), found: values.len(), expected: mesh.vertices.len() });
        }
        if self.snap {
            nodes.per_unit()?;
        }
        self.decimate.map_or(Ok(()), |target| target.check())?;
        self.clamp.map_or(Ok(()), |bounds| bounds.check())?;
        self.smoothing.map_or(Ok(()), |smoothing| smoothing.check())
    }

    /// Does it all. `nodes` are those of the lattice that the mesh was made on; `crowding` is how crowded the particles are around each vertex, or `None`
    /// to smooth everywhere alike.
    ///
    /// ```
    /// # use pellicle::{Control, Params, post::{Finish, snap::Nodes}};
    /// let params = Params::new(0.025);
    /// let mut mesh = pellicle::reconstruct(&[[0.0f32; 3], [0.05, 0.0, 0.0]], &params)?;
    /// Finish::good_looking().apply(&mut mesh, &Nodes::cubic(params.spacing()), None, &Control::default())?;
    /// assert!(pellicle::mesh::Report::of(&mesh).closed_manifold());
    /// # Ok::<(), pellicle::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of the verbs, before anything is done; [`Error::Cancelled`], when the mesh may be half finished.
    pub fn apply(
        &self,
        mesh: &mut Mesh,
        nodes: &Nodes,
        crowding: Option<&[f32]>,
        control: &Control<'_>,
    ) -> Result<Dropped, Error> {
        check(mesh)?;
        self.check(mesh, nodes, crowding)?;
        // The weights travel with the vertices while these are dropped and merged.
        if let Some(values) = crowding {
            let values = values.to_vec();
            mesh.attributes.push(VertexAttribute::new("", 1, values));
        }
        let dropped = if self.keep == Keep::default() { Dropped::default() } else { keep(mesh, &self.keep, control)? };
        // Stars are large: one set of memory serves all verbs.
        let (mut stars, mut values) = (Stars::default(), Values::default());
        let mut closed = Vec::new();
        if self.snap {
            closed = snap::with_stars(mesh, &mut stars, nodes, self.zigzag, control)?;
        }
        let crowding = crowding.and_then(|_| mesh.attributes.pop());
        let stale = self.smoothing.is_some() && !mesh.normals.is_empty();
        let normals = self.normals.or(stale.then_some(0));
        let mut rings = Rings::default();
        if self.smoothing.is_some() || normals.is_some() && self.decimate.is_none() {
            if !self.snap {
                stars.rebuild(&mesh.triangles, mesh.vertices.len());
            }
            rings = Rings::of(&stars);
        }
        if let Some(smoothing) = &self.smoothing {
            if !self.snap {
                closed = stars.closed(|_| false);
            }
            let weights = crowding.map(|crowding| smooth::weights(&crowding.values));
            let weight = |v: usize| if closed[v] { weights.as_ref().map_or(1.0, |weights| weights[v]) } else { 0.0 };
            smooth::with_rings(mesh, &rings, &mut values, weight, smoothing, control)?;
        }
        if let Some(target) = self.decimate {
            // Stale normals are made again below: they need not travel.
            if normals.is_some() {
                mesh.normals.clear();
            }
            decimate(mesh, target, control)?;
            if normals.is_some() {
                stars.rebuild(&mesh.triangles, mesh.vertices.len());
                rings = Rings::of(&stars);
            }
        }
        if let Some(iterations) = normals {
            normals::with_stars(mesh, &stars, &rings, &mut values, iterations, control)?;
        }
        if let Some(bounds) = &self.clamp {
            clamp(mesh, bounds, control)?;
        }
        Ok(dropped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Attribute, Params, Reconstructor, crowding, mesh::Report};

    #[test]
    fn each_verb_works_without_the_others_and_normals_are_those_of_the_mesh_that_is_left() {
        let positions: Vec<[f32; 3]> = (0..216).map(|i| [i % 6, i / 6 % 6, i / 36].map(|v| v as f32 * 0.05)).collect();
        let params = Params::new(0.025);
        let mesh = crate::reconstruct(&positions, &params).unwrap();
        let (decimate, smoothing) = (Some(decimate::Target::Share(0.3)), Some(Smoothing::default()));
        let nothing = Finish::default();
        for finish in [
            Finish { keep: Keep { largest: Some(1), ..Keep::default() }, ..nothing },
            Finish { snap: true, ..nothing },
            Finish { smoothing, ..nothing },
            Finish { decimate, ..nothing },
            Finish { normals: Some(2), ..nothing },
            Finish { decimate, normals: Some(2), ..nothing },
            Finish { decimate, ..Finish::good_looking() },
        ] {
            let mut found = mesh.clone();
            finish.apply(&mut found, &Nodes::cubic(params.spacing()), None, &Control::default()).unwrap();
            assert!(Report::of(&found).closed_manifold());
            assert!(found != mesh || finish.keep != Keep::default(), "{finish:?} does nothing");
            assert_eq!(found.normals.len(), finish.normals.map_or(0, |_| found.vertices.len()), "{finish:?}");
            let mut want = found.clone();
            if let Some(iterations) = finish.normals {
                normals::from_triangles(&mut want, iterations, &Control::default()).unwrap();
            }
            // Those of a star are summed in another order where an edge was turned.
            let near = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-5);
            assert!(found.normals.iter().zip(&want.normals).all(near), "{finish:?}");
            found.normals.clone_from(&want.normals);
            assert_eq!(found, want, "{finish:?}");
        }
    }

    #[test]
    fn spray_keeps_its_size_where_weights_are_given() {
        let mut positions: Vec<[f32; 3]> =
            (0..512).map(|i| [i % 8, i / 8 % 8, i / 64].map(|v| v as f32 * 0.05)).collect();
        positions.push([1.0, 0.0, 0.0]);
        let params = Params::new(0.025);
        let control = Control::default();
        let crowding = crowding((&positions).into(), params.support(), &control).unwrap();
        let attributes = [Attribute::new("crowding", 1, &crowding)];
        let mut reconstructor = Reconstructor::new();
        let surface = reconstructor.extract((&positions).into(), &attributes, &params, &control).unwrap();
        let mesh = surface.to_mesh().unwrap();
        let drop_volume = |weighted: bool| {
            let mut mesh = mesh.clone();
            let crowding = mesh.attributes.pop().unwrap().values;
            let finish = Finish::good_looking();
            finish
                .apply(&mut mesh, &Nodes::cubic(params.spacing()), weighted.then_some(&crowding[..]), &control)
                .unwrap();
            assert!(Report::of(&mesh).closed_manifold() && mesh.normals.len() == mesh.vertices.len());
            assert!(mesh.attributes.is_empty());
            let drops = Keep { min_volume: 0.0, ..Keep::default() };
            let mut small = mesh.clone();
            keep(&mut small, &drops, &control).unwrap();
            let all = Report::of(&mesh).signed_volume;
            keep(&mut small, &Keep { largest: Some(1), ..drops }, &control).unwrap();
            all - Report::of(&small).signed_volume
        };
        let (free, weighted) = (drop_volume(false), drop_volume(true));
        let before = {
            let mut large = mesh.clone();
            keep(&mut large, &Keep { largest: Some(1), ..Keep::default() }, &control).unwrap();
            Report::of(&mesh).signed_volume - Report::of(&large).signed_volume
        };
        assert!(free < 0.5 * before && weighted > 0.85 * before, "{free} {weighted} {before}");
    }
}
