//! stub
use super::{Particles, ReadOptions};
use crate::error::Error;
use std::path::Path;
pub(super) fn read(path: &Path, _options: &ReadOptions) -> Result<Particles, Error> {
    Err(Error::Unsupported { path: path.into(), what: "not yet".into() })
}
