use super::tile_key::TileKey;
use crate::cap::Cap;
use crate::line::LANES;
use crate::options::{DistanceOptions, UnknownRule};
use crate::voxel_distance::VoxelDistance;
use serde::{Deserialize, Serialize};
use std::path::Path;
use voxtile::space::TileBox;
use voxtile::{FormatError, Grid, Result, TileIndex};

/// Content of `field.json`: parameters and tiles of a field. It is written last.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Index {
    format: String,
    version: u32,
    /// Id of the map, if it has one.
    pub(super) map_id: Option<String>,
    /// Number of the last scan in the map.
    pub(super) scan_number: u64,
    resolution_m: f64,
    tile_size_m: f64,
    max_distance_m: f64,
    unknown: UnknownRule,
    is_signed: bool,
    /// Tiles outside of this box are not part of the field; `None` if all are.
    pub(super) region: Option<TileBox>,
    /// Damaged tiles of the map, around which distances are unknown.
    pub(super) damaged_map_tiles: Vec<[i32; 3]>,
    pub(super) tiles: Vec<IndexedTile>,
}

/// Tile of a field.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct IndexedTile {
    pub(super) tile: [i32; 3],
    pub(super) key: TileKey,
    /// The stored distance of all voxels, if they are equal. Such a tile has no file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) uniform: Option<i16>,
}

const FORMAT: &str = "voxtile-distance";
const VERSION: u32 = 1;

impl Index {
    pub(super) fn new(grid: &Grid, options: &DistanceOptions, region: Option<TileBox>) -> Self {
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            map_id: None,
            scan_number: 0,
            resolution_m: grid.resolution_m(),
            tile_size_m: grid.tile_size_m(),
            max_distance_m: options.max_distance_m,
            unknown: options.unknown,
            is_signed: options.is_signed,
            region,
            damaged_map_tiles: Vec::new(),
            tiles: Vec::new(),
        }
    }

    /// Parses and checks the file.
    ///
    /// # Errors
    ///
    /// Fails if the file is malformed or of a later version.
    pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let malformed =
            |line: usize, reason: String| FormatError::at_line(line as u64, reason).in_input(path);
        let index: Self =
            serde_json::from_slice(bytes).map_err(|error| malformed(error.line(), error.to_string()))?;
        if index.format != FORMAT || index.version != VERSION {
            let reason = format!(
                "{} version {} is no distance field that this version of voxtile reads; compute it again with `voxtile \
                 distance`",
                index.format, index.version
            );
            return Err(malformed(1, reason));
        }
        index
            .grid()
            .and_then(|grid| Cap::of(index.max_distance_m, grid.resolution_m()))
            .map_err(|error| malformed(1, error.to_string()))?;
        Ok(index)
    }

    pub(super) fn grid(&self) -> Result<Grid> {
        Ok(Grid::new(self.resolution_m, self.tile_size_m)?)
    }

    pub(super) fn options(&self) -> DistanceOptions {
        DistanceOptions {
            max_distance_m: self.max_distance_m,
            unknown: self.unknown,
            is_signed: self.is_signed,
        }
    }

    /// Distance of voxels in tiles that are not listed.
    pub(super) fn distance_of_absent(&self, tile: TileIndex) -> VoxelDistance {
        if self.region.is_some_and(|region| !region.contains(tile)) {
            return VoxelDistance::UNKNOWN;
        }
        distance_of_absent(&self.options())
    }
}

/// Distance of voxels in tiles that no field lists.
pub(super) fn distance_of_absent(options: &DistanceOptions) -> VoxelDistance {
    match options.unknown {
        UnknownRule::Unknown => VoxelDistance::UNKNOWN,
        UnknownRule::Free => VoxelDistance::BEYOND,
        UnknownRule::Obstacle if options.is_signed => VoxelDistance::DEEP_INSIDE,
        UnknownRule::Obstacle => VoxelDistance::within(0),
    }
}

/// Number of lines of a row of voxels.
pub(super) fn chunks_of(edge: usize) -> usize {
    edge.div_ceil(LANES)
}
