//! Voxels of 0.5 m for tests.

use super::row::{RowLayers, VoxelRow, VoxelsHead};
use voxtile::Layers;

pub(super) const RESOLUTION_M: f64 = 0.5;

pub(super) fn row(index: [i32; 3], probability: f64) -> VoxelRow {
    VoxelRow {
        index,
        center_m: index.map(|k| (f64::from(k) + 0.5) * RESOLUTION_M),
        probability,
        log_odds: (probability / (1.0 - probability)).ln(),
        observation_count: 4,
        tile: index.map(|k| k.div_euclid(16)),
        layers: RowLayers::default(),
    }
}

pub(super) fn head_of(rows: &[VoxelRow]) -> VoxelsHead {
    let bound = |k: usize, pick: fn(f64, f64) -> f64| rows.iter().map(|row| row.center_m[k]).reduce(pick);
    VoxelsHead {
        voxels: rows.len() as u64,
        resolution_m: RESOLUTION_M,
        bounds_m: [f64::min, f64::max].map(|pick| std::array::from_fn(|k| bound(k, pick).unwrap_or(0.0))),
        occupied_log_odds: 0.0,
        layers: Layers::NONE,
    }
}
