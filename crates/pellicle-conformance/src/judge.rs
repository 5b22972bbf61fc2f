//! Assertions. Each returns what is wrong, so that searches can go on; [`must`] turns it into a failed test.

use pellicle::{Mesh, mesh::Report};

use crate::{Scene, Subject, skip};

/// What is wrong with a mesh, in words.
pub type Defect = String;

/// Fails the test on a defect.
///
/// # Panics
/// When there is one.
#[track_caller]
pub fn must<T>(result: Result<T, Defect>) -> T {
    match result {
        Ok(value) => value,
        Err(defect) => panic!("{defect}"),
    }
}

/// Lets the subject mesh the scene, and judges the mesh: closed, oriented, as known, and the bytes of the reference. Says
/// so and passes when this machine lacks the subject's vector unit.
///
/// # Errors
/// The first defect.
pub fn check(scene: &Scene, subject: &Subject) -> Result<(), Defect> {
    if !subject.available() {
        skip(&format!("this machine has no {:?}", subject.lanes));
        return Ok(());
    }
    let name = &scene.name;
    let mesh_by = |subject: &Subject| subject.mesh(scene).map_err(|e| format!("{name}, {subject:?}: {e}"));
    let mesh = mesh_by(subject)?;
    let report = closed(&mesh).map_err(|e| format!("{name}, {subject:?}: {e}"))?;
    as_known(scene, &report).map_err(|e| format!("{name}, {subject:?}: {e}"))?;
    same_bytes(&mesh, &mesh_by(&Subject::reference())?).map_err(|e| format!("{name}, {subject:?}: {e}"))
}

/// A mesh is closed, 2-manifold, oriented outward, without unused vertices or numbers that are none.
///
/// # Errors
/// The report, when it is not.
pub fn closed(mesh: &Mesh) -> Result<Report, Defect> {
    let report = Report::of(mesh);
    let outward = report.signed_volume > 0.0 || mesh.triangles.is_empty();
    if report.closed_manifold() && report.nan_vertices == 0 && report.unused_vertices == 0 && outward {
        Ok(report)
    } else {
        Err(format!("not closed, manifold and outward: {report:?}"))
    }
}

fn as_known(scene: &Scene, report: &Report) -> Result<(), Defect> {
    let known = &scene.known;
    let differs = |what: &str, found: f64, expected: f64, tolerance: f64| {
        if (found - expected).abs() <= tolerance * expected.abs() {
            Ok(())
        } else {
            Err(format!("{what} {found}, {expected} expected (relative tolerance {tolerance})"))
        }
    };
    let counts = [
        ("components", report.components as f64, known.components.map(|v| v as f64)),
        ("Euler characteristic", report.euler_characteristic as f64, known.euler.map(|v| v as f64)),
    ];
    for (what, found, expected) in counts {
        expected.map_or(Ok(()), |expected| differs(what, found, expected, 0.0))?;
    }
    for (what, found, expected) in [("volume", report.signed_volume, known.volume), ("area", report.area, known.area)] {
        expected.map_or(Ok(()), |(expected, tolerance)| differs(what, found, expected, tolerance))?;
    }
    Ok(())
}

/// Two meshes are the same, bit for bit.
///
/// # Errors
/// Where they first differ.
pub fn same_bytes(found: &Mesh, expected: &Mesh) -> Result<(), Defect> {
    same("origin", &found.origin.map(f64::to_bits), &expected.origin.map(f64::to_bits))?;
    same("vertices", &vectors(&found.vertices), &vectors(&expected.vertices))?;
    same("triangles", &found.triangles, &expected.triangles)?;
    same("normals", &vectors(&found.normals), &vectors(&expected.normals))?;
    same("attributes", &vec![(); found.attributes.len()], &vec![(); expected.attributes.len()])?;
    for (found, expected) in found.attributes.iter().zip(&expected.attributes) {
        same("names", &[(&found.name, found.components)], &[(&expected.name, expected.components)])?;
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        same(&found.name, &bits(&found.values), &bits(&expected.values))?;
    }
    Ok(())
}

fn vectors(values: &[[f32; 3]]) -> Vec<[u32; 3]> {
    values.iter().map(|v| v.map(f32::to_bits)).collect()
}

fn same<T: PartialEq + std::fmt::Debug>(what: &str, found: &[T], expected: &[T]) -> Result<(), Defect> {
    if found.len() != expected.len() {
        return Err(format!("{} {what}, {} expected", found.len(), expected.len()));
    }
    match found.iter().zip(expected).position(|(a, b)| a != b) {
        Some(i) => Err(format!("{what} differ first at {i}: {:?}, {:?} expected", found[i], expected[i])),
        None => Ok(()),
    }
}
