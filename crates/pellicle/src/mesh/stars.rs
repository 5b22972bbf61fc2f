//! What lies around each vertex: the corners of its triangles.
//!
//! ```text
//! start     vertex ──► its first corner
//! corners   (next, previous) vertex of each triangle at the vertex, in the triangle's direction
//! ```
//!
//! A counting sort of the corners by vertex: no hash map, no half-edge records. Within a star corners come in the order of
//! the triangles, so whoever sums over a star gets the same bits for any number of threads.

/// The corners of every vertex of a triangle mesh. Reusable: [`rebuild`](Self::rebuild) keeps the memory.
#[derive(Default)]
pub(crate) struct Stars {
    start: Vec<usize>,
    corners: Vec<[u32; 2]>,
}

impl Stars {
    /// The corners of a mesh. All indices must be below `vertices`.
    pub(crate) fn of(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let mut stars = Self::default();
        stars.rebuild(triangles, vertices);
        stars
    }

    /// The corners of another mesh.
    pub(crate) fn rebuild(&mut self, triangles: &[[u32; 3]], vertices: usize) {
        let Self { start, corners } = self;
        // Counts go two places ahead, so that the scatter below turns `start[v + 1]` from v's beginning into its end.
        start.clear();
        start.resize(vertices + 2, 0);
        for v in triangles.as_flattened() {
            start[*v as usize + 2] += 1;
        }
        for i in 2..start.len() {
            start[i] += start[i - 1];
        }
        match corners.is_empty() {
            // New memory comes zeroed from the system.
            true => *corners = vec![[0; 2]; 3 * triangles.len()],
            false => corners.resize(3 * triangles.len(), [0; 2]),
        }
        for &[a, b, c] in triangles {
            for (v, next, previous) in [(a, b, c), (b, c, a), (c, a, b)] {
                let slot = &mut start[v as usize + 1];
                corners[*slot] = [next, previous];
                *slot += 1;
            }
        }
        start.pop();
    }

    /// Number of vertices.
    pub(crate) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// The (next, previous) vertices of each triangle at vertex `v`.
    #[inline(always)]
    pub(crate) fn corners(&self, v: usize) -> &[[u32; 2]] {
        &self.corners[self.start[v]..self.start[v + 1]]
    }

    /// Whether triangles go all round vertex `v`: every neighbor follows one triangle and precedes another. A vertex
    /// without triangles counts as closed. False at an open border and where more than two triangles share an edge.
    #[inline(always)]
    pub(crate) fn is_closed(&self, v: usize) -> bool {
        let corners = self.corners(v);
        corners.iter().all(|&[next, _]| {
            let follows = corners.iter().filter(|corner| corner[0] == next).count();
            let precedes = corners.iter().filter(|corner| corner[1] == next).count();
            follows == 1 && precedes == 1
        })
    }
}
