//! What goes into a page, read back.

use super::*;

fn triangle() -> Mesh {
    Mesh {
        origin: [1e9, 0.0, 0.0],
        vertices: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f32::NAN, 0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 1, 3]],
        ..Mesh::default()
    }
}

fn text(mesh: &Mesh, title: &str) -> String {
    String::from_utf8(page(mesh, &Page::new(title)).unwrap()).unwrap()
}

/// What stands between the script tags with this id.
fn script(html: &str, id: &str) -> String {
    let (_, after) = html.split_once(&format!("id=\"{id}\"")).unwrap();
    let (_, after) = after.split_once('>').unwrap();
    after.split_once("</script>").unwrap().0.to_string()
}

#[test]
fn indices_read_back() {
    let triangles = [[0, 1, 2], [u32::MAX, 0, 1 << 20], [5, 5, 4]];
    let bytes = index_bytes(&triangles);
    let (mut read, mut last, mut value, mut shift) = (Vec::new(), 0i64, 0u64, 0);
    for byte in bytes {
        value |= u64::from(byte & 127) << shift;
        shift += 7;
        if byte < 128 {
            last += (value >> 1) as i64 ^ -((value & 1) as i64);
            read.push(u32::try_from(last).unwrap());
            (value, shift) = (0, 0);
        }
    }
    assert_eq!(read, triangles.concat());
}

#[test]
fn directions_survive_folding() {
    for n in [[1.0f32, 0.0, 0.0], [0.0, -1.0, 0.0], [0.3, -0.5, -0.8], [-0.2, -0.1, 0.9], [0.0, 0.0, -1.0]] {
        let [u, v] = octahedral(n).map(|q| f64::from(q) / 65535.0 * 2.0 - 1.0);
        let z = 1.0 - u.abs() - v.abs();
        let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
        let back = if z < 0.0 { [(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v), z] } else { [u, v, z] };
        let (back, n) = (normalized(back).unwrap(), normalized(n.map(f64::from)).unwrap());
        assert!(crate::vector::dot(back, n) > 1.0 - 1e-8, "{n:?} {back:?}");
    }
}

#[test]
fn vertices_fill_the_box_and_broken_ones_take_their_triangles_along() {
    let html = text(&triangle(), "t");
    assert!(html.contains("data-triangles=\"1\""));
    let bytes = STANDARD.decode(script(&html, "vertices")).unwrap();
    let vertex = |i: usize| -> Vec<u16> {
        bytes[12 * i..12 * i + 6].chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
    };
    assert_eq!(bytes.len(), 4 * 12);
    assert_eq!([vertex(0), vertex(1), vertex(2)], [[0, 0, 32768], [65535, 0, 32768], [0, 65535, 32768]]);
}

#[test]
fn a_title_cannot_leave_its_place() {
    let html = text(&triangle(), "</title><script>alert(1)</script>{{FACTS}}\0\"'&");
    assert!(!html.contains("<script>alert"));
    assert!(html.contains("&lt;/title&gt;&lt;script&gt;alert(1)&lt;/script&gt;{{FACTS}} &quot;&#39;&amp;"));
    // Nothing else is left to fill in.
    assert!(!html.replace("{{FACTS}}", "").contains("{{"));
}

#[test]
fn nothing_is_loaded_from_elsewhere() {
    let html = text(&triangle(), "t");
    for word in ["http:", "https:", "src=", "href=", "import(", "fetch(", "@import", "url("] {
        assert!(!html.contains(word), "{word}");
    }
}

#[test]
fn an_empty_mesh_has_a_page_and_a_broken_one_an_error() {
    assert!(text(&Mesh::default(), "nothing").contains("data-triangles=\"0\""));
    let broken = Mesh { triangles: vec![[0, 1, 9]], ..triangle() };
    assert_eq!(page(&broken, &Page::new("t")), Err(Error::Vertex { triangle: 0, vertex: 9, vertices: 4 }));
    assert!(page(&triangle(), &Page { up: [0.0; 3], ..Page::new("t") }).is_err());
}

#[test]
fn counts_are_grouped() {
    assert_eq!(grouped(0), "0");
    assert_eq!(grouped(999), "999");
    assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
}
