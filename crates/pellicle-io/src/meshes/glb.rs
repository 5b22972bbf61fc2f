//! Binary glTF as a container: its JSON, its binary chunk, and accessors, views of typed numbers in that chunk.
//!
//! All that an accessor promises is compared with the chunk before a number is read. Data elsewhere than in the file
//! itself, sparse and compressed data are refused.
//!
//! Source: "glTF 2.0 Specification", The Khronos Group, 2021.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Place};
use crate::scalar::{Endian, Field, Records, Scalar, Target, decode};
use crate::source::Source;

/// Bytes of JSON, at most: parsed, it takes twenty times as much. Geometry is in the binary chunk.
const MAX_JSON: u32 = 4 << 20;
/// Extensions that change where vertices come from. A file may name them as optional.
const REFUSED: [&str; 4] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression", "EXT_mesh_gpu_instancing"];

/// A file in memory.
pub(super) struct Glb {
    path: PathBuf,
    pub(super) json: Value,
    binary: Vec<u8>,
    /// Bytes of the file.
    pub(super) len: u64,
}

/// Numbers in the binary chunk.
pub(super) struct Accessor<'a> {
    /// At least 1.
    pub(super) count: usize,
    pub(super) components: usize,
    pub(super) scalar: Scalar,
    is_normalized: bool,
    /// From the first number to the last.
    bytes: &'a [u8],
    stride: usize,
}

impl Glb {
    pub(super) fn open(path: &Path) -> Result<Glb, Error> {
        let mut source = Source::open(path)?;
        let len = source.remaining();
        if !source.peek(4)?.starts_with(b"glTF") {
            return Err(source.fail("this is not a binary glTF file: it does not begin with 'glTF'"));
        }
        source.advance(4);
        let version = number(&mut source)?;
        if version != 2 {
            return Err(source.unsupported(format!("glTF version {version} is not read, only 2: save it again as 2.0")));
        }
        let length = number(&mut source)?;
        if u64::from(length) > len {
            return Err(source.fail(format!("{length} bytes are announced, the file has {len}: it is cut short")));
        }
        let text = chunk(&mut source, b"JSON", MAX_JSON)?.unwrap_or_default();
        let json =
            serde_json::from_slice(&text).map_err(|error| source.fail(format!("the JSON is damaged: {error}")))?;
        let binary = if source.offset() < length.into() { chunk(&mut source, b"BIN\0", u32::MAX)? } else { None };
        let glb = Glb { path: path.into(), json, binary: binary.unwrap_or_default(), len };
        for extension in glb.list("extensionsRequired").iter().filter_map(Value::as_str) {
            if REFUSED.contains(&extension) {
                return Err(glb.unsupported(format!("its meshes use {extension}, which is not read: save it without")));
            }
        }
        Ok(glb)
    }

    pub(super) fn fail(&self, what: impl Into<String>) -> Error {
        Error::Format { path: self.path.clone(), place: Place::Whole, what: what.into() }
    }

    pub(super) fn unsupported(&self, what: impl Into<String>) -> Error {
        Error::Unsupported { path: self.path.clone(), what: what.into() }
    }

    /// An array at the top of the JSON; empty where there is none.
    pub(super) fn list(&self, name: &str) -> &[Value] {
        self.json[name].as_array().map_or(&[], Vec::as_slice)
    }

    /// The object that another one names by its number.
    pub(super) fn object(&self, list: &str, number: &Value) -> Result<&Value, Error> {
        let index = number.as_u64().and_then(|number| usize::try_from(number).ok());
        let found = index.and_then(|index| self.list(list).get(index));
        found.ok_or_else(|| self.fail(format!("the JSON refers to number {number} of {list}, which is not there")))
    }

    /// A whole number of an object, 0 where it is not given.
    fn whole(&self, object: &Value, name: &str) -> Result<usize, Error> {
        match &object[name] {
            Value::Null => Ok(0),
            value => value
                .as_u64()
                .and_then(|value| usize::try_from(value).ok())
                .ok_or_else(|| self.fail(format!("'{name}' is {value}, not a whole number"))),
        }
    }

    /// An accessor, checked against the binary chunk.
    pub(super) fn accessor(&self, number: &Value) -> Result<Accessor<'_>, Error> {
        let accessor = self.object("accessors", number)?;
        if !accessor["sparse"].is_null() || accessor["bufferView"].is_null() {
            let what = format!("accessor {number} is sparse or compressed, which is not read: save it without");
            return Err(self.unsupported(what));
        }
        let scalar = match self.whole(accessor, "componentType")? {
            5120 => Scalar::I8,
            5121 => Scalar::U8,
            5122 => Scalar::I16,
            5123 => Scalar::U16,
            5125 => Scalar::U32,
            5126 => Scalar::F32,
            other => return Err(self.fail(format!("accessor {number} has the componentType {other}"))),
        };
        let components = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            _ => return Err(self.unsupported(format!("accessor {number} has the type {}", accessor["type"]))),
        };
        let view = self.object("bufferViews", &accessor["bufferView"])?;
        let buffer = view["buffer"].as_u64();
        if buffer != Some(0) || !self.list("buffers").first().is_some_and(|buffer| buffer["uri"].is_null()) {
            return Err(self.unsupported("its data are in other files, which are not read: save it as a single .glb"));
        }
        let (count, size) = (self.whole(accessor, "count")?, components * scalar.size());
        let stride = match self.whole(view, "byteStride")? {
            0 => size,
            stride => stride,
        };
        let (start, len) = (self.whole(view, "byteOffset")?, self.whole(view, "byteLength")?);
        let from = self.whole(accessor, "byteOffset")?;
        let bytes = self.binary.get(start..).and_then(|bytes| bytes.get(..len)).and_then(|bytes| bytes.get(from..));
        let needed = count.checked_sub(1).and_then(|n| n.checked_mul(stride)).and_then(|n| n.checked_add(size));
        let bytes = bytes.zip(needed).and_then(|(bytes, needed)| bytes.get(..needed));
        match bytes {
            Some(bytes) if stride >= size => {
                let is_normalized = accessor["normalized"].as_bool().unwrap_or(false);
                Ok(Accessor { count, components, scalar, is_normalized, bytes, stride })
            }
            _ => Err(self.fail(format!(
                "accessor {number} has {count} items of {size} bytes, {stride} apart, which are not in the binary chunk \
                 of {} bytes",
                self.binary.len()
            ))),
        }
    }
}

impl Accessor<'_> {
    /// All numbers; integers that stand for a range of 0 to 1 or -1 to 1 as such.
    pub(super) fn floats(&self) -> Vec<f32> {
        let mut out = vec![0f32; self.count * self.components];
        self.decode(&mut out);
        let largest = match self.scalar {
            Scalar::I8 => 127.0,
            Scalar::U8 => 255.0,
            Scalar::I16 => 32767.0,
            Scalar::U16 => 65535.0,
            _ => return out,
        };
        if self.is_normalized {
            out.iter_mut().for_each(|value| *value = (*value / largest).max(-1.0));
        }
        out
    }

    /// All numbers of an accessor of single integers.
    pub(super) fn integers(&self) -> Vec<i64> {
        let mut out = vec![0; self.count * self.components];
        self.decode(&mut out);
        out
    }

    fn decode<T: Target>(&self, out: &mut [T]) {
        let fields: Vec<Field> =
            (0..self.components).map(|i| Field { offset: i * self.scalar.size(), scalar: self.scalar }).collect();
        let size = self.components * self.scalar.size();
        // Behind the last item there need not be a whole stride.
        let last = (self.count - 1) * self.stride;
        let (most, end) = out.split_at_mut((self.count - 1) * self.components);
        decode(most, Records { bytes: &self.bytes[..last], stride: self.stride, endian: Endian::Little }, &fields);
        decode(end, Records { bytes: &self.bytes[last..], stride: size, endian: Endian::Little }, &fields);
    }
}

fn number(source: &mut Source<'_>) -> Result<u32, Error> {
    let bytes = source.exact(4, "the header")?;
    Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}

/// The chunk of this kind, which comes next.
fn chunk(source: &mut Source<'_>, kind: &[u8; 4], limit: u32) -> Result<Option<Vec<u8>>, Error> {
    let len = number(source)?;
    let found = source.exact(4, "the header of a chunk")?;
    if found != kind {
        // Chunks that are not known are passed over; the first must be known.
        return if kind == b"JSON" { Err(source.fail("the first chunk is not JSON")) } else { Ok(None) };
    }
    if len > limit {
        return Err(source.unsupported(format!("its JSON has {len} bytes: the limit is {limit}")));
    }
    let mut bytes = Vec::with_capacity(source.room(len.into(), 1, "bytes of a chunk")?);
    while bytes.len() < len as usize {
        let step = (len as usize - bytes.len()).min(64 << 10);
        bytes.extend_from_slice(source.exact(step, "a chunk")?);
    }
    Ok(Some(bytes))
}
