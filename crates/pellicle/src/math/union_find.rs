//! Disjoint sets of small integers: who hangs together with whom.
//!
//! A set is named by its lowest member. Meshes number neighbors close together, so paths stay short without ranks.

/// Joins two sets; whether they were apart.
pub(crate) fn join(parent: &mut [u32], a: u32, b: u32) -> bool {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
    a != b
}

/// The lowest member of a set, halving the path on the way.
pub(crate) fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}
