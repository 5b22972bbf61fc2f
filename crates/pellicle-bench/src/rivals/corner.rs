//! What both rivals do with a cube once its corners are known.

use pellicle::internals::{CASES, edge_corner};

use super::Output;

/// A corner that has been evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    pub value: f32,
    /// Outward: the gradient turned round, up to its length.
    pub normal: [f32; 3],
    /// One more than the number of the vertex on the edge that starts here along each axis; 0 for none yet.
    pub edges: [u32; 3],
    /// Where it is: what its owner makes of it.
    pub place: u32,
    /// Whether the cube whose lowest corner this is was visited.
    pub done: bool,
    /// Whether a walk down from a particle came through here.
    pub walked: bool,
}

impl Corner {
    /// Not visited, from the sums over the particles.
    pub fn new([value, x, y, z]: [f32; 4], place: u32) -> Self {
        Self { value, normal: [x, y, z], edges: [0; 3], place, done: false, walked: false }
    }
}

/// The faces, 2·axis + side, through which the surface leaves a cube of each case.
pub static LEAVES: [u8; 256] = {
    let mut table = [0; 256];
    let mut case = 0;
    while case < 256 {
        let mut face = 0;
        while face < 6 {
            let (axis, side) = (face / 2, face % 2);
            let (mut inside, mut corner) = (0, 0);
            while corner < 8 {
                if corner >> axis & 1 == side && case >> corner & 1 == 1 {
                    inside += 1;
                }
                corner += 1;
            }
            if inside > 0 && inside < 4 {
                table[case] |= 1 << face;
            }
            face += 1;
        }
        case += 1;
    }
    table
};

/// One bit for each corner that is inside.
#[inline(always)]
pub fn case_of(corners: &[Corner], ids: &[u32; 8], iso: f32) -> usize {
    (0..8).fold(0, |case, c| case | usize::from(corners[ids[c] as usize].value > iso) << c)
}

/// Writes the triangles of one cube, and the vertices that no cube before made. `low` is where its lowest corner is.
#[inline(always)]
pub fn polygonize(
    corners: &mut [Corner],
    ids: &[u32; 8],
    case: usize,
    low: [f32; 3],
    spacing: f32,
    iso: f32,
    out: &mut Output,
) {
    let case = &CASES[case];
    let mut vertices = [0u32; 12];
    let mut left = case.edges;
    while left != 0 {
        let edge = left.trailing_zeros() as usize;
        left &= left - 1;
        let (from, axis) = (edge_corner(edge), edge / 4);
        let known = corners[ids[from] as usize].edges[axis];
        vertices[edge] = if known != 0 {
            known - 1
        } else {
            let (a, b) = (&corners[ids[from] as usize], &corners[ids[from | 1 << axis] as usize]);
            let t = (iso - a.value) / (b.value - a.value);
            let mut at: [f32; 3] = std::array::from_fn(|k| low[k] + (from >> k & 1) as f32 * spacing);
            at[axis] += t * spacing;
            let n: [f32; 3] = std::array::from_fn(|k| a.normal[k] + t * (b.normal[k] - a.normal[k]));
            let scale = 1.0 / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt().max(f32::MIN_POSITIVE);
            let number = out.vertices.len() as u32;
            out.vertices.push([at[0], at[1], at[2], n[0] * scale, n[1] * scale, n[2] * scale]);
            corners[ids[from] as usize].edges[axis] = number + 1;
            number
        };
    }
    for triangle in &case.triangles[..usize::from(case.len)] {
        out.indices.extend(triangle.map(|edge| vertices[usize::from(edge)]));
    }
    out.cubes += 1;
}
