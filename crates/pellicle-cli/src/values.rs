//! Single values of the command line, read and written: numbers, byte sizes, counts, lists of attributes.

use std::num::NonZeroUsize;
use std::path::Path;

use pellicle_io::{AttributeChoice, SampleType};

/// Which attributes to carry to the surface: `all`, `none`, or names separated by commas.
pub fn parse_attributes(text: &str) -> Result<AttributeChoice, String> {
    match text.trim() {
        "all" => return Ok(AttributeChoice::All),
        "none" => return Ok(AttributeChoice::None),
        _ => {}
    }
    let mut names: Vec<String> = Vec::new();
    for name in text.split(',').map(str::trim) {
        if name.is_empty() {
            return Err("a name is empty: write all, none, or names separated by commas".into());
        }
        if matches!(name, "all" | "none") {
            return Err(format!("{name} stands alone: write it without other names"));
        }
        if !names.iter().any(|n| n == name) {
            names.push(name.to_owned());
        }
    }
    Ok(AttributeChoice::Names(names))
}

/// A file name as it can be typed in a shell.
pub fn show_argument(path: &Path) -> String {
    let text = path.to_string_lossy();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,=@%:".contains(c);
    if !text.is_empty() && !text.starts_with('-') && text.chars().all(is_plain) {
        return text.into_owned();
    }
    // A name that begins with a dash would be an option.
    let dash = if text.starts_with('-') { "./" } else { "" };
    format!("'{dash}{}'", text.replace('\'', "'\\''"))
}

/// A finite number greater than 0.
pub fn parse_positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("must be a finite number greater than 0".into()),
    }
}

/// A finite number.
pub fn parse_finite(text: &str) -> Result<f64, String> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| "must be a finite number".into())
}

/// Width and height of a picture, such as 1920x1080.
pub fn parse_pixels(text: &str) -> Result<(u32, u32), String> {
    let most = pellicle_render::Settings::MOST;
    let side = |text: &str| text.trim().parse::<u32>().ok().filter(|side| (1..=most).contains(side));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| format!("must be width and height in pixels, each from 1 to {most}, such as 1920x1080"))
}

/// A point, as three finite numbers separated by commas.
pub fn parse_point(text: &str) -> Result<[f64; 3], String> {
    parse_numbers(text).ok_or_else(|| "must be three finite numbers separated by commas, such as 1,2.5,-3".into())
}

/// An isovalue, with the text that names its file.
#[derive(Debug, Clone, PartialEq)]
pub struct IsoValue {
    /// As typed.
    pub text: String,
    /// Finite.
    pub value: f64,
}

/// Isovalues, no two of them equal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IsoValues(pub Vec<IsoValue>);

/// Finite numbers between commas, whose texts are kept.
pub fn parse_isos(text: &str) -> Result<IsoValues, String> {
    let mut isos: Vec<IsoValue> = Vec::new();
    for text in text.split(',').map(str::trim) {
        let Some(value) = text.parse::<f64>().ok().filter(|value| value.is_finite()) else {
            return Err("must be a finite number, or several with commas between them, such as 300 or 0.25,0.5".into());
        };
        if isos.iter().any(|iso| iso.value == value) {
            return Err(format!("{text} is named twice"));
        }
        isos.push(IsoValue { text: text.to_owned(), value });
    }
    Ok(IsoValues(isos))
}

/// Labels whose surfaces are wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Labels {
    /// All that there are but 0, which is the background by convention.
    All,
    /// These, no two of them equal.
    Some(Vec<i128>),
}

/// `all`, or whole numbers between commas.
pub fn parse_labels(text: &str) -> Result<Labels, String> {
    if text.trim() == "all" {
        return Ok(Labels::All);
    }
    let mut labels = Vec::new();
    for text in text.split(',').map(str::trim) {
        let Ok(label) = text.parse::<i128>() else {
            return Err("must be all, or whole numbers with commas between them, such as 1,2,17".into());
        };
        if labels.contains(&label) {
            return Err(format!("{text} is named twice"));
        }
        labels.push(label);
    }
    Ok(Labels::Some(labels))
}

/// Samples along x, y and z, and numbers per sample.
pub fn parse_dims(text: &str) -> Result<[u64; 4], String> {
    let numbers: Option<Vec<u64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|&n| n > 0)).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok([x, y, z, 1]),
        Some(&[x, y, z, n]) if n <= 4096 => Ok([x, y, z, n]),
        _ => Err("must be three counts of samples, such as 512,512,300, and of numbers per sample, up to 4096".into()),
    }
}

/// A type of numbers.
pub fn parse_sample_type(text: &str) -> Result<SampleType, String> {
    SampleType::by_name(text.trim())
        .ok_or_else(|| "must be one of i8, u8, i16, u16, i32, u32, i64, u64, f16, f32 and f64".into())
}

/// The ends of a range, as two finite numbers separated by a comma, the lower one first.
pub fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let range = parse_numbers(text).filter(|[low, high]| low < high);
    range.ok_or_else(|| "must be two finite numbers separated by a comma, the lower one first, such as 0,5".into())
}

/// So many finite numbers with commas between them.
pub fn parse_numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    numbers?.try_into().ok()
}

/// More threads than processors of any machine to come soon; far more would exhaust the system.
const MAX_THREADS: usize = 4096;

/// A number of threads.
pub fn parse_threads(text: &str) -> Result<NonZeroUsize, String> {
    match text.trim().parse::<NonZeroUsize>() {
        Ok(threads) if threads.get() <= MAX_THREADS => Ok(threads),
        _ => Err(format!("must be a whole number from 1 to {MAX_THREADS}")),
    }
}

/// A byte size: a number, then K, M, G or T for powers of 1024 (`KB`, `KiB` and lower case mean the same).
pub fn parse_size(text: &str) -> Result<u64, String> {
    let wrong = || "must be a number of bytes, or a number with K, M, G or T, such as 512M or 8G".to_owned();
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let power = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 0,
        "k" | "kb" | "kib" => 1,
        "m" | "mb" | "mib" => 2,
        "g" | "gb" | "gib" => 3,
        "t" | "tb" | "tib" => 4,
        _ => return Err(wrong()),
    };
    let bytes = number.parse::<f64>().map_err(|_| wrong())? * 1024_f64.powi(power);
    if bytes < 1.0 {
        return Err("must be at least 1 byte".into());
    }
    // 2^63 is far beyond any machine, and below it the conversion is exact enough.
    if bytes > 2_f64.powi(63) {
        return Err("is more than can be counted (8 million T)".into());
    }
    Ok(bytes as u64)
}

/// Bytes for a reader: three digits and a unit, powers of 1024 as in [`parse_size`].
pub fn show_bytes(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["KiB", "MiB", "GiB", "TiB"];
    if bytes < 1024 {
        return format!("{bytes} bytes");
    }
    let mut value = bytes as f64 / 1024.0;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    let decimals = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
    format!("{value:.decimals$} {}", UNITS[unit])
}

/// A count with its thousands apart: 2,370,112.
pub fn show_count(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count with its noun: "1 triangle", "2,000 triangles".
pub fn show_many(count: usize, noun: &str) -> String {
    format!("{} {noun}{}", show_count(count), if count == 1 { "" } else { "s" })
}

/// `12 triangles`, or `12 triangles, 3 quads` where quads were asked for.
pub fn show_faces(triangles: usize, quads: Option<usize>) -> String {
    let quads = quads.map(|n| format!(", {}", show_many(n, "quad"))).unwrap_or_default();
    show_many(triangles, "triangle") + &quads
}

/// A count of vertices, whose plural is its own.
pub fn show_vertices(count: usize) -> String {
    format!("{} {}", show_count(count), if count == 1 { "vertex" } else { "vertices" })
}

/// A length or coordinate for a reader: six significant digits, no trailing zeros.
pub fn show_number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    if !(-5..9).contains(&magnitude) {
        let text = format!("{value:.5e}");
        return match text.split_once('e') {
            Some((mantissa, exponent)) => format!("{}e{exponent}", trim_zeros(mantissa)),
            None => text,
        };
    }
    let decimals = (5 - magnitude).max(0) as usize;
    trim_zeros(&format!("{value:.decimals$}")).to_owned()
}

fn trim_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_powers_of_1024_in_every_spelling() {
        for (text, bytes) in [
            ("1", 1),
            ("4096", 4096),
            ("4096b", 4096),
            ("1K", 1 << 10),
            ("1.5k", 1536),
            ("512M", 512 << 20),
            ("8G", 8 << 30),
            ("8 GiB", 8 << 30),
            ("8gb", 8 << 30),
            (" 2T ", 2 << 40),
        ] {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
    }

    #[test]
    fn sizes_that_mean_nothing_are_refused() {
        for text in ["", "G", "0", "0.0001", "-1G", "lots", "8X", "8GG", "1e3", "..", "nan", "1.2.3M", "99999999999T"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn only_finite_positive_numbers_pass() {
        assert_eq!(parse_positive("1e-30"), Ok(1e-30));
        assert_eq!(parse_positive(" 0.025 "), Ok(0.025));
        for text in ["0", "-0.0", "-1", "nan", "inf", "1e400", "1e-400", "", "0,5", "0.5x"] {
            assert!(parse_positive(text).is_err(), "{text}");
        }
    }

    #[test]
    fn threads_are_counted_from_one_within_reason() {
        assert_eq!(parse_threads("7").map(NonZeroUsize::get), Ok(7));
        for text in ["0", "-1", "2.5", "", "all", "100000", "99999999999999999999999"] {
            assert!(parse_threads(text).is_err(), "{text}");
        }
    }

    #[test]
    fn attribute_lists_keep_their_order_and_lose_repeats() {
        let names = |list: &[&str]| Ok(AttributeChoice::Names(list.iter().map(|&n| n.into()).collect()));
        assert_eq!(parse_attributes("all"), Ok(AttributeChoice::All));
        assert_eq!(parse_attributes("none"), Ok(AttributeChoice::None));
        assert_eq!(parse_attributes("velocity"), names(&["velocity"]));
        assert_eq!(parse_attributes("density, velocity,density"), names(&["density", "velocity"]));
        for text in ["", ",", "a,,b", "a,", "all,density", "density,none"] {
            assert!(parse_attributes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn names_are_quoted_where_a_shell_would_cut_them() {
        for (name, shown) in [
            ("a/b-1.ply", "a/b-1.ply"),
            ("a b", "'a b'"),
            ("it's", "'it'\\''s'"),
            ("-x", "'./-x'"),
            ("f_#.ply", "'f_#.ply'"),
        ] {
            assert_eq!(show_argument(Path::new(name)), shown);
        }
    }

    #[test]
    fn pictures_points_and_ranges() {
        assert_eq!(parse_pixels("1920x1080"), Ok((1920, 1080)));
        assert_eq!(parse_point("1,-2.5,3e0"), Ok([1.0, -2.5, 3.0]));
        assert_eq!(parse_range("-1,1"), Ok([-1.0, 1.0]));
        for text in ["0x10", "10", "x", "99999x10", "10x10x10"] {
            assert!(parse_pixels(text).is_err(), "{text}");
        }
        for text in ["1,2", "1,2,3,4", "1,nan,2", "a,b,c"] {
            assert!(parse_point(text).is_err(), "{text}");
        }
        for text in ["1,1", "2,1", "inf,1", "1"] {
            assert!(parse_range(text).is_err(), "{text}");
        }
    }

    #[test]
    fn isovalues_keep_their_text_and_dims_their_components() {
        let iso = |text: &str, value| IsoValue { text: text.into(), value };
        assert_eq!(parse_isos(" -1.50, 2"), Ok(IsoValues(vec![iso("-1.50", -1.5), iso("2", 2.0)])));
        for text in ["nan", "1e999", "", "1,", "1,1.0"] {
            assert!(parse_isos(text).is_err(), "{text}");
        }
        assert_eq!(parse_dims("5, 4,3"), Ok([5, 4, 3, 1]));
        assert_eq!(parse_dims("5,4,3,2"), Ok([5, 4, 3, 2]));
        for text in ["5,4", "5,4,0", "5,4,-3", "5,4,3,9999", "5,4,3,2,1", "1e3,4,3"] {
            assert!(parse_dims(text).is_err(), "{text}");
        }
        assert_eq!(parse_sample_type("u16"), Ok(SampleType::U16));
        assert!(parse_sample_type("float").is_err());
    }

    #[test]
    fn numbers_are_shown_short() {
        assert_eq!(show_count(0), "0");
        assert_eq!(show_count(999), "999");
        assert_eq!(show_count(140608), "140,608");
        assert_eq!(show_count(2370112), "2,370,112");
        assert_eq!(show_many(1, "triangle"), "1 triangle");
        assert_eq!(show_many(0, "triangle"), "0 triangles");
        assert_eq!(show_bytes(12), "12 bytes");
        assert_eq!(show_bytes(1536), "1.50 KiB");
        assert_eq!(show_bytes(45_000_000), "42.9 MiB");
        assert_eq!(show_bytes(8 << 30), "8.00 GiB");
        assert_eq!(show_number(0.025), "0.025");
        assert_eq!(show_number(0.024_999_999), "0.025");
        assert_eq!(show_number(-3.25e12), "-3.25e12");
        assert_eq!(show_number(1e-30), "1e-30");
        assert_eq!(show_number(123_456.7), "123457");
        assert_eq!(show_number(0.0), "0");
    }
}
