use voxtile::Scan;
use voxtile::scan::RayWalk;
use voxtile::sensor::{Evidence, Observation, SensorModel};
use voxtile::space::{Grid, MortonCode, VoxelIndex, VoxelKey};

/// One update of a voxel by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    pub voxel: VoxelIndex,
    /// Whether the ray ends there.
    pub is_hit: bool,
}

/// Updates by every ray, in the order of OctoMap's `insertPointCloudRays`: ray by ray, from the sensor outward. Stops
/// after `max` updates.
pub fn updates(grid: &Grid, scans: &[Scan], max: usize) -> Vec<Update> {
    let mut updates = Vec::new();
    for scan in scans {
        let Some(start) = grid.voxel_of(scan.origin) else { continue };
        for &point in scan.points.iter().filter(|point| **point != scan.origin) {
            let Some(last) = grid.voxel_of(point) else { continue };
            let walk =
                RayWalk::between(grid.to_voxel_units(scan.origin), start, grid.to_voxel_units(point), last);
            walk.for_each_before_end(|voxel| updates.push(Update { voxel, is_hit: false }));
            updates.push(Update { voxel: last, is_hit: true });
            if updates.len() >= max {
                updates.truncate(max);
                return updates;
            }
        }
    }
    updates
}

/// Log-odds of the voxel after each update, in this order.
pub fn accumulated(model: &SensorModel, updates: &[Update]) -> Vec<(MortonCode, f32)> {
    let mut known: rustc_hash::FxHashMap<VoxelIndex, Evidence> = Default::default();
    let values = updates.iter().map(|update| {
        let observation = if update.is_hit { Observation::Hit(0.0) } else { Observation::Miss };
        let evidence = model.update(known.get(&update.voxel).copied(), observation);
        known.insert(update.voxel, evidence);
        (VoxelKey::from_index(update.voxel).morton(), evidence.log_odds as f32)
    });
    values.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{datasets, map_config};
    use std::collections::BTreeMap;
    use std::path::Path;
    use voxtile::{InMemoryMapper, InsertMode, MapView, Mapper};

    /// The last value of every voxel is the one in the table of the mapper's map.
    #[test]
    fn the_updates_give_the_map_of_the_mapper() {
        let scans = datasets(Path::new(""))[1].scans(1).unwrap();
        let config = map_config(0.2).unwrap().with_insert_mode(InsertMode::PerRay);
        let updates = updates(&config.grid, &scans, usize::MAX);
        let last_values: BTreeMap<_, _> = accumulated(&config.sensor_model, &updates).into_iter().collect();
        let mut mapper = InMemoryMapper::new(config).unwrap();
        mapper.insert_scan(&scans[0]).unwrap();
        let mut voxels = 0;
        for tile in mapper.tiles() {
            for voxel in tile.unwrap().voxels() {
                let code = VoxelKey::from_index(voxel.index).morton();
                assert_eq!(last_values[&code], voxel.evidence.log_odds as f32);
                voxels += 1;
            }
        }
        assert_eq!(voxels, last_values.len());
    }
}
