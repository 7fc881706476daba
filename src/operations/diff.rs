use super::merge::common_crs;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::sensor::Evidence;
use crate::space::TileIndex;
use crate::tile::{LayerTable, Table};
use serde::Serialize;

/// Difference between two maps, or between two states of one map.
///
/// *Flipped* voxels changed from free to occupied or back, each by its own map's threshold. *Changed* voxels differ
/// only in log-odds or count. Layers are counted apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Diff {
    /// Number of tiles that only the second map has.
    pub tiles_appeared: u64,
    /// Number of tiles that only the first map has.
    pub tiles_gone: u64,
    /// Number of tiles in both maps with different voxels, evidence or layers.
    pub tiles_changed: u64,
    /// Number of tiles that are equal in both maps.
    pub tiles_equal: u64,
    /// Number of tiles that were read, because the index does not show that they are equal.
    pub tiles_read: u64,
    /// Number of different voxels in all tiles.
    #[serde(flatten)]
    pub voxels: VoxelDiff,
}

/// Numbers of different voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct VoxelDiff {
    /// Unknown in the first, observed in the second.
    pub appeared: u64,
    /// Observed in the first, unknown in the second.
    pub gone: u64,
    /// Free in the first, occupied in the second.
    pub to_occupied: u64,
    /// Occupied in the first, free in the second.
    pub to_free: u64,
    /// Occupied in both or free in both, with other log-odds or count.
    pub changed: u64,
    /// With other sums of [`Layers`](crate::Layers), whatever the evidence. 0 unless both maps have the same layers.
    pub layers: u64,
}

/// Difference of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct TileDiff {
    /// Index of the tile.
    pub tile: [i32; 3],
    /// Presence of the tile in the two maps.
    pub change: TileChange,
    /// Numbers of different voxels.
    #[serde(flatten)]
    pub voxels: VoxelDiff,
}

/// Change of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TileChange {
    /// Only the second map has it.
    Appeared,
    /// Only the first map has it.
    Gone,
    /// Both maps have it.
    Changed,
}

/// Compares two maps, or states of a map, tile by tile. Tiles whose index entries prove the same version of the same
/// map are not read. `found` receives each different tile, in order, and `progress` the number of tiles done and in
/// total. Memory: the lists of tiles, and one tile of each map.
///
/// # Errors
///
/// [`Error::Mismatch`] if resolution, tile size or coordinate reference system differ; an unreadable tile.
pub fn diff(
    first: &MapReader,
    second: &MapReader,
    mut found: impl FnMut(TileDiff),
    mut progress: impl FnMut(u64, u64),
) -> Result<Diff> {
    check_grids(first, second)?;
    common_crs([first, second])?;
    let mut tiles = first.tile_indices();
    tiles.extend(second.tile_indices());
    tiles.sort_unstable();
    tiles.dedup();
    let is_one_map = first.map_id().is_some() && first.map_id() == second.map_id();
    let mut diff = Diff::default();
    for (done, &tile) in (1..).zip(&tiles) {
        let versions = [first.version(tile), second.version(tile)];
        if is_one_map && versions[0].is_some() && versions[0] == versions[1] {
            diff.tiles_equal += 1;
        } else {
            diff.tiles_read += 1;
            diff.count(tile_diff(first, second, tile)?, &mut found);
        }
        progress(done, tiles.len() as u64);
    }
    Ok(diff)
}

fn check_grids(first: &MapReader, second: &MapReader) -> Result<()> {
    let grids = [first, second].map(|map| map.config().grid);
    let lengths = [
        ("resolution", grids.map(|grid| grid.resolution_m())),
        ("tile size", grids.map(|grid| grid.tile_size_m())),
    ];
    for (what, [first_m, second_m]) in lengths {
        if first_m != second_m {
            let (path, found) = (second.folder().to_owned(), format!("{second_m} m"));
            let wanted = format!("{first_m} m as {}", first.folder().display());
            return Err(Error::Mismatch { path, what, found, wanted });
        }
    }
    Ok(())
}

impl Diff {
    fn count(&mut self, tile: Option<TileDiff>, found: &mut impl FnMut(TileDiff)) {
        let Some(tile) = tile else {
            self.tiles_equal += 1;
            return;
        };
        match tile.change {
            TileChange::Appeared => self.tiles_appeared += 1,
            TileChange::Gone => self.tiles_gone += 1,
            TileChange::Changed => self.tiles_changed += 1,
        }
        self.voxels += tile.voxels;
        found(tile);
    }
}

fn tile_diff(first: &MapReader, second: &MapReader, index: TileIndex) -> Result<Option<TileDiff>> {
    let [a, b] = [first.tile_uncached(index)?, second.tile_uncached(index)?];
    let none = Table::default();
    let [a, b] = [&a, &b].map(|tile| tile.as_ref().map_or(&none, |tile| tile.table()));
    let mut voxels = VoxelDiff::of(first.config(), a, second.config(), b);
    voxels.layers = layer_differences(first.config(), a, second.config(), b);
    let change = match (a.is_empty(), b.is_empty()) {
        (true, false) => TileChange::Appeared,
        (false, true) => TileChange::Gone,
        _ if voxels == VoxelDiff::default() => return Ok(None),
        _ => TileChange::Changed,
    };
    Ok(Some(TileDiff { tile: index.to_array(), change, voxels }))
}

fn layer_differences(config_a: &MapConfig, a: &Table, config_b: &MapConfig, b: &Table) -> u64 {
    let layers = config_a.layers();
    if layers.is_none() || layers != config_b.layers() {
        return 0;
    }
    let none = LayerTable::new(layers);
    let [a, b] = [a, b].map(|table| table.layers().unwrap_or(&none));
    a.differences(b)
}

impl VoxelDiff {
    /// Compares two tables in Morton order.
    fn of(config_a: &MapConfig, a: &Table, config_b: &MapConfig, b: &Table) -> Self {
        let thresholds = [config_a, config_b].map(MapConfig::occupied_log_odds);
        let mut diff = Self::default();
        let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
        loop {
            let codes = (a.peek().map(|(code, _)| *code), b.peek().map(|(code, _)| *code));
            match codes {
                (None, None) => return diff,
                (Some(in_a), Some(in_b)) if in_a == in_b => {
                    let before_after = a.next().zip(b.next());
                    before_after.iter().for_each(|((_, before), (_, after))| {
                        diff.count(*before, *after, thresholds);
                    });
                }
                (Some(in_a), in_b) if in_b.is_none_or(|in_b| in_a < in_b) => {
                    diff.gone += 1;
                    a.next();
                }
                _ => {
                    diff.appeared += 1;
                    b.next();
                }
            }
        }
    }

    fn count(&mut self, before: Evidence, after: Evidence, thresholds: [f64; 2]) {
        let bits = |evidence: Evidence| (evidence.log_odds.to_bits(), evidence.observation_count);
        match (before.log_odds >= thresholds[0], after.log_odds >= thresholds[1]) {
            (false, true) => self.to_occupied += 1,
            (true, false) => self.to_free += 1,
            _ => self.changed += u64::from(bits(before) != bits(after)),
        }
    }
}

impl std::ops::AddAssign for VoxelDiff {
    fn add_assign(&mut self, other: Self) {
        self.appeared += other.appeared;
        self.gone += other.gone;
        self.to_occupied += other.to_occupied;
        self.to_free += other.to_free;
        self.changed += other.changed;
        self.layers += other.layers;
    }
}
