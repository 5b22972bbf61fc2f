//! What lies around each vertex: the corners of its triangles.
//!
//! ```text
//! start     vertex ──► its first corner
//! corners   (next, previous) vertex of each triangle at the vertex, in the triangle's direction
//! ```
//!
//! A counting sort of the corners by vertex: no hash map, no half-edge records. Within a star corners come in the order of
//! the triangles, so whoever sums over a star gets the same bits for any number of threads.

use rayon::prelude::*;

use crate::math::memory::filled;

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
        match corners.capacity() < 3 * triangles.len() {
            // New memory comes zeroed from the system.
            true => *corners = filled([0; 2], 3 * triangles.len()),
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

    /// Where each vertex's corners begin, and in the end their number; and all corners.
    pub(crate) fn into_parts(self) -> (Vec<usize>, Vec<[u32; 2]>) {
        (self.start, self.corners)
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

    /// Tells of each vertex whether triangles go all round it, where `is_sure` does not know that they do.
    pub(crate) fn closed(&self, is_sure: impl Fn(usize) -> bool + Sync) -> Vec<bool> {
        let vertices = (0..self.len()).into_par_iter().with_min_len(1 << 12);
        vertices.map(|v| is_sure(v) || self.is_closed(v)).collect()
    }

    /// Whether triangles go all round vertex `v`: every neighbor follows one triangle and precedes another. A vertex
    /// without triangles counts as closed. False at an open border and where more than two triangles share an edge.
    #[inline(always)]
    pub(crate) fn is_closed(&self, v: usize) -> bool {
        followers(self.corners(v), |_, _| {})
    }
}

/// Whether (next, previous) pairs form rings: the `previous` of each is the `next` of exactly one, and nobody else's
/// `previous`. Tells that one's place for each pair, as far as it gets.
#[inline(always)]
pub(crate) fn followers(pairs: &[[u32; 2]], mut tell: impl FnMut(usize, usize)) -> bool {
    const FEW: usize = 8;
    let n = pairs.len();
    if n > FEW {
        return many_followers(pairs, tell);
    }
    // Padded with what matches nothing, so that all loops have the same length, and no branch on what is compared:
    // nobody could foresee it.
    let (mut next, mut previous) = ([u32::MAX; FEW], [u32::MAX - 1; FEW]);
    for (i, pair) in pairs.iter().enumerate() {
        (next[i], previous[i]) = (pair[0], pair[1]);
    }
    // Bit i of `led[j]`: pair i is followed by pair j.
    let mut led = [0u32; FEW];
    for i in 0..FEW {
        for j in 0..FEW {
            led[j] |= u32::from(next[j] == previous[i]) << i;
        }
    }
    let mut sum = 0;
    let mut is_single = true;
    for (j, &bits) in led[..n].iter().enumerate() {
        is_single &= bits != 0 && bits & bits.wrapping_sub(1) == 0;
        sum += bits;
        tell(bits.trailing_zeros() as usize % FEW, j);
    }
    // As many single bits as places sum to all bits only if no two are the same.
    is_single && sum == (1 << n) - 1
}

/// The same for many.
#[cold]
fn many_followers(pairs: &[[u32; 2]], mut tell: impl FnMut(usize, usize)) -> bool {
    let mut places = rustc_hash::FxHashMap::default();
    places.extend(pairs.iter().enumerate().map(|(i, pair)| (pair[0], i)));
    let distinct = places.len() == pairs.len();
    let follows = |(i, pair): (usize, &[u32; 2])| places.remove(&pair[1]).map(|j| tell(i, j)).is_some();
    distinct && pairs.iter().enumerate().all(follows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rule, word for word.
    fn closed(pairs: &[[u32; 2]]) -> bool {
        let count = |a: usize, v: u32| pairs.iter().filter(|pair| pair[a] == v).count();
        pairs.iter().all(|&[next, previous]| [next, previous].iter().all(|&v| count(0, v) == 1 && count(1, v) == 1))
    }

    #[test]
    fn closed_is_what_the_rule_says_for_stars_of_any_size() {
        let (mut yes, mut no) = (0, 0);
        for n in (0..9).chain(60..70).chain(127..130) {
            for change in 0..40u32 {
                let shift = |i: u32| (i + 1) % n.max(1);
                let mut pairs: Vec<[u32; 2]> =
                    (0..n).map(|i| [7 * (i * 5 % n.max(1)), 7 * (shift(i * 5 % n.max(1)))]).collect();
                if n > 0 && change > 0 {
                    let (at, from) = (change % n, change / 3 % n);
                    pairs[at as usize][(change % 2) as usize] = pairs[from as usize][(change / 2 % 2) as usize];
                }
                let mut follower = vec![usize::MAX; pairs.len()];
                let found = followers(&pairs, |i, j| follower[i] = j);
                assert_eq!(found, closed(&pairs), "{pairs:?}");
                if found {
                    assert!(pairs.iter().zip(&follower).all(|(pair, &j)| pairs[j][0] == pair[1]));
                    yes += 1;
                } else {
                    no += 1;
                }
            }
        }
        assert!(yes > 50 && no > 50, "{yes} {no}");
    }
}
