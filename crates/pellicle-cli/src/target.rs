//! Where a mesh goes, judged in two steps: the name from the command line alone, the place before the work starts.

use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// An output file to come.
#[derive(Debug, Clone)]
pub struct Target {
    path: PathBuf,
}

impl Target {
    /// A name whose extension cannot be written is a usage error.
    pub fn new(path: PathBuf) -> Result<Self, Failure> {
        match pellicle_io::check_mesh_format(&path) {
            Ok(()) => Ok(Self { path }),
            Err(_) if has_extension(&path, "png") => {
                let path = path.display();
                let hint = "name a mesh, and the picture by --png; render draws a mesh or particles that are there";
                Err(Failure::Usage(format!("{path}: this would be a picture, not a mesh ({hint})")))
            }
            Err(error) => Err(Failure::Usage(error.to_string())),
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the mesh can be written chunk by chunk while it is made, as PLY; other formats need all of it at once.
    pub fn is_stream(&self) -> bool {
        has_extension(&self.path, "ply")
    }

    /// Finds out whether a file can be made there, before any work is done.
    pub fn check(&self) -> Result<(), Failure> {
        Ok(pellicle_io::check_writable(&self.path)?)
    }
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}
