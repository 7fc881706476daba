use std::collections::BTreeMap;
use voxtile::mapper::MapView;
use voxtile::{Occupancy, VoxelIndex};
use voxtile_distance::{DistanceOptions, UnknownRule, VoxelDistance};

/// Definition of the distances: looks at every voxel within the cap.
pub struct Naive {
    /// Whether each observed voxel is occupied.
    pub voxels: BTreeMap<VoxelIndex, bool>,
    pub options: DistanceOptions,
    pub resolution_m: f64,
}

impl Naive {
    pub fn of(map: &impl MapView, options: DistanceOptions) -> Self {
        let mut voxels = BTreeMap::new();
        for tile in map.tiles() {
            for voxel in tile.unwrap().voxels() {
                let is_occupied = Occupancy::of(map.config(), Some(voxel.evidence)).is_occupied();
                voxels.insert(voxel.index, is_occupied);
            }
        }
        Self { voxels, options, resolution_m: map.config().grid.resolution_m() }
    }

    fn is_obstacle(&self, voxel: VoxelIndex) -> bool {
        match self.voxels.get(&voxel) {
            Some(is_occupied) => *is_occupied,
            None => self.options.unknown == UnknownRule::Obstacle,
        }
    }

    fn is_open(&self, voxel: VoxelIndex) -> bool {
        match self.voxels.get(&voxel) {
            Some(is_occupied) => !is_occupied,
            None => self.options.unknown == UnknownRule::Free,
        }
    }

    pub fn distance(&self, voxel: VoxelIndex) -> VoxelDistance {
        if self.options.unknown == UnknownRule::Unknown && !self.voxels.contains_key(&voxel) {
            return VoxelDistance::UNKNOWN;
        }
        let is_inside = self.options.is_signed && self.is_obstacle(voxel);
        let is_wanted = |voxel| if is_inside { self.is_open(voxel) } else { self.is_obstacle(voxel) };
        let cap = self.options.max_distance_m / self.resolution_m;
        let reach = cap.ceil() as i32;
        let mut least: Option<i32> = None;
        for dx in -reach..=reach {
            for dy in -reach..=reach {
                for dz in -reach..=reach {
                    let squared = dx * dx + dy * dy + dz * dz;
                    let is_within = f64::from(squared) <= cap * cap * (1.0 + 1e-9);
                    if is_within
                        && least.is_none_or(|least| squared < least)
                        && is_wanted([voxel[0] + dx, voxel[1] + dy, voxel[2] + dz])
                    {
                        least = Some(squared);
                    }
                }
            }
        }
        match (least, is_inside) {
            (Some(squared), _) => VoxelDistance::within(squared as i16 * if is_inside { -1 } else { 1 }),
            (None, false) => VoxelDistance::BEYOND,
            (None, true) => VoxelDistance::DEEP_INSIDE,
        }
    }
}
