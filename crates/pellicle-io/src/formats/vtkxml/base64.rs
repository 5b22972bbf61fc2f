//! Base64, as VTK writes it: the sizes before the data and the data may be padded each for itself, and white space may
//! stand anywhere.
//!
//! Data are wanted in pieces, from several threads. Four characters make three bytes, so the place of any byte is
//! known where the text has no white space and no padding but at its end, as VTK and meshio write it. Other text is
//! decoded at once.

use std::borrow::Cow;
use std::io::{self, Read};
use std::ops::Range;

/// The bytes of an array, wherever they are.
pub(super) enum Payload<'a> {
    /// As they are.
    Raw(Cow<'a, [u8]>),
    /// The first bytes, which share their characters with what stands before, and the text of the others.
    Text { first: Vec<u8>, text: &'a [u8] },
}

impl<'a> Payload<'a> {
    /// What a decoder has left: `size` bytes of it. An error if they are not there.
    pub(super) fn of_text(mut decoder: Base64<'a>, size: usize) -> io::Result<Payload<'a>> {
        let first = decoder.take_left(size);
        let characters = (size - first.len()).div_ceil(3).checked_mul(4).ok_or(io::ErrorKind::UnexpectedEof)?;
        let blank = decoder.text.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let rest = &decoder.text[blank..];
        if let Some(text) = rest.get(..characters)
            && !text.iter().any(|&byte| byte <= b' ')
        {
            return Ok(Payload::Text { first, text });
        }
        // At least a character and a third for each byte: nothing is reserved for bytes that cannot be there.
        if rest.len() / 4 * 3 + 3 < size - first.len() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let mut bytes = vec![0; size];
        bytes[..first.len()].copy_from_slice(&first);
        decoder.read_exact(&mut bytes[first.len()..])?;
        Ok(Payload::Raw(bytes.into()))
    }

    /// The bytes in `range`, which must lie within the payload's size; decoded into `scratch` if need be.
    pub(super) fn get<'b>(&'b self, range: Range<usize>, scratch: &'b mut Vec<u8>) -> io::Result<&'b [u8]> {
        let (first, text) = match self {
            Payload::Raw(bytes) => return bytes.get(range).ok_or_else(|| io::ErrorKind::UnexpectedEof.into()),
            Payload::Text { first, text } => (first, text),
        };
        let (from, to) = (range.start.saturating_sub(first.len()), range.end.saturating_sub(first.len()));
        let text = text.get(from / 3 * 4..to.div_ceil(3) * 4).ok_or(io::ErrorKind::UnexpectedEof)?;
        let known = &first[range.start.min(first.len())..range.end.min(first.len())];
        // Bytes of the first characters that are not wanted stand between, only where nothing is known.
        let (skip, wanted) = (from % 3, to - from);
        let room = known.len() + text.len() / 4 * 3;
        if scratch.len() < room {
            scratch.resize(room, 0);
        }
        scratch[..known.len()].copy_from_slice(known);
        let count = read_full(&mut Base64::new(text), &mut scratch[known.len()..room])?;
        if count < skip + wanted {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "base64 that ends too early"));
        }
        Ok(&scratch[skip..skip + known.len() + wanted])
    }
}

/// Reads until the end or until `to` is full; returns how many bytes there were.
fn read_full(from: &mut impl Read, to: &mut [u8]) -> io::Result<usize> {
    let mut done = 0;
    while done < to.len() {
        match from.read(&mut to[done..])? {
            0 => break,
            count => done += count,
        }
    }
    Ok(done)
}

/// Decodes base64; stops at the first byte that cannot belong to it, such as the `<` of the end tag.
pub(super) struct Base64<'a> {
    text: &'a [u8],
    /// Decoded bytes that were not asked for yet, last first.
    left: [u8; 3],
    left_len: usize,
}

/// The value of each character; 64 marks padding, 255 all that is not base64.
const VALUES: [u8; 256] = {
    let mut values = [255; 256];
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut i = 0;
    while i < 64 {
        values[alphabet[i] as usize] = i as u8;
        i += 1;
    }
    values[b'=' as usize] = 64;
    values
};

impl<'a> Base64<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Base64 { text, left: [0; 3], left_len: 0 }
    }

    /// Decoded bytes that were not asked for yet, `limit` at most.
    fn take_left(&mut self, limit: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() < limit && self.left_len > 0 {
            self.left_len -= 1;
            bytes.push(self.left[self.left_len]);
        }
        bytes
    }

    /// Decodes the next four characters to up to three bytes; 0 at the end.
    fn quantum(&mut self) -> io::Result<([u8; 3], usize)> {
        let (mut values, mut count) = ([0u8; 4], 0);
        let mut used = 0;
        for &byte in self.text {
            let value = VALUES[usize::from(byte)];
            if value == 255 && !byte.is_ascii_whitespace() {
                break;
            }
            used += 1;
            if value != 255 {
                values[count] = value;
                count += 1;
                if count == 4 {
                    break;
                }
            }
        }
        self.text = &self.text[used..];
        let padding = values.iter().rev().take_while(|&&v| v == 64).count();
        match (count, padding) {
            (0, _) => return Ok(([0; 3], 0)),
            (4, 0..=2) if !values[..4 - padding].contains(&64) => {}
            _ => return Err(io::Error::new(io::ErrorKind::InvalidData, "not base64, or cut short")),
        }
        let bits = values.iter().fold(0u32, |bits, &v| bits << 6 | u32::from(v & 63));
        let [_, a, b, c] = bits.to_be_bytes();
        Ok(([a, b, c], 3 - padding))
    }
}

impl Read for Base64<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let mut done = 0;
        while done < to.len() && self.left_len > 0 {
            self.left_len -= 1;
            to[done] = self.left[self.left_len];
            done += 1;
        }
        // Four plain characters in a row are by far the most frequent.
        let (quads, _) = self.text.as_chunks::<4>();
        let mut used = 0;
        for (quad, to) in quads.iter().zip(to[done..].as_chunks_mut::<3>().0) {
            let values = quad.map(|byte| VALUES[usize::from(byte)]);
            if values.iter().any(|&v| v >= 64) {
                break;
            }
            let bits = values.iter().fold(0u32, |bits, &v| bits << 6 | u32::from(v));
            to.copy_from_slice(&bits.to_be_bytes()[1..]);
            used += 1;
        }
        self.text = &self.text[4 * used..];
        done += 3 * used;
        if done == 0 && !to.is_empty() {
            let (bytes, count) = self.quantum()?;
            for (i, &byte) in bytes[..count].iter().enumerate() {
                self.left[count - 1 - i] = byte;
            }
            self.left_len = count;
            while done < to.len() && self.left_len > 0 {
                self.left_len -= 1;
                to[done] = self.left[self.left_len];
                done += 1;
            }
        }
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(text: &[u8], step: usize) -> Vec<u8> {
        let (mut decoder, mut out, mut part) = (Base64::new(text), Vec::new(), vec![0; step]);
        loop {
            match decoder.read(&mut part).expect("this is base64") {
                0 => return out,
                count => out.extend_from_slice(&part[..count]),
            }
        }
    }

    #[test]
    fn base64_is_decoded_through_padding_within_and_white_space_whatever_the_step() {
        for step in 1..12 {
            assert_eq!(decode(b"cGVs\nbGlj bGU=\tc2tpbg==c2tpbg== </DataArray>", step), b"pellicleskinskin");
        }
    }

    #[test]
    fn damaged_base64_is_an_error() {
        for text in [&b"cGV"[..], b"c===", b"c=Vs", b"cGVsb"] {
            assert!(io::copy(&mut Base64::new(text), &mut io::sink()).is_err());
        }
    }

    #[test]
    fn any_part_of_a_payload_is_the_same_with_and_without_white_space_and_after_sizes() {
        let plain: Vec<u8> = (0..50u8).collect();
        let text = |line: usize, bytes: &[u8]| {
            let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
            let mut out = Vec::new();
            for (i, part) in bytes.chunks(3).enumerate() {
                let bits = part.iter().fold(0u32, |bits, &b| bits << 8 | u32::from(b)) << (8 * (3 - part.len()));
                let quad = [18, 12, 6, 0].map(|shift| alphabet[(bits >> shift & 63) as usize]);
                out.extend_from_slice(&quad[..part.len() + 1]);
                out.extend(std::iter::repeat_n(b'=', 3 - part.len()));
                if line > 0 && i % line == 0 {
                    out.push(b'\n');
                }
            }
            out
        };
        for (line, sizes) in [(0, 0), (0, 4), (0, 8), (5, 8), (1, 4)] {
            let text = text(line, &plain);
            let mut decoder = Base64::new(&text);
            let mut head = vec![0; sizes];
            decoder.read_exact(&mut head).expect("this is base64");
            let payload = Payload::of_text(decoder, plain.len() - sizes).expect("this is base64");
            for from in 0..plain.len() - sizes {
                for to in from..=plain.len() - sizes {
                    let found = payload.get(from..to, &mut Vec::new()).expect("within").to_vec();
                    assert_eq!(found, plain[sizes + from..sizes + to]);
                }
            }
            assert!(payload.get(0..plain.len() - sizes + 4, &mut Vec::new()).is_err());
        }
    }
}
