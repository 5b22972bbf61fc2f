use pellicle_io::{Error, Particles, ReadOptions};
use std::path::{Path, PathBuf};
#[derive(Debug)]
pub enum Content {
    Mesh(pellicle::Mesh),
    Particles(Particles),
}
pub fn read_content(p: &Path, o: &ReadOptions) -> Result<Content, Error> {
    Ok(Content::Particles(pellicle_io::read_particles(p, o)?))
}
pub fn write_pvd(_: &Path, _: &[(f64, PathBuf)]) -> Result<(), Error> {
    Ok(())
}
pub struct PvdEntry {
    pub time: f64,
    pub file: PathBuf,
}
pub fn read_pvd(_: &Path) -> Result<Vec<PvdEntry>, Error> {
    Ok(Vec::new())
}
