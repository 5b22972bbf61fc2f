//! Damage to files, as random as its seed: what fuzzing without a coverage-guided fuzzer can do.

use pellicle_scenes::Random;

/// Numbers that counts, sizes and indices are tried with.
const TEXTS: [&str; 16] = [
    "0",
    "1",
    "-1",
    "3",
    "41",
    "255",
    "65536",
    "2147483648",
    "4294967296",
    "4294967336",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999999",
    "nan",
    "1e400",
    "",
];
const NUMBERS: [u64; 16] = [
    0,
    1,
    2,
    3,
    0x7f,
    0xff,
    0x100,
    0xffff,
    1 << 20,
    1 << 31,
    (1 << 31) - 1,
    u32::MAX as u64,
    1 << 32,
    1 << 62,
    1 << 63,
    u64::MAX,
];
/// Beyond this, more bytes only take more time.
const MAX_LEN: usize = 64 << 10;

/// A damaged copy of `file`; `other` is a file of the same format, of which parts may be put in.
pub fn mutated(random: &mut Random, file: &[u8], other: &[u8]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for _ in 0..1 + random.below(4) {
        mutate(random, &mut bytes, other);
        bytes.truncate(MAX_LEN);
    }
    bytes
}

fn mutate(random: &mut Random, bytes: &mut Vec<u8>, other: &[u8]) {
    if bytes.is_empty() {
        *bytes = other.to_vec();
    }
    // Headers are worth more than data.
    let reach = if random.below(2) == 0 { bytes.len().min(400) } else { bytes.len() };
    if reach == 0 {
        return;
    }
    let at = random.below(reach);
    let some = |random: &mut Random, of: &[u8]| {
        let start = random.below(of.len().max(1));
        let most = [4, 16, 64, 1000][random.below(4)];
        start..(start + 1 + random.below(most)).min(of.len())
    };
    match random.below(12) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.bits() as u8,
        2 => bytes[at] = b"0123456789 \n\t,;:.<>\"'[]{}/-+eE#\0\xff"[random.below(33)],
        3 => bytes.truncate(at),
        4 => drop(bytes.drain(at..(at + [1, 4, 40, 400][random.below(4)]).min(bytes.len()))),
        5 => {
            let part = bytes[some(random, bytes)].to_vec();
            bytes.splice(at..at, part);
        }
        6 => {
            let part = other[some(random, other)].to_vec();
            bytes.splice(at..at, part);
        }
        7 => {
            // The rest of another file.
            bytes.truncate(at);
            bytes.extend_from_slice(&other[random.below(other.len().max(1)).min(other.len())..]);
        }
        8 | 9 => put_number(random, bytes, at),
        10 => put_text(bytes, at, TEXTS[random.below(TEXTS.len())]),
        _ => swap_words(bytes, at),
    }
}

/// Puts an integer of any width and order over the bytes at `at`, or near the one that is there.
fn put_number(random: &mut Random, bytes: &mut [u8], at: usize) {
    let width = [1, 2, 4, 8][random.below(4)];
    let Some(place) = bytes.get_mut(at..at + width) else { return };
    let is_big = random.below(2) == 0;
    if is_big {
        place.reverse();
    }
    let mut old = [0; 8];
    old[..width].copy_from_slice(place);
    let new = match random.below(3) {
        0 => u64::from_le_bytes(old).wrapping_add(random.below(9) as u64).wrapping_sub(4),
        _ => NUMBERS[random.below(NUMBERS.len())],
    };
    place.copy_from_slice(&new.to_le_bytes()[..width]);
    if is_big {
        place.reverse();
    }
}

/// Replaces the first decimal at or behind `at`.
fn put_text(bytes: &mut Vec<u8>, at: usize, text: &str) {
    let is_digit = |b: &u8| b.is_ascii_digit();
    let Some(start) = bytes[at..].iter().position(is_digit).map(|i| at + i) else { return };
    let end = bytes[start..].iter().position(|b| !is_digit(b)).map_or(bytes.len(), |i| start + i);
    bytes.splice(start..end, text.bytes());
}

/// Swaps the word behind `at` with the next one.
fn swap_words(bytes: &mut [u8], at: usize) {
    let ends: Vec<usize> = (at..bytes.len().min(at + 200)).filter(|&i| !bytes[i].is_ascii_alphanumeric()).collect();
    if let [a, b, c, ..] = ends[..]
        && a + 1 < b
        && b + 1 < c
    {
        bytes[a + 1..c].rotate_left(b - a);
    }
}

/// The least of `file` for which `is_same` still holds: parts are left out, the large ones first.
pub fn minimized(file: &[u8], mut is_same: impl FnMut(&[u8]) -> bool) -> Vec<u8> {
    let mut bytes = file.to_vec();
    let mut part = bytes.len().next_power_of_two() / 2;
    while part > 0 {
        let mut at = 0;
        while at < bytes.len() {
            let rest = &bytes[(at + part).min(bytes.len())..];
            let shorter = [&bytes[..at], rest].concat();
            if is_same(&shorter) {
                bytes = shorter;
            } else {
                at += part;
            }
        }
        part /= 2;
    }
    bytes
}
