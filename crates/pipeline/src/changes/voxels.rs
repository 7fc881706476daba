use crate::output::StagedOutput;
use std::path::Path;
use voxtile::mapper::MapView;
use voxtile::{Error, Layers, Result};
use voxtile_compare::{CompareOptions, ComparedVoxel, Comparison, VoxelClass, for_each_voxel};
use voxtile_formats::write::{OutputFormat, OutputFormats, RowLayers, VoxelRow, VoxelsHead, WriteOptions};

/// Formats that store the class of a voxel.
const FORMATS: [&str; 6] = ["las", "laz", "copc", "ply", "csv", "parquet"];

/// Selection of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhichChanges {
    /// Those of listed changes.
    Listed,
    /// All occupied voxels of both maps.
    All,
}

/// Class of a voxel in files: 64 and more, which LAS leaves to users.
pub fn class_code(class: VoxelClass) -> u8 {
    64 + class as u8
}

fn colour(class: VoxelClass) -> [u8; 3] {
    match class {
        VoxelClass::Unchanged => [160, 160, 160],
        VoxelClass::Appeared => [44, 160, 44],
        VoxelClass::Vanished => [214, 39, 40],
        VoxelClass::NotSeenBefore => [158, 202, 225],
        VoxelClass::NotSeenAfter => [31, 119, 180],
        VoxelClass::UncertainAppeared => [199, 233, 160],
        VoxelClass::UncertainVanished => [253, 174, 107],
        VoxelClass::HiddenBefore => [188, 189, 220],
        VoxelClass::HiddenAfter => [117, 107, 177],
    }
}

/// Returns the format of a file of changed voxels.
///
/// # Errors
///
/// The extension is unknown, the format cannot store classes, or this build does not support it.
pub fn changes_format(output: &Path) -> Result<OutputFormat> {
    let formats = OutputFormats::default();
    match formats.of_path(output).filter(|format| FORMATS.contains(&format.name)) {
        Some(format) => format.check_built().map(|()| *format),
        None => {
            let known: Vec<String> = FORMATS
                .iter()
                .filter_map(|name| Some(format!(".{}", formats.of_name(name)?.extension?)))
                .collect();
            let reason = format!("{}: voxels with classes are {}", output.display(), known.join(" "));
            Err(Error::argument("output", reason))
        }
    }
}

/// Writes voxels of two maps with the class and colour of their change; log-odds and counts are those of the map in
/// which they are occupied.
///
/// # Errors
///
/// The format is unsuitable, a map cannot be read, or the file cannot be written.
#[allow(clippy::too_many_arguments)]
pub fn write_changed_voxels<A: MapView, B: MapView>(
    before: &A,
    after: &B,
    options: &CompareOptions,
    comparison: &Comparison,
    which: WhichChanges,
    output: &Path,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> anyhow::Result<u64> {
    let format = changes_format(output)?;
    let (classes, voxels) = match which {
        WhichChanges::Listed => (
            &[VoxelClass::Appeared, VoxelClass::Vanished][..],
            comparison.appeared.voxels + comparison.vanished.voxels,
        ),
        WhichChanges::All => (
            &VoxelClass::ALL[..],
            comparison.before.occupied - comparison.before.unchanged + comparison.after.occupied,
        ),
    };
    let grid = before.config().grid;
    let head = VoxelsHead {
        voxels,
        resolution_m: grid.resolution_m(),
        bounds_m: bounds_m(before, after),
        occupied_log_odds: before.config().occupied_log_odds(),
        layers: Layers { colour: true, class: true, ..Layers::NONE },
    };
    let staged = StagedOutput::beside(output)?;
    let mut how = WriteOptions::for_path(output);
    how.companion_folder = staged.folder().to_owned();
    how.crs = before.config().crs.clone().or_else(|| after.config().crs.clone());
    let mut sink = format.open(&head, &staged.path()?, &how)?;
    let put = |ComparedVoxel { index, class, change }: ComparedVoxel| {
        if which == WhichChanges::Listed && change.is_none() {
            return Ok(());
        }
        let evidence = if class.is_of_earlier() { before.evidence(index)? } else { after.evidence(index)? };
        sink.put(&VoxelRow {
            index,
            center_m: grid.center_m(index),
            probability: evidence.map_or(0.5, |evidence| evidence.probability()),
            log_odds: evidence.map_or(0.0, |evidence| evidence.log_odds),
            observation_count: evidence.map_or(0, |evidence| evidence.observation_count),
            tile: grid.tile_of_voxel(index).to_array(),
            layers: RowLayers {
                colour: Some(colour(class)),
                class: Some(class_code(class)),
                ..RowLayers::default()
            },
        })
    };
    for_each_voxel(before, after, options, comparison, classes, put, progress)?;
    sink.finish()?;
    staged.finish()?;
    Ok(voxels)
}

/// Box around the tiles of both maps, in metres.
fn bounds_m(before: &impl MapView, after: &impl MapView) -> [[f64; 3]; 2] {
    let all = [corners_m(before), corners_m(after)];
    let union = |a: [[f64; 3]; 2], b: [[f64; 3]; 2]| {
        [std::array::from_fn(|k| a[0][k].min(b[0][k])), std::array::from_fn(|k| a[1][k].max(b[1][k]))]
    };
    all.into_iter().flatten().reduce(union).unwrap_or_default()
}

/// Corners of the box around the tiles of a map, in metres; `None` for an empty map.
fn corners_m(map: &impl MapView) -> Option<[[f64; 3]; 2]> {
    let grid = map.config().grid;
    let voxels = grid.voxels_of_tiles(map.tile_bounds()?);
    Some([voxels.min, voxels.end].map(|corner| corner.map(|k| f64::from(k) * grid.resolution_m())))
}
