use crate::temporary_map;
use voxtile::mapper::KeptScans;
use voxtile::scan::Stop;
use voxtile::space::Grid;
use voxtile::store::{KeptRecord, StagedMap};
use voxtile::{MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper, Result};

/// Edge of a tile in voxels. Small tiles need little memory.
const VOXELS_PER_EDGE: i32 = 64;

/// Temporary map of kept scans as if none were marked.
pub(crate) type ScanMap = StagedMap<OutOfCoreTileMapper>;

/// Order in which scans are mapped: the last ones decide whether a voxel is free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// As in the map itself.
    Forward,
    /// The map calls a voxel free that was seen through before something came.
    Reverse,
}

impl Order {
    fn name(self) -> &'static str {
        match self {
            Self::Forward => "unmarked",
            Self::Reverse => "reversed",
        }
    }
}

/// Builds the map of the kept scans of another map. `progress` receives the number of scans done.
///
/// # Errors
///
/// A running search of this map, damage, an I/O error, or a request to stop.
pub(crate) fn scan_map(
    map: &MapReader,
    order: Order,
    memory_bytes: usize,
    stop: &Stop,
    mut progress: impl FnMut(u64),
) -> Result<ScanMap> {
    let (mut scans, mut records) = (map.kept_scans()?, Vec::new());
    while let Some(record) = scans.next_record()? {
        stop.check()?;
        records.push(without_tiles_and_marks(record));
    }
    if order == Order::Reverse {
        records.reverse();
    }
    let mut config = map.config().clone().with_kept_scans(false);
    // A region consists of tiles of the map.
    if config.rays.region.is_none() && config.grid.voxels_per_tile_edge() > VOXELS_PER_EDGE {
        let resolution_m = config.grid.resolution_m();
        config.grid = Grid::new(resolution_m, f64::from(VOXELS_PER_EDGE) * resolution_m)?;
    }
    let memory_bytes = memory_bytes.max(MemoryLimit::min_bytes(&config.grid));
    let mut made = temporary_map::begin(map, order.name(), config.with_memory_bytes(memory_bytes))?;
    made.writer().stop_with(stop.clone());
    for (done, record) in records.into_iter().enumerate() {
        stop.check()?;
        progress(done as u64);
        insert(made.writer(), &scans, record)?;
    }
    Ok(made)
}

/// Tiles are most of the memory of a record.
pub(crate) fn without_tiles_and_marks(record: KeptRecord) -> KeptRecord {
    KeptRecord { tiles: Vec::new(), moving: None, ..record }
}

/// Inserts a scan, into the region of the map.
pub(crate) fn insert(mapper: &mut OutOfCoreTileMapper, scans: &KeptScans, record: KeptRecord) -> Result<()> {
    let scan = scans.open(record)?;
    let mut rays = *scan.rays();
    rays.region = mapper.config().rays.region;
    mapper.set_rays(rays)?;
    mapper.insert_points(&scan)?;
    Ok(())
}
