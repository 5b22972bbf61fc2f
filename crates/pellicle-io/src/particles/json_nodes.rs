//! What is kept of a JSON document while it streams by: columns of numbers, and the path to them.
//!
//! Nothing is kept of text, of deeper nesting and of members that nobody asked for. Every number kept is one in the
//! file, so memory is in proportion to it.

use serde::de::{self, DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

use super::{AttributeChoice, ReadOptions};
use crate::formats::names;

/// Members that the objects of an array may have.
const MAX_KEYS: usize = 256;
/// Names that are remembered for messages.
const MAX_SEEN: usize = 100;

/// Numbers of an array.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    pub(super) values: Vec<f64>,
    /// Numbers in a row; 0 where they are not in rows.
    pub(super) width: usize,
    pub(super) is_integer: bool,
    /// Why this is no array of numbers, if it is not. Nothing is kept then.
    pub(super) problem: Option<String>,
}

impl Numbers {
    fn spoil(&mut self, why: impl FnOnce() -> String) {
        if self.problem.is_none() {
            *self = Numbers { problem: Some(why()), ..Numbers::default() };
        }
    }

    fn push(&mut self, value: Number) {
        match value {
            _ if self.problem.is_some() => {}
            Number::Float(value) => {
                self.values.push(value);
                self.is_integer = false;
            }
            Number::Integer(value) => self.values.push(value),
            Number::None => self.spoil(|| "it is not made of numbers".into()),
        }
    }

    fn new() -> Numbers {
        Numbers { is_integer: true, ..Numbers::default() }
    }
}

/// Numbers with a name.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) numbers: Numbers,
}

/// What a part of the document is.
#[derive(Debug)]
pub(super) enum Node {
    Numbers(Numbers),
    Columns {
        columns: Vec<Column>,
        /// Names of all members, for messages.
        seen: Vec<String>,
        /// Whether the caller's path names the positions among the columns.
        positions_named: bool,
    },
    /// Nothing that holds particles, and why.
    Other(String),
}

enum Number {
    Float(f64),
    Integer(f64),
    None,
}

/// Walks down `keys` and keeps what is there.
#[derive(Clone, Copy)]
pub(super) struct Seed<'a> {
    pub(super) keys: &'a [&'a str],
    pub(super) options: &'a ReadOptions,
}

impl Seed<'_> {
    /// Whether a member of this name may be part of what was asked for.
    fn wants(&self, name: &str) -> bool {
        let lower = name.to_ascii_lowercase();
        if names::is_position(name) || ["x", "y", "z"].contains(&lower.as_str()) {
            return true;
        }
        let wants = |name: &str| {
            [1, 3, 4].iter().any(|&components| self.options.wants(&names::canonical(name, components), name))
        };
        let base = match lower.as_bytes() {
            [first @ (b'v' | b'n'), b'x' | b'y' | b'z'] => Some(if *first == b'v' { "velocity" } else { "normal" }),
            [base @ .., b'_' | b':' | b'.', _] => name.get(..base.len()),
            _ => None,
        };
        self.options.attributes == AttributeChoice::All || wants(name) || base.is_some_and(wants)
    }
}

impl<'de> DeserializeSeed<'de> for Seed<'_> {
    type Value = Node;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Node, D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// Visits whatever is neither an array nor an object.
macro_rules! scalars {
    ($value:expr) => {
        fn visit_unit<E: de::Error>(self) -> Result<Self::Value, E> {
            Ok($value(self, Number::Float(f64::NAN)))
        }
        fn visit_bool<E: de::Error>(self, v: bool) -> Result<Self::Value, E> {
            Ok($value(self, Number::Integer(f64::from(u8::from(v)))))
        }
        fn visit_f64<E: de::Error>(self, v: f64) -> Result<Self::Value, E> {
            Ok($value(self, Number::Float(v)))
        }
        fn visit_i64<E: de::Error>(self, v: i64) -> Result<Self::Value, E> {
            Ok($value(self, Number::Integer(v as f64)))
        }
        fn visit_u64<E: de::Error>(self, v: u64) -> Result<Self::Value, E> {
            Ok($value(self, Number::Integer(v as f64)))
        }
        fn visit_str<E: de::Error>(self, _: &str) -> Result<Self::Value, E> {
            Ok($value(self, Number::None))
        }
    };
}

impl<'de> Visitor<'de> for Seed<'_> {
    type Value = Node;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an array or an object")
    }

    scalars!(|_, _| Node::Other("there is neither an array nor an object of particles".into()));

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Node, A::Error> {
        let Some((key, keys)) = self.keys.split_first() else {
            let mut builder = Builder { numbers: Numbers::new(), rows: 0, records: None, seen: Vec::new() };
            while items.next_element_seed(Element { builder: &mut builder, seed: self })?.is_some() {}
            return Ok(builder.finish());
        };
        let mut found = None;
        let index: Option<usize> = key.parse().ok();
        let mut count = 0;
        loop {
            if index == Some(count) {
                found = items.next_element_seed(Seed { keys, ..self })?;
                if found.is_none() {
                    break;
                }
            } else if items.next_element::<IgnoredAny>()?.is_none() {
                break;
            }
            count += 1;
        }
        Ok(found.unwrap_or_else(|| Node::Other(format!("there is no '{key}' in an array of {count}"))))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Node, A::Error> {
        let mut columns: Vec<Column> = Vec::new();
        let (mut seen, mut nested, mut is_found) = (Vec::new(), None, false);
        while let Some(name) = members.next_key::<String>()? {
            if seen.len() < MAX_SEEN {
                seen.push(name.clone());
            }
            let is_next = self.keys.first().is_some_and(|key| *key == name);
            let is_neighbour = self.keys.len() < 2 && self.wants(&name);
            if !is_next && !is_neighbour {
                members.next_value::<IgnoredAny>()?;
                continue;
            }
            let keys = if is_next { &self.keys[1..] } else { &[] };
            is_found |= is_next;
            match members.next_value_seed(Seed { keys, ..self })? {
                Node::Numbers(numbers) if self.keys.len() < 2 && columns.len() < 4096 => {
                    columns.push(Column { name, numbers });
                }
                // Arrays of objects and objects of arrays are sets of particles of their own.
                node if is_next || nested.is_none() && names::is_position(&name) => nested = Some(node),
                _ => {}
            }
        }
        let has_named = self.keys.first().is_some_and(|key| columns.iter().any(|column| column.name == *key));
        match (self.keys.first(), nested) {
            (Some(key), _) if !is_found => {
                Ok(Node::Other(format!("there is no '{key}'; there is: {}", seen.join(", "))))
            }
            (Some(_), Some(node)) if !has_named => Ok(node),
            (None, Some(node)) if !columns.iter().any(|column| names::is_position(&column.name)) => Ok(node),
            _ => Ok(Node::Columns { columns, seen, positions_named: has_named }),
        }
    }
}

/// An array in the making.
struct Builder {
    numbers: Numbers,
    rows: usize,
    /// Columns of objects, if the first element was one; those that hold no numbers are kept as spoilt.
    records: Option<Vec<Column>>,
    /// Names of all members of the first object.
    seen: Vec<String>,
}

impl Builder {
    fn finish(self) -> Node {
        match self.records {
            None => Node::Numbers(self.numbers),
            Some(columns) => Node::Columns { columns, seen: self.seen, positions_named: false },
        }
    }
}

/// An element of an array.
struct Element<'a, 'b> {
    builder: &'a mut Builder,
    seed: Seed<'b>,
}

impl<'de> DeserializeSeed<'de> for Element<'_, '_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl Element<'_, '_> {
    fn number(self, value: Number) {
        let Builder { numbers, rows, records, .. } = self.builder;
        *rows += 1;
        if numbers.width > 0 || records.is_some() {
            numbers.spoil(|| format!("element {} is a number, others are not", *rows - 1));
            *records = None;
        } else {
            numbers.push(value);
        }
    }
}

impl<'de> Visitor<'de> for Element<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number, an array or an object")
    }

    scalars!(|this: Self, value| this.number(value));

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        let Builder { numbers, rows, records, .. } = self.builder;
        let mut width = 0;
        while let Some(value) = items.next_element_seed(Plain)? {
            numbers.push(value);
            width += 1;
        }
        let is_first = *rows == 0;
        *rows += 1;
        if is_first {
            numbers.width = width;
        }
        if width != numbers.width || width == 0 || records.is_some() {
            let expected = numbers.width;
            numbers.spoil(|| format!("row {} has {width} numbers, where {expected} were expected", *rows - 1));
            *records = None;
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<(), A::Error> {
        let Builder { numbers, rows, records, seen } = self.builder;
        let is_first = *rows == 0;
        *rows += 1;
        if is_first {
            *records = Some(Vec::new());
        }
        let Some(columns) = records else {
            numbers.spoil(|| format!("element {} is an object, others are not", *rows - 1));
            while members.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
            return Ok(());
        };
        let mut at = 0;
        while let Some(name) = members.next_key::<String>()? {
            if is_first && seen.len() < MAX_SEEN {
                seen.push(name.clone());
            }
            let found = match columns.get(at) {
                Some(column) if column.name == name => Some(at),
                _ => columns.iter().position(|column| column.name == name),
            };
            let index = match found {
                Some(index) => index,
                None if is_first && self.seed.wants(&name) => {
                    if columns.len() == MAX_KEYS {
                        return Err(de::Error::custom(format!("an object of more than {MAX_KEYS} members")));
                    }
                    columns.push(Column { name, numbers: Numbers::new() });
                    columns.len() - 1
                }
                None => {
                    members.next_value::<IgnoredAny>()?;
                    continue;
                }
            };
            at = index + 1;
            members.next_value_seed(Value { numbers: &mut columns[index].numbers, is_first })?;
        }
        for Column { name, numbers } in columns.iter() {
            if numbers.problem.is_none() && numbers.values.len() != *rows * numbers.width {
                let what = format!("element {} has not as many numbers in '{name}' as the first", *rows - 1);
                return Err(de::Error::custom(what));
            }
        }
        Ok(())
    }
}

/// The value of an object's member: a number or a row of them.
struct Value<'a> {
    numbers: &'a mut Numbers,
    is_first: bool,
}

impl<'de> DeserializeSeed<'de> for Value<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl Value<'_> {
    fn number(self, value: Number) {
        if self.is_first {
            self.numbers.width = 1;
        }
        self.numbers.push(value);
    }
}

impl<'de> Visitor<'de> for Value<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a value")
    }

    scalars!(|this: Self, value| this.number(value));

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        let mut width = 0;
        while let Some(value) = items.next_element_seed(Plain)? {
            self.numbers.push(value);
            width += 1;
        }
        if self.is_first {
            self.numbers.width = width;
        }
        if width == 0 {
            self.numbers.spoil(|| "it is empty".into());
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<(), A::Error> {
        while members.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        self.numbers.spoil(|| "it is made of objects".into());
        Ok(())
    }
}

/// A number in a row; whatever else is there is passed over.
struct Plain;

impl<'de> DeserializeSeed<'de> for Plain {
    type Value = Number;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Number, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Plain {
    type Value = Number;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number")
    }

    scalars!(|_, value| value);

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Number, A::Error> {
        while items.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Number::None)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Number, A::Error> {
        while members.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(Number::None)
    }
}
