use super::change::{Change, rays_within, tiles_of_marks};
use super::filtered_scan::FilteredScan;
use super::replay::Replay;
use super::revision::{Revision, Touched};
use super::scan_change::ScanChange;
use crate::error::{Error, Result};
use crate::mapper::{KeptSummary, OutOfCoreTileMapper};
use crate::scan::ScanPoints;
use crate::space::{TileBox, TileIndex, TileSelection};
use crate::store::{KeptRecord, MapPath, TileStore};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Result of a part of a replay: what [`Replay::with_parts`] needs in addition to the part's shard.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReplayPart {
    /// The flush of the map that was read.
    pub(super) flush_number: u64,
    /// Tiles of the map that the part replaces. Those that its shard lacks become empty.
    pub(super) replaced: Vec<[i32; 3]>,
    /// Changed scans that update tiles of the part; all scans if all tiles are replayed.
    pub(super) changed: Vec<ChangedScan>,
    /// First and last tile of its region.
    pub(super) region: [[i32; 3]; 2],
    /// Number of scans that were replayed, in whole or in part, and of their updates.
    pub(super) scans_mapped: u64,
    pub(super) updates_mapped: u64,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct ChangedScan {
    pub(super) number: u64,
    pub(super) updates: u64,
    pub(super) tiles: Vec<[i32; 3]>,
}

/// More columns than any plan has: a few rays of many kilometres.
const MAX_COLUMNS: u64 = 1 << 20;

/// Columns of tiles, by their index in units of `tiles` along x and y, that a change of kept scans may affect: the parts
/// of a replay that several processes share ([`replay_part`], then [`Replay::with_parts`]).
///
/// # Errors
///
/// As for the operation of the change, and new poses or marks of scans of a map of a region without a maximum range.
pub fn replay_columns(
    scans: &KeptSummary,
    change: &ScanChange,
    how: &Replay,
    tiles: u32,
) -> Result<BTreeSet<[i32; 2]>> {
    let (revision, store) = begin(scans, change, how)?;
    let edge = i32::try_from(tiles.max(1)).unwrap_or(i32::MAX);
    let mut columns = BTreeSet::new();
    let config = how.config_of(&store)?;
    let column_of = |tile: TileIndex| [tile.x.div_euclid(edge), tile.y.div_euclid(edge)];
    if revision.replays_all() {
        columns.extend(store.tiles().iter().map(column_of));
    }
    let mut records = store.archive().records()?;
    while let Some(record) = records.next_kept()? {
        let Some(change) = revision.changes.get(&record.number) else { continue };
        for reach in change.reach(&record, &config.grid)? {
            let ([west, south], [east, north]) = (column_of(reach.min()), column_of(reach.max()));
            let count =
                (u64::from(west.abs_diff(east)) + 1).saturating_mul(u64::from(south.abs_diff(north)) + 1);
            if columns.len() as u64 + count > MAX_COLUMNS {
                let reason = format!(
                    "the rays of scan {} may reach {count} columns of {edge} tiles; use larger columns",
                    record.number
                );
                return Err(Error::argument("tiles", reason));
            }
            columns.extend((west..=east).flat_map(|x| (south..=north).map(move |y| [x, y])));
        }
    }
    Ok(columns)
}

/// Replays the tiles of a region that a change affects, as a shard in `output`. The map is unchanged. Without such tiles
/// there is no shard.
///
/// # Errors
///
/// As for the operation of the change, and an output with other content.
pub fn replay_part(
    scans: &KeptSummary,
    change: &ScanChange,
    how: &Replay,
    region: TileBox,
    output: impl Into<MapPath>,
    mut progress: impl FnMut(u64, u64),
) -> Result<ReplayPart> {
    let (mut revision, store) = begin(scans, change, how)?;
    let touched = revision.look(&store, Some(region))?;
    let mut replaced: Vec<_> = store
        .tiles()
        .iter()
        .filter(|&tile| region.contains(tile) && touched.has(tile))
        .map(TileIndex::to_array)
        .collect();
    replaced.sort_unstable();
    let region_tiles = [region.min(), region.max()].map(TileIndex::to_array);
    let flush_number = store.commits().flush_number;
    let mut part = ReplayPart { flush_number, replaced, region: region_tiles, ..ReplayPart::default() };
    if touched.tiles.as_ref().is_some_and(|tiles| tiles.is_empty()) {
        return Ok(part);
    }
    let Some(map_id) = store.map_id() else {
        return Err(Error::argument("map", "is of the original format; convert it first"));
    };
    let shard = touched.config.clone().with_kept_scans(false).with_region(region);
    let mut mapper = OutOfCoreTileMapper::create_as(output, shard, map_id)?;
    mapper.stop_with(how.stop.clone());
    let all = scans.scans().len() as u64;
    let mut records = store.archive().records()?;
    let mut done = 0;
    while let Some(record) = records.next_kept()? {
        how.stop.check()?;
        progress(done, all);
        done += 1;
        part.replay(&revision, &store, &touched, region, &mut mapper, record)?;
    }
    mapper.commit_replay(store.commits().scan_number, false)?;
    progress(all, all);
    Ok(part)
}

impl ReplayPart {
    /// Replays a scan in the affected tiles of the region.
    fn replay(
        &mut self,
        revision: &Revision,
        store: &TileStore,
        touched: &Touched,
        region: TileBox,
        mapper: &mut OutOfCoreTileMapper,
        record: KeptRecord,
    ) -> Result<()> {
        let grid = &touched.config.grid;
        let is_touched = |tile: &TileIndex| region.contains(*tile) && touched.has(*tile);
        let change = revision.changes.get(&record.number);
        let is_near = match change {
            Some(Change::Remove) => false,
            None | Some(Change::Filter(_)) => record.tiles.iter().any(is_touched),
            Some(change) => change.may_reach(&record, grid, Some(region))?,
        };
        let Some(rays) = rays_within(&record.rays, Some(region)).filter(|_| is_near) else { return Ok(()) };
        let (number, mut tiles) = (record.number, record.tiles.clone());
        let mut scan = revision.open(store.layout(), record)?;
        let rest;
        let mut points: &dyn ScanPoints = &scan;
        match change {
            Some(Change::Filter(of_box)) => {
                rest = FilteredScan::new(&scan, *of_box, false)?;
                points = &rest;
            }
            Some(Change::Move(pose)) => {
                scan = scan.with_pose(pose.clone());
                points = &scan;
            }
            Some(Change::Mark(marks)) => {
                let marks = marks.of(&scan)?;
                tiles.extend(tiles_of_marks(grid, &scan, &marks)?);
                scan = scan.with_moving(marks);
                points = &scan;
            }
            Some(Change::Remove) | None => {}
        }
        let selection = match change {
            // A moved scan may update any tile.
            Some(Change::Move(_)) => None,
            _ => Some(tiles.into_iter().filter(is_touched).collect::<TileSelection>()),
        };
        let (updates, tiles) = mapper.replay_scan(number, points, &rays, selection.as_ref())?;
        self.scans_mapped += 1;
        self.updates_mapped += updates;
        if !tiles.is_empty() && (change.is_some() || touched.tiles.is_none()) {
            // Scans without a change keep their list of tiles.
            let tiles = if change.is_some() { tiles } else { Vec::new() };
            let tiles = tiles.into_iter().map(TileIndex::to_array).collect();
            self.changed.push(ChangedScan { number, updates, tiles });
        }
        Ok(())
    }
}

/// Opens the map for reading, as of the flush of the summary.
fn begin(scans: &KeptSummary, change: &ScanChange, how: &Replay) -> Result<(Revision, TileStore)> {
    scans.check_keeps_all()?;
    let revision = Revision::new(scans, how, change.of(scans)?)?;
    let (disk, folder) = scans.place();
    let store = TileStore::open_read_only(disk, folder)?;
    match store.commits().flush_number == scans.flush_number() {
        true => Ok((revision, store)),
        false => Err(Error::Changed { path: folder.to_owned() }),
    }
}
