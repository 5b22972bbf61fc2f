//! Lists of files: steps and parts are joined in order, and lists that go round in circles are refused.

mod common;

use common::{Folder, attribute, positions, read};
use pellicle_io::{AttributeChoice, ReadOptions, read_particles, read_pvd};

fn vtp(first: usize, count: usize, extra: &str) -> String {
    let points: String = (first..first + count).map(|i| format!("{i} 0 0.5 ")).collect();
    let ids: String = (first..first + count).map(|i| format!("{i} ")).collect();
    format!(
        "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"{count}\"><PointData>\
         <DataArray type=\"Int32\" Name=\"id\">{ids}</DataArray>\
         <DataArray type=\"Int32\" Name=\"{extra}\">{ids}</DataArray></PointData>\
         <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">{points}</DataArray></Points></Piece></PolyData></VTKFile>"
    )
}

fn pvd(sets: &[(&str, &str, &str)]) -> String {
    let set = |(time, part, file): &(&str, &str, &str)| {
        format!("<DataSet timestep=\"{time}\" group=\"\" part=\"{part}\" file=\"{file}\"/>")
    };
    let sets: String = sets.iter().map(set).collect();
    format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\"><Collection>{sets}</Collection></VTKFile>")
}

#[test]
fn a_step_is_all_its_parts_in_order_with_what_they_share() {
    let folder = Folder::new();
    for (name, first, count, extra) in
        [("a.vtp", 0, 3, "one"), ("b.vtp", 3, 2, "other"), ("c.vtp", 5, 0, "one"), ("late.vtp", 9, 1, "one")]
    {
        folder.write(name, vtp(first, count, extra));
    }
    let sets = [("1e1", "0", "late.vtp"), ("0.5", "10", "c.vtp"), ("0.5", "2", "b.vtp"), ("0.5", "0", "a.vtp")];
    let path = folder.write("all.pvd", pvd(&sets));
    let entries = read_pvd(&path).expect("a list");
    let found: Vec<(f64, &str)> = entries.iter().map(|e| (e.time, e.part.as_str())).collect();
    assert_eq!(found, [(0.5, "0"), (0.5, "2"), (0.5, "10"), (10.0, "0")]);
    assert_eq!(entries[0].file, folder.join("a.vtp"));
    let particles = read(&path).expect("the first step");
    assert_eq!(positions(&particles), (0..5).map(|i| [f64::from(i), 0.0, 0.5]).collect::<Vec<_>>());
    assert_eq!(*attribute(&particles, "id").to_f32(), [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(particles.attributes.len(), 1);
    let at = |frame| read_particles(&path, &ReadOptions { frame, ..ReadOptions::default() });
    assert_eq!(positions(&at(1).expect("the second step")), [[9.0, 0.0, 0.5]]);
    let message = at(2).expect_err("there are two").to_string();
    assert!(message.contains("no time step 2") && message.contains("has 2"), "{message}");
    let named = |name: &str| {
        let attributes = AttributeChoice::Names(vec![name.into()]);
        read_particles(&path, &ReadOptions { attributes, ..ReadOptions::default() })
    };
    assert_eq!(named("id").expect("in all parts").attributes.len(), 1);
    assert!(named("one").expect_err("not in all parts").to_string().contains("b.vtp"));
}

#[test]
fn pieces_of_one_step_are_joined_and_may_stand_in_a_sequence() {
    let folder = Folder::new();
    folder.write("a.vtp", vtp(0, 3, "one"));
    folder.write("b.vtp", vtp(3, 2, "one"));
    let pieces = "<Piece Source=\"a.vtp\"/><Piece Source=\"b.vtp\"/>";
    let parallel = format!("<VTKFile type=\"PPolyData\"><PPolyData>{pieces}</PPolyData></VTKFile>");
    let path = folder.write("all.pvtp", parallel);
    assert_eq!(positions(&read(&path).expect("pieces")).len(), 5);
    let sequence = folder.write("all.pvd", pvd(&[("0", "0", "all.pvtp")]));
    assert_eq!(positions(&read(&sequence).expect("a sequence of pieces")).len(), 5);
}

#[test]
fn lists_that_lead_nowhere_or_to_themselves_are_refused() {
    let folder = Folder::new();
    // Each names the next without an extension that would tell, the last the first.
    folder.write("one", pvd(&[("0", "", "two")]));
    folder.write("two", pvd(&[("0", "", "one")]));
    let parallel = |file: &str| format!("<VTKFile type=\"PPolyData\"><Piece Source=\"{file}\"/></VTKFile>");
    folder.write("three", parallel("four"));
    folder.write("four", parallel("three"));
    folder.write("data.vtp", vtp(0, 1, "one"));
    let cases = [
        ("itself.pvd", pvd(&[("0", "", "itself.pvd")]), "itself"),
        ("around.pvd", pvd(&[("0", "", "./x/../around.pvd")]), "itself"),
        ("other.pvd", pvd(&[("0", "", "one")]), "another list"),
        ("pieces.pvd", pvd(&[("0", "", "three")]), "which is a list, too"),
        ("itself.pvtp", parallel("itself.pvtp"), "itself"),
        ("none.pvd", pvd(&[("0", "", "")]), "no file"),
        ("time.pvd", pvd(&[("soon", "", "a.vtp")]), "'soon'"),
        ("endless.pvd", pvd(&[("1e400", "", "a.vtp")]), "'1e400'"),
        ("twice.pvd", pvd(&[("0", "0", "data.vtp"), ("0", "1", "./data.vtp")]), "twice"),
        ("nan.pvd", pvd(&[("NaN", "", "a.vtp")]), "'NaN'"),
        ("missing.pvd", pvd(&[("0", "", "gone.vtp")]), "gone.vtp"),
        ("empty.pvd", pvd(&[]), "has 0"),
        ("data.pvd", vtp(0, 1, "one"), "name it .vtu"),
        ("list.vtu", pvd(&[("0", "", "a.vtp")]), ".pvd"),
    ];
    for (name, text, expected) in cases {
        let message = read(&folder.write(name, text)).expect_err(name).to_string();
        assert!(message.contains(expected), "{message}");
    }
}
