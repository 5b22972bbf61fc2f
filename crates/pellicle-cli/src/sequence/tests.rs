//! Names as typed to frames with their outputs.

use super::gaps::gaps_text;
use super::scratch::Folder;
use super::*;

const PLAIN: Request<'static> = Request { frames: None, missing: Missing::Refuse, output: None, extension: "ply" };

fn resolve(folder: &Folder, names: &[&str], request: &Request<'_>) -> Result<Sequence, String> {
    let inputs: Vec<PathBuf> = names.iter().map(|name| folder.path().join(name)).collect();
    Sequence::resolve(&inputs, request).map_err(|failure| failure.to_string())
}

/// Numbers, inputs and outputs, the latter two below the folder.
fn frames(folder: &Folder, names: &[&str], request: &Request<'_>) -> Vec<(Option<i64>, String, String)> {
    let sequence = resolve(folder, names, request).unwrap_or_else(|e| panic!("{e}"));
    let short = |path: &Path| path.strip_prefix(folder.path()).unwrap_or(path).to_str().unwrap().to_owned();
    sequence.frames.iter().map(|f| (f.number, short(&f.input), short(&f.output))).collect()
}

fn expect(list: &[(i64, &str, &str)]) -> Vec<(Option<i64>, String, String)> {
    list.iter().map(|&(n, input, output)| (Some(n), input.into(), output.into())).collect()
}

#[test]
fn a_pattern_takes_all_its_files_in_numeric_order() {
    let folder = Folder::with(&["f_10.vtk", "f_2.vtk", "f_4.vtk", "other.vtk"]);
    let want = expect(&[(2, "f_2.vtk", "f_2.ply"), (4, "f_4.vtk", "f_4.ply"), (10, "f_10.vtk", "f_10.ply")]);
    assert_eq!(frames(&folder, &["f_{}.vtk"], &PLAIN), want);
    let sequence = resolve(&folder, &["f_$F.vtk"], &PLAIN).unwrap();
    assert_eq!(gaps_text(&sequence.gaps), "2 frames are missing: 6, 8");
    let message = resolve(&folder, &["g_{}.vtk"], &PLAIN).unwrap_err();
    assert!(message.contains("g_1.vtk"), "{message}");
    assert!(resolve(&folder, &["f_*.vtk"], &PLAIN).unwrap_err().contains("####"));
}

#[test]
fn explicit_frames_must_be_there_unless_told_otherwise() {
    let folder = Folder::with(&["f_0001.vtk", "f_0002.vtk", "f_0004.vtk", "f_0007.vtk"]);
    let range = |text: &str| FrameRange::parse(text).unwrap();
    let ask = |range, missing| Request { frames: Some(range), missing, ..PLAIN };
    let (some, gappy, none) = (range("1-7:3"), range("1-7"), range("20-30"));
    let want =
        expect(&[(1, "f_0001.vtk", "f_0001.ply"), (4, "f_0004.vtk", "f_0004.ply"), (7, "f_0007.vtk", "f_0007.ply")]);
    assert_eq!(frames(&folder, &["f_####.vtk"], &ask(&some, Missing::Refuse)), want);
    assert_eq!(frames(&folder, &["f_{}.vtk"], &ask(&some, Missing::Refuse)), want, "files are named as they are");
    let message = resolve(&folder, &["f_####.vtk"], &ask(&gappy, Missing::Refuse)).unwrap_err();
    assert!(message.contains("--frames 1-7: 3 frames are missing: 3, 5, 6; there are 4 frames, 1 to 7"), "{message}");
    assert_eq!(frames(&folder, &["f_####.vtk"], &ask(&gappy, Missing::Skip)).len(), 4);
    assert!(resolve(&folder, &["f_####.vtk"], &ask(&none, Missing::Skip)).unwrap_err().contains("20 to 30"));
    assert_eq!(frames(&folder, &[""], &ask(&some, Missing::Refuse)), want, "a folder, too");
    let message = resolve(&folder, &["f_0001.vtk"], &ask(&some, Missing::Refuse)).unwrap_err();
    assert!(message.contains("no numbers to go by"), "{message}");
}

#[test]
fn a_file_that_is_there_is_taken_literally() {
    let folder = Folder::with(&["f_#.vtk", "f_1.vtk", "100%d.vtk"]);
    let found = frames(&folder, &["f_#.vtk"], &PLAIN);
    assert_eq!(found, [(None, "f_#.vtk".into(), "f_#.ply".into())]);
    assert_eq!(frames(&folder, &["100%d.vtk"], &PLAIN).len(), 1);
    // One that is not there is its reader's affair.
    assert_eq!(frames(&folder, &["gone.vtk"], &PLAIN), [(None, "gone.vtk".into(), "gone.ply".into())]);
}

#[test]
fn listed_files_keep_their_order_and_their_numbers() {
    let folder = Folder::with(&["f_3.vtk", "f_20.vtk", "g.vtk"]);
    let output = folder.path().join("out/w_##.obj");
    let request = Request { output: Some(&output), ..PLAIN };
    let want = expect(&[(20, "f_20.vtk", "out/w_20.obj"), (3, "f_3.vtk", "out/w_03.obj")]);
    assert_eq!(frames(&folder, &["f_20.vtk", "f_3.vtk"], &request), want);
    let mixed = frames(&folder, &["g.vtk", "f_3.vtk"], &request);
    assert_eq!(mixed, [(None, "g.vtk".into(), "out/w_00.obj".into()), (None, "f_3.vtk".into(), "out/w_01.obj".into())]);
    assert!(resolve(&folder, &["g.vtk", "f_{}.vtk"], &PLAIN).unwrap_err().contains("stands alone"));
    assert!(resolve(&folder, &["g.vtk", ""], &PLAIN).unwrap_err().contains("stands alone"));
    assert!(resolve(&folder, &[], &PLAIN).is_err());
}

#[test]
fn lists_bring_their_times() {
    let list = vec![(0.5, PathBuf::from("d/a_5.vtu")), (1.5, PathBuf::from("d/a_10.vtu"))];
    let sequence = Sequence::from_list(list, &Request { output: Some(Path::new("o/")), ..PLAIN }).unwrap();
    let frame = |number, time, input: &str, output: &str| Frame {
        number: Some(number),
        time: Some(time),
        input: input.into(),
        output: output.into(),
    };
    assert_eq!(sequence.frames, [frame(5, 0.5, "d/a_5.vtu", "o/a_5.ply"), frame(10, 1.5, "d/a_10.vtu", "o/a_10.ply")]);
    assert!(Sequence::from_list(Vec::new(), &PLAIN).is_err());
}

#[test]
fn one_output_for_several_frames_is_refused() {
    let folder = Folder::with(&["f_1.vtk", "f_2.vtk"]);
    let output = folder.path().join("out.ply");
    let message = resolve(&folder, &["f_{}.vtk"], &Request { output: Some(&output), ..PLAIN }).unwrap_err();
    assert!(message.contains("out_####.ply"), "{message}");
    assert_eq!(frames(&folder, &["f_1.vtk"], &Request { output: Some(&output), ..PLAIN }).len(), 1);
}
