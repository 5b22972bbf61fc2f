//! Records of a file on their way into columns in memory: the part that all readers share.

use std::path::Path;

use crate::error::Error;
use crate::formats::names::Groups;
use crate::particles::{AttributeValues, ParticleAttribute, Particles, PositionData, ReadOptions};
use crate::scalar::{Endian, Field, Kind, Records, Scalar, decode, decode_component};

impl PositionData {
    /// Empty, of the precision that holds all of `scalars`.
    pub(crate) fn of(scalars: impl IntoIterator<Item = Scalar>, capacity: usize) -> PositionData {
        if scalars.into_iter().all(Scalar::fits_f32) {
            PositionData::F32(Vec::with_capacity(capacity))
        } else {
            PositionData::F64(Vec::with_capacity(capacity))
        }
    }

    /// Makes room for `more` positions.
    pub(crate) fn reserve(&mut self, more: usize) {
        match self {
            PositionData::F32(positions) => positions.reserve_exact(more),
            PositionData::F64(positions) => positions.reserve_exact(more),
        }
    }

    /// Fills up with zeros to `len` positions, unless there are as many already.
    pub(crate) fn grow(&mut self, len: usize) {
        match self {
            PositionData::F32(out) if len > out.len() => out.resize(len, [0.0; 3]),
            PositionData::F64(out) if len > out.len() => out.resize(len, [0.0; 3]),
            _ => {}
        }
    }

    /// Appends one position per record.
    pub(crate) fn append(&mut self, records: Records<'_>, fields: &[Field; 3]) {
        match self {
            PositionData::F32(out) => {
                let old = out.len();
                out.resize(old + records.len(), [0.0; 3]);
                decode(out[old..].as_flattened_mut(), records, fields);
            }
            PositionData::F64(out) => {
                let old = out.len();
                out.resize(old + records.len(), [0.0; 3]);
                decode(out[old..].as_flattened_mut(), records, fields);
            }
        }
    }

    /// Sets one coordinate of the particles from `first` on, which must exist.
    pub(crate) fn set(&mut self, first: usize, axis: usize, records: Records<'_>, field: Field) {
        match self {
            PositionData::F32(out) => decode_component(out[first..].as_flattened_mut(), axis, 3, records, field),
            PositionData::F64(out) => decode_component(out[first..].as_flattened_mut(), axis, 3, records, field),
        }
    }
}

impl AttributeValues {
    /// Empty, of a type that holds all of `scalars`.
    pub(crate) fn of(scalars: impl IntoIterator<Item = Scalar>, capacity: usize) -> AttributeValues {
        let joined = scalars.into_iter().map(Scalar::kind).reduce(|a, b| match (a, b) {
            (a, b) if a == b => a,
            (Kind::I32 | Kind::I64, Kind::I32 | Kind::I64) => Kind::I64,
            _ => Kind::F64,
        });
        match joined.unwrap_or(Kind::F32) {
            Kind::F32 => AttributeValues::F32(Vec::with_capacity(capacity)),
            Kind::F64 => AttributeValues::F64(Vec::with_capacity(capacity)),
            Kind::I32 => AttributeValues::I32(Vec::with_capacity(capacity)),
            Kind::I64 => AttributeValues::I64(Vec::with_capacity(capacity)),
        }
    }

    /// A value in double precision; NaN beyond the end.
    pub(crate) fn get_f64(&self, i: usize) -> f64 {
        let value = match self {
            AttributeValues::F32(values) => values.get(i).map(|&v| f64::from(v)),
            AttributeValues::F64(values) => values.get(i).copied(),
            AttributeValues::I32(values) => values.get(i).map(|&v| f64::from(v)),
            AttributeValues::I64(values) => values.get(i).map(|&v| v as f64),
        };
        value.unwrap_or(f64::NAN)
    }

    /// Appends `fields.len()` values per record.
    pub(crate) fn append(&mut self, records: Records<'_>, fields: &[Field]) {
        fn grow<T: Clone + Default>(values: &mut Vec<T>, by: usize) -> &mut [T] {
            let old = values.len();
            values.resize(old + by, T::default());
            &mut values[old..]
        }
        let by = records.len() * fields.len();
        match self {
            AttributeValues::F32(values) => decode(grow(values, by), records, fields),
            AttributeValues::F64(values) => decode(grow(values, by), records, fields),
            AttributeValues::I32(values) => decode(grow(values, by), records, fields),
            AttributeValues::I64(values) => decode(grow(values, by), records, fields),
        }
    }

    /// Sets one component of `components`, from value `first` on.
    pub(crate) fn set(&mut self, first: usize, component: (usize, usize), records: Records<'_>, field: Field) {
        let (at, of) = component;
        match self {
            AttributeValues::F32(values) => decode_component(&mut values[first..], at, of, records, field),
            AttributeValues::F64(values) => decode_component(&mut values[first..], at, of, records, field),
            AttributeValues::I32(values) => decode_component(&mut values[first..], at, of, records, field),
            AttributeValues::I64(values) => decode_component(&mut values[first..], at, of, records, field),
        }
    }

    /// Makes room for `more` values.
    pub(crate) fn reserve(&mut self, more: usize) {
        match self {
            AttributeValues::F32(values) => values.reserve_exact(more),
            AttributeValues::F64(values) => values.reserve_exact(more),
            AttributeValues::I32(values) => values.reserve_exact(more),
            AttributeValues::I64(values) => values.reserve_exact(more),
        }
    }

    /// Fills up with zeros to `len` values, unless there are as many already.
    pub(crate) fn grow(&mut self, len: usize) {
        if len > self.len() {
            self.resize(len);
        }
    }

    /// Fills up with zeros.
    pub(crate) fn resize(&mut self, len: usize) {
        match self {
            AttributeValues::F32(values) => values.resize(len, 0.0),
            AttributeValues::F64(values) => values.resize(len, 0.0),
            AttributeValues::I32(values) => values.resize(len, 0),
            AttributeValues::I64(values) => values.resize(len, 0),
        }
    }
}

/// Where the numbers of a record are.
#[derive(Default)]
pub(crate) struct Layout {
    fields: Vec<Field>,
    stride: usize,
}

impl Layout {
    /// Adds a number behind what is there; returns its index.
    pub(crate) fn push(&mut self, scalar: Scalar) -> usize {
        self.fields.push(Field { offset: self.stride, scalar });
        self.stride += scalar.size();
        self.fields.len() - 1
    }

    /// Adds bytes that are passed over.
    pub(crate) fn skip(&mut self, bytes: usize) {
        self.stride += bytes;
    }

    /// Bytes of a record.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }
}

/// An attribute and its fields in each record.
struct Column {
    attribute: ParticleAttribute,
    fields: Vec<Field>,
}

/// Particles in the making, from records of one layout.
pub(crate) struct Table {
    stride: usize,
    positions: PositionData,
    position_fields: [Field; 3],
    columns: Vec<Column>,
}

impl Table {
    /// A table for packed records of `layout`, in which `position` and `groups` say what the numbers mean; only what
    /// `options` asks for is kept.
    pub(crate) fn new(
        path: &Path,
        layout: &[Scalar],
        position: [usize; 3],
        groups: &Groups,
        options: &ReadOptions,
        capacity: usize,
    ) -> Result<Table, Error> {
        let mut packed = Layout::default();
        layout.iter().for_each(|&scalar| {
            packed.push(scalar);
        });
        Table::with_layout(path, &packed, position, groups, options, capacity)
    }

    /// A table for records in which not every byte is a number.
    pub(crate) fn with_layout(
        path: &Path,
        layout: &Layout,
        position: [usize; 3],
        groups: &Groups,
        options: &ReadOptions,
        capacity: usize,
    ) -> Result<Table, Error> {
        options.check(path, groups.attributes.iter().map(|g| (g.name.as_str(), g.original.as_str())))?;
        let (all, stride) = (&layout.fields, layout.stride);
        let position_fields = position.map(|i| all[i]);
        let mut columns = Vec::new();
        for group in groups.attributes.iter().filter(|g| options.wants(&g.name, &g.original)) {
            let fields: Vec<Field> = group.columns.iter().map(|&i| all[i]).collect();
            let components = fields.len();
            let values = AttributeValues::of(fields.iter().map(|f| f.scalar), capacity * components);
            columns
                .push(Column { attribute: ParticleAttribute { name: group.name.clone(), components, values }, fields });
        }
        let positions = PositionData::of(position_fields.map(|f| f.scalar), capacity);
        Ok(Table { stride, positions, position_fields, columns })
    }

    /// Appends a run of records.
    pub(crate) fn append(&mut self, bytes: &[u8], endian: Endian) {
        let records = Records { bytes, stride: self.stride, endian };
        self.positions.append(records, &self.position_fields);
        for column in &mut self.columns {
            column.attribute.values.append(records, &column.fields);
        }
    }

    /// What was read.
    pub(crate) fn finish(self) -> Particles {
        let attributes = self.columns.into_iter().map(|column| column.attribute).collect();
        Particles { positions: self.positions, attributes }
    }
}
