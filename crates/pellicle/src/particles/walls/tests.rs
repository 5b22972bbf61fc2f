use std::sync::Arc;

use super::*;
use crate::{Control, Mesh, Params, Reconstructor, ScalarField, mesh::Report};

/// The corners of a box's triangles, outward.
fn box_mesh(low: [f64; 3], high: [f64; 3]) -> Vec<Triangle> {
    let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 0 { low[a] } else { high[a] });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c].map(corner), [a, c, d].map(corner)]).collect()
}

/// Jittered particles, a tenth apart, half of that from the faces of a box.
fn water(counts: [usize; 3]) -> Vec<[f64; 3]> {
    let [x, y, z] = counts;
    let jitter = |i: usize| ((i * 7919 % 101) as f64 / 100.0 - 0.5) * 0.02;
    (0..x * y * z)
        .map(|i| {
            let at = [i % x, i / x % y, i / x / y];
            [0, 1, 2].map(|a| 0.1 * at[a] as f64 + 0.05 + jitter(3 * i + a))
        })
        .collect()
}

fn surface(particles: &[[f64; 3]], walls: Walls, params: &Params) -> Mesh {
    let walls = Arc::new(walls);
    let mut positions = particles.to_vec();
    positions.extend(walls.ghosts((&positions).into(), params).positions);
    let mut reconstructor = Reconstructor::new();
    reconstructor.set_walls(Some(walls));
    reconstructor.extract((&positions).into(), &[], params, &Control::default()).unwrap().to_mesh().unwrap()
}

/// Water of 12 × 12 × 6 on a floor and between two walls; how far its surface is from the floor below it, at the most.
fn basin() -> Walls {
    let walls = Walls::new().with_plane([0.0, 0.0, 2.0], 0.0).unwrap();
    walls.with_plane([1.0, 0.0, 0.0], 0.0).unwrap().with_plane([0.0, 1.0, 0.0], 0.0).unwrap()
}

#[test]
fn the_contact_with_half_spaces_is_flat_and_the_rest_has_no_bump() {
    let particles = water([12, 12, 6]);
    for field in [ScalarField::Sph, ScalarField::from_name("solenthaler").unwrap_or_default()] {
        let params = Params { normals: true, ..Params::with_field(0.05, field) };
        let mesh = surface(&particles, basin(), &params);
        let report = Report::of(&mesh);
        assert!(report.closed_manifold() && report.components == 1, "{report:?}");
        assert!(mesh.vertices.iter().flatten().all(|x| *x >= 0.0));
        // All of the floor is touched: flat to the last bit, normals down, full area.
        let on_floor = |v: &u32| mesh.vertices[*v as usize][2] == 0.0;
        let floor: Vec<[u32; 3]> = mesh.triangles.iter().filter(|t| t.iter().all(on_floor)).copied().collect();
        assert!(
            floor
                .iter()
                .flatten()
                .all(|&v| mesh.normals[v as usize][2] == -1.0 || mesh.vertices[v as usize][..2].contains(&0.0))
        );
        let area = Report::of(&Mesh { triangles: floor, ..mesh.clone() }).area;
        // But for a cell along its edges, where the walls meet and where the water ends.
        assert!(((1.2 - 0.08f64).powi(2)..(1.2 + 0.05f64).powi(2)).contains(&area), "{area}");
        // The free surface next to a wall is as high as elsewhere, but for less than a cell.
        let top = |near: bool| {
            let is_there =
                |v: &&[f32; 3]| v[2] > 0.4 && v[1] > 0.3 && v[1] < 0.9 && (v[0] < 0.02) == near && v[0] < 0.9;
            let heights: Vec<f32> = mesh.vertices.iter().filter(is_there).map(|v| v[2]).collect();
            heights.iter().copied().fold(f32::MIN, f32::max)
        };
        assert!((top(true) - top(false)).abs() < 0.025, "{} {}", top(true), top(false));
    }
}

#[test]
fn a_solid_is_taken_out_and_a_room_holds_the_fluid() {
    let particles = water([12, 12, 12]);
    let params = Params::new(0.05);
    let free = Report::of(&surface(&particles, Walls::new(), &params)).signed_volume;
    // A solid within, one that sticks out, and a room.
    for (low, high, solid, lost) in [
        ([0.4; 3], [0.8; 3], Solid::Inside, 0.4f64.powi(3)),
        ([0.4, 0.4, 0.6], [0.8, 0.8, 2.0], Solid::Inside, 0.16 * 0.62),
        ([0.1, -1.0, -1.0], [1.1, 2.0, 2.0], Solid::Outside, free * 0.24 / 1.24),
    ] {
        let walls = Walls::new().with_mesh(box_mesh(low, high), solid).unwrap();
        let mesh = surface(&particles, walls.clone(), &params);
        let report = Report::of(&mesh);
        assert!(report.closed_manifold(), "{report:?}");
        let found = free - report.signed_volume;
        assert!((found / lost - 1.0).abs() < 0.15, "{found} {lost}");
        // Nothing reaches into the wall but what a cell cuts off its edges.
        let deepest = mesh.vertices.iter().map(|v| -walls.height(v.map(f64::from), 1.0)).fold(f64::MIN, f64::max);
        assert!(deepest < 1e-6, "{deepest}");
    }
}

#[test]
fn the_same_bytes_for_threads_bands_and_limits() {
    let particles = water([10, 10, 6]);
    let room = || basin().with_mesh(box_mesh([0.3; 3], [0.52, 0.47, 0.9]), Solid::Inside).unwrap();
    let params = Params { normals: true, ..Params::new(0.05) };
    let with = |threads, params: &Params| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| surface(&particles, room(), params))
    };
    let one = with(1, &params);
    assert!(Report::of(&one).closed_manifold());
    assert_eq!(one, with(3, &params));
    assert_eq!(one, with(2, &Params { band: crate::Band::Full, ..params.clone() }));
}

#[test]
fn triangles_without_area_change_nothing() {
    let particles = water([10, 10, 6]);
    let params = Params { normals: true, ..Params::new(0.05) };
    // The order matters, the tree's halves too: without area first, all over one edge, and a point.
    let (low, high) = ([0.3; 3], [0.52, 0.47, 0.9]);
    let flat = [[0.3, 0.3, 0.4], [0.3, 0.3, 0.55], [0.3, 0.3, 0.7]];
    let mut with_flat = vec![flat, [flat[1]; 3], [flat[2], flat[0], flat[1]]];
    with_flat.extend(box_mesh(low, high));
    let of = |triangles| surface(&particles, basin().with_mesh(triangles, Solid::Inside).unwrap(), &params);
    let found = of(with_flat);
    assert!(found.normals.iter().flatten().all(|n| n.is_finite()));
    assert_eq!(found, of(box_mesh(low, high)));
}

#[test]
fn ghosts_are_mirrored_also_in_corners_and_not_through_plates() {
    let (at, params) = ([[0.1875, 0.25, 5.0]], Params::new(0.0625));
    let corner = Walls::new().with_plane([1.0, 0.0, 0.0], 0.0).unwrap().with_plane([0.0, 3.0, 0.0], 0.0).unwrap();
    let ghosts = corner.ghosts((&at).into(), &params);
    assert_eq!(ghosts.of, [0, 0, 0]);
    assert_eq!(ghosts.positions, [[0.0, 0.25, 5.0], [0.1875, -0.0625, 5.0], [0.0, -0.0625, 5.0]]);
    // The same corner as a room.
    let room = Walls::new().with_mesh(box_mesh([0.0; 3], [9.0; 3]), Solid::Outside).unwrap();
    let mut found = room.ghosts((&at).into(), &params).positions;
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let near = |a: &[f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-12);
    assert!(
        found.len() == 3 && near(&found[0], [0.0, -0.0625, 5.0]) && near(&found[2], [0.1875, -0.0625, 5.0]),
        "{found:?}"
    );
    // A plate so thin that the image would be beyond, a particle within a wall, and particles too near and too far.
    let plate = Walls::new().with_mesh(box_mesh([-0.05, -9.0, -9.0], [0.0, 9.0, 9.0]), Solid::Inside).unwrap();
    assert_eq!(plate.ghosts((&[[0.3125, 5.0, 5.0]]).into(), &params), Ghosts::default());
    assert_eq!(plate.ghosts((&[[0.1875, 5.0, 5.0]]).into(), &params).of.len(), 1);
    for x in [-0.1, 0.12, 0.35] {
        assert_eq!(corner.ghosts((&[[x, 1.0, 0.0]]).into(), &params), Ghosts::default());
    }
    assert!(Walls::new().with_plane([0.0; 3], 1.0).is_err());
    assert!(Walls::new().with_mesh(vec![[[f64::NAN; 3]; 3]], Solid::Inside).is_err());
}
