//! Compares the tree with a naive map from voxels to values.

use super::{Leaf, Octree};
use crate::space::MortonCode;
use proptest::prelude::*;
use std::collections::BTreeMap;

type Model = BTreeMap<u64, f32>;
type Voxel = (MortonCode, f32);

/// Codes from a few clusters, small enough that nodes are often complete.
fn any_code() -> impl Strategy<Value = u64> {
    let cluster = prop_oneof![Just(0), Just(0x1234_5678_9a00), Just(MortonCode::END - 512)];
    (cluster, prop_oneof![4 => 0..16_u64, 3 => 0..64_u64, 1 => 0..512_u64]).prop_map(|(base, low)| base + low)
}

/// Few values, so that neighbours are often equal; both zeros, which are equal but not bit-identical.
fn any_value() -> impl Strategy<Value = f32> {
    prop_oneof![6 => Just(1.5_f32), 3 => Just(-2.0), 1 => Just(0.0), 1 => Just(-0.0), 1 => -3.0..3.0_f32]
}

/// One change: some voxels, or a run of voxels with one value.
fn any_batch() -> impl Strategy<Value = BTreeMap<u64, f32>> {
    prop_oneof![
        prop::collection::btree_map(any_code(), any_value(), 1..40),
        (any_code(), 1..200_u64, any_value()).prop_map(|(first, length, value)| {
            (first..(first + length).min(MortonCode::END)).map(|code| (code, value)).collect()
        }),
    ]
}

fn voxels_of(model: &Model) -> Vec<Voxel> {
    model.iter().map(|(&code, &value)| (MortonCode(code), value)).collect()
}

fn max_of(model: &Model, code: u64, depth: u8) -> Option<f32> {
    let first = MortonCode(code).ancestor(depth).0;
    model.range(first..first + MortonCode::span(depth)).map(|(_, &value)| value).reduce(f32::max)
}

/// Leaves and number of nodes of the unique minimal tree of these voxels: the largest aligned cubes of one value.
fn minimal_tree(model: &Model) -> (Vec<Leaf>, u64) {
    fn grow(voxels: &[Voxel], depth: u8, leaves: &mut Vec<Leaf>) -> u64 {
        let Some(&(code, value)) = voxels.first() else { return 0 };
        let uniform = voxels.iter().all(|(_, other)| other.to_bits() == value.to_bits());
        if uniform && voxels.len() as u64 == MortonCode::span(depth) {
            leaves.push(Leaf { code, depth, value });
            return 1;
        }
        let children = voxels.chunk_by(|a, b| a.0.ancestor(depth + 1) == b.0.ancestor(depth + 1));
        1 + children.map(|child| grow(child, depth + 1, leaves)).sum::<u64>()
    }
    let mut leaves = Vec::new();
    let nodes = grow(&voxels_of(model), 0, &mut leaves);
    (leaves, nodes)
}

fn assert_is(tree: &Octree, model: &Model) {
    let (leaves, nodes) = minimal_tree(model);
    assert_eq!(tree.leaves().collect::<Vec<_>>(), leaves);
    assert_eq!((tree.node_count(), tree.leaf_count()), (nodes, leaves.len() as u64));
    assert_eq!(tree.expanded_leaf_count(), model.len() as u64);
    assert_eq!(tree.is_empty(), model.is_empty());
}

proptest! {
    #[test]
    fn trees_are_minimal_and_nodes_are_the_maximum_of_their_voxels(
        batches in prop::collection::vec((any::<bool>(), any_batch()), 1..12),
        queried in prop::collection::vec(any_code(), 1..20),
    ) {
        let (mut tree, mut model) = (Octree::new(), Model::new());
        for (at_once, batch) in batches {
            if at_once {
                tree.write_sorted(&voxels_of(&batch));
            } else {
                batch.iter().for_each(|(&code, &value)| tree.set(MortonCode(code), value));
            }
            model.extend(batch);
            assert_is(&tree, &model);
        }
        for code in queried {
            for depth in 0..=16 {
                assert_eq!(tree.get(MortonCode(code), depth), max_of(&model, code, depth));
            }
        }
        let built = Octree::from_sorted(voxels_of(&model));
        assert_is(&built, &model);
        tree.normalize();
        assert_is(&tree, &model);
    }

    #[test]
    fn overrides_give_the_same_values_as_writes(
        before in prop::collection::vec(any_batch(), 0..4),
        overrides in any_batch(),
        queried in prop::collection::vec(any_code(), 1..20),
    ) {
        let tree = Octree::from_sorted(voxels_of(&before.iter().flatten().map(|(&c, &v)| (c, v)).collect()));
        let overrides = voxels_of(&overrides);
        let mut written = tree.clone();
        written.write_sorted(&overrides);
        for code in queried.into_iter().map(MortonCode) {
            for depth in 0..=16 {
                assert_eq!(tree.max_with_overrides(code, depth, &overrides), written.get(code, depth));
            }
        }
    }

    #[test]
    fn leaves_can_start_anywhere_and_be_limited_to_a_node(
        batches in prop::collection::vec(any_batch(), 0..4),
        code in any_code(),
        depth in 0..=16_u8,
    ) {
        let tree = Octree::from_sorted(batches.iter().flatten().map(|(&c, &v)| (MortonCode(c), v)));
        let end = |leaf: &Leaf| leaf.code.0 + MortonCode::span(leaf.depth);
        let from: Vec<_> = tree.leaves().filter(|leaf| end(leaf) > code).collect();
        assert_eq!(tree.leaves_from(MortonCode(code)).collect::<Vec<_>>(), from);

        let first = MortonCode(code).ancestor(depth);
        let last = first.0 + MortonCode::span(depth);
        let under: Vec<_> = tree
            .leaves()
            .filter(|leaf| end(leaf) > first.0 && leaf.code.0 < last)
            .map(|leaf| if leaf.depth < depth { Leaf { code: first, depth, ..leaf } } else { leaf })
            .collect();
        assert_eq!(tree.leaves_under(MortonCode(code), depth).collect::<Vec<_>>(), under);
    }

    #[test]
    fn any_order_and_any_value_is_accepted(
        voxels in prop::collection::vec((any::<u64>(), any::<f32>()), 0..50), depth in any::<u8>(),
    ) {
        let voxels: Vec<_> = voxels.into_iter().map(|(code, value)| (MortonCode(code), value)).collect();
        let mut tree = Octree::from_sorted(voxels.iter().copied());
        tree.write_sorted(&voxels);
        for &(code, _) in &voxels {
            let _ = tree.get(code, depth);
            let _ = tree.max_with_overrides(code, depth, &voxels);
            let _ = (tree.leaves_under(code, depth).count(), tree.leaves_from(code).count());
        }
        let states = tree.count_voxels(0.0);
        assert_eq!(states.occupied + states.free, tree.expanded_leaf_count());
    }
}

#[test]
fn a_full_cube_is_one_leaf_until_one_voxel_differs() {
    let mut tree = Octree::from_sorted((0..32_768).map(|code| (MortonCode(code), 1.0)));
    assert_eq!(tree.leaves().collect::<Vec<_>>(), [Leaf { code: MortonCode(0), depth: 11, value: 1.0 }]);
    assert_eq!(tree.node_count(), 12);

    tree.set(MortonCode(9), -1.0);
    assert_eq!(tree.leaf_count(), 1 + 5 * 7);
    assert_eq!((tree.get(MortonCode(9), 16), tree.get(MortonCode(9), 15)), (Some(-1.0), Some(1.0)));
    assert_eq!(tree.count_voxels(0.0), super::VoxelCounts { occupied: 32_767, free: 1 });

    let bytes = tree.bytes();
    tree.set(MortonCode(9), 1.0);
    assert_eq!((tree.leaf_count(), tree.bytes()), (1, bytes), "released blocks wait for the next use");
    tree.clear();
    assert!(tree.is_empty() && tree.bytes() == 0);
}
