//! Stars of a mesh whose edges collapse: each collapse changes those around it and no others.
//!
//! A star stays in its place; one that outgrows it moves to the end of the memory. A collapse leaves about as many corners as
//! it takes, so the memory grows by less than the corners that there were.
//!
//! Source: this project.

use crate::mesh::stars::Stars;

/// The (next, previous) vertices of each triangle at each vertex.
pub(super) struct Fans {
    /// First corner, and their number.
    place: Vec<(usize, u32)>,
    corners: Vec<[u32; 2]>,
}

impl Fans {
    pub(super) fn of(stars: Stars) -> Self {
        let (place, corners) = stars.into_parts();
        Self { place, corners }
    }

    #[inline(always)]
    pub(super) fn corners(&self, v: usize) -> &[[u32; 2]] {
        let (first, count) = self.place[v];
        &self.corners[first..first + count as usize]
    }

    /// Makes vertex `b` vanish in its neighbor `a`. Between them lie two triangles.
    pub(super) fn collapse(&mut self, a: u32, b: u32, star: &mut Vec<[u32; 2]>) {
        star.clear();
        star.extend(self.corners(a as usize).iter().filter(|corner| !corner.contains(&b)));
        star.extend(self.corners(b as usize).iter().filter(|corner| !corner.contains(&a)));
        for i in 0..self.corners(b as usize).len() {
            // Around a closed star every neighbor is `next` once.
            let [near, _] = self.corners(b as usize)[i];
            if near != a {
                self.rename(near as usize, a, b);
            }
        }
        self.place[b as usize].1 = 0;
        let (first, count) = &mut self.place[a as usize];
        if star.len() > *count as usize {
            *first = self.corners.len();
            self.corners.resize(*first + star.len(), [0; 2]);
        }
        *count = star.len() as u32;
        self.corners[*first..*first + star.len()].copy_from_slice(star);
    }

    /// At `v`, what was `b` is `a`, and the triangle that had both is none.
    fn rename(&mut self, v: usize, a: u32, b: u32) {
        let (first, count) = self.place[v];
        let star = &mut self.corners[first..first + count as usize];
        let mut kept = 0;
        for i in 0..star.len() {
            let corner = star[i].map(|n| if n == b { a } else { n });
            if corner[0] != corner[1] {
                star[kept] = corner;
                kept += 1;
            }
        }
        self.place[v].1 = kept as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_collapses_stars_are_those_of_the_triangles_that_are_left() {
        // A strip around a cylinder, with lids.
        let n = 12;
        let at = |i: u32, j: u32| 2 + j * n + i % n;
        let mut triangles = Vec::new();
        for i in 0..n {
            triangles.extend([[0, at(i + 1, 0), at(i, 0)], [1, at(i, 4), at(i + 1, 4)]]);
            for j in 0..4 {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        let vertices = 2 + 5 * n as usize;
        let mut fans = Fans::of(Stars::of(&triangles, vertices));
        let mut star = Vec::new();
        for (a, b) in [(at(0, 1), at(1, 1)), (at(0, 1), at(2, 1)), (0, at(5, 0)), (at(8, 2), at(8, 3))] {
            fans.collapse(a, b, &mut star);
            triangles.iter_mut().for_each(|t| *t = t.map(|v| if v == b { a } else { v }));
            triangles.retain(|[a, b, c]| a != b && b != c && c != a);
            let stars = Stars::of(&triangles, vertices);
            for v in 0..vertices {
                let sorted = |corners: &[[u32; 2]]| {
                    let mut corners = corners.to_vec();
                    corners.sort_unstable();
                    corners
                };
                assert_eq!(sorted(fans.corners(v)), sorted(stars.corners(v)), "{a} {b} {v}");
            }
        }
    }
}
