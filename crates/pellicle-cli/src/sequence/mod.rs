use std::path::{Path, PathBuf};
#[derive(Debug, Clone)]
pub struct Ranges;
impl Ranges {
    pub fn parse(_: &str) -> Result<Self, String> {
        Ok(Self)
    }
}
#[derive(Debug, Clone)]
pub struct Shard;
impl Shard {
    pub fn parse(_: &str) -> Result<Self, String> {
        Ok(Self)
    }
}
#[derive(Debug, Clone)]
pub struct Pattern;
impl Pattern {
    pub fn parse(_: &Path) -> Option<Self> {
        None
    }
    pub fn name(&self, _: i64) -> PathBuf {
        PathBuf::new()
    }
    pub fn printf(&self) -> PathBuf {
        PathBuf::new()
    }
}
