use std::fs;
use std::path::Path;
use voxtile_formats::write::{OutputFormat, OutputFormats, RowLayers, VoxelRow, VoxelsHead, WriteOptions};

/// Number of voxels written by [`write_voxels`].
pub const VOXELS: i32 = 30;

/// Returns a voxel of half a metre.
pub fn voxel(k: i32) -> VoxelRow {
    let index = [k, 7 * k, -k];
    VoxelRow {
        index,
        center_m: index.map(|k| f64::from(k) * 0.5 + 0.25),
        probability: 0.9,
        log_odds: 2.0,
        observation_count: k,
        tile: [0; 3],
        layers: RowLayers::default(),
    }
}

/// Returns the format with this name.
pub fn format_of(name: &str) -> OutputFormat {
    *OutputFormats::default().of_name(name).unwrap()
}

/// Writes voxels 0 to [`VOXELS`] - 1.
pub fn write_voxels(format: &str, path: &Path, crs: Option<&str>) {
    let [first, last] = [voxel(0), voxel(VOXELS - 1)].map(|row| row.center_m);
    let bound = |pick: fn(f64, f64) -> f64| std::array::from_fn(|k| pick(first[k], last[k]));
    let head = VoxelsHead {
        voxels: VOXELS as u64,
        resolution_m: 0.5,
        bounds_m: [bound(f64::min), bound(f64::max)],
        occupied_log_odds: 0.0,
        layers: voxtile::Layers::NONE,
    };
    let options = WriteOptions { crs: crs.map(str::to_owned), ..WriteOptions::for_path(path) };
    let mut sink = format_of(format).open(&head, path, &options).unwrap();
    (0..VOXELS).for_each(|k| sink.put(&voxel(k)).unwrap());
    sink.finish().unwrap();
}

/// Returns the bytes of a file from [`write_voxels`].
pub fn voxel_file(format: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a").with_extension(format_of(format).extension.unwrap());
    write_voxels(format, &path, Some("LOCAL_CS[\"hall\",UNIT[\"metre\",1]]"));
    fs::read(path).unwrap()
}
