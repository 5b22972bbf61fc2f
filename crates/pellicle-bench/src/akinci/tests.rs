use pellicle::{Band, ScalarField};
use pellicle_scenes::splash;

use super::{
    compare::compare,
    measure::{Method, measure},
    params,
    scenes::Scene,
};

#[test]
fn rivals_find_our_surface_with_any_sizes_and_threads() {
    let splash = splash(4000, 3);
    let scene = Scene { name: "splash", file: "".into(), radius: splash.radius.into() };
    for name in ["solenthaler", "anisotropic"] {
        let field = ScalarField::from_name(name).expect("a field");
        for cell in [1.0, 0.5] {
            let params = params(&scene, field, cell);
            let run = |method, threads| measure(method, &splash.positions, &params, threads, 1).expect("a surface");
            let ours = run(Method::Ours(Band::Full), 1);
            assert!(ours.triangles > 1000 && ours.bytes > 1000);
            for method in [
                Method::Ours(Band::Auto),
                Method::Scatter { cell: 0.125, block: None },
                Method::Scatter { cell: 0.5, block: Some(16) },
                Method::Scatter { cell: 1.0, block: Some(64) },
                Method::Gather { cell: 0.25, brick: 4, thin: true },
                Method::Gather { cell: 0.5, brick: 8, thin: false },
                Method::Gather { cell: 1.0, brick: 16, thin: true },
            ] {
                let found = run(method, 2);
                let difference = compare(&ours.mesh, &found.mesh, params.spacing());
                // A sign that rounding decides moves a few vertices by a cell.
                let most = ours.mesh.vertices.len() / 1000;
                assert!(difference.astray <= most, "{name}, cell {cell} r, {method:?}: {difference:?}");
                assert!(difference.farthest < 0.01 && difference.farthest.is_finite());
                assert!(found.mesh.vertices.len().abs_diff(ours.mesh.vertices.len()) <= most, "{name} {method:?}");
            }
        }
    }
}
