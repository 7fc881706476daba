use super::ComparedMap;
use crate::map_at::AnyMap;
use std::path::Path;
use voxtile::space::VoxelBox;
use voxtile::store::{Extension, InputRecord};
use voxtile::{Clearing, Error, Result, beginning_or_difference};

/// Checks that two maps do not name different coordinate reference systems, and returns the common one.
///
/// # Errors
///
/// The systems differ.
pub fn check_crs<'a>(maps: [impl Into<ComparedMap<'a>>; 2]) -> Result<Option<String>> {
    let maps: [ComparedMap<'a>; 2] = maps.map(Into::into);
    let [before, after] = maps.map(|map| map.config.crs.clone());
    if let (Some(wanted), Some(found)) = (&before, &after)
        && wanted != found
    {
        let (path, what) = (maps[1].path.to_owned(), "the coordinate reference system");
        let (found, wanted) =
            (beginning_or_difference(found, wanted), beginning_or_difference(wanted, found));
        return Err(Error::Mismatch { path, what, found, wanted });
    }
    Ok(before.or(after))
}

/// Returns what makes the changes between two maps doubtful, the gravest first.
pub fn warnings_of<'a>(maps: [impl Into<ComparedMap<'a>>; 2]) -> Vec<String> {
    let mut warnings = Vec::new();
    let maps: [ComparedMap<'a>; 2] = maps.map(Into::into);
    let [before, after] = maps;
    if common(before, after).is_none() {
        let [before, after] = [before.path, after.path].map(Path::display);
        warnings.push(format!(
            "{before} and {after} have no place in common: all voxels are not seen in the other map; check that both \
             have the same frame"
        ));
    }
    if let [Some(of_before), Some(of_after)] = [before.extension, after.extension] {
        if of_before.map_id == of_after.map_id {
            warnings.push(format!(
                "both are states of one map, so the later one contains the evidence of {}: a change appears only when \
                 later scans outweigh it",
                before.path.display()
            ));
        } else if let Some(name) = common_input(of_before, of_after) {
            warnings.push(format!("both maps contain scans of {name}, so their evidence is not independent"));
        }
    }
    for map in maps {
        if map.config.rays.clearing() == Clearing::Octomap {
            warnings.push(format!(
                "{} was made with OctoMap's rule of clearing, by which passing rays erase surfaces: these look vanished; \
                 build it with `--clearing guarded`",
                map.path.display()
            ));
        }
    }
    if before.config.crs.is_some() != after.config.crs.is_some() {
        warnings.push(
            "only one of the maps names a coordinate reference system; the other is taken to have it too"
                .into(),
        );
    }
    warnings
}

/// Returns the common part of the boxes around the tiles of two maps of one resolution; `None` if it is empty.
pub fn common_voxels(before: &AnyMap, after: &AnyMap) -> Option<VoxelBox> {
    let unnamed = Path::new("");
    common((unnamed, before).into(), (unnamed, after).into())
}

fn common(before: ComparedMap<'_>, after: ComparedMap<'_>) -> Option<VoxelBox> {
    let voxels = |map: ComparedMap<'_>| Some(map.config.grid.voxels_of_tiles(map.tile_bounds?));
    let common = voxels(before)?.intersection(&voxels(after)?);
    (!common.is_empty()).then_some(common)
}

/// Returns the name of an input that begins with the same scan in both maps.
fn common_input<'a>(before: &Extension, after: &'a Extension) -> Option<&'a str> {
    let first_scan = |input: &InputRecord| input.content.as_ref()?.begins_with.clone();
    let of_before: Vec<String> = before.inputs.iter().filter_map(first_scan).collect();
    let is_common = |input: &&InputRecord| first_scan(input).is_some_and(|scan| of_before.contains(&scan));
    after.inputs.iter().find(is_common).map(|input| input.name.as_str())
}
