use anyhow::ensure;
use std::io::BufReader;
use std::path::Path;
use voxtile::MapConfig;
use voxtile::mapper::{MapView as _, OctreeMap};
use voxtile::operations::MapWriter;
use voxtile_formats::read::open_input;

/// Maximum number of voxels of a file with its pruned leaves expanded: twenty bytes can represent 2^48 voxels.
const MAX_VOXELS: u64 = 1 << 28;

/// Creates a map from an OctoMap file, with the file's resolution. `complete` sets the other parameters. Returns the
/// configuration.
///
/// # Errors
///
/// A file that cannot be read, is not of OctoMap or is too large, or a map that cannot be written.
pub fn create(
    file: &Path,
    output: &Path,
    complete: impl FnOnce(MapConfig) -> anyhow::Result<MapConfig>,
) -> anyhow::Result<MapConfig> {
    let tree = voxtile::octree::read(BufReader::with_capacity(1 << 16, open_input(file)?));
    let map = OctreeMap::of(tree.map_err(|error| error.in_input(file))?)?;
    let voxels = map.tree().expanded_leaf_count();
    ensure!(
        voxels <= MAX_VOXELS,
        "--octomap-path {}: the file expands to {voxels} voxels; at most {MAX_VOXELS} are supported",
        file.display()
    );
    let config = complete(map.config().clone())?;
    let mut writer = MapWriter::create(output, &config)?;
    for tile in map.tile_indices() {
        if let Some(content) = map.tile(tile)? {
            writer.put(tile, content.table())?;
        }
    }
    let written = writer.finish()?;
    let (file, resolution_m) = (file.display(), config.grid.resolution_m());
    log::info!(
        "new map from {file}: {} voxels of {resolution_m} m, {} occupied",
        written.voxels,
        written.occupied
    );
    Ok(config)
}
