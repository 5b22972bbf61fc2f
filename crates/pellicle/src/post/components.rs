//! Droplets and cavities: whole components kept or dropped.
//!
//! A component is what hangs together through triangles. One that winds outward encloses a positive volume; one that winds
//! inward, the wall of a cavity within the fluid, a negative one. Dropping components changes no other: closed manifolds
//! stay such.
//!
//! Source: this project.

use super::{
    check,
    rebuild::{NONE, merge},
};
use crate::{
    Control, Error, Mesh,
    math::{
        union_find::{join, root},
        vector::{cross, dot, subtract},
    },
};

/// Which components stay.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Keep {
    /// Smallest volume that an outer surface must enclose, in cubic world units. Default 0: all.
    pub min_volume: f64,
    /// What happens to the walls of cavities.
    pub cavities: Cavities,
    /// How many components stay at most, those of the largest volume. Default: all.
    pub largest: Option<usize>,
}

/// Surfaces that wind inward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cavities {
    /// They stay, whatever their size.
    #[default]
    Keep,
    /// They go: the fluid is filled.
    Fill,
}

/// What was dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dropped {
    /// Outer surfaces.
    pub droplets: usize,
    /// Walls of cavities.
    pub cavities: usize,
}

/// Drops components, and vertices without triangles.
///
/// # Errors
/// [`Error::Parameter`] for a volume that is negative or not a number, [`Error::Count`] for an index that names no vertex,
/// [`Error::Length`] for an attribute of the wrong length, [`Error::Cancelled`].
pub fn keep(mesh: &mut Mesh, keep: &Keep, control: &Control<'_>) -> Result<Dropped, Error> {
    if keep.min_volume.is_nan() || keep.min_volume < 0.0 {
        return Err(Error::Parameter { name: "min_volume", value: keep.min_volume, must: "0 or greater" });
    }
    check(mesh)?;
    let parts = Parts::of(mesh);
    control.check()?;
    let (stays, dropped) = parts.choose(keep);
    if dropped == Dropped::default() && parts.unused == 0 {
        return Ok(dropped);
    }
    let target = |v: usize| match parts.of_vertex[v] {
        part if part != NONE && stays[part as usize] => v as u32,
        _ => NONE,
    };
    let target: Vec<u32> = (0..mesh.vertices.len()).map(target).collect();
    merge(mesh, &target);
    Ok(dropped)
}

/// The components of a mesh.
struct Parts {
    /// Component of each vertex, or [`NONE`] without triangles.
    of_vertex: Vec<u32>,
    /// Enclosed volume of each component, by its lowest vertex in ascending order.
    volumes: Vec<f64>,
    /// Vertices without triangles.
    unused: usize,
}

impl Parts {
    fn of(mesh: &Mesh) -> Self {
        let n = mesh.vertices.len();
        let mut parent: Vec<u32> = (0..n as u32).collect();
        let mut used = vec![false; n];
        for t in &mesh.triangles {
            t.iter().for_each(|&v| used[v as usize] = true);
            join(&mut parent, t[0], t[1]);
            join(&mut parent, t[1], t[2]);
        }
        let mut of_vertex = vec![NONE; n];
        let (mut count, mut unused) = (0, 0);
        for v in 0..n {
            let lowest = root(&mut parent, v as u32) as usize;
            if !used[v] {
                unused += 1;
            } else if lowest == v {
                of_vertex[v] = count;
                count += 1;
            } else {
                of_vertex[v] = of_vertex[lowest];
            }
        }
        Self { volumes: volumes(mesh, &of_vertex, count as usize), of_vertex, unused }
    }

    /// Which components stay, and what goes.
    fn choose(&self, keep: &Keep) -> (Vec<bool>, Dropped) {
        let mut order: Vec<usize> = (0..self.volumes.len()).collect();
        // Stable: of equal ones the first stays.
        order.sort_by(|&a, &b| self.volumes[b].abs().total_cmp(&self.volumes[a].abs()));
        let mut stays: Vec<bool> = (self.volumes.iter())
            .map(|&volume| if volume < 0.0 { keep.cavities == Cavities::Keep } else { volume >= keep.min_volume })
            .collect();
        let allowed = order.iter().filter(|&&part| stays[part]).copied().collect::<Vec<_>>();
        allowed.iter().skip(keep.largest.unwrap_or(usize::MAX)).for_each(|&part| stays[part] = false);
        let mut dropped = Dropped::default();
        for (_, volume) in stays.iter().zip(&self.volumes).filter(|(stays, _)| !**stays) {
            *(if *volume < 0.0 { &mut dropped.cavities } else { &mut dropped.droplets }) += 1;
        }
        (stays, dropped)
    }
}

/// Enclosed volumes: tetrahedra from the component's first vertex, so that far from the origin nothing cancels.
fn volumes(mesh: &Mesh, of_vertex: &[u32], count: usize) -> Vec<f64> {
    let mut volumes = vec![0.0; count];
    let mut corners: Vec<Option<[f64; 3]>> = vec![None; count];
    for t in &mesh.triangles {
        let part = of_vertex[t[0] as usize] as usize;
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].map(f64::from));
        let from = *corners[part].get_or_insert(a);
        let [p, q, r] = [a, b, c].map(|v| subtract(v, from));
        volumes[part] += dot(p, cross(q, r)) / 6.0;
    }
    volumes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, mesh::Report, reconstruct};

    /// A hollow ball, a middling drop and a small one.
    fn scene() -> Mesh {
        let grid = (-9..=9).flat_map(|x| (-9..=9).flat_map(move |y| (-9..=9).map(move |z| [x, y, z])));
        let shell = grid.filter(|p: &[i32; 3]| (25..=81).contains(&p.iter().map(|v| v * v).sum::<i32>()));
        let mut positions: Vec<[f32; 3]> = shell.map(|p| p.map(|v| v as f32 * 0.05)).collect();
        positions.extend((0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|v| 1.0 + v as f32 * 0.05)));
        positions.push([2.0, 0.0, 0.0]);
        reconstruct(&positions, &Params { cell_size: 1.0, ..Params::new(0.025) }).unwrap()
    }

    #[test]
    fn droplets_and_cavities_go_as_asked() {
        let all = scene();
        assert_eq!(Report::of(&all).components, 4);
        let small =
            Report::of(&reconstruct(&[[2.0f32, 0.0, 0.0]], &Params { cell_size: 1.0, ..Params::new(0.025) }).unwrap());
        let cases = [
            (Keep::default(), 4, Dropped::default()),
            (
                Keep { min_volume: 1.5 * small.signed_volume, ..Keep::default() },
                3,
                Dropped { droplets: 1, cavities: 0 },
            ),
            (Keep { cavities: Cavities::Fill, ..Keep::default() }, 3, Dropped { droplets: 0, cavities: 1 }),
            (Keep { largest: Some(1), ..Keep::default() }, 1, Dropped { droplets: 2, cavities: 1 }),
            (Keep { largest: Some(2), ..Keep::default() }, 2, Dropped { droplets: 2, cavities: 0 }),
            (
                Keep { min_volume: f64::INFINITY, cavities: Cavities::Fill, largest: None },
                0,
                Dropped { droplets: 3, cavities: 1 },
            ),
        ];
        for (choice, components, dropped) in cases {
            let mut mesh = all.clone();
            assert_eq!(keep(&mut mesh, &choice, &Control::default()).unwrap(), dropped, "{choice:?}");
            let report = Report::of(&mesh);
            assert!(report.closed_manifold() && report.unused_vertices == 0);
            assert_eq!(report.components, components, "{choice:?}");
        }
    }
}
