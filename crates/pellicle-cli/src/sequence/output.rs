//! Where the results of a sequence go, worked out for all frames before any work is done.
//!
//! | `-o` | the result of frame `in/f_0007.bgeo` |
//! |---|---|
//! | not given | `in/f_0007.ply`; `in/f_0007_surface.ply` where that is the input itself |
//! | `out/`, or a folder that is there | `out/f_0007.ply` |
//! | `out/w_####.obj` | `out/w_0007.obj`; frames without a number are counted from 0 |
//! | `a.ply` | that file, for one frame only |
//!
//! A folder that a folder's or a pattern's results go to is made if it is missing, but only it: where the one above is
//! missing, too, it is probably misspelled. Two frames to one file, and a result in place of any frame's input, are refused.

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf, is_separator};

use crate::failure::Failure;

use super::pattern::Pattern;

/// Where results go.
#[derive(Debug, Clone, PartialEq)]
pub enum Outputs {
    /// Beside each input.
    Beside,
    /// Into a folder, under the input's name.
    Folder(PathBuf),
    /// By a name with the frame number in it.
    Pattern(Pattern),
    /// To one file.
    File(PathBuf),
}

impl Outputs {
    /// What `-o` says. A file that is really called `a#.ply` is taken literally.
    ///
    /// # Errors
    /// A pattern that cannot be one.
    pub fn new(output: Option<&Path>) -> Result<Self, Failure> {
        let Some(output) = output else { return Ok(Self::Beside) };
        if output.is_dir() {
            return Ok(Self::Folder(output.to_owned()));
        }
        let ends_in_separator = output.to_string_lossy().ends_with(is_separator);
        Ok(match Pattern::parse(output)? {
            Some(_) if output.is_file() => Self::File(output.to_owned()),
            Some(pattern) if !ends_in_separator => Self::Pattern(pattern),
            _ if ends_in_separator => Self::Folder(output.to_owned()),
            _ => Self::File(output.to_owned()),
        })
    }

    /// The output of one frame; `position` counts the frames from 0, `extension` is what results have by default.
    pub fn name(&self, input: &Path, number: Option<i64>, position: usize, extension: &str) -> PathBuf {
        match self {
            Self::Beside => beside(input, extension),
            Self::Folder(folder) => folder.join(with_extension(input, extension).file_name().unwrap_or_default()),
            // Positions are numbers of files, far from the largest integer.
            Self::Pattern(pattern) => pattern.name(number.unwrap_or(position as i64)),
            Self::File(path) => path.clone(),
        }
    }

    /// Makes the folder that `output` goes to if it is missing and may be made.
    ///
    /// # Errors
    /// What the system says, by folder.
    pub fn prepare(&self, output: &Path) -> Result<(), Failure> {
        if matches!(self, Self::Beside | Self::File(_)) {
            return Ok(());
        }
        let Some(folder) = output.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) else {
            return Ok(());
        };
        match fs::create_dir(folder) {
            Ok(()) => Ok(()),
            // Another process, with another part of the frames, was faster.
            Err(_) if folder.is_dir() => Ok(()),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Err(Failure::file(
                folder,
                "cannot make this folder: the one above does not exist, either (make it first)",
            )),
            Err(error) => Err(Failure::file(folder, format_args!("cannot make this folder: {error}"))),
        }
    }
}

/// The input's name with another extension, in place of `.bgeo.gz` as of `.bgeo`.
fn with_extension(input: &Path, extension: &str) -> PathBuf {
    let is_compressed = input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    if is_compressed { input.with_extension("") } else { input.to_owned() }.with_extension(extension)
}

/// The default output of one input: `IN` with the extension, `IN_surface` with it where that would be the input itself.
pub fn beside(input: &Path, extension: &str) -> PathBuf {
    let output = with_extension(input, extension);
    if output != input {
        return output;
    }
    let mut name = OsString::from(input.file_stem().unwrap_or_default());
    name.push("_surface.");
    name.push(extension);
    input.with_file_name(name)
}

/// Refuses outputs that meet each other or an input. `frames` are (input, output), `inputs` all there are.
///
/// # Errors
/// The first two that meet.
pub fn check<'a>(outputs: &Outputs, frames: &[(&'a Path, &'a Path)]) -> Result<(), Failure> {
    if let (Outputs::File(path), [_, _, ..]) = (outputs, frames) {
        return Err(Failure::Usage(format!(
            "{}: {} frames would go to this one file (name it {}, or a folder with a slash at the end)",
            path.display(),
            frames.len(),
            suggestion(path).display()
        )));
    }
    let mut places = Places::default();
    let inputs: HashMap<PathBuf, &Path> = frames.iter().map(|(input, _)| (places.of(input), *input)).collect();
    let mut taken: HashMap<PathBuf, &Path> = HashMap::new();
    for (input, output) in frames {
        let place = places.of(output);
        if let Some(other) = inputs.get(&place) {
            return Err(Failure::Usage(format!(
                "{}: the result of {} would overwrite {} (choose another name)",
                output.display(),
                input.display(),
                if other == input { "its input".to_owned() } else { format!("the input {}", other.display()) },
            )));
        }
        if let Some(other) = taken.insert(place, input) {
            return Err(Failure::Usage(format!(
                "{}: {} and {} would both go to this file (choose a name with a frame number, such as {})",
                output.display(),
                other.display(),
                input.display(),
                suggestion(output).display()
            )));
        }
    }
    Ok(())
}

/// `a_####.ply` for `a.ply`.
fn suggestion(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_stem().unwrap_or_default());
    name.push("_####");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Files by where they really are, through links and `..`, also those that are not there yet.
#[derive(Default)]
struct Places {
    folders: HashMap<PathBuf, PathBuf>,
}

impl Places {
    fn of(&mut self, path: &Path) -> PathBuf {
        if let Ok(place) = path.canonicalize() {
            return place;
        }
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return path.to_owned() };
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let place = self.folders.entry(folder.to_owned());
        place.or_insert_with(|| folder.canonicalize().unwrap_or_else(|_| folder.to_owned())).join(name)
    }
}

/// Whether `--skip-existing` leaves a frame alone: its output is there, not empty, and no older than its input. Outputs
/// appear whole or not at all, so one that is there is complete. A frame that was simulated anew since is made again; where
/// the system tells no times, being there is enough. Options that have changed since are not noticed.
pub fn is_done(input: &Path, output: &Path) -> bool {
    let Ok(made) = fs::metadata(output) else { return false };
    if !made.is_file() || made.len() == 0 {
        return false;
    }
    match (made.modified(), fs::metadata(input).and_then(|read| read.modified())) {
        (Ok(made), Ok(read)) => made >= read,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;
    use crate::sequence::scratch::Folder;

    fn name(output: Option<&str>, input: &str, number: Option<i64>) -> PathBuf {
        Outputs::new(output.map(Path::new)).unwrap().name(Path::new(input), number, 3, "ply")
    }

    #[test]
    fn every_kind_of_output_names_its_file() {
        assert_eq!(name(None, "d/a.1.bgeo.gz", Some(1)), Path::new("d/a.1.ply"));
        assert_eq!(name(None, "d/a", None), Path::new("d/a.ply"));
        assert_eq!(name(None, "d/a.ply", None), Path::new("d/a_surface.ply"));
        assert_eq!(name(Some("out/"), "d/a.7.vtk", Some(7)), Path::new("out/a.7.ply"));
        assert_eq!(name(Some("out/w_####.obj"), "d/a.7.vtk", Some(7)), Path::new("out/w_0007.obj"));
        assert_eq!(name(Some("out/w_####.obj"), "d/a.vtk", None), Path::new("out/w_0003.obj"));
        assert_eq!(name(Some("b.obj"), "d/a.7.vtk", Some(7)), Path::new("b.obj"));
        let folder = Folder::with(&["out/x", "w#.ply"]);
        let there = folder.path().join("out");
        assert_eq!(name(there.to_str(), "d/a.7.vtk", Some(7)), there.join("a.7.ply"));
        let literal = folder.path().join("w#.ply");
        assert_eq!(name(literal.to_str(), "d/a.7.vtk", Some(7)), literal);
    }

    fn checked(output: Option<&str>, inputs: &[&str]) -> Result<(), String> {
        let outputs = Outputs::new(output.map(Path::new)).unwrap();
        let names: Vec<PathBuf> =
            inputs.iter().enumerate().map(|(i, input)| outputs.name(Path::new(input), None, i, "ply")).collect();
        let frames: Vec<_> = inputs.iter().map(Path::new).zip(names.iter().map(PathBuf::as_path)).collect();
        check(&outputs, &frames).map_err(|failure| {
            assert!(matches!(failure, Failure::Usage(_)));
            failure.to_string()
        })
    }

    #[test]
    fn outputs_that_meet_are_refused_with_both_inputs() {
        assert_eq!(checked(Some("a.ply"), &["x.vtk"]), Ok(()));
        assert_eq!(checked(Some("o/"), &["a/x.vtk", "a/y.vtk"]), Ok(()));
        let message = checked(Some("o/a.ply"), &["x.vtk", "y.vtk"]).unwrap_err();
        assert!(message.contains("2 frames") && message.contains("o/a_####.ply"), "{message}");
        let message = checked(Some("o/"), &["a/x.vtk", "b/x.vtk"]).unwrap_err();
        assert!(message.contains("a/x.vtk and b/x.vtk would both") && message.contains("o/x_####.ply"), "{message}");
        assert!(checked(None, &["x.vtk", "x.bgeo"]).unwrap_err().contains("both"));
        assert!(checked(Some("o_{}.ply"), &["x.vtk", "x.vtk"]).is_ok(), "one input may give several results");
    }

    #[test]
    fn no_output_takes_an_inputs_place() {
        assert!(checked(Some("x.ply"), &["x.ply"]).unwrap_err().contains("its input"));
        let folder = Folder::with(&["a.ply", "b.vtk", "sub/c"]);
        let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let message = checked(None, &[&at("b.vtk"), &at("b.ply")]).unwrap_err();
        assert!(message.contains("would overwrite the input"), "{message}");
        assert!(checked(Some(&at("sub/../a.ply")), &[&at("a.ply")]).is_err());
        assert!(checked(Some(&at("sub/../new.ply")), &[&at("a.ply")]).is_ok());
    }

    #[test]
    fn only_the_last_missing_folder_is_made() {
        let folder = Folder::with(&[]);
        let prepare = |output: &str, file: &str| {
            let outputs = Outputs::new(Some(&folder.path().join(output))).unwrap();
            outputs.prepare(&folder.path().join(file)).map_err(|e| e.to_string())
        };
        assert_eq!(prepare("out/", "out/a.ply"), Ok(()));
        assert_eq!(prepare("out/", "out/b.ply"), Ok(()));
        assert_eq!(prepare("r$F/b{}.ply", "r1/b1.ply"), Ok(()));
        assert!(folder.path().join("out").is_dir() && folder.path().join("r1").is_dir());
        assert!(prepare("x/y/", "x/y/a.ply").unwrap_err().contains("the one above"));
        assert_eq!(prepare("z/a.ply", "z/a.ply"), Ok(()));
        assert!(!folder.path().join("x").exists() && !folder.path().join("z").exists());
    }

    #[test]
    fn a_frame_is_done_unless_its_input_is_newer() {
        let folder = Folder::with(&["in", "out"]);
        let (input, output) = (folder.path().join("in"), folder.path().join("out"));
        let touch = |path: &Path, seconds| {
            let file = fs::File::options().write(true).open(path).unwrap();
            file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)).unwrap();
        };
        touch(&input, 1000);
        touch(&output, 1000);
        assert!(is_done(&input, &output));
        touch(&input, 1001);
        assert!(!is_done(&input, &output));
        assert!(is_done(&folder.path().join("gone"), &output));
        fs::write(&output, "").unwrap();
        touch(&output, 2000);
        assert!(!is_done(&input, &output), "empty");
        assert!(!is_done(&input, &folder.path().join("gone")));
        assert!(!is_done(&input, folder.path()));
    }
}
