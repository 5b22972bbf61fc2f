//! What lies around each vertex: the corners of its triangles.
//!
//! ```text
//! start     vertex ──► its first corner
//! count     vertex ──► how many it has
//! corners   (next, previous) vertex of each triangle at the vertex, in the triangle's direction; behind those of each vertex
//!           room for one more, which an edge that is turned may bring
//! ```
//!
//! A counting sort of the corners by vertex: no hash map, no half-edge records. Within a star corners come in the order of
//! the triangles, but for those of turned edges, so whoever sums over a star gets the same bits for any number of threads.

use rayon::prelude::*;

use crate::math::memory::filled;

/// The corners of every vertex of a triangle mesh. Reusable: [`rebuild`](Self::rebuild) keeps the memory.
#[derive(Default)]
pub(crate) struct Stars {
    start: Vec<usize>,
    count: Vec<u32>,
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
        let Self { start, count, corners } = self;
        count.clear();
        count.resize(vertices, 0);
        for v in triangles.as_flattened() {
            count[*v as usize] += 1;
        }
        start.clear();
        let mut end = 0;
        start.extend(count.iter_mut().map(|count| {
            let start = end;
            end += std::mem::take(count) as usize + 1;
            start
        }));
        match corners.capacity() < end {
            // New memory comes zeroed from the system.
            true => *corners = filled([0; 2], end),
            false => corners.resize(end, [0; 2]),
        }
        for &[a, b, c] in triangles {
            for (v, next, previous) in [(a, b, c), (b, c, a), (c, a, b)] {
                let count = &mut count[v as usize];
                corners[start[v as usize] + *count as usize] = [next, previous];
                *count += 1;
            }
        }
    }

    /// Where each vertex's corners begin and how many there are, and all corners.
    pub(crate) fn into_parts(self) -> (Vec<(usize, u32)>, Vec<[u32; 2]>) {
        (self.start.into_iter().zip(self.count).collect(), self.corners)
    }

    /// Number of vertices.
    pub(crate) fn len(&self) -> usize {
        self.start.len()
    }

    /// The (next, previous) vertices of each triangle at vertex `v`.
    #[inline(always)]
    pub(crate) fn corners(&self, v: usize) -> &[[u32; 2]] {
        &self.corners[self.start[v]..][..self.count[v] as usize]
    }

    /// The number of triangles at vertex `v`.
    #[inline(always)]
    pub(crate) fn valence(&self, v: u32) -> u32 {
        self.count[v as usize]
    }

    /// Turns the edge from a to b, of the triangles (a, b, c) and (a, d, b), so that it runs from c to d: triangles (a, d, c)
    /// and (d, b, c). There is room for one such edge at c and d each.
    pub(crate) fn turn(&mut self, [a, b, c, d]: [u32; 4]) {
        for (end, other, [before, after]) in [(a, b, [d, c]), (b, a, [c, d])] {
            let (start, count) = (self.start[end as usize], &mut self.count[end as usize]);
            let star = &mut self.corners[start..][..*count as usize];
            let mut kept = 0;
            for i in 0..star.len() {
                if star[i][0] != other {
                    star[kept] = if star[i] == [before, other] { [before, after] } else { star[i] };
                    kept += 1;
                }
            }
            *count = kept as u32;
        }
        for (wing, [before, after], across) in [(c, [a, b], d), (d, [b, a], c)] {
            let (start, count) = (self.start[wing as usize], &mut self.count[wing as usize]);
            let star = &mut self.corners[start..][..*count as usize + 1];
            for corner in &mut star[..*count as usize] {
                *corner = if *corner == [before, after] { [before, across] } else { *corner };
            }
            star[*count as usize] = [across, after];
            *count += 1;
        }
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
    fn a_turned_edge_leaves_the_stars_of_the_triangles_with_it() {
        let n = 9;
        let at = |i: u32, j: u32| i * n + j;
        let mut triangles: Vec<[u32; 3]> = (0..(n - 1) * (n - 1))
            .flat_map(|q| {
                let (i, j) = (q / (n - 1), q % (n - 1));
                [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            })
            .collect();
        let mut stars = Stars::of(&triangles, (n * n) as usize);
        for (i, j) in [(1, 1), (4, 5), (6, 2)] {
            let [a, b, c, d] = [at(i + 1, j + 1), at(i, j), at(i + 1, j), at(i, j + 1)];
            let first = 2 * (i * (n - 1) + j) as usize;
            assert!(triangles[first].contains(&c) && triangles[first + 1].contains(&d));
            (triangles[first], triangles[first + 1]) = ([a, d, c], [d, b, c]);
            stars.turn([a, b, c, d]);
        }
        let after = Stars::of(&triangles, stars.len());
        for v in 0..stars.len() {
            let sorted = |stars: &Stars| {
                let mut star = stars.corners(v).to_vec();
                star.sort_unstable();
                star
            };
            assert_eq!(sorted(&stars), sorted(&after), "{v}");
            assert_eq!(stars.valence(v as u32) as usize, after.corners(v).len());
        }
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
