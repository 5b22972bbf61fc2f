//! ParaView's list of files over time.

use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

use crate::error::Error;
use crate::output::Output;

/// Writes a `.pvd`: the files of a sequence with their times, in the order given. Files in the folder of `path` or below
/// it are named relative to it, so that the folder can be moved; others by their absolute path.
///
/// # Errors
/// [`Error::Unsupported`] for a time that is not finite, [`Error::Sink`].
pub fn write_pvd(path: &Path, files: &[(f64, PathBuf)]) -> Result<(), Error> {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (time, file) in files {
        if !time.is_finite() {
            let what = format!("the time of {} is {time}: times must be finite", file.display());
            return Err(Error::Unsupported { path: path.into(), what });
        }
        let name = super::write_vtkxml::escape(&relative(path, file));
        // Writing to a string cannot fail.
        let _ = writeln!(text, "<DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{name}\"/>");
    }
    text.push_str("</Collection>\n</VTKFile>\n");
    let mut out = Output::create(path, Some(text.len() as u64))?;
    out.bytes(text.as_bytes())?;
    out.finish()
}

/// The file as seen from the list, with slashes.
fn relative(list: &Path, file: &Path) -> String {
    let folder = match list.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (Ok(folder), Ok(file)) = (std::path::absolute(folder), std::path::absolute(file)) else {
        return file.to_string_lossy().into_owned();
    };
    let Ok(inside) = file.strip_prefix(folder) else { return file.to_string_lossy().into_owned() };
    let parts = inside.components().filter(|part| *part != Component::CurDir);
    parts.map(|part| part.as_os_str().to_string_lossy().into_owned()).collect::<Vec<_>>().join("/")
}
