use super::receiver_config::ReceiverConfig;
use super::set::VoxelSet;
use voxtile::space::{VoxelBox, VoxelIndex};

/// Limits of a layer on region, voxels, tiles and memory.
#[derive(Clone, Debug)]
pub(super) struct LayerLimits {
    region: Option<VoxelBox>,
    max_voxels: u64,
    max_tiles: usize,
    /// Memory limit of the layer alone, in bytes.
    pub(super) bytes: usize,
}

impl LayerLimits {
    pub(super) fn new(config: &ReceiverConfig, bytes: usize) -> Self {
        let ReceiverConfig { region, max_voxels, max_tiles, .. } = *config;
        Self { region, max_voxels, max_tiles, bytes }
    }

    /// Adds or removes a voxel. Returns `false` and leaves the layer unchanged if the voxel is beyond the limits.
    pub(super) fn put(&self, layer: &mut VoxelSet, voxel: VoxelIndex, is_in: bool) -> bool {
        let is_inside = || self.region.as_ref().is_none_or(|region| region.contains(voxel));
        let is_allowed =
            !is_in || (is_inside() && (self.has_space_for(layer, voxel) || layer.contains(voxel)));
        if is_allowed {
            layer.put(voxel, is_in);
        }
        is_allowed
    }

    fn has_space_for(&self, layer: &VoxelSet, voxel: VoxelIndex) -> bool {
        let tile = layer.grid().tile_of_voxel(voxel);
        layer.len() < self.max_voxels
            && layer.memory_bytes() + VoxelSet::MAX_BYTES_PER_VOXEL <= self.bytes
            && (layer.tile_count() < self.max_tiles || layer.has_tile(tile))
    }
}
