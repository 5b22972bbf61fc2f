//! The tables of docs/src/formats.md: made of what this build reads and writes, and of what foreign programs have witnessed
//! (docs/witnesses.tsv, which the Python tests write). `cargo xtask formats` makes both anew; without it this test checks
//! that the page is up to date.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use pellicle_io::{FormatInfo, formats};

const BEGIN: &str = "<!-- made by cargo xtask formats -->\n";
const END: &str = "<!-- end -->\n";

/// What tests in Rust have witnessed: `writers.rs`.
const IN_RUST: &str = "binary glTF\tmesh out\tgltf (Rust)\tnormals, colours, vectors, validity\tagrees\n";

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
}

/// The directions, and whether a format goes there.
fn directions(format: &FormatInfo) -> [(&'static str, bool); 6] {
    [
        ("particles in", format.reads_particles),
        ("particles out", format.writes_particles),
        ("mesh in", format.reads_meshes),
        ("mesh out", format.writes_meshes),
        ("volume in", format.reads_volumes),
        ("volume out", format.writes_volumes),
    ]
}

fn tables(witnesses: &str) -> String {
    let rows: Vec<Vec<&str>> = witnesses.lines().map(|line| line.split('\t').collect()).collect();
    let mut text = String::from(
        "\n| format | extensions | particles in | particles out | mesh in | mesh out | volume in | volume out |\n|---|---|---|---|---|---|---|---|\n",
    );
    for format in formats() {
        let extensions: Vec<String> = format.extensions.iter().map(|e| format!("`.{e}`")).collect();
        let cells = directions(&format).map(|(_, is_there)| if is_there { "yes" } else { "" });
        let _ = writeln!(text, "| {} | {} | {} |", format.name, extensions.join(" "), cells.join(" | "));
    }
    text.push_str(
        "\n| format | direction | judged by | besides positions, triangles and samples | result |\n|---|---|---|---|---|\n",
    );
    for format in formats() {
        for (direction, _) in directions(&format).into_iter().filter(|d| d.1) {
            let of_this = rows.iter().filter(|row| row[0] == format.name && row[1] == direction);
            let found: Vec<_> = of_this.collect();
            if found.is_empty() {
                let _ = writeln!(text, "| {} | {direction} | our own tests only | | |", format.name);
            }
            for row in found {
                let _ = writeln!(text, "| {} | {direction} | {} | {} | {} |", row[0], row[2], row[3], row[4]);
            }
        }
    }
    text.push('\n');
    text
}

#[test]
fn the_page_of_formats_is_up_to_date() {
    let witnesses = std::fs::read_to_string(docs().join("witnesses.tsv")).expect("docs/witnesses.tsv");
    let witnesses = witnesses.replace("\r\n", "\n") + IN_RUST;
    for row in witnesses.lines() {
        let cells: Vec<&str> = row.split('\t').collect();
        assert_eq!(cells.len(), 5, "{row}");
        let there = formats().any(|f| f.name == cells[0] && directions(&f).contains(&(cells[1], true)));
        assert!(there, "a test has witnessed what is not read or written here: {row}");
        assert_eq!(cells[4], "agrees", "{row}");
    }
    let path = docs().join("src/formats.md");
    let page = std::fs::read_to_string(&path).expect("the page").replace("\r\n", "\n");
    let (before, rest) = page.split_once(BEGIN).expect("the mark where the tables begin");
    let (found, after) = rest.split_once(END).expect("the mark where the tables end");
    let expected = tables(&witnesses);
    if std::env::var_os("PELLICLE_WRITE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{expected}{END}{after}")).expect("the page");
        return;
    }
    assert!(found == expected, "docs/src/formats.md is out of date: run cargo xtask formats");
}
