//! Bytes of nodes with layers at all levels, compared with naive means.

use super::tests::{memory_store, reached};
use super::*;
use crate::Layer;
use flate2::read::GzDecoder;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::io::Read;
use voxtile::mapper::{InMemoryMapper, MapView, Mapper};
use voxtile::{Layers, MapConfig, PointAttributes, ScanRef, VoxelLayers};

const ALL: Layers = Layers { colour: true, intensity_max: Some(50.0), class: true, time: true, shape: false };

/// A point with a color, a class, an intensity, and the number of its scan.
type Hit = ([f64; 3], Option<[u8; 3]>, Option<u8>, f32, u8);

fn map_of(edge: i32, hits: &[Hit]) -> InMemoryMapper {
    let config = MapConfig::new(0.5, 0.5 * f64::from(edge)).unwrap().with_layers(ALL);
    let mut map = InMemoryMapper::new(config).unwrap();
    for scan in 0..4 {
        let of_scan: Vec<&Hit> = hits.iter().filter(|hit| hit.4 == scan).collect();
        let points: Vec<_> = of_scan.iter().map(|hit| hit.0).collect();
        let intensities: Vec<f32> = of_scan.iter().map(|hit| hit.3).collect();
        let attributes = PointAttributes {
            colours: of_scan.iter().map(|hit| hit.1).collect(),
            classes: of_scan.iter().map(|hit| hit.2).collect(),
            ..PointAttributes::default()
        };
        let points = ScanRef::in_world([0.0, 0.0, 500.0], &points).with_intensities(&intensities).unwrap();
        let points = points.with_attributes(&attributes).unwrap();
        // The last scan has no time stamp.
        let points = if scan < 3 { points.with_stamp_ns(i64::from(scan) * 1_000_000_000) } else { points };
        map.insert_points(&points).unwrap();
    }
    map
}

fn hits() -> impl Strategy<Value = Vec<Hit>> {
    let place = prop_oneof![4 => Just(0.0), 1 => Just(3000.0)];
    let point = (-40.0..40.0, -40.0..40.0, 0.0..6.0, place).prop_map(|(x, y, z, far)| [x + far, y, z]);
    let colour = proptest::option::weighted(0.8, any::<[u8; 3]>());
    let class = proptest::option::weighted(0.8, prop_oneof![Just(2_u8), Just(6), Just(255)]);
    let intensity = prop_oneof![3 => 0.0..60.0_f32, 1 => Just(f32::NAN)];
    proptest::collection::vec((point, colour, class, intensity, 0..4_u8), 1..150)
}

/// Values of a layer by the lowest voxel of the map that a node's voxel covers; a color as a number.
fn values_of(
    levels: &Levels,
    map: &InMemoryMapper,
    store: &NodeStore,
    key: NodeKey,
    layer: Layer,
) -> BTreeMap<[i64; 3], Option<f64>> {
    let compressed = levels.layered_node(map, store, key, layer).unwrap().unwrap();
    let plain = levels.node(map, store, key, Kind::Occupied).unwrap().unwrap();
    let unpacked = |compressed: &[u8]| {
        let mut bytes = Vec::new();
        GzDecoder::new(compressed).read_to_end(&mut bytes).unwrap();
        bytes
    };
    let (mut bytes, plain) = (unpacked(&compressed), unpacked(&plain));
    let values = bytes.split_off(plain.len());
    // But for the number of the layer, the bytes before are those of the node without a layer.
    assert_eq!(std::mem::replace(&mut bytes[47], 0), layer_planes::number_of(layer));
    assert_eq!(bytes, plain);
    let cells =
        node_bytes::decode(&levels.node(map, store, key, Kind::Occupied).unwrap().unwrap()).unwrap().cells;
    let first = levels.scheme.first_voxel(key);
    let count = cells.len();
    let value = |number: usize| match layer {
        Layer::Colour => {
            let [red, green, blue, is_there] = [0, 1, 2, 3].map(|k| values[k * count + number]);
            (is_there > 0).then(|| f64::from(u32::from_be_bytes([0, red, green, blue])))
        }
        _ => {
            let end = |k: usize| f64::from_le_bytes(values[8 * k..8 * k + 8].try_into().unwrap());
            let stored = u16::from_le_bytes([values[16 + number], values[16 + count + number]]);
            (stored > 0).then(|| end(0) + (end(1) - end(0)) * (f64::from(stored) - 1.0) / 65534.0)
        }
    };
    assert_eq!(values.len(), if layer == Layer::Colour { 4 * count } else { 16 + 2 * count });
    if layer == Layer::Colour {
        let of_voxels = levels.coloured_voxels(map, store, key).unwrap().into_iter();
        let (voxels, colours): (Vec<_>, Vec<_>) = of_voxels.unzip();
        assert_eq!(voxels, levels.voxels(map, store, key).unwrap());
        let colours = colours.into_iter().map(|colour| {
            colour.map(|[red, green, blue]| f64::from(u32::from_be_bytes([0, red, green, blue])))
        });
        assert!(colours.eq((0..count).map(value)));
    }
    let voxel = |place: u32| {
        let at = cells::axes(place);
        [0, 1, 2].map(|k| first[k] + (at[k] << key.level))
    };
    cells.iter().enumerate().map(|(number, cell)| (voxel(cell.place), value(number))).collect()
}

/// Value of a layer over the occupied voxels of a box.
fn naive(layer: Layer, voxels: &[&VoxelLayers]) -> Option<f64> {
    let mut sum = VoxelLayers::default();
    voxels.iter().for_each(|voxel| sum.add(voxel));
    match layer {
        Layer::Colour => {
            sum.mean_colour().map(|[red, green, blue]| f64::from(u32::from_be_bytes([0, red, green, blue])))
        }
        Layer::Intensity => sum.mean_intensity(&ALL),
        Layer::Class => sum.class().map(f64::from),
        Layer::Time => sum.time.map(|time| time.last_ns as f64 * 1e-9),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn nodes_have_the_means_of_their_voxels(edge in prop_oneof![Just(4), Just(100), Just(256)], hits in hits()) {
        let map = map_of(edge, &hits);
        let store = memory_store();
        let levels = Levels::build(&map, &map.tile_indices(), 0, &store, &|_| true).unwrap().unwrap();
        let threshold = map.config().occupied_log_odds();
        let mut wanted: BTreeMap<[i64; 3], VoxelLayers> = BTreeMap::new();
        for tile in map.tiles() {
            let tile = tile.unwrap();
            for voxel in tile.voxels_from(threshold) {
                if let Some(layers) = tile.layers_of(voxel.index) {
                    wanted.insert(voxel.index.map(i64::from), layers);
                }
            }
        }
        for key in reached(&levels, &map, &store) {
            let width = 1_i64 << key.level;
            for layer in Layer::ALL {
                for (voxel, found) in values_of(&levels, &map, &store, key, layer) {
                    let inside = wanted.range(voxel..).take_while(|(fine, _)| fine[0] < voxel[0] + width);
                    let is_inside = |fine: &[i64; 3]| (0..3).all(|k| (voxel[k]..voxel[k] + width).contains(&fine[k]));
                    let inside = inside.filter(|(fine, _)| is_inside(fine));
                    let naive = naive(layer, &inside.map(|(_, layers)| layers).collect::<Vec<_>>());
                    let is_same = match (found, naive) {
                        // Half a step of an intensity is 25 / 65534.
                        (Some(found), Some(naive)) => (found - naive).abs() <= 4e-4,
                        (found, naive) => found.is_none() && naive.is_none(),
                    };
                    prop_assert!(is_same, "{layer} of {voxel:?} at level {}: {found:?}, not {naive:?}", key.level);
                }
            }
        }
        // Totals count the voxels of the map.
        let totals = levels.layer_totals(&map, &store).unwrap();
        let mut classes = BTreeMap::new();
        for class in wanted.values().filter_map(VoxelLayers::class) {
            *classes.entry(class).or_insert(0) += 1;
        }
        prop_assert_eq!(totals.classes().collect::<BTreeMap<u8, u64>>(), classes);
        let last_ns = wanted.values().filter_map(|voxel| voxel.time).map(|time| time.last_ns).max();
        prop_assert_eq!(totals.time().map(|time| time.last_ns), last_ns);
    }
}

#[test]
fn a_map_without_the_layer_is_refused() {
    let map = InMemoryMapper::new(MapConfig::new(0.5, 10.0).unwrap()).unwrap();
    let store = memory_store();
    let levels = Levels::build(&map, &map.tile_indices(), 0, &store, &|_| true).unwrap().unwrap();
    let key = NodeKey { level: 0, index: [0; 3] };
    assert!(levels.layered_node(&map, &store, key, Layer::Class).is_err());
    assert!(levels.coloured_voxels(&map, &store, key).is_err());
    assert_eq!(levels.layer_totals(&map, &store).unwrap(), LayerTotals::default());
    let map = map_of(20, &[]);
    let levels = Levels::build(&map, &map.tile_indices(), 0, &store, &|_| true).unwrap().unwrap();
    assert!(levels.layered_node(&map, &store, key, Layer::Class).unwrap().is_none());
}
