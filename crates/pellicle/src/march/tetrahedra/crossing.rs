//! Where an edge between an inside and an outside node is crossed.
//!
//! From samples alone: where the linear interpolant is 0. Where the source can be asked anywhere, as a function can, that is
//! only a first guess: on a field that is far from linear over a cell, as that of inverse squares, it is off by a good part
//! of the cell, by more or less from edge to edge, which shows as a jagged surface. So the place is then found on the edge
//! by the method of false position, all edges of a brick at once.
//!
//! Source: this project; the rule that keeps false position from creeping is the Illinois method (Dowell & Jarratt, A
//! modified regula falsi method for computing the root of an equation, 1971).

use super::source::{ABSENT, Source};

/// Evaluations of an edge at most.
const ROUNDS: usize = 16;
/// Parts of an edge to which a crossing is found.
const PRECISION: f64 = 1e-4;

/// A crossed edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Places of the inside and of the outside end, in units of cells.
    ends: [[f64; 3]; 2],
    /// Values there: greater than 0, and not.
    values: [f64; 2],
    /// Where it is crossed: 0 at the inside end, 1 at the outside one.
    along: f64,
}

/// Where on an edge between relative values, one above 0 and one not, the linear interpolant is 0.
#[inline(always)]
pub(super) fn part(a: f64, b: f64) -> f64 {
    // Values so large that their difference is not finite meet in the middle.
    let t = a / (a - b);
    if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

impl Crossing {
    /// Between two nodes given by site, place and value, in any order.
    #[inline(always)]
    pub(super) fn between(source: &dyn Source, a: (usize, [f64; 3], f64), b: (usize, [f64; 3], f64)) -> Self {
        let (a, b) = if a.2 > b.2 { (a, b) } else { (b, a) };
        let along = if b.2 == ABSENT { source.end((a.0, a.1), (b.0, b.1)) } else { part(a.2, b.2) };
        Self { ends: [a.1, b.1], values: [a.2, b.2], along }
    }

    /// Part of the edge between the inside end and the crossing.
    #[inline(always)]
    pub(super) fn along(&self) -> f64 {
        self.along
    }

    /// Place, in units of cells.
    #[inline(always)]
    pub(super) fn place(&self) -> [f64; 3] {
        let [a, b] = self.ends;
        std::array::from_fn(|i| a[i] + self.along * (b[i] - a[i]))
    }
}

/// A crossing at work: where its ends have come to, as parts of the edge.
struct Bracket {
    index: usize,
    at: [f64; 2],
    values: [f64; 2],
    /// The end that moved last; 2 for none.
    moved: usize,
}

/// Moves crossings to where the source's own values say, if it has any between nodes.
pub(super) fn refine(source: &dyn Source, crossings: &mut [Crossing]) {
    if !source.is_anywhere() {
        return;
    }
    let mut work: Vec<Bracket> = crossings
        .iter()
        .enumerate()
        .filter(|(_, crossing)| crossing.values[1] != ABSENT)
        .map(|(index, crossing)| Bracket { index, at: [0.0, 1.0], values: crossing.values, moved: 2 })
        .collect();
    let (mut places, mut values) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        if work.is_empty() {
            break;
        }
        places.clear();
        places.extend(work.iter().map(|bracket| crossings[bracket.index].place()));
        values.resize(places.len(), 0.0);
        source.values_at(&places, &mut values);
        let mut value = values.iter();
        work.retain_mut(|bracket| {
            let along = &mut crossings[bracket.index].along;
            let next = value.next().map_or(*along, |&value| bracket.narrow(*along, value));
            let is_far = (next - *along).abs() > PRECISION;
            *along = next;
            is_far
        });
    }
}

impl Bracket {
    /// Takes in the value at a place and says where to look next.
    fn narrow(&mut self, at: f64, value: f64) -> f64 {
        let end = usize::from(value <= 0.0);
        if self.moved == end {
            // The other end has been kept twice: less of its value, so that the next place lies nearer to it.
            self.values[1 - end] *= 0.5;
        }
        (self.at[end], self.values[end], self.moved) = (at, value, end);
        let t = part(self.values[0], self.values[1]);
        self.at[0] + t * (self.at[1] - self.at[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crossing_of_a_crooked_field_is_found() {
        // From 100 down to the distance squared's inverse less 1.
        for iso in [0.3, 0.9, 1.0, 2.0, 40.0] {
            let field = |t: f64| 1.0 / (0.1 + 2.0 * t).powi(2) - iso;
            let (mut bracket, mut rounds) =
                (Bracket { index: 0, at: [0.0, 1.0], values: [field(0.0), field(1.0)], moved: 2 }, 0);
            let mut at = part(field(0.0), field(1.0));
            loop {
                let next = bracket.narrow(at, field(at));
                rounds += 1;
                let is_done = (next - at).abs() <= PRECISION;
                at = next;
                if is_done {
                    break;
                }
            }
            let want = 0.5 * (iso.powf(-0.5) - 0.1);
            assert!((at - want).abs() < 2.0 * PRECISION && rounds <= ROUNDS, "{iso}: {at} {want} {rounds}");
        }
    }

    #[test]
    fn values_without_end_do_not_stop_it() {
        let mut bracket = Bracket { index: 0, at: [0.0, 1.0], values: [f64::INFINITY, -1.0], moved: 2 };
        let mut at = part(f64::INFINITY, -1.0);
        for _ in 0..ROUNDS {
            at = bracket.narrow(at, if at < 0.7 { f64::INFINITY } else { ABSENT });
        }
        assert!((at - 0.7).abs() < 0.01, "{at}");
    }
}
