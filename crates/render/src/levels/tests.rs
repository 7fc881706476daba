use super::cells::{Cells, axes};
use super::node_bytes;
use super::*;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::sync::{Arc, Mutex};
use voxtile::MapConfig;
use voxtile::mapper::{InMemoryMapper, MapView, Mapper};
use voxtile::query::MapQueries;
use voxtile::scan::{PointBatch, Scan};
use voxtile::space::VoxelIndex;

/// In-memory file that can be inspected, damaged and reopened.
#[derive(Clone, Default)]
struct SharedFile(Arc<Mutex<Vec<u8>>>);

struct Opened(SharedFile, Cursor<Vec<u8>>);

impl SharedFile {
    fn open(&self) -> Opened {
        Opened(self.clone(), Cursor::new(self.0.lock().unwrap().clone()))
    }
}

impl std::io::Read for Opened {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        self.1.read(bytes)
    }
}

impl std::io::Write for Opened {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.1.write(bytes)?;
        *self.0.0.lock().unwrap() = self.1.get_ref().clone();
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for Opened {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        self.1.seek(to)
    }
}

fn map_of(edge: i32, points: &[[f64; 3]]) -> InMemoryMapper {
    let mut map = InMemoryMapper::new(MapConfig::new(0.5, 0.5 * f64::from(edge)).unwrap()).unwrap();
    // Observe some voxels more often than others.
    for points in [points, &points[points.len() / 3..], &points[points.len() / 2..]] {
        let is_occupied = vec![true; points.len()];
        map.batch_update(&PointBatch { points, intensities: None, is_occupied: &is_occupied }).unwrap();
    }
    map
}

pub(super) fn memory_store() -> NodeStore {
    NodeStore::open(Cursor::new(Vec::new()), "nodes").unwrap()
}

fn levels_of(map: &InMemoryMapper, store: &NodeStore) -> Levels {
    Levels::build(map, &map.tile_indices(), 0, store, &|_| true).unwrap().unwrap()
}

/// Returns the values of the voxels of a node. The key is the index of the lowest voxel of the map that the voxel
/// covers.
fn voxels_of(
    levels: &Levels,
    map: &InMemoryMapper,
    store: &NodeStore,
    key: NodeKey,
) -> BTreeMap<[i64; 3], u8> {
    let Some(bytes) = levels.node(map, store, key, Kind::Occupied).unwrap() else { return BTreeMap::new() };
    let first = levels.scheme.first_voxel(key);
    let cells = node_bytes::decode(&bytes).unwrap();
    assert!(cells.cells.is_sorted_by_key(|cell| cell.place));
    let voxel = |place: u32| {
        let at = axes(place);
        [0, 1, 2].map(|k| first[k] + (at[k] << key.level))
    };
    cells.cells.iter().map(|cell| (voxel(cell.place), cell.value)).collect()
}

/// Returns all nodes that a viewer can reach through the tileset's files.
pub(super) fn reached(levels: &Levels, map: &InMemoryMapper, store: &NodeStore) -> Vec<NodeKey> {
    let nodes = LevelsOf { levels, map };
    let mut uris = BTreeSet::new();
    let mut open = vec![tileset(&nodes, store, TilesetContent::Voxels, 0.into()).unwrap()];
    while let Some(file) = open.pop() {
        let mut inside = vec![file["root"].clone()];
        while let Some(node) = inside.pop() {
            inside.extend(node["children"].as_array().into_iter().flatten().cloned());
            let Some(uri) = node["content"]["uri"].as_str() else { continue };
            let path = uri.split('?').next().unwrap().trim_start_matches("../");
            if let Some(key) = path.strip_prefix("subtree/") {
                let key = key.strip_suffix(".json").unwrap().parse().unwrap();
                open.push(subtree(&nodes, store, TilesetContent::Voxels, key).unwrap().unwrap());
            } else {
                assert!(uris.insert(path.to_owned()), "{path} is there twice");
            }
        }
    }
    let key =
        |uri: &String| uri.strip_prefix("node/").unwrap().strip_suffix(".vox").unwrap().parse().unwrap();
    uris.iter().map(key).collect()
}

fn points() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let near = -60.0..60.0;
    let far = prop_oneof![4 => Just(0.0), 1 => Just(40_000.0), 1 => Just(-3000.0)];
    let point = (near.clone(), near.clone(), near, far).prop_map(|(x, y, z, far)| [x + far, y, z / 4.0]);
    proptest::collection::vec(point, 1..200)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// For any size of tiles, the finest nodes contain each occupied voxel once. A coarser voxel exists if and only if
    /// it contains an occupied one, and has the maximum of their values.
    #[test]
    fn nodes_match_the_voxels_of_the_map(edge in prop_oneof![Just(2), Just(5), Just(100), Just(130), Just(256), Just(333)], points in points()) {
        let map = map_of(edge, &points);
        let store = memory_store();
        let levels = levels_of(&map, &store);
        let wanted: BTreeSet<[i64; 3]> = map
            .all_occupied_voxels(None).unwrap().iter().map(|voxel| voxel.index.map(i64::from)).collect();
        let keys = reached(&levels, &map, &store);
        let mut found: BTreeMap<u8, Vec<([i64; 3], u8)>> = BTreeMap::new();
        for &key in &keys {
            let voxels = voxels_of(&levels, &map, &store, key);
            let bounds = levels.bounds_m(&store, key);
            for voxel in voxels.keys() {
                // Bounds are clipped to the tiles of the map, so a coarse voxel may be only partly inside. If the
                // tile's size is not a multiple of the coarse voxel's size, a coarse voxel without an occupied voxel
                // may exist next to the border, outside of the bounds.
                let low = voxel.map(|at| 0.5 * at as f64);
                let high = voxel.map(|at| 0.5 * (at + (1 << key.level)) as f64);
                let overlaps = (0..3).all(|k| bounds.min[k] < high[k] && low[k] < bounds.max[k]);
                prop_assert!(overlaps || edge == 333, "{key:?}: {voxel:?} is outside {bounds:?}");
                if key.level == 0 {
                    prop_assert!((0..3).all(|k| bounds.min[k] <= low[k] && high[k] <= bounds.max[k]));
                }
            }
            found.entry(key.level).or_default().extend(voxels);
        }
        let finest = found.remove(&0).unwrap();
        prop_assert_eq!(finest.len(), wanted.len());
        let finest: BTreeMap<[i64; 3], u8> = finest.into_iter().collect();
        prop_assert!(finest.keys().eq(&wanted));
        for (level, voxels) in found {
            let width = 1_i64 << level;
            let voxels: BTreeMap<_, _> = voxels.into_iter().collect();
            for (voxel, value) in &voxels {
                let within = |fine: &[i64; 3]| (0..3).all(|k| (voxel[k]..voxel[k] + width).contains(&fine[k]));
                let most = finest.iter().filter(|(fine, _)| within(fine)).map(|(_, value)| value).max();
                // If the tile's size is not a multiple of the voxel's size, the last voxel may have the value of its
                // neighbour.
                prop_assert!(most == Some(value) || edge == 333, "level {level}, {voxel:?}: {value}, not {most:?}");
            }
            for fine in &wanted {
                let is_there = voxels.keys().any(|voxel| (0..3).all(|k| (voxel[k]..voxel[k] + width).contains(&fine[k])));
                prop_assert!(is_there, "level {level} lacks {fine:?}");
            }
        }
        prop_assert!(levels.tops().len() <= 8);
    }

    /// An older store that is damaged or truncated anywhere gives the same nodes as an empty one.
    #[test]
    fn damaged_stores_give_correct_nodes(points in points(), damage in 0.0..1.0, is_cut in any::<bool>()) {
        let map = map_of(20, &points);
        let fresh = memory_store();
        let wanted = levels_of(&map, &fresh);
        let again = SharedFile::default();
        levels_of(&map, &NodeStore::open(again.open(), "again").unwrap());
        {
            let mut bytes = again.0.lock().unwrap();
            if !bytes.is_empty() {
                let at = ((bytes.len() - 1) as f64 * damage) as usize;
                if is_cut { bytes.truncate(at) } else { bytes[at] ^= 0x41 }
            }
        }
        let kept = NodeStore::open(again.open(), "again").unwrap();
        let found = levels_of(&map, &kept);
        let keys = reached(&wanted, &map, &fresh);
        prop_assert_eq!(&reached(&found, &map, &kept), &keys);
        for key in keys {
            prop_assert_eq!(voxels_of(&found, &map, &kept, key), voxels_of(&wanted, &map, &fresh, key));
        }
    }

    /// The difference of two maps at every level: voxels in one of them, and voxels in both.
    #[test]
    fn differences_match_the_nodes(edge in prop_oneof![Just(20), Just(256)], first in points(), second in points()) {
        let (before, after) = (map_of(edge, &first), map_of(edge, &second));
        let (old_store, store) = (memory_store(), memory_store());
        let (old, new) = (levels_of(&before, &old_store), levels_of(&after, &store));
        // The tiles have no versions, so the two maps need separate stores.
        let difference = Difference::new((&old, &before), (&new, &after)).unwrap();
        let mut found = BTreeMap::new();
        for tile in before.tile_indices().into_iter().chain(after.tile_indices()) {
            let top = new.scheme.key_of_tile(tile);
            let within = difference.within_tile(&store, top).unwrap();
            let keys: Vec<_> = if top.level == 0 { vec![top] } else { within.into_iter().filter(|key| key.level == 0).collect() };
            for key in keys {
                let bytes = difference.node(&store, key).unwrap().unwrap();
                let corner = new.scheme.first_voxel(key);
                for cell in node_bytes::decode(&bytes).unwrap().cells {
                    let at = axes(cell.place);
                    found.insert([0, 1, 2].map(|k| corner[k] + at[k]), cell.value);
                }
            }
        }
        let voxels = |map: &InMemoryMapper| -> BTreeSet<[i64; 3]> {
            let index = |voxel: VoxelIndex| voxel.map(i64::from);
            map.all_occupied_voxels(None).unwrap().iter().map(|voxel| index(voxel.index)).collect()
        };
        let (a, b) = (voxels(&before), voxels(&after));
        let wanted: BTreeMap<_, _> = a.union(&b).map(|voxel| {
            (*voxel, match (a.contains(voxel), b.contains(voxel)) { (true, true) => 3, (true, false) => 2, _ => 1 })
        }).collect();
        prop_assert_eq!(found, wanted);
    }
}

#[test]
fn free_and_unknown_voxels_match_the_map() {
    let mut map = InMemoryMapper::new(MapConfig::new(0.5, 10.0).unwrap()).unwrap();
    let points = vec![[8.0, 1.2, 1.2], [3.0, 8.0, 2.0]];
    map.insert_scan(&Scan { origin: [1.0; 3], points, intensities: None }).unwrap();
    let store = memory_store();
    let levels = levels_of(&map, &store);
    let key = levels.scheme.key_of_tile(map.tile_indices()[0]);
    let cells = |kind| -> Cells {
        node_bytes::decode(&levels.node(&map, &store, key, kind).unwrap().unwrap()).unwrap()
    };
    let (mut occupied, mut free) = (0, 0);
    map.for_each_occupied(Some(0.0), None, |voxel| {
        if voxel.evidence.log_odds >= 0.0 { occupied += 1 } else { free += 1 }
    })
    .unwrap();
    assert_eq!((cells(Kind::Occupied).cells.len(), cells(Kind::Free).cells.len()), (occupied, free));
    let unknown = cells(Kind::Unknown).cells;
    assert!(!unknown.is_empty());
    let tile = map.tile(map.tile_indices()[0]).unwrap().unwrap();
    for cell in unknown {
        let voxel = axes(cell.place).map(|k| k as i32);
        assert!(tile.evidence(voxel).is_none());
        let is_free = |voxel| tile.evidence(voxel).is_some_and(|evidence| evidence.log_odds < 0.0);
        let neighbor = |k: usize, step: i32| {
            let mut neighbor = voxel;
            neighbor[k] += step;
            neighbor
        };
        assert!(
            (0..3).any(|k| is_free(neighbor(k, 1)) || is_free(neighbor(k, -1))),
            "{voxel:?} borders nothing free"
        );
    }
}

#[test]
fn an_empty_map_has_no_nodes() {
    let map = InMemoryMapper::new(MapConfig::new(0.5, 10.0).unwrap()).unwrap();
    let store = memory_store();
    let levels = levels_of(&map, &store);
    assert!(levels.tops().is_empty());
    assert!(reached(&levels, &map, &store).is_empty());
    let key = NodeKey { level: 0, index: [0; 3] };
    assert!(levels.node(&map, &store, key, Kind::Occupied).unwrap().is_none());
}

#[test]
fn invalid_keys_are_refused() {
    for text in [
        "",
        "1/2/3",
        "1/2/3/4/5",
        "01/2/3/4",
        "+1/2/3/4",
        "43/0/0/0",
        "1/2/3/4294967296",
        "1/-0/0/0",
        "1/2/3/ 4",
    ] {
        assert!(text.parse::<NodeKey>().is_err(), "{text}");
    }
    let key = NodeKey { level: 3, index: [-1, 2, i32::MIN] };
    assert_eq!(key.to_string().parse(), Ok(key));
    assert!(key.children().all(|child| child.parent() == key));
}

/// Tiles of in-memory maps have no versions. Stores and browsers must not mix nodes of two such maps.
#[test]
fn nodes_of_tiles_without_versions_differ_by_origin() {
    let (one, other) = (map_of(8, &[[1.0; 3]]), map_of(8, &[[2.0; 3]]));
    let store = memory_store();
    let levels = |map: &InMemoryMapper, origin| {
        Levels::build(map, &map.tile_indices(), origin, &store, &|_| true).unwrap().unwrap()
    };
    let versions = |levels: &Levels| {
        let keys = levels.keys().into_iter();
        keys.map(|key| (key, levels.get(key).unwrap().version)).collect::<BTreeSet<_>>()
    };
    let (first, second) = (levels(&one, 1), levels(&other, 2));
    assert_eq!(first.keys(), second.keys());
    assert!(versions(&first).is_disjoint(&versions(&second)));
    assert_eq!(versions(&first), versions(&levels(&one, 1)));
    for (levels, map) in [(&first, &one), (&second, &other)] {
        for key in levels.keys() {
            let alone = levels_of(map, &memory_store());
            let wanted = voxels_of(&alone, map, &memory_store(), key);
            assert_eq!(voxels_of(levels, map, &store, key), wanted);
        }
    }
}
