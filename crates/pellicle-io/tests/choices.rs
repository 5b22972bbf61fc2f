//! What a caller chooses: the array, the time step, the type of raw numbers; and what formats refuse to choose.

mod common;
#[path = "common/samples.rs"]
mod samples;

use common::{Folder, all, attribute, positions, read};
use pellicle_io::{AttributeChoice, AttributeValues, Particles, PositionData, RawType, ReadOptions, read_particles};
use samples::COUNT;

fn frame(number: usize) -> ReadOptions {
    ReadOptions { frame: number, ..all() }
}

fn array(name: &str) -> ReadOptions {
    ReadOptions { array: Some(name.into()), ..all() }
}

fn sample(folder: &Folder, name: &str) -> std::path::PathBuf {
    let samples = samples::all();
    let sample = samples.iter().find(|s| s.name == name).expect(name);
    folder.write(name, &sample.bytes)
}

#[test]
fn time_steps_are_chosen_by_number_and_missing_ones_are_told() {
    let folder = Folder::new();
    for name in ["classic.xyz", "extended.extxyz", "extended.xyz.gz", "usual.dump", "usual.lammpstrj.gz", "scaled.dump"]
    {
        let path = sample(&folder, name);
        let second = read_particles(&path, &frame(1)).expect(name);
        assert_eq!(second.positions.len(), 1, "{name}");
        let expected = if name.contains("dump") || name.contains("lammps") { 0 } else { COUNT - 1 };
        assert_eq!(positions(&second), [samples::position(expected).map(f64::from)], "{name}");
        let error = read_particles(&path, &frame(2)).expect_err(name).to_string();
        assert!(error.contains("0 to 1") && error.contains('2'), "{error}");
    }
}

#[test]
fn formats_without_names_or_time_steps_refuse_to_choose() {
    let folder = Folder::new();
    for name in [
        "raw.xyz",
        "raw.f64",
        "comma.csv",
        "c3.npy",
        "stored.npz",
        "rows.json",
        "single.bi4",
        "little.ply",
        "plain.bgeo",
    ] {
        let path = sample(&folder, name);
        let error = read_particles(&path, &frame(3)).expect_err(name).to_string();
        assert!(error.contains("one time step") && error.contains('3') && error.contains(name), "{error}");
    }
    for name in
        ["raw.xyz", "comma.csv", "classic.xyz", "usual.dump", "c3.npy", "single.bi4", "little.ply", "plain.bgeo"]
    {
        let path = sample(&folder, name);
        let error = read_particles(&path, &array("pos")).expect_err(name).to_string();
        assert!(error.contains("no named arrays") && error.contains("'pos'") && error.contains(name), "{error}");
    }
}

#[test]
fn arrays_of_an_archive_are_chosen_by_name() {
    let folder = Folder::new();
    let path = sample(&folder, "stored.npz");
    let velocities = read_particles(&path, &array("v")).expect("it is N x 3");
    assert_eq!(positions(&velocities)[7], samples::velocity(7).map(f64::from));
    assert_eq!(attribute(&velocities, "positions").components, 3);
    let error = read_particles(&path, &array("nothing")).expect_err("it is not there").to_string();
    assert!(error.contains("'nothing'") && error.contains("positions [40, 3]"), "{error}");
    let error = read_particles(&path, &array("density")).expect_err("it has one column").to_string();
    assert!(error.contains("in the array 'density'") && error.contains("[40]"), "{error}");
}

#[test]
fn parts_of_json_are_chosen_by_their_path() {
    let folder = Folder::new();
    let text = r#"{"frames": [{"pos": [[1, 2, 3]]}, {"t": 1, "pos": [[4, 5, 6], [7, 8, 9.5]], "id": [3, 4], "mass": [1, null]}],
                   "other": [{"x": 1, "y": 2, "z": 3}], "cloud": {"x": [1, 2], "y": [3, 4], "z": [5, 6]}}"#;
    let path = folder.write("a.json", text);
    let at = |name: &str| read_particles(&path, &array(name)).map_err(|error| error.to_string());
    let check = |particles: &Particles| {
        assert_eq!(positions(particles), [[4.0, 5.0, 6.0], [7.0, 8.0, 9.5]]);
        assert_eq!(attribute(particles, "id").values, AttributeValues::I64(vec![3, 4]));
        assert!(attribute(particles, "mass").to_f32()[1].is_nan());
    };
    check(&at("frames/1").expect("an object"));
    check(&at("frames/1/pos").expect("an array with neighbours"));
    assert_eq!(positions(&at("frames/0").expect("an object")), [[1.0, 2.0, 3.0]]);
    assert_eq!(positions(&at("other").expect("an array of objects")), [[1.0, 2.0, 3.0]]);
    assert_eq!(positions(&at("cloud").expect("an object of columns")), [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]);
    for (name, expected) in [
        ("frames/2", "no '2' in an array of 2"),
        ("frame", "no 'frame'; there is: frames, other, cloud"),
        ("frames/1/id", "'id' holds no positions"),
        ("frames/0/none", "no 'none'; there is: pos"),
    ] {
        let error = at(name).expect_err(name);
        assert!(error.contains(expected), "{name}: {error}");
    }
    let error = read(&path).expect_err("nothing is named like positions").to_string();
    assert!(error.contains("frames, other, cloud"), "{error}");
}

#[test]
fn json_that_does_not_fit_together_is_told_by_element() {
    let folder = Folder::new();
    for (text, expected) in [
        ("[[1,2,3],[4,5]]", "row 1 has 2 numbers, where 3 were expected"),
        ("[[1,2,3],4]", "element 1 is a number"),
        ("[[1,2,3],{}]", "element 1 is an object"),
        ("[1,2,3,4]", "4 numbers are no whole number of triples"),
        ("[[1,2,\"a\"]]", "not made of numbers"),
        ("[{\"x\":1,\"y\":2,\"z\":3},{\"x\":1,\"y\":2}]", "element 1 has not as many numbers in 'z'"),
        ("[[1,2,3]] tail", "line 1"),
        ("3", "neither an array nor an object"),
        ("[[1,2,3],\n[4,5,", "line 2"),
    ] {
        let error = read(&folder.write("a.json", text)).expect_err(text).to_string();
        assert!(error.contains(expected) && error.contains("a.json"), "{text}: {error}");
    }
    for text in ["[]", "{\"positions\": []}", "{\"x\": [], \"y\": [], \"z\": []}"] {
        assert!(read(&folder.write("a.json", text)).expect(text).positions.is_empty());
    }
}

#[test]
fn raw_numbers_are_what_the_caller_says() {
    let folder = Folder::new();
    let path = folder.write("a.xyz", [1.5f64, 2.5, -3.5].map(f64::to_le_bytes).concat());
    let as_type = |raw| read_particles(&path, &ReadOptions { raw, ..all() }).expect("24 bytes are both");
    assert_eq!(as_type(RawType::F64).positions, PositionData::F64(vec![[1.5, 2.5, -3.5]]));
    assert_eq!(as_type(RawType::Auto).positions.len(), 2);
    assert_eq!(as_type(RawType::F32).positions.len(), 2);
    // Text may be numbers, too, if the caller says so.
    let path = folder.write("b.xyz", "1.5 2.5 3.5\n");
    let said = read_particles(&path, &ReadOptions { raw: RawType::F32, ..all() }).expect("12 bytes");
    assert_eq!(said.positions.len(), 1);
    assert_eq!(positions(&read(&path).expect("text")), [[1.5, 2.5, 3.5]]);
}

#[test]
fn attributes_of_text_are_chosen_by_either_name() {
    let folder = Folder::new();
    let names = |name: &str, wanted: &[&str]| {
        let attributes = AttributeChoice::Names(wanted.iter().map(|&n| n.into()).collect());
        let read = read_particles(&sample(&folder, name), &ReadOptions { attributes, ..ReadOptions::default() });
        read.map(|p| p.attributes.into_iter().map(|a| a.name).collect::<Vec<_>>()).map_err(|error| error.to_string())
    };
    assert_eq!(names("extended.extxyz", &["velo", "is_wet"]), Ok(vec!["velocity".into(), "is_wet".into()]));
    assert_eq!(names("usual.dump", &["velocity", "type"]), Ok(vec!["type".into(), "velocity".into()]));
    assert_eq!(names("single.bi4", &["Rhop", "id"]), Ok(vec!["id".into(), "density".into()]));
    assert_eq!(names("stored.npz", &["v"]), Ok(vec!["velocity".into()]));
    assert_eq!(names("nested.json", &["vel"]), Ok(vec!["velocity".into()]));
    for name in ["extended.extxyz", "usual.dump", "single.bi4", "stored.npz", "nested.json", "comma.csv"] {
        let error = names(name, &["nonsense"]).expect_err(name);
        assert!(error.contains("'nonsense'") && error.contains("velocity") | error.contains("vel"), "{error}");
    }
}

#[test]
fn lines_of_long_files_are_counted_and_threads_do_not_show() {
    let folder = Folder::new();
    let rows = 300_000;
    let text = |bad: Option<usize>| {
        let line = |i| if bad == Some(i) { "1,x,2\n".into() } else { format!("{i},{},0.5\n", i * 2) };
        "# a comment\nx,y,z\n".to_owned() + &(0..rows).map(line).collect::<String>()
    };
    let particles = read(&folder.write("long.csv", text(None))).expect("it is sound");
    let found = positions(&particles);
    assert_eq!(found.len(), rows);
    assert!(found.iter().enumerate().all(|(i, p)| *p == [i as f64, 2.0 * i as f64, 0.5]));
    let error = read(&folder.write("bad.csv", text(Some(250_000)))).expect_err("one row is bad").to_string();
    assert!(error.contains("in line 250003: 'x' in column 2"), "{error}");
}
