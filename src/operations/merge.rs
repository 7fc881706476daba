use super::appended_scans::append_scans;
use super::map_writer::{MapWriter, WrittenMap};
use super::merge_rule::{MergeRule, Prefer};
use super::regions::OneBuild;
use super::table_merge::TableMerge;
use super::united_scans::{Part, unite_scans};
use crate::config::MapConfig;
use crate::error::{Error, Result, beginning_or_difference};
use crate::mapper::{MapReader, MapView, TileRef};
use crate::persistence::{new_map_id, new_metadata};
use crate::space::TileIndex;
use crate::tile::Table;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// Result of [`merge`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Merged {
    /// The new map.
    #[serde(flatten)]
    pub written: WrittenMap,
    /// Number of voxels that are observed in two or more maps.
    pub common_voxels: u64,
    /// Pairs of maps that are the same or share history, as indices with the lower one first. Both contain their common
    /// evidence.
    pub related: Vec<(usize, usize)>,
    /// Whether evidence was added, so that common evidence of related maps counts twice.
    pub is_added: bool,
    /// Whether the maps are regions of one build, which the new map can resume because it has their scans.
    pub is_one_build: bool,
    /// Whether the new map keeps the scans of all maps.
    pub keeps_scans: bool,
}

/// Merges maps. A voxel that one map has observed keeps its evidence; for a voxel that several have observed, `prefer`
/// decides.
///
/// Without `prefer`, log-odds are added in the order of the maps and clamped once, and counts are added. The result is
/// that of one map of all scans, apart from intermediate clamping and the order of additions. This requires equal
/// parameters, and the model [`LogOdds`](crate::sensor::LogOdds) without guarded clearing: otherwise an update depends
/// on earlier evidence in the same map. Maps without a common tile need neither this nor `prefer`. With `prefer` the
/// sensor models may differ. Sensor model, occupancy threshold and storage are those of the first map.
///
/// The new map has its own id. If the maps are regions of one build ([`RayConfig::region`](crate::RayConfig)) that
/// together form a box, the result equals one build of that box and can be resumed. If all maps keep their scans, the
/// new map keeps those of regions, or of unrelated maps of all of space one after the other if their evidence is added or
/// they have no common tile; else it has no scans. The maps must have the same layers, which are combined like the evidence: added,
/// or those of the preferred map. The map is created on the disk of the first map, and appears only when it is complete,
/// see [`MapWriter`]. `progress` receives the number of tiles done and in total.
///
/// # Errors
///
/// Fewer than two maps, maps with different grids, maps that need `prefer`, a damaged tile, an output with other
/// content, or an I/O error.
pub fn merge(
    maps: &[MapReader],
    output: impl AsRef<Path>,
    prefer: Option<Prefer>,
    mut progress: impl FnMut(u64, u64),
) -> Result<Merged> {
    let [first, .., _] = maps else {
        return Err(Error::argument("maps", "name at least two maps"));
    };
    let mut config = first.config().clone();
    if maps.iter().any(|map| map.config().rays.region != config.rays.region) {
        config.rays.region = None;
    }
    maps.iter().try_for_each(|map| check_grid(map, first).and_then(|()| check_layers(map, first)))?;
    config.crs = common_crs(maps)?;
    let rule = rule_for(maps, first, prefer)?;
    let one_build = OneBuild::of(maps)?;
    let mut writer = begin(first, output.as_ref(), config, one_build, new_map_id())?;
    let related = related(maps);
    let is_added = matches!(rule, MergeRule::Add { .. });
    let are_all_kept = maps.iter().all(MapReader::keeps_scans);
    // Regions of different builds have common scans. Without a sum of evidence, it is not that of all scans.
    let are_apart = related.is_empty() && maps.iter().all(|map| map.config().rays.region.is_none());
    let is_of_all_scans = one_build.is_some() || are_apart && (is_added || have_no_common_tile(maps));
    let keeps_scans = are_all_kept && is_of_all_scans;
    match one_build {
        Some(build) if keeps_scans => {
            unite_scans(&mut writer, maps.iter().map(Part::open).collect(), build.region, true)?;
        }
        None if keeps_scans => append_scans(&mut writer, maps)?,
        _ => {}
    }
    let tiles: BTreeSet<TileIndex> = maps.iter().flat_map(MapView::tile_indices).collect();
    let mut merge = TableMerge::new(rule);
    for (done, &tile) in (0..).zip(&tiles) {
        progress(done, tiles.len() as u64);
        put_merged(&mut writer, &mut merge, rule, maps, tile)?;
    }
    progress(tiles.len() as u64, tiles.len() as u64);
    let written = writer.finish()?;
    Ok(Merged {
        written,
        common_voxels: merge.common,
        related,
        is_added,
        is_one_build: one_build.is_some(),
        keeps_scans,
    })
}

/// Returns the rule for voxels that several maps have observed. Maps without a common tile, such as regions, need no
/// preference.
fn rule_for(maps: &[MapReader], first: &MapReader, prefer: Option<Prefer>) -> Result<MergeRule> {
    let model = &first.config().sensor_model;
    let checked = match prefer {
        Some(_) => Ok(()),
        None => maps.iter().try_for_each(|map| check_model(map, first)),
    };
    let rule = checked.and_then(|()| {
        MergeRule::of(first.config(), prefer).ok_or_else(|| {
            let cause = match first.config().rays.clearing().guard() {
                Some(_) => "the maps have guarded clearing".to_owned(),
                None => format!("the maps' sensor model is {}", model.name()),
            };
            let reason = format!(
                "{cause}, whose evidence cannot be added: select the map of common voxels with `prefer` first, last \
                 or more-observed"
            );
            Error::argument("maps", reason)
        })
    });
    rule.or_else(|error| match have_no_common_tile(maps) {
        true => Ok(MergeRule::Take(Prefer::First)),
        false => Err(error),
    })
}

/// Begins the merged map: without scans, or as one build of all regions would have created it.
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

pub(super) fn have_no_common_tile(maps: &[MapReader]) -> bool {
    let mut seen = BTreeSet::new();
    maps.iter().flat_map(MapView::tile_indices).all(|tile| seen.insert(tile))
}

/// Returns the common coordinate reference system of maps, if one has any. Different systems are an error, because
/// coordinates would not match. A map without a system matches any.
pub(super) fn common_crs<'a>(maps: impl IntoIterator<Item = &'a MapReader>) -> Result<Option<String>> {
    maps.into_iter().try_fold(None, with_crs_of)
}

/// Combines a common coordinate reference system with that of another map.
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

/// Returns whether the rule leaves a table unchanged if no other map has its tile. `Add` clamps log-odds beyond the
/// limits, which only maps of other programs contain.
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

/// Checks that a map has the layers of the first.
pub(super) fn check_layers(map: &MapReader, first: &MapReader) -> Result<()> {
    let (found, wanted) = (map.config().layers(), first.config().layers());
    if found == wanted {
        return Ok(());
    }
    let wanted = format!("{wanted} as {}", first.folder().display());
    Err(Error::Mismatch { path: map.folder().to_owned(), what: "layers", found: found.to_string(), wanted })
}

/// Checks that evidence of a map can be added to that of the first.
pub(super) fn check_model(map: &MapReader, first: &MapReader) -> Result<()> {
    let (config, wanted) = (map.config(), first.config());
    let first = first.folder().display();
    let what = if !map.is_verified() {
        "it has the original format, which does not contain the sensor model".to_owned()
    } else if config.sensor_model != wanted.sensor_model {
        format!("its sensor model is {}, that of {first} is {}", config.sensor_model, wanted.sensor_model)
    } else if config.occupancy_threshold != wanted.occupancy_threshold {
        let (found, wanted) = (config.occupancy_threshold, wanted.occupancy_threshold);
        format!("its occupancy threshold is {found}, that of {first} is {wanted}")
    } else if config.rays.clearing() != wanted.rays.clearing() {
        let (found, wanted) = (config.rays.clearing(), wanted.rays.clearing());
        format!("its rule of clearing is {found}, that of {first} is {wanted}")
    } else {
        return Ok(());
    };
    let hint = "so evidence cannot be added: select the map of common voxels with `prefer` first, last or \
                more-observed";
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
