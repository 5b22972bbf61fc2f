//! HDF5: groups and datasets by name, steps by number; without the feature an error that says what to do.

mod common;

use std::path::Path;

use pellicle_io::{ReadOptions, read_particles};

fn sample(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples").join(name)
}

#[cfg(not(feature = "hdf5"))]
#[test]
fn without_the_feature_the_way_out_is_told() {
    let error = read_particles(&sample("snapshot.hdf5"), &ReadOptions::default()).expect_err("not in this build");
    let message = error.to_string();
    assert!(message.contains("--features hdf5") && message.contains(".npy"), "{message}");
}

#[cfg(feature = "hdf5")]
mod with_the_feature {
    use pellicle_io::{Error, Particles};

    use super::common::positions;
    use super::*;

    fn read(name: &str, array: Option<&str>, frame: usize) -> Result<Particles, Error> {
        let options = ReadOptions { array: array.map(str::to_owned), frame, ..super::common::all() };
        read_particles(&sample(name), &options)
    }

    fn names(particles: &Particles) -> Vec<&str> {
        particles.attributes.iter().map(|a| a.name.as_str()).collect()
    }

    #[test]
    fn groups_and_datasets_are_chosen_by_name() {
        for array in ["PartType1", "/PartType1/", "PartType1/Coordinates"] {
            let found = read("snapshot.hdf5", Some(array), 0).expect(array);
            assert_eq!(positions(&found)[1], [100.25, 100.5, 100.125], "{array}");
            assert!(found.attributes.is_empty());
        }
        let gas = read("snapshot.hdf5", Some("PartType0/Velocities"), 0).expect("three columns");
        assert_eq!(positions(&gas)[3], [-3.0, 0.5, 6.0]);
        assert_eq!(names(&gas), ["Coordinates", "density"]);
        for (array, said) in [
            ("PartType7", "PartType0/Velocities"),
            ("PartType0/density", "three columns"),
            ("PartType0/nothing", "there is no"),
            ("PartType0/density/more", "there is no"),
            ("", "there is no"),
        ] {
            let message = read("snapshot.hdf5", Some(array), 0).expect_err(array).to_string();
            assert!(message.contains(said) && message.contains("snapshot.hdf5"), "{message}");
        }
        assert!(read("snapshot.hdf5", None, 1).is_err());
    }

    #[test]
    fn steps_are_chosen_by_number() {
        let second = read("steps.vtkhdf", None, 1).expect("the second step");
        assert_eq!(positions(&second), [[9.0; 3]; 2]);
        assert_eq!(*second.attribute("density").expect("it is there").to_f32(), [7.0, 7.0]);
        assert_eq!(*second.attribute("velocity").expect("it is there").to_f32(), [9.0; 6]);
        let message = read("steps.vtkhdf", None, 2).expect_err("there are two").to_string();
        assert!(message.contains("no time step 2") && message.contains("has 2"), "{message}");
        let all = read("steps.vtkhdf", Some("VTKHDF/Points"), 0).expect("all steps");
        assert_eq!(positions(&all).len(), 42);
    }
}
