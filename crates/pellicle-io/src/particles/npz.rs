//! NumPy archives: arrays in a ZIP file, stored or deflated.
//!
//! The positions are the array that `array` names; else the one with a name like `positions`, `pos`, `points` or `x`; else
//! the only one of N × 3; else three arrays `x`, `y`, `z` of N numbers; else the only one of N × k. They are read like an NPY
//! file. Every other array with N rows of up to 16 numbers is an attribute; arrays of single numbers whose names are those
//! of components, such as `vx`, `vy`, `vz`, make a vector. Stored arrays are read in place.
//!
//! Source: `numpy.savez`, <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>, and APPNOTE.TXT of PKWARE.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use zip::{CompressionMethod, ZipArchive};

use super::npy_header::{self, Header};
use super::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions, npy};
use crate::error::{Error, Place};
use crate::formats::{detect, names};
use crate::source::{self, Source};

/// Arrays that an archive may have, and numbers of an attribute.
const MAX_MEMBERS: usize = 4096;
const MAX_COMPONENTS: usize = 16;

/// An array of the archive.
struct Member {
    index: usize,
    /// Without `.npy`.
    name: String,
    header: Header,
}

impl Member {
    fn rows(&self) -> u64 {
        self.header.rows
    }

    fn is_points(&self) -> bool {
        self.header.is_structured && self.header.shape.len() == 1
            || self.header.shape.len() == 2 && self.header.columns >= 3
    }

    fn is_column(&self) -> bool {
        !self.header.is_structured && self.header.shape.len() == 1
    }
}

pub(crate) struct Archive {
    path: PathBuf,
    len: u64,
    zip: ZipArchive<BufReader<File>>,
}

pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Particles, Error> {
    options.refuse_frame(path, "a NumPy archive")?;
    let mut archive = Archive::open(path)?;
    let members = archive.members()?;
    let position = choose(path, &members, options)?;
    let positions = match position {
        Choice::One(member) => {
            archive.with(member, |source, header| npy::read_particles(source, header, &all(options)))
        }
        Choice::Three(columns) => archive.join(columns),
    }?;
    let taken = |member: &Member| match position {
        Choice::One(one) => one.index == member.index,
        Choice::Three(three) => three.iter().any(|m| m.index == member.index),
    };
    let rows = positions.positions.len() as u64;
    let others: Vec<&Member> = members
        .iter()
        .filter(|m| !taken(m) && m.rows() == rows && !m.header.shape.is_empty() && !m.header.is_structured)
        .filter(|m| (1..=MAX_COMPONENTS).contains(&m.header.columns))
        .collect();
    let others = attributes(&others);
    let own: Vec<(String, String)> = positions.attributes.iter().map(|a| (a.name.clone(), a.name.clone())).collect();
    let found = own.iter().map(|(n, o)| (n.as_str(), o.as_str()));
    options.check(path, found.chain(others.iter().map(|other| (other.name.as_str(), other.original.as_str()))))?;
    let mut particles = positions;
    particles.attributes.retain(|a| options.wants(&a.name, &a.name));
    for other in others {
        if options.wants(&other.name, &other.original) {
            let (components, values) = match other.members.as_slice() {
                &[member] => (member.header.columns, archive.with(member, npy::read_values)?),
                columns => (columns.len(), archive.interleave(columns)?),
            };
            particles.attributes.push(ParticleAttribute { name: other.name, components, values });
        }
    }
    Ok(particles)
}

/// An attribute and the arrays that it is made of.
struct Other<'a> {
    name: String,
    original: String,
    members: Vec<&'a Member>,
}

/// The attributes that these arrays are, in the order of the archive. Single numbers are joined where their names say so.
fn attributes<'a>(members: &[&'a Member]) -> Vec<Other<'a>> {
    let (columns, whole): (Vec<usize>, Vec<usize>) = (0..members.len()).partition(|&i| members[i].is_column());
    let whole = whole.into_iter().map(|i| {
        let Member { name, header, .. } = members[i];
        (i, Other { name: names::canonical(name, header.columns), original: name.clone(), members: vec![members[i]] })
    });
    let column_names: Vec<String> = columns.iter().map(|&i| members[i].name.clone()).collect();
    let joined = names::group_attributes(&column_names).into_iter().map(|group| {
        let parts: Vec<usize> = group.columns.iter().map(|&column| columns[column]).collect();
        let members = parts.iter().map(|&i| members[i]).collect();
        (parts[0], Other { name: group.name, original: group.original, members })
    });
    let mut found: Vec<(usize, Other<'a>)> = whole.chain(joined).collect();
    found.sort_by_key(|(first, _)| *first);
    found.into_iter().map(|(_, other)| other).collect()
}

/// For the array of positions, whose own columns are chosen when those of the other arrays are known.
fn all(options: &ReadOptions) -> ReadOptions {
    ReadOptions { attributes: super::AttributeChoice::All, also: Vec::new(), ..options.clone() }
}

#[derive(Clone, Copy)]
enum Choice<'a> {
    One(&'a Member),
    /// Columns x, y and z.
    Three([&'a Member; 3]),
}

fn choose<'a>(path: &Path, members: &'a [Member], options: &ReadOptions) -> Result<Choice<'a>, Error> {
    let unsupported = |what: String| Error::Unsupported { path: path.into(), what };
    let list = || {
        let list = members.iter().map(|m| format!("{} {:?}", m.name, m.header.shape)).collect::<Vec<_>>().join(", ");
        if list.is_empty() { "none".into() } else { list }
    };
    if let Some(name) = &options.array {
        let found = members.iter().find(|m| m.name == *name || m.name == name.trim_end_matches(".npy"));
        return found
            .map(Choice::One)
            .ok_or_else(|| unsupported(format!("no array is named '{name}'; the arrays of numbers are: {}", list())));
    }
    if let Some(found) = members.iter().find(|m| m.is_points() && names::is_position(&m.name)) {
        return Ok(Choice::One(found));
    }
    let by_name = |name: &str| members.iter().find(|m| m.name.eq_ignore_ascii_case(name));
    if let Some(found) = by_name("x").filter(|m| m.is_points()) {
        return Ok(Choice::One(found));
    }
    if let (Some(x), Some(y), Some(z)) = (by_name("x"), by_name("y"), by_name("z"))
        && [x, y, z].iter().all(|m| m.is_column() && m.rows() == x.rows())
    {
        return Ok(Choice::Three([x, y, z]));
    }
    let mut candidates = members.iter().filter(|m| m.is_points() && (m.header.is_structured || m.header.columns == 3));
    let mut wide = members.iter().filter(|m| m.is_points());
    match (candidates.next(), candidates.next(), wide.next(), wide.next()) {
        (Some(only), None, ..) | (None, None, Some(only), None) => Ok(Choice::One(only)),
        _ => Err(unsupported(format!(
            "which array holds the positions is not clear: name one of N x 3; the arrays of numbers are: {}",
            list()
        ))),
    }
}

impl Archive {
    pub(crate) fn open(path: &Path) -> Result<Archive, Error> {
        let mut source = Source::open(path)?;
        let head = source.peek(64)?;
        if !head.starts_with(b"PK") {
            let what = detect::mismatch("a NumPy archive", &head[..head.len().min(64)]);
            return Err(source.fail(what));
        }
        let (file, len) = source::open(path)?;
        let zip = ZipArchive::new(BufReader::new(file)).map_err(|error| damaged(path, &error.to_string()))?;
        if zip.len() > MAX_MEMBERS {
            return Err(damaged(path, &format!("{} arrays: the limit is {MAX_MEMBERS}", zip.len())));
        }
        Ok(Archive { path: path.into(), len, zip })
    }

    /// The arrays of numbers with their headers.
    fn members(&mut self) -> Result<Vec<Member>, Error> {
        let found = self.arrays(|source| {
            let header = npy_header::read(source)?;
            // A header that promises more than there is shall not pass for an array of other length.
            source.room(header.rows, header.stride() as u64, "rows").map(|_| header)
        })?;
        Ok(found.into_iter().map(|(index, name, header)| Member { index, name, header }).collect())
    }

    /// What `read` makes of the header of each array, with index and name. Text and Python objects, which are not
    /// supported, are passed over.
    pub(crate) fn arrays<T>(
        &mut self,
        read: impl Fn(&mut Source<'_>) -> Result<T, Error>,
    ) -> Result<Vec<(usize, String, T)>, Error> {
        let names: Vec<String> = self.zip.file_names().filter_map(|name| Some(name.ok()?.into_owned())).collect();
        let mut arrays = Vec::new();
        for file_name in names {
            let Some(name) = file_name.strip_suffix(".npy") else { continue };
            let Some(index) = self.zip.index_for_name(&file_name) else { continue };
            match self.part(index, name, &read) {
                Ok(header) => arrays.push((index, name.to_owned(), header)),
                Err(Error::Unsupported { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(arrays)
    }

    /// Reads what follows the header of an array.
    fn with<T>(
        &mut self,
        member: &Member,
        read: impl FnOnce(&mut Source<'_>, &Header) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.part(member.index, &member.name, |source| {
            npy_header::read(source)?;
            read(source, &member.header)
        })
    }

    /// Runs `read` on the bytes of an array.
    pub(crate) fn part<T>(
        &mut self,
        index: usize,
        name: &str,
        read: impl FnOnce(&mut Source<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let file = self.zip.by_index(index).map_err(|error| damaged(&self.path, &format!("{name}: {error}")))?;
        let result = match (file.compression(), file.data_start()) {
            (CompressionMethod::Stored, Some(start)) if !file.encrypted() => {
                let size = file.size();
                if start.checked_add(size).is_none_or(|end| end > self.len) {
                    return Err(damaged(
                        &self.path,
                        &format!("{name}: the file is cut short or its directory is wrong"),
                    ));
                }
                Source::open_part(&self.path, start, size).and_then(|mut source| read(&mut source))
            }
            _ => {
                let limit = file.size().min(source::inflated_limit(self.len));
                read(&mut Source::inflating(&self.path, file, limit))
            }
        };
        result.map_err(|error| match error {
            Error::Format { path, place, what } => {
                Error::Format { path, place, what: format!("in the array '{name}': {what}") }
            }
            Error::Unsupported { path, what } => {
                Error::Unsupported { path, what: format!("in the array '{name}': {what}") }
            }
            other => other,
        })
    }

    /// A vector from an array per component.
    fn interleave(&mut self, columns: &[&Member]) -> Result<AttributeValues, Error> {
        let mut values = AttributeValues::of(columns.iter().filter_map(|m| m.header.parts[0].scalar), 0);
        for (component, member) in columns.iter().enumerate() {
            self.with(member, |source, header| {
                npy::read_component(source, header, &mut values, (component, columns.len()))
            })?;
        }
        Ok(values)
    }

    /// Positions from three arrays.
    fn join(&mut self, columns: [&Member; 3]) -> Result<Particles, Error> {
        let mut positions = PositionData::of(columns.iter().filter_map(|m| m.header.parts[0].scalar), 0);
        for (axis, member) in columns.into_iter().enumerate() {
            let values = self.with(member, npy::read_values)?;
            positions.grow(values.len());
            match &mut positions {
                PositionData::F32(out) => {
                    out.iter_mut().enumerate().for_each(|(i, p)| p[axis] = values.get_f64(i) as f32);
                }
                PositionData::F64(out) => out.iter_mut().enumerate().for_each(|(i, p)| p[axis] = values.get_f64(i)),
            }
        }
        Ok(Particles { positions, attributes: Vec::new() })
    }
}

fn damaged(path: &Path, what: &str) -> Error {
    Error::Format { path: path.into(), place: Place::Whole, what: format!("the ZIP archive cannot be read: {what}") }
}
