//! A mesh as one HTML file that a browser shows, with nothing to load from anywhere else.
//!
//! ```text
//! vertex   u16 x, y, z within the box, u16 padding, u16 × 2 normal       12 bytes, little-endian
//! index    difference to the one before, zigzag, 7 bits a byte           about 1.5 bytes
//! ```
//!
//! Both are base64 in the page. 16 bits place a vertex within 1/131070 of the box, finer than a screen shows. Normals are
//! octahedral: the unit sphere is folded flat onto a square (Cigolle et al., "A survey of efficient representations for
//! independent unit vectors", 2014). Vertices that are not finite take their triangles with them. The page's body has
//! `data-state`: `loading`, then `ready`, `unsupported` (no WebGL 2) or `failed`; and `data-triangles`.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use pellicle::Mesh;

use crate::camera::horizontal;
use crate::stage::{averaged, check_mesh};
use crate::vector::{Vec3, length, normalized, scale, sub};
use crate::{Bounds, Color, Error, lighting};

/// What the page says and how it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Page<'a> {
    /// In the page's head and its title line. Any text: it is escaped.
    pub title: &'a str,
    /// The world's up axis, of any length but 0. Default y.
    pub up: [f64; 3],
}

impl<'a> Page<'a> {
    /// A page with a title, y up.
    pub const fn new(title: &'a str) -> Self {
        Self { title, up: [0.0, 1.0, 0.0] }
    }
}

/// One self-contained HTML file, as bytes of UTF-8, that shows the mesh in WebGL 2: turn by mouse or touch, zoom by wheel
/// or pinch, wires, insides; light or dark as the browser is.
///
/// About 16 bytes a vertex and 5 a triangle: a million triangles make about 13 MB.
///
/// ```
/// let mesh = pellicle::reconstruct(&[[0.0f32, 0.0, 0.0]], &pellicle::Params::new(0.05))?;
/// let html = pellicle_render::page(&mesh, &pellicle_render::Page::new("One drop"))?;
/// assert!(String::from_utf8(html)?.contains("<title>One drop</title>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Camera`] for an up axis that is none, [`Error::Vertex`] and [`Error::Length`] for a mesh whose arrays do not
/// fit each other.
pub fn page(mesh: &Mesh, page: &Page<'_>) -> Result<Vec<u8>, Error> {
    check_mesh(mesh)?;
    let up = normalized(page.up).ok_or_else(|| Error::Camera {
        what: format!("the up axis is {:?}", page.up),
        must: "it must be finite and not 0",
    })?;
    let (front, side) = horizontal(up);

    let finite = |v: &u32| mesh.vertices[*v as usize].iter().all(|x| x.is_finite());
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(|t| t.iter().all(finite)).copied().collect();
    let mut bounds = Bounds::EMPTY;
    for &v in triangles.iter().flatten() {
        bounds.add(mesh.vertices[v as usize].map(f64::from));
    }
    let (centre, half) = bounds.framed();
    // Relative to the largest half edge: neither a huge nor a tiny mesh leaves the range of a shader's numbers.
    let unit = half.iter().fold(0.0f64, |most, &x| most.max(x));
    let half = scale(half, 1.0 / unit);
    let relative = |v: u32| -> Vec3 {
        let v = mesh.vertices[v as usize];
        std::array::from_fn(|a| (f64::from(v[a]) - centre[a]) / unit)
    };
    let (mut radius, mut edges) = (0.0f64, 0.0f64);
    for triangle in &triangles {
        let corners = triangle.map(relative);
        radius = corners.iter().fold(radius, |most, &p| most.max(length(p)));
        edges += (0..3).map(|k| length(sub(corners[k], corners[(k + 1) % 3]))).sum::<f64>() / 3.0;
    }
    let edge = edges / triangles.len().max(1) as f64;
    let axes: Vec<String> = [side, up, front].iter().map(|a| format!("[{},{},{}]", a[0], a[1], a[2])).collect();
    let list = |v: [f64; 3]| format!("[{},{},{}]", v[0], v[1], v[2]);
    let facts = format!(
        "{{\"triangles\":{},\"low\":{},\"size\":{},\"radius\":{},\"edge\":{edge},\"axes\":[{}]}}",
        triangles.len(),
        list(half.map(|x| -x)),
        list(half.map(|x| 2.0 * x)),
        if radius > 0.0 { radius } else { 1.0 },
        axes.join(","),
    );
    let place = |v: [f32; 3]| -> [u16; 3] {
        std::array::from_fn(|a| {
            let reach = half[a] * unit;
            let share = if reach > 0.0 { ((f64::from(v[a]) - centre[a]) / reach + 1.0) / 2.0 } else { 0.5 };
            quantized(share)
        })
    };
    let vertices = STANDARD.encode(vertex_bytes(mesh, place));
    let indices = STANDARD.encode(index_bytes(&triangles));
    let title = escaped(page.title);
    let (vertex_count, triangle_count) = (mesh.vertices.len(), triangles.len());
    let counts = format!("{} vertices, {} triangles", grouped(vertex_count), grouped(triangle_count));
    Ok(filled(
        include_str!("template.html"),
        &[
            ("TITLE", &title),
            ("STYLE", include_str!("style.css")),
            ("TRIANGLES", &triangle_count.to_string()),
            ("VERTICES", &vertex_count.to_string()),
            ("COUNTS", &counts),
            ("FACTS", &facts),
            ("VERTEX_DATA", &vertices),
            ("INDEX_DATA", &indices),
            ("LIGHT", &light()),
            ("SCRIPT", include_str!("viewer.js")),
        ],
    ))
}

fn vertex_bytes(mesh: &Mesh, place: impl Fn([f32; 3]) -> [u16; 3]) -> Vec<u8> {
    let computed;
    let normals = if mesh.normals.is_empty() {
        computed = averaged(mesh);
        &computed
    } else {
        &mesh.normals
    };
    let mut bytes = Vec::with_capacity(mesh.vertices.len() * 12);
    for (&v, &n) in mesh.vertices.iter().zip(normals) {
        let ([x, y, z], [u, w]) = (place(v), octahedral(n));
        for number in [x, y, z, 0, u, w] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
    }
    bytes
}

/// 0 to 1 in 16 bits; what is not a number is 0.
fn quantized(share: f64) -> u16 {
    (share.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16
}

/// A direction of any length on the unfolded octahedron; what has none points to z.
fn octahedral(n: [f32; 3]) -> [u16; 2] {
    let [x, y, z] = normalized(n.map(f64::from)).unwrap_or([0.0, 0.0, 1.0]);
    let sum = x.abs() + y.abs() + z.abs();
    let (x, y) = (x / sum, y / sum);
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    // The lower half is folded outward over the square's corners.
    let (x, y) = if z < 0.0 { ((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)) } else { (x, y) };
    [quantized((x + 1.0) / 2.0), quantized((y + 1.0) / 2.0)]
}

fn index_bytes(triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(triangles.len() * 6);
    let mut last = 0i64;
    for &index in triangles.iter().flatten() {
        let step = i64::from(index) - last;
        last = i64::from(index);
        let mut rest = (step << 1 ^ step >> 63) as u64;
        while rest > 127 {
            bytes.push((rest & 127) as u8 | 128);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
    bytes
}

/// The constants of [`lighting`] and the colors for the page's shader.
fn light() -> String {
    let mut text = String::new();
    for (name, [x, y, z]) in lighting::constants() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "const vec3 {name} = vec3({x:?}, {y:?}, {z:?});");
    }
    for (name, color) in
        [("WATER", Color::WATER), ("OUTSIDE", Color::OUTSIDE), ("INSIDE", Color::INSIDE), ("WIRE", Color::WIRE)]
    {
        let [r, g, b] = color.light();
        let _ = writeln!(text, "const vec3 {name} = vec3({r:?}, {g:?}, {b:?});");
    }
    for (name, finish) in [("WET", lighting::Finish::WET), ("DULL", lighting::Finish::DULL)] {
        let _ = writeln!(text, "const vec2 {name} = vec2({:?}, {:?});", finish.gloss, finish.rim);
    }
    text
}

/// 1234567 as 1 234 567, with narrow spaces that do not break.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // A parser would take them for an error, or for the end of the text.
            control if control.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

/// The template with its names in double braces replaced, once: what is put in is not searched again.
fn filled(template: &str, values: &[(&str, &str)]) -> Vec<u8> {
    let length: usize = values.iter().map(|(_, value)| value.len()).sum();
    let mut out = String::with_capacity(template.len() + 2 * length.min(1 << 16) + length);
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        out.push_str(before);
        out.push_str(values.iter().find(|(known, _)| *known == name).map_or("", |(_, value)| value));
        rest = after;
    }
    out.push_str(rest);
    out.into_bytes()
}

#[cfg(test)]
mod tests;
