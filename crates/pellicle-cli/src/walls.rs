//! `--wall`: half-spaces, boxes and meshes that the fluid touches.

use std::path::PathBuf;
use std::sync::Arc;

use pellicle::{Solid, Walls};
use pellicle_io::read_mesh;

use crate::failure::Failure;
use crate::values::parse_numbers;

/// A wall as typed.
#[derive(Debug, Clone, PartialEq)]
pub enum Wall {
    /// The fluid is where `normal · x` is greater than the offset.
    Plane { normal: [f64; 3], offset: f64 },
    /// The fluid is in a box.
    Box { min: [f64; 3], max: [f64; 3] },
    /// A mesh of which one side is wall.
    Mesh { path: PathBuf, solid: Solid },
}

/// `plane=NX,NY,NZ,D`, `box=X,Y,Z,X,Y,Z`, `outside=FILE` or `FILE`.
pub fn parse_wall(text: &str) -> Result<Wall, String> {
    const FORMS: &str = "plane=NX,NY,NZ,D, box=X,Y,Z,X,Y,Z, FILE or outside=FILE";
    match text.split_once('=') {
        Some(("plane", numbers)) => {
            let [x, y, z, offset] = parse(numbers)?;
            if [x, y, z] == [0.0; 3] {
                return Err("the plane's normal is 0,0,0: it points to the fluid".into());
            }
            Ok(Wall::Plane { normal: [x, y, z], offset })
        }
        Some(("box", numbers)) => {
            let [a, b, c, d, e, f] = parse(numbers)?;
            let (min, max) = ([a, b, c], [d, e, f]);
            if (0..3).any(|i| min[i] >= max[i]) {
                return Err("the smaller corner of the box comes first".into());
            }
            Ok(Wall::Box { min, max })
        }
        Some(("outside", path)) if !path.is_empty() => Ok(Wall::Mesh { path: path.into(), solid: Solid::Outside }),
        _ if text.is_empty() => Err(format!("must be {FORMS}")),
        _ => Ok(Wall::Mesh { path: text.into(), solid: Solid::Inside }),
    }
}

fn parse<const N: usize>(text: &str) -> Result<[f64; N], String> {
    parse_numbers(text).ok_or_else(|| format!("'{text}' must be {N} numbers"))
}

/// All walls, their meshes read; `None` without any.
///
/// # Errors
/// Meshes that cannot be read.
pub fn build(walls: &[Wall]) -> Result<Option<Arc<Walls>>, Failure> {
    let mut all = Walls::new();
    let wrong = |error: pellicle::Error| Failure::Usage(format!("--wall: {error}"));
    for wall in walls {
        all = match wall {
            Wall::Plane { normal, offset } => all.with_plane(*normal, *offset).map_err(wrong)?,
            Wall::Box { min, max } => {
                for a in 0..3 {
                    for (sign, bound) in [(1.0, min[a]), (-1.0, max[a])] {
                        let mut normal = [0.0; 3];
                        normal[a] = sign;
                        all = all.with_plane(normal, sign * bound).map_err(wrong)?;
                    }
                }
                all
            }
            Wall::Mesh { path, solid } => {
                let triangles = read_mesh(path)?.world_triangles();
                if triangles.is_empty() {
                    return Err(Failure::file(path, "there is no triangle in it, so it is no wall"));
                }
                all.with_mesh(triangles, *solid).map_err(|error| Failure::core(path, error))?
            }
        };
    }
    Ok((!walls.is_empty()).then(|| Arc::new(all)))
}

/// For the output's header.
pub fn record(walls: &[Wall]) -> Vec<String> {
    let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let line = |wall: &Wall| match wall {
        Wall::Plane { normal, offset } => format!("wall plane {normal:?} {offset}"),
        Wall::Box { min, max } => format!("wall box {min:?} to {max:?}"),
        Wall::Mesh { path, solid: Solid::Inside } => format!("wall {}", name(path)),
        Wall::Mesh { path, solid: Solid::Outside } => format!("wall outside {}", name(path)),
    };
    walls.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_written_in_four_ways() {
        assert_eq!(parse_wall("plane=0,1,0,-2"), Ok(Wall::Plane { normal: [0.0, 1.0, 0.0], offset: -2.0 }));
        assert_eq!(parse_wall("box=0,0,0, 1,2,3"), Ok(Wall::Box { min: [0.0; 3], max: [1.0, 2.0, 3.0] }));
        assert_eq!(parse_wall("a.stl"), Ok(Wall::Mesh { path: "a.stl".into(), solid: Solid::Inside }));
        assert_eq!(parse_wall("outside=b=c.ply"), Ok(Wall::Mesh { path: "b=c.ply".into(), solid: Solid::Outside }));
        for (text, told) in [
            ("plane=0,0,0,1", "normal"),
            ("plane=1,2,3", "4 numbers"),
            ("box=0,0,0,1,0,1", "smaller corner"),
            ("box=0,0,0,1,nan,1", "6 numbers"),
            ("", "outside=FILE"),
        ] {
            assert!(parse_wall(text).unwrap_err().contains(told), "{text}");
        }
        let walls = build(&[parse_wall("box=0,0,0,1,2,3").unwrap()]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(walls.map(|walls| walls.planes().len()), Some(6));
        assert!(build(&[]).unwrap_or_else(|e| panic!("{e}")).is_none());
    }
}
