use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use testkit::faulty_disk::FaultyDisk;
use voxtile::integrity::{Finding, Severity, verify};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{Replay, snapshots};
use voxtile::store::SnapshotName;
use voxtile::{
    Digest, Error, Layers, MapConfig, MapPath, MapQueries, MapReader, MemoryLimit, OutOfCoreTileMapper,
    Result,
};

/// Folder of the map.
pub fn map() -> &'static Path {
    Path::new("/city/map")
}

/// The map on a disk.
pub fn at(disk: &FaultyDisk) -> MapPath {
    MapPath::on(disk.shared(), map())
}

pub fn name(name: &str) -> SnapshotName {
    SnapshotName::new(name).unwrap()
}

/// A map of few voxels, with memory for two tiles and a tiny write buffer: every scan evicts tiles.
pub fn config() -> MapConfig {
    MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_cache_tiles(2).with_write_buffer_bytes(600)
}

/// The same map with kept scans.
pub fn keeping_scans() -> MapConfig {
    config().with_range(0.3, 3.0).with_kept_scans(true)
}

pub fn all_layers() -> Layers {
    Layers { colour: true, intensity_max: Some(255.0), class: true, time: true, shape: true }
}

/// Replays kept scans with the minimum of memory.
pub fn replay() -> Replay {
    Replay::default().with_memory(MemoryLimit::Bytes(MemoryLimit::min_bytes(&config().grid)))
}

/// Opens the map, or creates it.
pub fn open_or_create(disk: &FaultyDisk, config: &MapConfig) -> Result<OutOfCoreTileMapper> {
    match OutOfCoreTileMapper::open(at(disk), config.clone()) {
        Err(Error::NoMap { .. }) => OutOfCoreTileMapper::create(at(disk), config.clone()),
        opened => opened,
    }
}

/// Reads the summary of kept scans that replays need.
pub fn scans(disk: &FaultyDisk) -> Result<KeptSummary> {
    KeptSummary::read(at(disk))
}

/// Returns the digest of the map, or of a snapshot.
pub fn digest_of(disk: &FaultyDisk, snapshot: Option<&str>) -> Result<Digest> {
    match snapshot {
        Some(of) => MapReader::open_snapshot(at(disk), &name(of), 1 << 20)?.digest(),
        None => MapReader::open(at(disk), 1 << 20)?.digest(),
    }
}

/// Returns the sorted names of the snapshots.
pub fn snapshot_names(disk: &FaultyDisk) -> Vec<String> {
    let mut names: Vec<_> = snapshots(at(disk)).unwrap().into_iter().map(|info| info.name).collect();
    names.sort_unstable();
    names
}

/// Returns the damaged files of the map.
pub fn damage_in(disk: &FaultyDisk) -> BTreeSet<PathBuf> {
    let mut damaged = BTreeSet::new();
    let found = |finding: &Finding| {
        if finding.severity == Severity::Damage {
            damaged.insert(finding.path.clone());
        }
    };
    verify(at(disk), found, |_, _| ()).unwrap();
    damaged
}

/// Whether verification finds no damage.
pub fn is_whole(disk: &FaultyDisk) -> bool {
    verify(at(disk), |_| (), |_, _| ()).unwrap().is_whole()
}

/// Converts a map of `octomap` storage with voxels of 0.4 m to the original format, by removing the files that voxtile
/// adds.
pub fn make_foreign(disk: &FaultyDisk, folder: &Path) {
    for name in ["commits.log", "snapshots", "scans.bin"] {
        disk.take(&folder.join(name));
    }
    let metadata = br#"{"version": "1.0", "resolution": 0.4, "tile_size": 3.2, "bounds": {"min": [0,0,0], "max": [0,0,0]}}"#;
    disk.put(&folder.join("metadata.json"), metadata);
    for (path, bytes) in disk.files().into_iter().filter(|(path, _)| path.starts_with(folder)) {
        if path.ends_with("iwlo_meta.bin") {
            let count = u64::from_le_bytes(bytes[8..16].try_into().unwrap()) as usize;
            disk.put(&path, &bytes[..16 + 18 * count]);
        } else if path.to_string_lossy().contains(".flush") {
            disk.take(&path);
        }
    }
}
