//! The tables of formats: Python tests judge every format by foreign readers and note what they have witnessed in
//! docs/witnesses.tsv; a Rust test, which knows what is read and written, makes docs/src/formats.md of it.

use std::path::Path;
use std::process::Command;

use crate::python;
use crate::test::{Extent, cargo, echo, succeeds, target};

/// Runs the tests that witness, then writes the tables. Whether all went well.
pub fn run(root: &Path) -> bool {
    let target = target(root);
    if !succeeds(cargo(root, &["build", "--quiet", "--package", "pellicle-cli"])) {
        return false;
    }
    let python = match python::interpreter(root, &target, Extent::All) {
        Ok(python) => python,
        Err(reason) => {
            println!("the witnesses cannot be called: {reason}");
            return false;
        }
    };
    let binary = target.join("debug").join(format!("pellicle{}", std::env::consts::EXE_SUFFIX));
    let mut pytest = Command::new(python);
    // All tests that use the fixture `witness`, wherever they are.
    pytest.args(["-m", "pytest", "tests", "-q", "--witnesses", "-p", "no:cacheprovider", "--basetemp"]);
    pytest.arg(target.join("pytest")).current_dir(root);
    pytest.env("PELLICLE_BIN", binary).env("PELLICLE_WITNESSES", root.join("docs/witnesses.tsv"));
    pytest.env("PYTHONDONTWRITEBYTECODE", "1");
    let (judged, _) = echo(&mut pytest);
    let mut tables = cargo(root, &["test", "--quiet", "--package", "pellicle-io", "--test", "documentation"]);
    tables.env("PELLICLE_WRITE_DOCS", "1");
    succeeds(tables) && judged
}
