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
pub fn page(_: &pellicle::Mesh, _: &str) -> Result<String, pellicle_render::Error> {
    Ok(String::new())
}
