//! Claims of the OctoCache paper about the order of updates.

use std::collections::BTreeSet;
use testkit::random_scans::Random;
use voxtile::space::MortonCode;

/// A leaf of a small octree: its child numbers from the root down.
type Leaf = Vec<u8>;

/// Number of steps from a leaf up to the lowest common ancestor with another leaf, and down to that leaf.
fn distance(a: &Leaf, b: &Leaf) -> usize {
    let common = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    (a.len() - common) + (b.len() - common)
}

/// Cost of a sequence of leaves: the paper's F (the sum of the distances between neighbors), plus the paths from the
/// root to the first leaf and from the last leaf to the root. The paths are constant if all leaves have the same depth.
/// In a pruned tree, a sequence could otherwise save cost by ending at a deep leaf.
fn cost(sequence: &[&Leaf]) -> usize {
    let ends = [sequence.first(), sequence.last()].map(|leaf| leaf.map_or(0, |leaf| leaf.len()));
    sequence.windows(2).map(|pair| distance(pair[0], pair[1])).sum::<usize>() + ends[0] + ends[1]
}

/// Minimum cost over all orders of the leaves.
fn least_cost(leaves: &mut Vec<&Leaf>, fixed: usize) -> usize {
    if fixed == leaves.len() {
        return cost(leaves);
    }
    let mut least = usize::MAX;
    for k in fixed..leaves.len() {
        leaves.swap(fixed, k);
        least = least.min(least_cost(leaves, fixed + 1));
        leaves.swap(fixed, k);
    }
    least
}

/// Theorem A.1, checked by trying every order: Morton order has minimum cost. Covers trees with all leaves at one
/// depth, and pruned trees, where the order is lexicographic.
#[test]
fn morton_order_has_the_minimum_cost_of_updates() {
    let mut random = Random(11);
    for round in 0..200 {
        let is_pruned = round % 2 == 1;
        let mut leaves: BTreeSet<Leaf> = BTreeSet::new();
        while leaves.len() < 7 {
            let depth = if is_pruned { 1 + random.below(4) } else { 4 };
            // Few distinct children, so that leaves share ancestors.
            let leaf: Leaf = (0..depth).map(|_| random.below(3) as u8 * 3).collect();
            let is_apart = leaves.iter().all(|other| !other.starts_with(&leaf) && !leaf.starts_with(other));
            if is_apart {
                leaves.insert(leaf);
            } else if is_pruned && random.below(50) == 0 {
                leaves.clear();
            }
        }
        let mut in_morton_order: Vec<&Leaf> = leaves.iter().collect();
        if !is_pruned {
            // Morton codes as voxels have them, computed from keys.
            let code = |leaf: &Leaf| leaf.iter().fold(0, |code, child| code << 3 | u64::from(*child));
            in_morton_order.sort_by_key(|leaf| MortonCode(code(leaf)).to_key().morton());
        }
        let expected = cost(&in_morton_order);
        assert_eq!(least_cost(&mut in_morton_order.clone(), 0), expected, "{leaves:?}");
    }
}
