//! The header of a NumPy array, for the writers of `.npy` and `.npz`: version 1.0, little-endian, C order.
//!
//! Source: "The .npy format", `numpy/lib/format.py`.

use crate::columns::Values;
use crate::scalar::Scalar;

/// The header's length is a multiple of this, so that the data can be mapped into memory.
const ALIGN: usize = 64;

/// The header of an array with `components` numbers per row; of one dimension where that is 1.
pub(crate) fn header(values: Values<'_>, components: usize) -> Vec<u8> {
    let kind = match values.scalar() {
        Scalar::F64 => "<f8",
        Scalar::I64 => "<i8",
        Scalar::I32 => "<i4",
        Scalar::U32 => "<u4",
        Scalar::U8 => "|u1",
        _ => "<f4",
    };
    let rows = values.len() / components.max(1);
    let shape = if components == 1 { format!("({rows},)") } else { format!("({rows}, {components})") };
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let len = (10 + text.len() + 1).next_multiple_of(ALIGN) - 10;
    text.extend(std::iter::repeat_n(' ', len - text.len() - 1));
    text.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    // Far below 2^16: a type and two counts.
    out.extend_from_slice(&(len as u16).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_whole_lines_of_64_bytes() {
        for len in [0, 3, 300_000] {
            let bytes = header(Values::Repeated(0, len), 3);
            assert_eq!(bytes.len() % ALIGN, 0);
            assert_eq!(usize::from(u16::from_le_bytes([bytes[8], bytes[9]])) + 10, bytes.len());
            assert!(bytes.ends_with(b" \n"));
        }
        let text = String::from_utf8_lossy(&header(Values::F64(&[0.0; 4]), 1)[10..]).into_owned();
        assert!(text.starts_with("{'descr': '<f8', 'fortran_order': False, 'shape': (4,), }"), "{text}");
    }
}
