use super::map_writer::{MapWriter, WrittenMap};
use super::merge_rule::{MergeRule, Prefer};
use super::regions::OneBuild;
use super::table_merge::TableMerge;
use crate::config::MapConfig;
use crate::error::{Error, Result, beginning_or_difference};
use crate::mapper::{MapReader, MapView, TileRef};
use crate::persistence::{new_map_id, new_metadata};
use crate::space::TileIndex;
use crate::tile::Table;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// What a merge did.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Merged {
    /// The map that it made.
    #[serde(flatten)]
    pub written: WrittenMap,
    /// Voxels that two maps or more know.
    pub common_voxels: u64,
    /// Maps that are the same or go back to the same map, by their places in the list, the earlier one first: what they
    /// have in common is in both.
    pub related: Vec<(usize, usize)>,
    /// Whether evidence was added, so that what related maps have in common counts twice.
    pub is_added: bool,
    /// Whether the maps are regions of one build, which can go on with the new map: that has their scans.
    pub is_one_build: bool,
}

/// Makes one map of several: of a voxel that one map knows its evidence, of one that several know what `prefer` says.
///
/// Without a preference log-odds are added, in the order of the maps, and clamped once; counts are added, too. That is
/// what one map of all scans would have, but for the clamps on the way and the order of additions. It takes maps of the
/// model [`LogOdds`](crate::sensor::LogOdds) with equal parameters, because evidence of the other model depends on what
/// was there before, unless no tile is in two maps. With a preference any models go together; sensor model, occupancy
/// threshold and storage are those of the first map.
///
/// The new map has an id of its own and no scans, unless the maps are regions of one build
/// ([`RayConfig::region`](crate::RayConfig)) that together are a box: then it is what one build of that box would
/// be, which goes on with it. It is there as a whole or not at all, see [`MapWriter`]; it is made
/// on the disk of the first. `progress` is told the tiles done and all.
///
/// # Errors
///
/// Fewer than two maps, maps of different grids, maps that do not go together without a preference, a damaged tile, an
/// output with other content, a disk that refuses.
pub fn merge(
    maps: &[MapReader],
    output: impl AsRef<Path>,
    prefer: Option<Prefer>,
    mut progress: impl FnMut(u64, u64),
) -> Result<Merged> {
    let [first, .., _] = maps else {
        return Err(Error::argument("maps", "name two maps or more to be merged"));
    };
    let mut config = first.config().clone();
    if maps.iter().any(|map| map.config().rays.region != config.rays.region) {
        config.rays.region = None;
    }
    maps.iter().try_for_each(|map| check_grid(map, first))?;
    config.crs = common_crs(maps)?;
    let rule = rule_for(maps, first, prefer)?;
    let one_build = OneBuild::of(maps)?;
    let mut writer = begin(first, output.as_ref(), config, one_build, new_map_id())?;
    let tiles: BTreeSet<TileIndex> = maps.iter().flat_map(MapView::tile_indices).collect();
    let mut merge = TableMerge::new(rule);
    for (done, &tile) in (0..).zip(&tiles) {
        progress(done, tiles.len() as u64);
        put_merged(&mut writer, &mut merge, rule, maps, tile)?;
    }
    progress(tiles.len() as u64, tiles.len() as u64);
    let written = writer.finish()?;
    let is_added = matches!(rule, MergeRule::Add { .. });
    Ok(Merged {
        written,
        common_voxels: merge.common,
        related: related(maps),
        is_added,
        is_one_build: one_build.is_some(),
    })
}

/// What becomes of voxels that several maps know. With no tile in common there is nothing to prefer, as with maps of
/// regions.
fn rule_for(maps: &[MapReader], first: &MapReader, prefer: Option<Prefer>) -> Result<MergeRule> {
    let model = &first.config().sensor_model;
    let checked = match prefer {
        Some(_) => Ok(()),
        None => maps.iter().try_for_each(|map| check_model(map, first)),
    };
    let rule = checked.and_then(|()| {
        MergeRule::of(first.config(), prefer).ok_or_else(|| {
            let reason = format!(
                "the maps' sensor model is {}, whose evidence does not add up: say which map's voxels to take with \
                 `prefer` first, last or more-observed",
                model.name()
            );
            Error::argument("maps", reason)
        })
    });
    rule.or_else(|error| match have_no_common_tile(maps) {
        true => Ok(MergeRule::Take(Prefer::First)),
        false => Err(error),
    })
}

/// Begins the map of several, of which `first` is one: without scans, or as one build of all would have made it.
pub(super) fn begin(
    first: &MapReader,
    output: &Path,
    mut config: MapConfig,
    one_build: Option<OneBuild>,
    map_id: [u8; 16],
) -> Result<MapWriter> {
    let Some(build) = one_build else {
        return MapWriter::create_as(first.disk(), output, new_metadata(&config.validated()?, map_id, &[]));
    };
    config.rays.region = build.region;
    let part = first.metadata().ext.as_ref();
    let inputs = part.map_or(Vec::new(), |ext| ext.inputs.clone());
    let inputs: Vec<_> = inputs.into_iter().map(|input| input.with_region(build.region)).collect();
    let mut metadata = new_metadata(&config, map_id, &inputs);
    if let (Some(ext), Some(part)) = (&mut metadata.ext, part) {
        (ext.scan_number, ext.decayed_scan) = (part.scan_number, part.decayed_scan);
    }
    let mut writer = MapWriter::create_as(first.disk(), output, metadata)?;
    writer.take_scans_of(first)?;
    Ok(writer)
}

/// Whether every tile is in one map only.
pub(super) fn have_no_common_tile(maps: &[MapReader]) -> bool {
    let mut seen = BTreeSet::new();
    maps.iter().flat_map(MapView::tile_indices).all(|tile| seen.insert(tile))
}

/// The coordinate reference system of maps, if one names it. What is in one place in one system is elsewhere in another;
/// a map that names none goes with any.
pub(super) fn common_crs<'a>(maps: impl IntoIterator<Item = &'a MapReader>) -> Result<Option<String>> {
    maps.into_iter().try_fold(None, with_crs_of)
}

/// The coordinate reference system of some maps, and of one more.
pub(super) fn with_crs_of(common: Option<String>, map: &MapReader) -> Result<Option<String>> {
    match (common, &map.config().crs) {
        (Some(wanted), Some(found)) if *found != wanted => {
            let (found, wanted) =
                (beginning_or_difference(found, &wanted), beginning_or_difference(&wanted, found));
            let what = "the coordinate reference system";
            Err(Error::Mismatch { path: map.folder().to_owned(), what, found, wanted })
        }
        (common, found) => Ok(common.or_else(|| found.clone())),
    }
}

fn put_merged(
    writer: &mut MapWriter,
    merge: &mut TableMerge,
    rule: MergeRule,
    maps: &[MapReader],
    tile: TileIndex,
) -> Result<()> {
    let found = maps.iter().map(|map| map.tile_uncached(tile));
    let found: Vec<TileRef<'_>> = found.filter_map(Result::transpose).collect::<Result<_>>()?;
    let tables: Vec<&Table> = found.iter().map(|tile| tile.table()).collect();
    match tables[..] {
        [only] if is_left_alone(only, rule) => writer.put(tile, only),
        _ => writer.put(tile, &merge.merge(&tables)),
    }
}

/// Whether the rule leaves the voxels as they are that only this table has. Log-odds beyond the clamps come from other
/// programs only.
fn is_left_alone(table: &Table, rule: MergeRule) -> bool {
    match rule {
        MergeRule::Take(_) => true,
        MergeRule::Add { min, max } => {
            table.iter().all(|(_, evidence)| min <= evidence.log_odds && evidence.log_odds <= max)
        }
    }
}

pub(super) fn check_grid(map: &MapReader, first: &MapReader) -> Result<()> {
    let (grid, first_grid) = (&map.config().grid, &first.config().grid);
    for (what, found, wanted) in [
        ("resolution", grid.resolution_m(), first_grid.resolution_m()),
        ("tile size", grid.tile_size_m(), first_grid.tile_size_m()),
    ] {
        if found.to_bits() != wanted.to_bits() {
            let (found, wanted) =
                (format!("{found} m"), format!("{wanted} m as {}", first.folder().display()));
            return Err(Error::Mismatch { path: map.folder().to_owned(), what, found, wanted });
        }
    }
    Ok(())
}

/// Whether evidence of a map can be added to that of the first.
pub(super) fn check_model(map: &MapReader, first: &MapReader) -> Result<()> {
    let (config, wanted) = (map.config(), first.config());
    let first = first.folder().display();
    let what = if !map.is_verified() {
        "it is of the original format, which does not tell the sensor model".to_owned()
    } else if config.sensor_model != wanted.sensor_model {
        format!("its sensor model is {}, that of {first} is {}", config.sensor_model, wanted.sensor_model)
    } else if config.occupancy_threshold != wanted.occupancy_threshold {
        let (found, wanted) = (config.occupancy_threshold, wanted.occupancy_threshold);
        format!("its voxels are occupied from probability {found}, those of {first} from {wanted}")
    } else {
        return Ok(());
    };
    let hint = "so that evidence does not add up: say which map's voxels to take with `prefer` first, last or more-observed";
    Err(Error::argument(map.folder().display().to_string(), format!("{what}, {hint}")))
}

fn related(maps: &[MapReader]) -> Vec<(usize, usize)> {
    let pairs = (0..maps.len()).flat_map(|later| (0..later).map(move |earlier| (earlier, later)));
    let is_related = |&(earlier, later): &(usize, usize)| {
        let (a, b): (&MapReader, &MapReader) = (&maps[earlier], &maps[later]);
        a.map_id().is_some() && a.map_id() == b.map_id()
    };
    pairs.filter(is_related).collect()
}
