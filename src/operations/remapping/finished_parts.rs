use super::change::Change;
use super::replay::Replayed;
use super::replay_part::ReplayPart;
use super::revision::{Revision, Touched};
use crate::error::{Error, Result};
use crate::mapper::Remapper;
use crate::space::{Grid, TileIndex};
use crate::store::{KeptRecord, MapPath, TileStore};
use rustc_hash::{FxHashMap, FxHashSet};

/// Finished parts of a replay, checked against the map.
pub(super) struct FinishedParts {
    map_id: Option<[u8; 16]>,
    shards: Vec<MapPath>,
    regions: Vec<Columns>,
    /// Rectangles of tiles that the regions cover.
    covered: FxHashSet<Columns>,
    /// Tiles of the map that no part replaces.
    kept: FxHashSet<TileIndex>,
    /// Updates and updated tiles of scans in all parts.
    scans: FxHashMap<u64, (u64, Vec<TileIndex>)>,
    scans_mapped: u64,
    updates_mapped: u64,
}

impl FinishedParts {
    /// Also returns the tiles that the parts replace.
    ///
    /// # Errors
    ///
    /// Parts of overlapping regions or of another flush; a part without its shard; a missing part, if the change affects
    /// all tiles.
    pub(super) fn of(
        parts: &[(Option<MapPath>, ReplayPart)],
        store: &TileStore,
        revision: &mut Revision,
    ) -> Result<(Self, Touched)> {
        let listed = || parts.iter().map(|(_, part)| part);
        if listed().any(|part| part.flush_number != store.commits().flush_number) {
            return Err(Error::Changed { path: store.folder().to_owned() });
        }
        let needs_shard = |part: &ReplayPart| !(part.replaced.is_empty() && part.changed.is_empty());
        if let Some((_, part)) = parts.iter().find(|(shard, part)| shard.is_none() && needs_shard(part)) {
            let [first, last] = part.region.map(TileIndex::from);
            let reason =
                format!("the shard of the tiles {first} to {last} is missing: replay this part again");
            return Err(Error::argument("parts", reason));
        }
        let mut scans: FxHashMap<u64, (u64, Vec<TileIndex>)> = FxHashMap::default();
        for scan in listed().flat_map(|part| &part.changed) {
            let (updates, tiles) = scans.entry(scan.number).or_default();
            *updates = updates.saturating_add(scan.updates);
            tiles.extend(scan.tiles.iter().copied().map(TileIndex::from));
        }
        scans.values_mut().for_each(|(_, tiles)| tiles.sort_unstable());
        let replaced: FxHashSet<TileIndex> =
            listed().flat_map(|part| &part.replaced).copied().map(TileIndex::from).collect();
        let kept: FxHashSet<TileIndex> =
            store.tiles().iter().filter(|tile| !replaced.contains(tile)).collect();
        if let (true, Some(tile)) = (revision.replays_all(), kept.iter().min()) {
            let reason = format!("no part replaces {tile}, but the change affects all tiles: pass all parts");
            return Err(Error::argument("parts", reason));
        }
        let touched = revision.touched_by(store, replaced)?;
        let finished = Self {
            map_id: store.map_id(),
            shards: parts.iter().filter_map(|(shard, _)| shard.clone()).collect(),
            regions: regions_of(parts)?,
            covered: FxHashSet::default(),
            kept,
            scans,
            scans_mapped: listed().map(|part| part.scans_mapped).sum(),
            updates_mapped: listed().map(|part| part.updates_mapped).sum(),
        };
        Ok((finished, touched))
    }

    /// Returns the number of updates of a scan and its tiles, in order.
    pub(super) fn of_scan(&self, number: u64) -> (u64, Vec<TileIndex>) {
        self.scans.get(&number).cloned().unwrap_or_default()
    }

    /// Checks that there are parts for all tiles that the change of a scan may affect.
    pub(super) fn check_has_all(&mut self, record: &KeptRecord, change: &Change, grid: &Grid) -> Result<()> {
        if let Change::Move(_) | Change::Remove = change
            && let Some(tile) = record.tiles.iter().find(|tile| self.kept.contains(tile))
        {
            let reason =
                format!("no part replaces {tile}, which scan {} touched: pass all parts", record.number);
            return Err(Error::argument("parts", reason));
        }
        for reach in change.reach(record, grid)? {
            let wanted = columns_of(reach.min().to_array(), reach.max().to_array());
            if self.covered.insert(wanted) && !self.covers(&wanted) {
                let reason = format!(
                    "the change of scan {} reaches tiles of a missing part: pass all parts",
                    record.number
                );
                return Err(Error::argument("parts", reason));
            }
        }
        Ok(())
    }

    /// Returns whether the disjoint regions cover all columns of tiles of a box.
    fn covers(&self, wanted: &Columns) -> bool {
        self.regions.iter().map(|region| common_columns(region, wanted)).sum::<i128>()
            >= common_columns(wanted, wanted)
    }

    /// Adds the tiles of all shards.
    ///
    /// # Errors
    ///
    /// A shard of another map, or with a tile that no part replaces.
    pub(super) fn link_into(&self, remapper: &mut Remapper) -> Result<()> {
        for shard in &self.shards {
            let (disk, folder) = shard.clone().into_parts();
            let shard = TileStore::open_read_only(disk, &folder)?;
            if shard.map_id() != self.map_id {
                return Err(Error::argument(
                    folder.display().to_string(),
                    "is no part of a replay of this map",
                ));
            }
            if let Some(tile) = shard.tiles().iter().find(|tile| self.kept.contains(tile)) {
                let reason = format!("has {tile}, which no part replaces: pass the text of this part");
                return Err(Error::argument(folder.display().to_string(), reason));
            }
            remapper.link_in(&shard)?;
        }
        Ok(())
    }

    /// Sets the counts of what the parts have replayed.
    pub(super) fn put_counts(&self, counts: &mut Replayed) {
        (counts.scans_mapped, counts.updates_mapped) = (self.scans_mapped, self.updates_mapped);
    }
}

/// A rectangle of tiles along x and y: first and last index along each.
type Columns = [[i64; 2]; 2];

/// Returns the regions of all parts.
///
/// # Errors
///
/// Regions that overlap.
fn regions_of(parts: &[(Option<MapPath>, ReplayPart)]) -> Result<Vec<Columns>> {
    let regions: Vec<Columns> =
        parts.iter().map(|(_, ReplayPart { region: [min, max], .. })| columns_of(*min, *max)).collect();
    let overlaps = |at: usize| regions[..at].iter().any(|before| common_columns(before, &regions[at]) > 0);
    if (0..regions.len()).any(overlaps) {
        return Err(Error::argument("parts", "regions overlap: pass each part once, with its own text"));
    }
    Ok(regions)
}

/// Returns the number of columns that two rectangles have in common.
fn common_columns(one: &Columns, other: &Columns) -> i128 {
    let along = |axis: usize| {
        let (first, last) = (one[axis][0].max(other[axis][0]), one[axis][1].min(other[axis][1]));
        i128::from((last - first + 1).max(0))
    };
    along(0) * along(1)
}

fn columns_of(min: [i32; 3], max: [i32; 3]) -> Columns {
    [0, 1].map(|axis| [min[axis], max[axis]].map(i64::from))
}
