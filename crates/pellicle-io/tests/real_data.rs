//! Every reader on frames of a real simulator, against sums that numpy and meshio gave for the same files.

mod common;

use common::{attribute, data, positions, read};

/// File, array, particles, components, sum of all values, sum of each value times (its index modulo 997).
const WITNESS: &[(&str, &str, usize, usize, f64, f64)] = &[
    ("blob.xyz", "pos", 100, 3, 5.8225812302e+00, 1.2343176253e+03),
    ("cbd1m_t1.56.xyz", "pos", 1124864, 3, 7.8700895095e+06, 3.9197739994e+09),
    ("cbd_t0.00.npy", "pos", 140608, 3, 5.8000249118e+05, 2.8886807995e+08),
    ("cbd_t0.50.bgeo", "pos", 140608, 3, 5.5978949363e+05, 2.7877488803e+08),
    ("cbd_t0.50.bgeo", "velocity", 140608, 3, 1.2902966693e+05, 6.4435150815e+07),
    ("cbd_t0.50.bgeo", "density", 140608, 1, 1.3954959423e+08, 6.9460819118e+10),
    ("cbd_t0.50.bgeo", "id", 140608, 1, 9.8852345280e+09, 4.9290670268e+12),
    ("cbd_t1.10.xyz", "pos", 140608, 3, 7.9962426408e+05, 3.9839596756e+08),
    ("cbd_t1.75.vtk", "pos", 140608, 3, 1.0164580912e+06, 5.0608153823e+08),
    ("cbd_t1.75.vtk", "velocity", 140608, 3, 8.8604368463e+04, 4.4005577765e+07),
    ("cbd_t1.75.vtk", "density", 140608, 1, 1.3260546983e+08, 6.5988351391e+10),
    ("cbd_t4.00.vtu", "pos", 140608, 3, 6.8411084996e+05, 3.4033128416e+08),
    ("cbd_t4.00.vtu", "velocity", 140608, 3, 2.8328366068e+04, 1.3810880763e+07),
    ("cbd_t4.00.vtu", "density", 140608, 1, 1.3949160277e+08, 6.9388920736e+10),
    ("cbd_t6.00.ply", "pos", 140608, 3, 9.0636003879e+05, 4.5154903727e+08),
    ("cbd_t6.00.ply", "velocity", 140608, 3, -6.0051948910e+04, -2.9890862296e+07),
    ("cbd_t6.00.ply", "density", 140608, 1, 1.3999785439e+08, 6.9707679281e+10),
    ("drop_t0.10.npy", "pos", 149260, 3, 8.0928904448e+04, 4.0317273969e+07),
    ("drop_t0.20.bgeo", "pos", 149260, 3, 7.8154632909e+04, 3.8918488156e+07),
    ("drop_t0.20.bgeo", "velocity", 149260, 3, 1.9969947228e+04, 1.0484873056e+07),
    ("drop_t0.20.bgeo", "density", 149260, 1, 1.4768406527e+08, 7.3458202378e+10),
    ("drop_t0.20.bgeo", "id", 149260, 1, 1.1139199170e+10, 5.5751797876e+12),
    ("drop_t0.30.xyz", "pos", 149260, 3, 8.3221851025e+04, 4.1487586577e+07),
    ("drop_t0.80.xyz", "pos", 149260, 3, 8.2018438064e+04, 4.0827617607e+07),
    ("explosion_t0.xyz", "pos", 1000, 3, 8.6032111962e+01, 8.9699518663e+03),
    ("explosion_t1.xyz", "pos", 1000, 3, -2.6235861620e+02, -1.8419149219e+05),
    ("explosion_t2.xyz", "pos", 1000, 3, -1.1255921473e+04, -5.7234100485e+06),
    ("fountain_f0.xyz", "pos", 3000, 3, 1.6340167004e+04, 8.0803864255e+06),
    ("fountain_f1.xyz", "pos", 3000, 3, 1.5976959837e+04, 7.8211083415e+06),
    ("hemi_t0.35.vtk", "pos", 28899, 3, 1.9536898800e+04, 9.7911669989e+06),
    ("hemi_t0.35.vtk", "velocity", 28899, 3, -8.4929801788e+04, -4.2033166812e+07),
    ("hemi_t0.35.vtk", "density", 28899, 1, 2.7944170631e+07, 1.3925365598e+10),
    ("hemi_t0.60.ply", "pos", 28899, 3, 1.1949998634e+04, 5.7853166167e+06),
    ("hemi_t0.60.ply", "velocity", 28899, 3, 1.2843181054e+04, 5.8678393035e+06),
    ("hemi_t0.60.ply", "density", 28899, 1, 2.5929316667e+07, 1.2916167101e+10),
    ("hemi_t1.50.csv", "pos", 28899, 3, 1.3436008931e+04, 6.5371372358e+06),
    ("hemi_t1.50.csv", "velocity", 28899, 3, -1.8758906480e+04, -9.3949457425e+06),
    ("hemi_t1.50.csv", "density", 28899, 1, 2.4004200153e+07, 1.1860997558e+10),
];

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-9 * expected.abs().max(1.0)
}

#[test]
fn every_frame_holds_what_an_independent_reader_found_in_it() {
    let Some(data) = data() else { return };
    let mut checked = 0;
    for &(file, name, count, components, sum, weighted) in WITNESS {
        let particles = read(&data.join("particles").join(file)).expect(file);
        let values: Vec<f64> = if name == "pos" {
            positions(&particles).into_flattened()
        } else {
            let attribute = attribute(&particles, name);
            assert_eq!(attribute.components, components, "{file} {name}");
            attribute.to_f32().iter().map(|&v| f64::from(v)).collect()
        };
        assert_eq!(values.len(), count * components, "{file} {name}");
        // CSV is kept in double precision, of which to_f32 gives a part only.
        let tolerant = file.ends_with(".csv") && name != "pos";
        let found_sum: f64 = values.iter().sum();
        let found_weighted: f64 = values.iter().enumerate().map(|(i, v)| v * (i % 997) as f64).sum();
        let ok = |found: f64, expected: f64| {
            if tolerant { (found / expected - 1.0).abs() < 1e-6 } else { close(found, expected) }
        };
        assert!(ok(found_sum, sum), "{file} {name}: {found_sum} {sum}");
        assert!(ok(found_weighted, weighted), "{file} {name}: {found_weighted} {weighted}");
        checked += 1;
    }
    assert_eq!(checked, WITNESS.len());
}

#[test]
fn only_the_velocity_is_read_unless_more_is_asked_for() {
    let Some(data) = data() else { return };
    for file in ["cbd_t0.50.bgeo", "cbd_t1.75.vtk", "cbd_t4.00.vtu", "cbd_t6.00.ply", "hemi_t1.50.csv"] {
        let path = data.join("particles").join(file);
        let names = |options| -> Vec<String> {
            let particles = pellicle_io::read_particles(&path, &options).expect(file);
            particles.attributes.into_iter().map(|a| a.name).collect()
        };
        let choose = |attributes| pellicle_io::ReadOptions { attributes, ..Default::default() };
        assert_eq!(names(Default::default()), ["velocity"], "{file}");
        assert!(names(choose(pellicle_io::AttributeChoice::None)).is_empty(), "{file}");
        let density = pellicle_io::AttributeChoice::Names(vec!["density".into()]);
        assert_eq!(names(choose(density)), ["density"], "{file}");
        let missing = choose(pellicle_io::AttributeChoice::Names(vec!["colour".into()]));
        let error = pellicle_io::read_particles(&path, &missing).expect_err(file).to_string();
        assert!(error.contains("colour") && error.contains("velocity, density"), "{error}");
    }
}
