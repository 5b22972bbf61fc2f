//! PLY particles: the `vertex` element, wherever it stands in the file. The vertices of meshes are read here too.

use std::path::Path;

use super::{Particles, ReadOptions};
use crate::error::Error;
use crate::formats::names;
use crate::formats::ply::{self, Element};
use crate::source::Source;
use crate::table::Table;

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.single(path, "PLY")?;
    let mut source = Source::open(path)?;
    let header = ply::read_header(&mut source)?;
    let Some(at) = header.elements.iter().position(|e| e.name == "vertex") else {
        return Err(source.fail("the header declares no element 'vertex'"));
    };
    for element in &header.elements[..at] {
        ply::skip_element(&mut source, header.encoding, element)?;
    }
    read_vertices(&mut source, &header, &header.elements[at], options)
}

/// Reads the vertices, which come next.
pub(crate) fn read_vertices(
    source: &mut Source<'_>,
    header: &ply::Header,
    element: &Element,
    options: &ReadOptions,
) -> Result<Particles, Error> {
    let (names, layout) = element.scalars();
    let groups = names::group(&names);
    let Some(position) = groups.position else {
        return Err(source.fail(format!("the vertices have no x, y and z, but: {}", names.join(", "))));
    };
    let capacity = source.room(element.count, element.least_bytes(header.encoding), "vertices")?;
    let path = source.path().to_owned();
    let mut table = Table::new(&path, &layout, position, &groups, options, capacity)?;
    ply::read_scalars(source, header.encoding, element, |bytes, endian| {
        table.append(bytes, endian);
        Ok(())
    })?;
    Ok(table.finish())
}
