//! OctoMap's `.bt` and `.ot` files: real maps, bytes written by hand, and invalid bytes.

use proptest::prelude::*;
use std::path::PathBuf;
use testkit::support::{fixtures, shared_data};
use voxtile::DecodeError;
use voxtile::octree::{
    Leaf, OCTOMAP_MAX_LOG_ODDS as OCCUPIED, OCTOMAP_MIN_LOG_ODDS as FREE, Octree, OctreeFormat, read,
    read_bt, read_ot, read_with_limit, write_bt, write_bt_unpruned, write_ot,
};
use voxtile::sensor::Evidence;
use voxtile::space::{MortonCode, VoxelKey};
use voxtile::tile::Table;

const COMMENTS: &str = "# (feel free to add / change comments, but leave the first line as it is!)\n#\n";

fn bt_file(fields: &str, payload: &[u8]) -> Vec<u8> {
    [format!("# Octomap OcTree binary file\n{COMMENTS}{fields}\ndata\n").as_bytes(), payload].concat()
}

fn ot_file(fields: &str, payload: &[u8]) -> Vec<u8> {
    [format!("# Octomap OcTree file\n{COMMENTS}{fields}\ndata\n").as_bytes(), payload].concat()
}

fn written_bt(tree: &Octree, resolution_m: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_bt(tree, resolution_m, 0.0, &mut bytes).unwrap();
    bytes
}

fn written_ot(tree: &Octree, resolution_m: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_ot(tree, resolution_m, &mut bytes).unwrap();
    bytes
}

fn refusal(bytes: &[u8]) -> (u64, String) {
    match read(bytes).unwrap_err() {
        DecodeError::Format(error) => (error.at, error.reason),
        error => panic!("{error}"),
    }
}

/// Maps that OctoMap wrote: small ones of our own (`tools/octomap_oracle/fixtures.cpp`), and large public ones if they
/// are available.
fn maps_of_octomap() -> Vec<PathBuf> {
    let is_map =
        |path: &PathBuf| path.extension().is_some_and(|extension| extension == "bt" || extension == "ot");
    let folders = [Some(fixtures("octomap_1")), shared_data("octomap_maps")];
    let files = folders.into_iter().flatten().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    files.map(|entry| entry.unwrap().path()).filter(is_map).collect()
}

/// The finest voxel of a key near the middle of OctoMap's range, and its value.
fn voxel(x: u16, y: u16, z: u16, value: f32) -> (MortonCode, f32) {
    (VoxelKey([32768 + x, 32768 + y, 32768 + z]).morton(), value)
}

#[test]
fn maps_of_octomap_are_read_to_the_last_node_and_written_back_to_the_byte() {
    for path in maps_of_octomap() {
        let bytes = std::fs::read(&path).unwrap();
        let mut rest = bytes.as_slice();
        let file = read(&mut rest).unwrap();
        assert!(rest.is_empty(), "{}: {} bytes are left", path.display(), rest.len());
        assert_eq!(file.tree.node_count(), file.stated_nodes);
        assert_eq!(file.tree.leaf_count(), file.tree.leaves().count() as u64);
        let again = match file.format {
            OctreeFormat::Bt => written_bt(&file.tree, file.resolution_m),
            OctreeFormat::Ot | OctreeFormat::ColorOt => written_ot(&file.tree, file.resolution_m),
        };
        assert!(again == bytes, "{}: not the same bytes", path.display());
    }
}

#[test]
fn a_table_of_a_map_of_octomap_writes_the_bytes_of_its_tree() {
    for path in maps_of_octomap() {
        let file = read(std::fs::read(&path).unwrap().as_slice()).unwrap();
        if file.tree.expanded_leaf_count() > 20_000_000 {
            continue;
        }
        let mut voxels: Vec<(MortonCode, f32)> = Vec::new();
        for leaf in file.tree.leaves() {
            let end = leaf.code.0 + MortonCode::span(leaf.depth);
            voxels.extend((leaf.code.0..end).map(|code| (MortonCode(code), leaf.value)));
        }
        let mut table = Table::default();
        for brick in voxels.chunk_by(|a, b| a.0.brick() == b.0.brick()) {
            let evidence = |value| Evidence { log_odds: f64::from(value), observation_count: 1 };
            let places = brick.iter().map(|&(code, value)| (code.place_in_brick(), evidence(value)));
            table.insert(brick[0].0.brick(), &places.collect::<Vec<_>>());
        }
        assert_eq!(table.len(), voxels.len());
        let mut bytes = Vec::new();
        table.write_bt(file.resolution_m, 0.0, &mut bytes).unwrap();
        assert!(bytes == written_bt(&file.tree, file.resolution_m), "{}: not the same bytes", path.display());
    }
}

#[test]
fn maps_of_octomap_are_normalized_trees_with_consistent_leaves() {
    for path in maps_of_octomap() {
        let bytes = std::fs::read(&path).unwrap();
        let tree = read(bytes.as_slice()).unwrap().tree;
        let mut normal = tree.clone();
        normal.normalize();
        assert!(normal.leaves().eq(tree.leaves()), "{}", path.display());
        for leaf in tree.leaves().step_by(97) {
            for depth in leaf.depth..=16 {
                assert_eq!(tree.get(leaf.code, depth), Some(leaf.value));
            }
            assert!(tree.get(leaf.code, leaf.depth - 1) >= Some(leaf.value));
        }
    }
}

#[test]
fn geb079_has_the_counts_of_octomap() {
    let Some(path) = shared_data("octomap_maps").map(|folder| folder.join("geb079.bt")) else { return };
    let file = read_bt(std::fs::read(path).unwrap().as_slice()).unwrap();
    assert_eq!((file.tree.node_count(), file.tree.leaf_count()), (532_566, 428_144));
    assert_eq!(file.tree.count_voxels(0.0).occupied, 185_673);
    assert_eq!((file.resolution_m, file.id.as_str()), (0.08, "OcTree"));
}

#[test]
fn a_tiny_tree_has_these_bytes() {
    let mut tree = Octree::from_sorted([voxel(0, 0, 0, 1.5), voxel(1, 0, 0, -0.5), voxel(0, 1, 0, 0.0)]);
    // 15 times: the first child of the last has children. Then free (1) and occupied (2) leaves.
    let bt = [[0x00, 0xc0].as_slice(), &[0x03, 0x00].repeat(14), &[0b10_01_10, 0x00]].concat();
    assert_eq!(written_bt(&tree, 0.1), bt_file("id OcTree\nsize 19\nres 0.1", &bt));

    let inner = |mask| [1.5_f32.to_le_bytes().as_slice(), &[mask]].concat();
    let leaf = |value: f32| [value.to_le_bytes().as_slice(), &[0]].concat();
    let ot = [inner(0x80), inner(1).repeat(14), inner(0b111), leaf(1.5), leaf(-0.5), leaf(0.0)].concat();
    assert_eq!(written_ot(&tree, 1e-5), ot_file("id OcTree\nsize 19\nres 1e-05", &ot));

    tree.clear();
    assert_eq!(written_bt(&tree, 0.1), bt_file("id OcTree\nsize 0\nres 0.1", &[]));
    assert_eq!(written_ot(&tree, 0.1), ot_file("id OcTree\nsize 0\nres 0.1", &[]));
    for bytes in [written_bt(&tree, 0.1), written_ot(&tree, 0.1)] {
        assert!(read(bytes.as_slice()).unwrap().tree.is_empty());
    }
}

#[test]
fn writing_bt_prunes_by_state_and_does_not_change_the_tree() {
    let tree = Octree::from_sorted((0..64).map(|i| (MortonCode(i), 1.0 + i as f32)));
    assert_eq!((tree.node_count(), tree.leaf_count()), (15 + 8 + 64, 64));
    let bytes = written_bt(&tree, 0.1);
    let pruned = read(bytes.as_slice()).unwrap().tree;
    assert_eq!(
        pruned.leaves().collect::<Vec<_>>(),
        [Leaf { code: MortonCode(0), depth: 14, value: OCCUPIED }]
    );
    assert_eq!((pruned.node_count(), tree.leaf_count()), (15, 64));

    let mut unpruned = Vec::new();
    write_bt_unpruned(&tree, 0.1, 10.0, &mut unpruned).unwrap();
    let mut unpruned = read(unpruned.as_slice()).unwrap().tree;
    assert_eq!((unpruned.node_count(), unpruned.count_voxels(0.0).free), (87, 9));
    unpruned.normalize();
    assert_eq!((unpruned.leaf_count(), unpruned.get(MortonCode(0), 15)), (1 + 8 + 6, Some(FREE)));
}

#[test]
fn writing_bt_stops_pruning_where_octomap_does() {
    // Eight cubes of eight voxels. OctoMap finds nothing to prune among the voxels and stops there.
    let cubes = Octree::from_sorted((0..64).map(|i| (MortonCode(i), 1.0 + (i / 8) as f32)));
    assert_eq!(read(written_bt(&cubes, 0.1).as_slice()).unwrap().tree.node_count(), 15 + 8);

    // With one more cube that can be pruned, the eight are pruned too.
    let mut tree = cubes.clone();
    tree.write_sorted(&std::array::from_fn::<_, 8, _>(|i| (MortonCode(512 + i as u64), -1.0 - i as f32)));
    let pruned = read(written_bt(&tree, 0.1).as_slice()).unwrap().tree;
    let depths: Vec<_> = pruned.leaves().map(|leaf| (leaf.depth, leaf.value)).collect();
    assert_eq!(depths, [(14, OCCUPIED), (15, FREE)]);
}

#[test]
fn a_lone_occupied_root_covers_all_space() {
    let bytes = bt_file("id OcTree\nsize 1\nres 0.1", &[0, 0]);
    let mut tree = read(bytes.as_slice()).unwrap().tree;
    assert_eq!(tree.expanded_leaf_count(), 1 << 48);
    assert_eq!(tree.get(MortonCode(12345), 16), Some(OCCUPIED));
    assert_eq!(tree.bytes(), 0);
    assert_eq!(written_bt(&tree, 0.1), bytes);
    tree.set(MortonCode(12345), FREE);
    assert_eq!((tree.leaf_count(), tree.expanded_leaf_count()), (1 + 16 * 7, 1 << 48));
}

#[test]
fn the_header_may_have_any_order_and_unknown_fields() {
    let nodes = [[0x80, 0x00].as_slice(), &[0x00, 0x00]].concat();
    for header in [
        "id 1\nsize 2\nres 0.1\ndata\n",
        "res 0.1 size 2\n\n  # id Other\nid\tOcTree\r\ncolor red and green\ndata  and more\n",
        "size 7\nsize 2\nid OcTreeStamped\n#data\nres +1e-1 data\n",
    ] {
        let bytes = [b"# Octomap OcTree binary file, mine\n", header.as_bytes(), &nodes[..2]].concat();
        let file = read(bytes.as_slice()).unwrap();
        assert_eq!((file.resolution_m, file.stated_nodes, file.tree.leaf_count()), (0.1, 2, 1));
        assert_ne!(file.id, "1");
    }
}

#[test]
fn a_file_from_before_the_text_header_is_read() {
    let payload = [0x02, 0x40];
    let bytes =
        [3_i32.to_le_bytes().as_slice(), &0.25_f64.to_le_bytes(), &3_u32.to_le_bytes(), &payload].concat();
    let file = read(bytes.as_slice()).unwrap();
    assert_eq!((file.resolution_m, file.id.as_str(), file.format), (0.25, "OcTree", OctreeFormat::Bt));
    let values: Vec<_> = file.tree.leaves().map(|leaf| (leaf.depth, leaf.value)).collect();
    assert_eq!(values, [(1, OCCUPIED), (1, FREE)]);
}

#[test]
fn a_colored_tree_is_read_without_its_colors() {
    let node = |value: f32, mask| [value.to_le_bytes().as_slice(), b"RGB", &[mask]].concat();
    let payload = [node(2.0, 0b101), node(2.0, 0), node(-1.0, 0)].concat();
    let bytes = ot_file("id ColorOcTree\nsize 3\nres 0.1", &payload);
    let file = read_ot(bytes.as_slice()).unwrap();
    assert_eq!(file.id, "ColorOcTree");
    assert_eq!(file.tree.leaves().map(|leaf| leaf.value).collect::<Vec<_>>(), [2.0, -1.0]);
    let (at, reason) = refusal(&ot_file("id CountingOcTree\nsize 1\nres 1", &payload));
    assert_eq!(at, ot_file("id CountingOcTree\nsize 1\nres 1", &[]).len() as u64);
    assert!(reason.contains("CountingOcTree"), "{reason}");
}

#[test]
fn trees_of_files_are_kept_even_if_they_are_not_normal() {
    let node = |value: f32, mask| [value.to_le_bytes().as_slice(), &[mask]].concat();
    let payload = [node(-7.0, 0xff), node(0.5, 0).repeat(8)].concat();
    let bytes = ot_file("id OcTree\nsize 9\nres 0.1", &payload);
    let mut tree = read(bytes.as_slice()).unwrap().tree;
    assert_eq!(tree.get(MortonCode(0), 0), Some(-7.0));
    assert_eq!(written_ot(&tree, 0.1), bytes);
    tree.normalize();
    assert_eq!((tree.node_count(), tree.get(MortonCode(0), 0)), (1, Some(0.5)));
}

#[test]
fn bytes_after_the_last_node_are_not_consumed() {
    let tree = Octree::from_sorted([voxel(3, 4, 5, 1.0)]);
    for mut bytes in [written_bt(&tree, 0.1), written_ot(&tree, 0.1)] {
        bytes.extend(b"more");
        let mut rest = bytes.as_slice();
        read(&mut rest).unwrap();
        assert_eq!(rest, b"more");
    }
}

#[test]
fn invalid_files_are_errors_with_an_offset() {
    let header = "id OcTree\nsize 2\nres 0.1";
    let begin = bt_file(header, &[]).len() as u64;
    let ot_begin = ot_file("id OcTree\nres 1", &[]).len() as u64;
    let refusals = [
        (bt_file(header, &[0x01]), begin, "ends"),
        (bt_file(header, &[0x05, 0x00]), begin, "3 nodes follow, but the header says 2"),
        (bt_file(header, &[0x03, 0x00, 0x00, 0x00]), begin + 2, "has no children"),
        (bt_file(header, &[0x03, 0x00].repeat(16)), begin + 30, "finest level"),
        (ot_file("id OcTree\nres 1", &[0, 0, 0, 0, 1].repeat(17)), ot_begin + 84, "finest level"),
        (ot_file("id OcTree\nres 1", &f32::NAN.to_le_bytes()), ot_begin, "not finite"),
        (ot_file("id OcTree\nres 1", &f32::INFINITY.to_le_bytes()), ot_begin, "not finite"),
        (bt_file("id OcTree\nsize 2\nres -0.1", &[1, 0]), begin + 1, "positive, finite"),
        (bt_file("id OcTree\nsize 2\nres 0.0", &[1, 0]), begin, "positive, finite"),
        (bt_file("id OcTree\nsize 2\nres nan", &[1, 0]), begin, "positive, finite"),
        (bt_file("size 2\nres 0.1", &[1, 0]), begin - 10, "no id"),
        (bt_file("id OcTree\nsize 2", &[1, 0]), begin - 8, "no res"),
        (b"# Octomap OcTree".to_vec(), 0, "first line"),
        (b"PLY".to_vec(), 0, "ends where the header"),
        (Vec::new(), 0, "ends where the header"),
    ];
    for (bytes, offset, part) in refusals {
        let (at, reason) = refusal(&bytes);
        assert!(reason.contains(part), "{reason}");
        assert_eq!(at, offset, "{reason}");
    }
    assert!(read_ot(bt_file(header, &[1, 0]).as_slice()).is_err());
    assert!(read_bt(ot_file(header, &[0; 5]).as_slice()).is_err());
    let endless = bt_file(&"more\n".repeat(100_000), &[]);
    assert_eq!(refusal(&endless).0, 1 << 16);
}

#[test]
fn an_invalid_resolution_is_not_written() {
    for resolution_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(write_bt(&Octree::new(), resolution_m, 0.0, &mut Vec::new()).is_err());
        assert!(write_ot(&Octree::new(), resolution_m, &mut Vec::new()).is_err());
    }
}

#[test]
fn memory_has_a_limit() {
    let tree = Octree::from_sorted((0..1000).map(|i| (MortonCode(i * 1_000_003), i as f32)));
    for bytes in [written_bt(&tree, 0.1), written_ot(&tree, 0.1)] {
        let blocks = 64 * (tree.node_count() - tree.leaf_count()) as usize;
        let error = read_with_limit(bytes.as_slice(), blocks - 1).unwrap_err();
        assert!(error.to_string().contains("more than"), "{error}");
        assert!(read_with_limit(bytes.as_slice(), blocks).is_ok());
    }
}

/// Bytes of a valid file, with some of them changed, removed or inserted.
fn damaged_file() -> impl Strategy<Value = Vec<u8>> {
    let voxels = prop::collection::btree_map(0..600_u64, prop_oneof![Just(1.0_f32), Just(-1.0)], 0..200);
    let damage = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3), 0..4);
    (voxels, any::<bool>(), damage).prop_map(|(voxels, is_bt, damage)| {
        let tree = Octree::from_sorted(voxels.into_iter().map(|(code, value)| (MortonCode(code), value)));
        let mut bytes = if is_bt { written_bt(&tree, 0.1) } else { written_ot(&tree, 0.1) };
        for (at, byte, kind) in damage {
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => bytes.truncate(at + 1),
            }
        }
        bytes
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn damaged_bytes_give_a_tree_or_an_error(bytes in damaged_file()) {
        if let Ok(file) = read(bytes.as_slice()) {
            let again = written_ot(&file.tree, file.resolution_m);
            let tree = read(again.as_slice()).unwrap().tree;
            assert!(tree.leaves().eq(file.tree.leaves()));
            assert_eq!(tree.node_count(), file.tree.node_count());
            let _ = read(written_bt(&tree, file.resolution_m).as_slice()).unwrap();
        }
    }

    #[test]
    fn random_bytes_give_a_tree_or_an_error(
        is_bt in any::<bool>(), nodes in any::<u64>(), payload in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let _ = read(payload.as_slice());
        let fields = format!("id OcTree\nsize {nodes}\nres 0.1");
        let bytes = if is_bt { bt_file(&fields, &payload) } else { ot_file(&fields, &payload) };
        let _ = read(bytes.as_slice());
    }

    #[test]
    fn a_round_trip_through_ot_keeps_every_bit(
        voxels in prop::collection::btree_map(0..MortonCode::END, -4.0..4.0_f32, 0..100),
    ) {
        let tree = Octree::from_sorted(voxels.into_iter().map(|(code, value)| (MortonCode(code), value)));
        let bytes = written_ot(&tree, 0.1);
        let back = read(bytes.as_slice()).unwrap().tree;
        assert!(back.leaves().eq(tree.leaves()));
        assert_eq!(written_ot(&back, 0.1), bytes);
    }
}
