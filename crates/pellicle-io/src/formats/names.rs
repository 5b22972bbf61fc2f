//! What the columns of a file mean: which are the position, which belong together as a vector, and the one name that
//! every format's name for it is translated to.

use super::catalog::Format;

/// Columns that make one attribute.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    /// The name used in memory.
    pub(crate) name: String,
    /// The name in the file, without the component's suffix.
    pub(crate) original: String,
    /// Indices of its columns, one per component.
    pub(crate) columns: Vec<usize>,
}

/// The columns of a file, sorted by meaning.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Groups {
    /// The columns of x, y and z.
    pub(crate) position: Option<[usize; 3]>,
    /// All others.
    pub(crate) attributes: Vec<Group>,
}

/// The name used in memory for an attribute, whatever program wrote it: Houdini says `v`, DualSPHysics `Vel`.
pub fn canonical(name: &str, components: usize) -> String {
    let lower = name.to_ascii_lowercase();
    match (lower.as_str(), components) {
        ("v" | "vel" | "velo" | "velocity" | "velocities", 3) => "velocity".into(),
        ("n" | "normal" | "normals", 3) => "normal".into(),
        ("cd" | "color" | "colour", 3 | 4) => "color".into(),
        ("pscale" | "radius", 1) => "radius".into(),
        _ => name.into(),
    }
}

/// Whether an array of three components by this name is the position.
pub(crate) fn is_position(name: &str) -> bool {
    const NAMES: [&str; 10] =
        ["position", "positions", "pos", "posd", "points", "point", "coordinates", "coords", "xyz", "particles"];
    NAMES.contains(&name.to_ascii_lowercase().as_str())
}

/// The name of an attribute in a file of `format`, from the name used in memory: the inverse of [`canonical`]. Never empty.
///
/// PLY and CSV name every component of a vector; the names of those are made from this one.
pub(crate) fn foreign(format: Format, name: &str, components: usize) -> String {
    match (format, name, components) {
        (_, "", _) => foreign(format, "unnamed", components),
        (Format::Bgeo, "velocity", 3) => "v".into(),
        (Format::Bgeo, "normal", 3) => "N".into(),
        (Format::Bgeo, "color", 3 | 4) => "Cd".into(),
        (Format::Bgeo, "radius", 1) => "pscale".into(),
        (Format::Npz, "normal", 3) => "normals".into(),
        (Format::Glb, "normal", 3) => "NORMAL".into(),
        (Format::Glb, "color", 3 | 4) => "COLOR_0".into(),
        // An underscore marks what the specification does not know.
        (Format::Glb, _, _) => {
            let word = |c: char| if c.is_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
            std::iter::once('_').chain(name.chars().map(word)).collect()
        }
        _ => name.into(),
    }
}

/// The name used in memory for an attribute of a glTF file. Its case is lost: all is upper case there.
pub(crate) fn from_gltf(name: &str, components: usize) -> String {
    match name.strip_prefix('_') {
        Some(custom) => canonical(&custom.to_ascii_lowercase(), components),
        None if name == "COLOR_0" => "color".into(),
        None => canonical(&name.to_ascii_lowercase(), components),
    }
}

/// Finds out what the columns of a table (a PLY element, a CSV file) mean by their names.
pub(crate) fn group(names: &[String]) -> Groups {
    let lower: Vec<String> = names.iter().map(|n| n.to_ascii_lowercase()).collect();
    let mut position = triple(&lower, ["x", "y", "z"]);
    let mut attributes = Vec::new();
    let mut taken = vec![false; names.len()];
    take(&mut taken, position.as_ref().map_or(&[], |p| p));
    for (name, columns) in [("velocity", ["vx", "vy", "vz"]), ("normal", ["nx", "ny", "nz"])] {
        if let Some(found) = triple(&lower, columns) {
            take(&mut taken, &found);
            attributes.push(Group { name: name.into(), original: name.into(), columns: found.into() });
        }
    }
    for i in 0..names.len() {
        if taken[i] {
            continue;
        }
        let (base, columns) = run(&lower, i);
        if let (None, "points" | "point" | "position" | "positions", Ok(found)) =
            (position, base, <[usize; 3]>::try_from(columns.as_slice()))
        {
            take(&mut taken, &found);
            position = Some(found);
            continue;
        }
        take(&mut taken, &columns);
        let original = names[i][..base.len()].to_owned();
        attributes.push(Group { name: canonical(&original, columns.len()), original, columns });
    }
    attributes.sort_by_key(|group| group.columns[0]);
    Groups { position, attributes }
}

fn take(taken: &mut [bool], columns: &[usize]) {
    for &column in columns {
        taken[column] = true;
    }
}

fn triple(names: &[String], wanted: [&str; 3]) -> Option<[usize; 3]> {
    let find = |name: &str| names.iter().position(|n| n == name);
    Some([find(wanted[0])?, find(wanted[1])?, find(wanted[2])?])
}

/// A vector that begins with column `first`: columns in a row whose names differ by their component's suffix only.
fn run(names: &[String], first: usize) -> (&str, Vec<usize>) {
    let suffixes: [(&str, &dyn Fn(usize) -> String); 4] = [
        ("_0", &|i| format!("_{i}")),
        (":0", &|i| format!(":{i}")),
        ("_x", &|i| format!("_{}", axis(i))),
        (".x", &|i| format!(".{}", axis(i))),
    ];
    let name = names[first].as_str();
    for (start, suffix) in suffixes {
        let Some(base) = name.strip_suffix(start).filter(|base| !base.is_empty()) else { continue };
        let matching = |&i: &usize| names.get(first + i).is_some_and(|n| *n == format!("{base}{}", suffix(i)));
        let length = 1 + (1..).take_while(matching).count();
        if length > 1 {
            return (base, (first..first + length).collect());
        }
    }
    (name, vec![first])
}

fn axis(i: usize) -> &'static str {
    ["x", "y", "z"].get(i).copied().unwrap_or("?")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|&n| n.into()).collect()
    }

    type Found = (Option<[usize; 3]>, Vec<(String, Vec<usize>)>);

    fn found(list: &[&str]) -> Found {
        let groups = group(&names(list));
        (groups.position, groups.attributes.into_iter().map(|g| (g.name, g.columns)).collect())
    }

    #[test]
    fn components_are_joined_in_any_order_and_case() {
        let (position, attributes) = found(&["id", "Z", "Y", "X", "vx", "vy", "vz", "Temp_0", "Temp_1", "w_0"]);
        assert_eq!(position, Some([3, 2, 1]));
        let expected: [(&str, Vec<usize>); 4] =
            [("id", vec![0]), ("velocity", vec![4, 5, 6]), ("Temp", vec![7, 8]), ("w_0", vec![9])];
        assert_eq!(attributes, expected.map(|(n, c)| (n.to_owned(), c)));
    }

    #[test]
    fn paraview_names_are_understood() {
        let (position, attributes) =
            found(&["Velocity:0", "Velocity:1", "Velocity:2", "Points:0", "Points:1", "Points:2"]);
        assert_eq!(position, Some([3, 4, 5]));
        assert_eq!(attributes, [("velocity".to_owned(), vec![0, 1, 2])]);
    }

    #[test]
    fn names_without_ascii_are_kept_whole() {
        let (position, attributes) = found(&["größe_x", "größe_y", "größe_z", "İ_0", "İ_1"]);
        assert_eq!(position, None);
        assert_eq!(attributes.len(), 2);
        assert_eq!(attributes[0].0, "größe");
    }

    #[test]
    fn names_of_every_format_lead_back_to_the_name_in_memory() {
        for (name, components) in [("velocity", 3), ("normal", 3), ("color", 3), ("color", 4), ("radius", 1), ("id", 1)]
        {
            for row in crate::formats::catalog::CATALOG {
                let there = foreign(row.format, name, components);
                let back = match row.format {
                    Format::Glb => from_gltf(&there, components),
                    _ => canonical(&there, components),
                };
                assert_eq!(back, name, "{there} in {}", row.name);
            }
        }
        assert_eq!(foreign(Format::Bgeo, "radius", 1), "pscale");
        assert_eq!(foreign(Format::Glb, "velocity", 3), "_VELOCITY");
        assert_eq!(foreign(Format::Glb, "", 1), "_UNNAMED");
    }

    #[test]
    fn an_incomplete_position_is_none() {
        assert_eq!(found(&["x", "y", "w"]).0, None);
    }
}
