//! The real-time road over moving particles: closed, manifold, outward, and the same bytes for every number of threads, in
//! frames of every show.

use pellicle::mesh::Report;
use pellicle::realtime::{Engine, Params, Particles};
use pellicle::{Mesh, sink::Shaded};
use pellicle_conformance::in_pool;
use pellicle_scenes::{FRAMES, ISO, LimbSkin, Play, SUPPORT, Show};

/// Runs a show, and judges every frame.
fn run(show: Show, spacing: f64) {
    let params = Params { iso: ISO.into(), ..Params::new(SUPPORT.into(), spacing) };
    let threads = [1, 2, 5];
    let mut engines = threads.map(|_| Engine::with_skin(params.clone(), LimbSkin::default()).unwrap());
    let mut made = threads.map(|_| Shaded::<[f32; 2]>::default());
    let mut play = Play::new(show, 1);
    while play.frame() < FRAMES {
        let context = format!("{} frame {}", show.name(), play.frame());
        for ((engine, made), threads) in engines.iter_mut().zip(&mut made).zip(threads) {
            engine.skin_mut().take(play.balls());
            let balls = play.balls();
            let strengths = Some(&balls.strengths[..]);
            let particles = Particles { positions: (&balls.positions).into(), reaches: None, strengths };
            let frame = in_pool(threads, || engine.update(particles, made)).unwrap();
            assert_eq!((frame.triangles, frame.unmatched), (made.mesh.triangles.len(), 0), "{context}");
        }
        judge(&made[0].mesh, &context);
        assert!(made[0] == made[1] && made[0] == made[2], "{context}: other bytes on other threads");
        let texture = &made[0].data;
        assert!(texture.iter().flatten().all(|x| x.is_finite()), "{context}");
        assert!(texture.iter().all(|[u, _]| (-0.5..=0.5).contains(u)), "{context}");
        play.step();
    }
}

fn judge(mesh: &Mesh, context: &str) {
    let report = Report::of(mesh);
    assert!(!mesh.triangles.is_empty() && report.closed_manifold(), "{context}: {report:?}");
    assert!(report.signed_volume > 0.0 && report.unused_vertices == 0, "{context}: {report:?}");
    // Triangles face where their vertices' normals point. A few do not: where one node alone lies in a gap or in a drop, which
    // happens where cells are a third of the reach, triangles close around it on all sides while normals, which are the
    // field's, point all one way. Two in a thousand are allowed; a mesh turned inside out has all.
    let inward = mesh.triangles.iter().filter(|t| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].map(f64::from));
        let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        let face = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let along = |v: u32| (0..3).map(|k| face[k] * f64::from(mesh.normals[v as usize][k])).sum::<f64>();
        let size = face.iter().map(|x| x * x).sum::<f64>().sqrt();
        size > 1e-4 && t.iter().all(|&v| along(v) < 0.0)
    });
    let (inward, all) = (inward.count(), mesh.triangles.len());
    assert!(500 * inward <= all, "{context}: {inward} of {all} triangles against all three of their normals");
}

#[test]
fn every_frame_of_every_show_is_closed_and_the_same_on_every_number_of_threads() {
    run(Show::Fountain, 1.0);
    run(Show::Blob, 0.3);
    run(Show::Explosion, 0.6);
    run(Show::Monster, 0.5);
}
