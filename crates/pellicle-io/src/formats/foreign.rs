//! Formats that hold particles but are not read: told by name or by content, each with a way to one that is read.

/// A format that is not read.
pub(crate) struct Foreign {
    what: &'static str,
    /// Endings of the file's name, in lower case.
    endings: &'static [&'static str],
    /// Beginnings of the content.
    magic: &'static [&'static [u8]],
    /// How to convert it.
    convert: &'static str,
}

/// Houdini's own converter; it comes with every edition.
const GCONVERT: &str =
    "convert it by Houdini's command gconvert IN OUT.bhclassic, or save it as classic .bhclassic or as .ply";

static FOREIGN: &[Foreign] = &[
    Foreign {
        what: "Houdini's compressed geometry",
        endings: &[".bgeo.sc", ".geo.sc"],
        magic: &[b"scf1"],
        convert: GCONVERT,
    },
    Foreign {
        what: "Houdini's newer, JSON-based geometry",
        endings: &[".geo", ".geo.gz"],
        magic: &[b"\x7fNSJ", b"[\n\t\"fileversion\"", b"[\"fileversion\"", b"[\n  \"fileversion\""],
        convert: GCONVERT,
    },
    Foreign {
        what: "Houdini's classic ASCII geometry",
        endings: &[".hclassic"],
        magic: &[b"PGEOMETRY"],
        convert: GCONVERT,
    },
    Foreign {
        what: "Alembic",
        endings: &[".abc"],
        magic: &[b"Ogawa"],
        convert: "convert its points by Houdini's command gabc -l points IN.abc OUT.bhclassic, or import it into Blender and \
                  save it by File > Export > Stanford PLY",
    },
    Foreign {
        what: "USD",
        endings: &[".usd", ".usda", ".usdc", ".usdz"],
        magic: &[b"PXR-USDC", b"#usda"],
        convert: "write the points as .npy by Python with usd-core: import numpy; from pxr import Usd, UsdGeom; \
                  stage = Usd.Stage.Open(\"IN.usd\"); numpy.save(\"OUT.npy\", UsdGeom.Points(stage.GetPrimAtPath(\
                  \"/PRIM\")).GetPointsAttr().Get(TIME))",
    },
    Foreign {
        what: "OpenVDB",
        endings: &[".vdb"],
        magic: &[b" BDV"],
        convert: "in Houdini load it by a File node, unpack it by Convert VDB Points, and save the points by Save > Geometry as \
                  .bhclassic or .ply",
    },
    Foreign {
        what: "an index of other files",
        endings: &[".vtm", ".series"],
        magic: &[],
        convert: "name the .vtu, .vtp or .vtk files that it lists, or save it in ParaView as .pvd, which is read",
    },
];

impl Foreign {
    /// That it is not read, and what to do.
    pub(crate) fn refusal(&self) -> String {
        format!("{} is not read: {}", self.what, self.convert)
    }
}

/// By the file's name, in lower case.
pub(crate) fn by_name(name: &str) -> Option<&'static Foreign> {
    FOREIGN.iter().find(|foreign| foreign.endings.iter().any(|ending| name.ends_with(ending)))
}

/// By the file's first bytes.
pub(crate) fn by_content(head: &[u8]) -> Option<&'static Foreign> {
    FOREIGN.iter().find(|foreign| foreign.magic.iter().any(|magic| head.starts_with(magic)))
}
