use super::completion::release;
use super::new_poses::NewPoses;
use super::remap::{Remap, Remapped};
use super::replay::{Replayed, clean_up_after_error, create_snapshot, open};
use super::revision::{Change, Changes, MAX_POINTS_IN_MEMORY, PART_FOR_ALL};
use crate::config::RayConfig;
use crate::error::{Error, Result};
use crate::mapper::{KeptScan, KeptSummary, NewPose, OutOfCoreTileMapper, Remapper, TileFinder};
use crate::space::{Aabb, Grid, TileBox, TileIndex, TileSelection};
use crate::store::{CatalogEntry, KeptRecord, MapPath, TileStore};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Result of a part of a remap: what [`join_remap`] needs besides the part's shard.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RemapPart {
    /// Tiles of the map that the part replaces. Those that its shard lacks become empty.
    replaced: Vec<[i32; 3]>,
    /// Moved scans that change tiles of the part.
    moved: Vec<MovedScan>,
    /// First and last tile of its region.
    region: [[i32; 3]; 2],
    /// Number of scans that were replayed, in whole or in part, and of their updates.
    scans_mapped: u64,
    updates_mapped: u64,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct MovedScan {
    number: u64,
    updates: u64,
    tiles: Vec<[i32; 3]>,
}

/// More columns than any plan has: a few rays of many kilometres.
const MAX_COLUMNS: u64 = 1 << 20;

/// Columns of tiles, by their index in units of `tiles` along x and y, that new poses may change: the parts of a remap
/// that several processes share ([`remap_part`], then [`join_remap`]).
///
/// # Errors
///
/// As for [`remap`](super::remap()), and scans of a map of a region without a maximum range.
pub fn remap_columns(
    scans: &KeptSummary,
    poses: &NewPoses,
    how: &Remap,
    tiles: u32,
) -> Result<BTreeSet<[i32; 2]>> {
    let (moves, store) = moves(scans, poses, how)?;
    let edge = i32::try_from(tiles.max(1)).unwrap_or(i32::MAX);
    let mut columns = BTreeSet::new();
    let mut records = store.archive().records()?;
    let config = how.replay.config_of(&store)?;
    let column_of = |tile: TileIndex| [tile.x.div_euclid(edge), tile.y.div_euclid(edge)];
    if moves.are_most {
        columns.extend(store.tiles().iter().map(column_of));
    }
    while let Some(record) = records.next_kept()? {
        let Some(pose) = moves.poses.get(&record.number) else { continue };
        columns.extend(record.tiles.iter().copied().map(column_of));
        let reach = reach_of(&record, pose, &config.grid)?;
        let ([west, south], [east, north]) = (column_of(reach.min()), column_of(reach.max()));
        let count = (u64::from(west.abs_diff(east)) + 1).saturating_mul(u64::from(south.abs_diff(north)) + 1);
        if columns.len() as u64 + count > MAX_COLUMNS {
            let reason = format!(
                "the rays of scan {} may reach {count} columns of {edge} tiles; use larger columns",
                record.number
            );
            return Err(Error::argument("poses", reason));
        }
        columns.extend((west..=east).flat_map(|x| (south..=north).map(move |y| [x, y])));
    }
    Ok(columns)
}

/// Replays the tiles of a region that new poses affect, as a shard in `output`. The map is unchanged. Without such tiles
/// there is no shard.
///
/// # Errors
///
/// As for [`remap`](super::remap()), and an output with other content.
pub fn remap_part(
    scans: &KeptSummary,
    poses: &NewPoses,
    how: &Remap,
    region: TileBox,
    output: impl Into<MapPath>,
    mut progress: impl FnMut(u64, u64),
) -> Result<RemapPart> {
    let (moves, store) = moves(scans, poses, how)?;
    let config = how.replay.config_of(&store)?;
    let touched = match moves.are_most {
        true => None,
        false => Some(tiles_of_moved(&moves, &store, scans, how, region)?),
    };
    let is_touched = |tile: &TileIndex| {
        region.contains(*tile) && touched.as_ref().is_none_or(|touched| touched.contains(tile))
    };
    let mut replaced: Vec<_> = store.tiles().iter().filter(is_touched).map(TileIndex::to_array).collect();
    replaced.sort_unstable();
    let mut part = RemapPart {
        replaced,
        region: [region.min(), region.max()].map(TileIndex::to_array),
        ..RemapPart::default()
    };
    if touched.as_ref().is_some_and(FxHashSet::is_empty) {
        return Ok(part);
    }
    let Some(map_id) = store.map_id() else {
        return Err(Error::argument("map", "is of the original format; convert it first"));
    };
    let shard = config.clone().with_kept_scans(false).with_region(region);
    let mut mapper = OutOfCoreTileMapper::create_as(output, shard, map_id)?;
    mapper.stop_with(how.replay.stop.clone());
    let (disk, _) = scans.place();
    let all = scans.scans().len() as u64;
    let mut records = store.archive().records()?;
    let mut done = 0;
    while let Some(record) = records.next_kept()? {
        how.replay.stop.check()?;
        progress(done, all);
        done += 1;
        let pose = moves.poses.get(&record.number);
        let is_near = match pose {
            Some(pose) => reach_of(&record, pose, &config.grid)?.intersection(region).is_some(),
            None => record.tiles.iter().any(is_touched),
        };
        let Some(rays) = limited_to(region, &record).filter(|_| is_near) else { continue };
        let selection: Option<TileSelection> =
            pose.is_none().then(|| record.tiles.iter().copied().filter(|tile| is_touched(tile)).collect());
        let number = record.number;
        let scan = KeptScan::open(&disk, store.layout(), record, MAX_POINTS_IN_MEMORY)?;
        let scan = match pose {
            Some(pose) => scan.with_pose(pose.clone()),
            None => scan,
        };
        let (report, tiles) = mapper.replay_scan(number, &scan, &rays, selection.as_ref())?;
        let updates = report.hits + report.misses;
        part.scans_mapped += 1;
        part.updates_mapped += updates;
        if pose.is_some() && !tiles.is_empty() {
            let tiles = tiles.into_iter().map(TileIndex::to_array).collect();
            part.moved.push(MovedScan { number, updates, tiles });
        }
    }
    mapper.commit_replay(store.commits().scan_number, false)?;
    progress(all, all);
    Ok(part)
}

/// Applies new poses to a map, with the parts of all [`remap_columns`]. In one commit the map becomes that of
/// [`remap`](super::remap()) with the same poses. The shards are unchanged.
///
/// # Errors
///
/// As for [`remap`](super::remap()); a missing part; a shard of another map, or with a tile that no part replaces. The
/// map is unchanged then.
pub fn join_remap(
    scans: &KeptSummary,
    poses: &NewPoses,
    how: &Remap,
    parts: &[(Option<MapPath>, RemapPart)],
) -> Result<Remapped> {
    let (mut remapped, changes) = Remapped::by_poses(scans, poses, how)?;
    let (disk, folder) = scans.place();
    let mut store = open(scans)?;
    remapped.mapped = Replayed {
        scans: scans.scans().len() as u64,
        scans_changed: changes.len() as u64,
        updates: scans.scans().iter().map(|scan| scan.updates).sum(),
        tiles: store.tiles().count() as u64,
        tiles_mapped: parts.iter().map(|(_, part)| part.replaced.len() as u64).sum(),
        scans_mapped: parts.iter().map(|(_, part)| part.scans_mapped).sum(),
        updates_mapped: parts.iter().map(|(_, part)| part.updates_mapped).sum(),
        ..Replayed::default()
    };
    if changes.is_empty() {
        return Ok(remapped);
    }
    create_snapshot(&mut store, &how.replay)?;
    let released = clean_up_after_error(disk, folder, joined(store, &changes, how, parts))?;
    if let Err(error) = released {
        log::warn!("{}: committed, but the cleanup failed: {error:#}", folder.display());
    }
    Ok(remapped)
}

fn joined(
    store: TileStore,
    changes: &Changes,
    how: &Remap,
    parts: &[(Option<MapPath>, RemapPart)],
) -> Result<Result<()>> {
    let mut moved: FxHashMap<u64, (u64, Vec<TileIndex>)> = FxHashMap::default();
    for scan in parts.iter().flat_map(|(_, part)| &part.moved) {
        let (updates, tiles) = moved.entry(scan.number).or_default();
        *updates += scan.updates;
        tiles.extend(scan.tiles.iter().copied().map(TileIndex::from));
    }
    let replaced: Vec<TileIndex> =
        parts.iter().flat_map(|(_, part)| &part.replaced).copied().map(TileIndex::from).collect();
    let replaced: FxHashSet<TileIndex> =
        replaced.into_iter().filter(|tile| store.tiles().contains(*tile)).collect();
    let kept: FxHashSet<TileIndex> = store.tiles().iter().filter(|tile| !replaced.contains(tile)).collect();
    let config = how.replay.config_of(&store)?;
    let (map_id, mut records, grid) = (store.map_id(), store.archive().records()?, config.grid);
    let regions = regions_of(parts)?;
    let mut remapper = Remapper::begin(store, config, replaced, how.replay.stop.clone())?;
    while let Some(entry) = records.next_entry()? {
        how.replay.stop.check()?;
        let CatalogEntry::Kept(mut record) = entry else {
            remapper.put(&entry)?;
            continue;
        };
        if let Some(Change::Move(pose)) = changes.get(&record.number) {
            if let Some(tile) = record.tiles.iter().find(|tile| kept.contains(tile)) {
                let reason =
                    format!("no part replaces {tile}, which scan {} touched: pass all parts", record.number);
                return Err(Error::argument("parts", reason));
            }
            if !are_covered(reach_of(&record, pose, &grid)?, &regions) {
                let reason = format!(
                    "the new pose of scan {} reaches tiles of a missing part: pass all parts",
                    record.number
                );
                return Err(Error::argument("parts", reason));
            }
            pose.put_in(&mut record);
            (record.updates, record.tiles) = moved.remove(&record.number).unwrap_or_default();
            record.tiles.sort_unstable();
        }
        remapper.put(&CatalogEntry::Kept(record))?;
    }
    for (shard, _) in parts {
        let Some(shard) = shard else { continue };
        let (disk, folder) = shard.clone().into_parts();
        let shard = TileStore::open_read_only(disk, &folder)?;
        if shard.map_id() != map_id {
            return Err(Error::argument(folder.display().to_string(), "is no part of a remap of this map"));
        }
        if let Some(tile) = shard.tiles().iter().find(|tile| kept.contains(tile)) {
            let reason = format!("has {tile}, which no part replaces: pass the text of this part");
            return Err(Error::argument(folder.display().to_string(), reason));
        }
        remapper.link_in(&shard)?;
    }
    remapper.finish(true, release)
}

/// Rectangles of tiles along x and y.
type Columns = [[i64; 2]; 2];

/// Returns the regions of all parts.
///
/// # Errors
///
/// Regions that overlap.
fn regions_of(parts: &[(Option<MapPath>, RemapPart)]) -> Result<Vec<Columns>> {
    let regions: Vec<Columns> =
        parts.iter().map(|(_, RemapPart { region: [min, max], .. })| columns_of(*min, *max)).collect();
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

/// Returns whether disjoint regions cover all columns of tiles of a box.
fn are_covered(tiles: TileBox, regions: &[Columns]) -> bool {
    let wanted = columns_of(tiles.min().to_array(), tiles.max().to_array());
    regions.iter().map(|region| common_columns(region, &wanted)).sum::<i128>()
        >= common_columns(&wanted, &wanted)
}

/// New poses by the number of the scan.
struct Moves {
    poses: FxHashMap<u64, NewPose>,
    /// Whether so many scans move that all tiles are replayed.
    are_most: bool,
}

fn moves(scans: &KeptSummary, poses: &NewPoses, how: &Remap) -> Result<(Moves, TileStore)> {
    let (_, changes) = Remapped::by_poses(scans, poses, how)?;
    scans.check_marks(|_| false)?;
    let (disk, folder) = scans.place();
    let store = TileStore::open_read_only(disk, folder)?;
    if store.commits().flush_number != scans.flush_number() {
        return Err(Error::Changed { path: folder.to_owned() });
    }
    let poses: FxHashMap<u64, NewPose> = changes
        .into_iter()
        .filter_map(|(number, change)| match change {
            Change::Move(pose) => Some((number, pose)),
            _ => None,
        })
        .collect();
    let (mut all, mut moved) = (0_u64, 0_u64);
    for scan in scans.scans() {
        all = all.saturating_add(scan.updates);
        moved = moved.saturating_add(if poses.contains_key(&scan.number) { scan.updates } else { 0 });
    }
    Ok((Moves { poses, are_most: moved > all / PART_FOR_ALL }, store))
}

/// The tiles of a region that moved scans touch before and after.
fn tiles_of_moved(
    moves: &Moves,
    store: &TileStore,
    scans: &KeptSummary,
    how: &Remap,
    region: TileBox,
) -> Result<FxHashSet<TileIndex>> {
    let config = how.replay.config_of(store)?;
    let (disk, _) = scans.place();
    let mut tiles = FxHashSet::default();
    let mut finder = TileFinder::new(&config, disk.clone(), how.replay.stop.clone());
    let mut records = store.archive().records()?;
    while let Some(record) = records.next_kept()? {
        how.replay.stop.check()?;
        let Some(pose) = moves.poses.get(&record.number) else { continue };
        tiles.extend(record.tiles.iter().copied().filter(|tile| region.contains(*tile)));
        if reach_of(&record, pose, &config.grid)?.intersection(region).is_none() {
            continue;
        }
        let Some(rays) = limited_to(region, &record) else { continue };
        let scan = KeptScan::open(&disk, store.layout(), record, MAX_POINTS_IN_MEMORY)?;
        tiles.extend(finder.tiles_of(&scan.with_pose(pose.clone()), &rays, store.folder())?);
    }
    Ok(tiles)
}

/// The ray settings of a scan for a region; `None` if it was never mapped there.
fn limited_to(region: TileBox, record: &KeptRecord) -> Option<RayConfig> {
    let own = record.rays.region;
    let region = own.map_or(Some(region), |own| own.intersection(region))?;
    Some(RayConfig { region: Some(region), ..record.rays })
}

/// A box around the tiles that a scan can change with a new pose: its rays are as long as before.
fn reach_of(record: &KeptRecord, new: &NewPose, grid: &Grid) -> Result<TileBox> {
    let longest_m = match record.rays.region {
        // Rays may end beyond the tiles of a region.
        Some(_) => record.rays.max_range_m.ok_or_else(|| {
            let reason = format!("scan {} was mapped into a region, without a maximum range", record.number);
            Error::argument("map", reason)
        })?,
        None => {
            let from = record.origin_m();
            let far_m = |tile: &TileIndex| {
                let edge_m = grid.tile_size_m();
                let tile = tile.to_array();
                let axis = |k: usize| {
                    let low = f64::from(tile[k]) * edge_m - from[k];
                    low.abs().max((low + edge_m).abs())
                };
                (0..3).map(|k| axis(k).powi(2)).sum::<f64>().sqrt()
            };
            // The range of a point when it was measured differs from that at the stamp by the motion between.
            let moved_m: f64 =
                [&record.sweep, &new.sweep].into_iter().flatten().map(|sweep| sweep.reach_m()).sum();
            record.tiles.iter().map(far_m).fold(0.0, f64::max) + moved_m
        }
    };
    let (position, reach_m) = (new.world_from_sensor.position_m(), longest_m + grid.resolution_m());
    let around = Aabb { min: position.map(|k| k - reach_m), max: position.map(|k| k + reach_m) };
    let voxels = grid.voxels_in(&around);
    let last = voxels.end.map(|k| k.saturating_sub(1));
    Ok(TileBox::new(grid.tile_of_voxel(voxels.min), grid.tile_of_voxel(last)))
}
