use crate::temporary_map;
use voxtile::mapper::{KeptScan, KeptScans};
use voxtile::scan::Stop;
use voxtile::store::{KeptRecord, StagedMap};
use voxtile::{MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper, Queries, Result};

/// Temporary map of the kept scans in reverse order, as if none were marked. It calls a voxel free that was seen through
/// before something came and stayed to the end, or was last seen there.
pub(crate) type ReversedMap = StagedMap<OutOfCoreTileMapper>;

/// Builds the map. `progress` receives the number of scans done.
///
/// # Errors
///
/// A running search of this map, damage, an I/O error, or a request to stop.
pub(crate) fn reversed_map(
    map: &MapReader,
    memory_bytes: usize,
    stop: &Stop,
    mut progress: impl FnMut(u64),
) -> Result<ReversedMap> {
    let (mut scans, mut records) = (map.kept_scans()?, Vec::new());
    while let Some(record) = scans.next_record()? {
        stop.check()?;
        records.push(without_tiles_and_marks(record));
    }
    let memory_bytes = memory_bytes.max(MemoryLimit::min_bytes(&map.grid()));
    let config = map.config().clone().with_kept_scans(false).with_memory_bytes(memory_bytes);
    let mut reversed = temporary_map::begin(map, "reversed", config)?;
    reversed.writer().stop_with(stop.clone());
    for (done, record) in records.into_iter().rev().enumerate() {
        stop.check()?;
        progress(done as u64);
        insert(reversed.writer(), &scans, record)?;
    }
    Ok(reversed)
}

/// Tiles are most of the memory of a record.
fn without_tiles_and_marks(record: KeptRecord) -> KeptRecord {
    KeptRecord { tiles: Vec::new(), moving: None, ..record }
}

fn insert(mapper: &mut OutOfCoreTileMapper, scans: &KeptScans, record: KeptRecord) -> Result<()> {
    let scan: KeptScan = scans.open(record)?;
    mapper.set_rays(*scan.rays())?;
    mapper.insert_points(&scan)?;
    Ok(())
}
