//! Checks the range of heights for colours.

use voxtile::mapper::MapView;
use voxtile::{InMemoryMapper, MapConfig, Mapper, Scan};
use voxtile_render::height_range_m;

#[test]
fn ranges_leave_out_two_percent_at_each_end() {
    for voxels in [0, 1, 2, 49, 50, 51, 400] {
        let mut map = InMemoryMapper::new(MapConfig::new(0.1, 1.6).unwrap()).unwrap();
        // Heights in voxels, most of them small.
        let heights: Vec<i64> = (0..voxels).map(|k: i64| (k * k) % 97 * (k % 7) / 5 - 40).collect();
        for (k, &z) in heights.iter().enumerate() {
            let at = [0.1 * k as f64 + 0.05, 0.05, 0.1 * z as f64 + 0.05];
            map.insert_scan(&Scan { origin: [at[0], 0.15, at[2]], points: vec![at], intensities: None })
                .unwrap();
        }
        let mut sorted: Vec<i64> = map
            .tile_indices()
            .into_iter()
            .flat_map(|index| map.tile_uncached(index).unwrap().unwrap().voxels_from(0.0).collect::<Vec<_>>())
            .map(|voxel| i64::from(voxel.index[2]))
            .collect();
        sorted.sort_unstable();
        assert_eq!(sorted.len(), heights.len());
        let range = height_range_m(&map, &map.tile_indices()).unwrap();
        let left_out = sorted.len() / 50;
        let wanted = (!sorted.is_empty())
            .then(|| [0.1 * sorted[left_out] as f64, 0.1 * (sorted[sorted.len() - 1 - left_out] + 1) as f64]);
        let rounded = |range: [f64; 2]| range.map(|height| (1e6 * height).round());
        assert_eq!(range.map(rounded), wanted.map(rounded), "{voxels} voxels");
    }
}
