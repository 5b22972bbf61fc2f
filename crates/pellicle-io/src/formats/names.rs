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

/// Triples of columns that make one vector. The fourth name, where it is there, is a fourth component.
const TRIPLES: [(&str, [&str; 3], &str); 5] = [
    ("velocity", ["vx", "vy", "vz"], ""),
    ("velocity", ["velx", "vely", "velz"], ""),
    ("normal", ["nx", "ny", "nz"], ""),
    ("color", ["red", "green", "blue"], "alpha"),
    ("color", ["r", "g", "b"], "a"),
];

/// Positions, the usual names first.
const POSITIONS: [[&str; 3]; 3] = [["x", "y", "z"], ["posx", "posy", "posz"], ["px", "py", "pz"]];

/// Finds out what the columns of a table (a PLY element, a CSV file) mean by their names. Units behind a name, as in
/// `Pos.x [m]` or `X (m)`, do not count.
pub(crate) fn group(names: &[String]) -> Groups {
    let names: Vec<&str> = names.iter().map(|name| without_unit(name)).collect();
    let lower: Vec<String> = names.iter().map(|name| name.to_ascii_lowercase()).collect();
    let find = |wanted: &str| lower.iter().position(|name| name == wanted);
    let triple = |[x, y, z]: [&str; 3]| Some([find(x)?, find(y)?, find(z)?]);
    let mut position = POSITIONS.into_iter().find_map(triple);
    let mut attributes: Vec<Group> = Vec::new();
    let mut taken = vec![false; names.len()];
    take(&mut taken, position.as_ref().map_or(&[], |p| p));
    for (name, columns, fourth) in TRIPLES {
        if let Some(found) = triple(columns)
            && found.iter().all(|&column| !taken[column])
            && attributes.iter().all(|group| group.name != name)
        {
            let columns: Vec<usize> = found.into_iter().chain(find(fourth)).collect();
            take(&mut taken, &columns);
            attributes.push(Group { name: name.into(), original: name.into(), columns });
        }
    }
    for i in 0..names.len() {
        if taken[i] {
            continue;
        }
        let (base, columns) = run(&lower, i);
        if let (None, Ok(found)) = (position, <[usize; 3]>::try_from(columns.as_slice()))
            && (is_position(base) || matches!(base, "p" | "x"))
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

/// The attributes that columns make which do not hold positions.
pub(crate) fn group_attributes(names: &[String]) -> Vec<Group> {
    // Position columns are found first, so with some in front no other are taken for them.
    let all: Vec<String> = ["x", "y", "z"].map(String::from).into_iter().chain(names.iter().cloned()).collect();
    let mut groups = group(&all).attributes;
    groups.iter_mut().flat_map(|group| &mut group.columns).for_each(|column| *column -= 3);
    groups
}

fn take(taken: &mut [bool], columns: &[usize]) {
    for &column in columns {
        taken[column] = true;
    }
}

/// A column's name without the unit behind it. What stands in brackets and is a component is none.
fn without_unit(name: &str) -> &str {
    let name = name.trim();
    let close = if name.ends_with(']') { '[' } else { '(' };
    match name.rfind(close) {
        Some(open) if name.ends_with([']', ')']) && open > 0 && !is_component(&name[open + 1..name.len() - 1]) => {
            name[..open].trim_end()
        }
        _ => name,
    }
}

fn is_component(text: &str) -> bool {
    matches!(text, "x" | "y" | "z" | "X" | "Y" | "Z") || !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// A vector that begins with column `first`: columns in a row whose names differ by their component's suffix only.
fn run(names: &[String], first: usize) -> (&str, Vec<usize>) {
    let suffixes: [(&str, &dyn Fn(usize) -> String); 7] = [
        ("_0", &|i| format!("_{i}")),
        (":0", &|i| format!(":{i}")),
        ("[0]", &|i| format!("[{i}]")),
        ("_x", &|i| format!("_{}", axis(i))),
        (".x", &|i| format!(".{}", axis(i))),
        (":x", &|i| format!(":{}", axis(i))),
        ("[x]", &|i| format!("[{}]", axis(i))),
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
    fn units_and_brackets_are_understood() {
        for columns in [
            ["Pos.x [m]", "Pos.y [m]", "Pos.z [m]", "Vel.x [m/s]", "Vel.y [m/s]", "Vel.z [m/s]"],
            ["X (m)", "Y (m)", "Z (m)", "VelX", "VelY", "VelZ"],
            ["P[x]", "P[y]", "P[z]", "v[x]", "v[y]", "v[z]"],
            ["P.x", "P.y", "P.z", "v[0] (m/s)", "v[1] (m/s)", "v[2] (m/s)"],
            ["pos_x", "pos_y", "pos_z", "vx", "vy", "vz"],
            ["px", "py", "pz", "v:x", "v:y", "v:z"],
        ] {
            let expected = vec![("velocity".to_owned(), vec![3, 4, 5])];
            assert_eq!(found(&columns), (Some([0, 1, 2]), expected), "{columns:?}");
        }
        let (position, attributes) = found(&["x", "y", "z", "px", "py", "pz", "Rhop [kg/m^3]", "[m]"]);
        assert_eq!(position, Some([0, 1, 2]));
        let names: Vec<&str> = attributes.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["px", "py", "pz", "Rhop", "[m]"]);
    }

    #[test]
    fn colours_are_joined_with_their_opacity() {
        let colored = |columns: &[usize]| vec![("color".to_owned(), columns.to_vec())];
        assert_eq!(found(&["red", "green", "blue", "x", "y", "z"]).1, colored(&[0, 1, 2]));
        assert_eq!(found(&["x", "y", "z", "red", "green", "blue", "alpha"]).1, colored(&[3, 4, 5, 6]));
        // A radius alone is no colour.
        assert_eq!(found(&["x", "y", "z", "r"]).1, [("r".to_owned(), vec![3])]);
    }

    #[test]
    fn an_incomplete_position_is_none() {
        assert_eq!(found(&["x", "y", "w"]).0, None);
    }
}
