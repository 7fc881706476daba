//! OctoMap files as maps: contents and voxels.

use std::io::BufReader;
use std::path::Path;
use voxtile::octree::{self, Leaf, OctreeFile};
use voxtile::space::{Grid, MortonCode};
use voxtile::{Error, Result};
use voxtile_formats::read::open_input;
use voxtile_formats::write::{RowLayers, VoxelRow};

/// Limit for the voxels of a file when its pruned leaves are expanded: a file of twenty bytes can represent 2^48
/// voxels.
pub const MAX_VOXELS: u64 = 1 << 28;

/// Reads an octree file.
///
/// # Errors
///
/// The file cannot be read or is not an OctoMap file.
pub fn read(path: &Path) -> Result<OctreeFile> {
    octree::read(BufReader::with_capacity(1 << 16, open_input(path)?)).map_err(|error| error.in_input(path))
}

/// Returns the grid of a file's voxels. The tile size is arbitrary (two voxels), because the file has no tiles.
///
/// # Errors
///
/// The resolution is invalid.
pub fn grid_of(file: &OctreeFile) -> Result<Grid> {
    Ok(Grid::new(file.resolution_m, 2.0 * file.resolution_m)?)
}

/// Counts the finest voxels with at least `min_log_odds`, with pruned leaves expanded.
///
/// # Errors
///
/// There are more than [`MAX_VOXELS`].
pub fn count_voxels(file: &OctreeFile, min_log_odds: f32, keep: impl Fn(&VoxelRow) -> bool) -> Result<u64> {
    let size = file.tree.count_voxels(min_log_odds).occupied;
    if size > MAX_VOXELS {
        let hint = "such files contain large pruned cubes; export it as .ot or .bt, which remain pruned";
        return Err(Error::TooLarge { what: "number of voxels in the file", size, limit: MAX_VOXELS, hint });
    }
    let mut count = 0;
    for_each_voxel(file, min_log_odds, |voxel| {
        count += u64::from(keep(voxel));
        Ok(())
    })?;
    Ok(count)
}

/// Visits the finest voxels with at least `min_log_odds` in Morton order. Their observation counts are 0, because
/// OctoMap files contain none.
///
/// # Errors
///
/// `visit` fails, or the resolution is invalid.
pub fn for_each_voxel(
    file: &OctreeFile,
    min_log_odds: f32,
    mut visit: impl FnMut(&VoxelRow) -> Result<()>,
) -> Result<()> {
    let grid = grid_of(file)?;
    for Leaf { code, depth, value } in file.tree.leaves() {
        if value < min_log_odds {
            continue;
        }
        for offset in 0..MortonCode::span(depth) {
            let voxel = MortonCode(code.0 + offset).to_key().to_index_from([-32768; 3]);
            let log_odds = f64::from(value);
            visit(&VoxelRow {
                index: voxel,
                center_m: grid.center_m(voxel),
                probability: voxtile::maths::sigmoid(log_odds),
                log_odds,
                observation_count: 0,
                tile: [0; 3],
                layers: RowLayers::default(),
            })?;
        }
    }
    Ok(())
}
