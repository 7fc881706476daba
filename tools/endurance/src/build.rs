use crate::case::{Case, Limit};
use crate::metered_disk::{DiskSpeed, Meter, MeteredDisk};
use crate::process_memory;
use anyhow::{Context, Result};
use report::Stopwatch;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};
use voxtile::mapper::IoCounts;
use voxtile::{InMemoryMapper, MapPath, MapQueries, MapReader, Mapper, OutOfCoreTileMapper, Scan, Storage};

/// A map to build, scan by scan and with one flush at the end.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Build {
    /// Scans and map settings.
    pub case: Case,
    pub limit: Limit,
    pub disk: DiskSpeed,
    pub storage: Storage,
    /// Number of scans that are generated or read before they are inserted one after another. The wall time excludes
    /// work that other threads do while scans are generated.
    pub scans_at_a_time: usize,
    /// Folder of the map. An existing one is replaced.
    pub folder: PathBuf,
    /// Whether the map is kept on disk.
    pub is_kept: bool,
    /// Whether the digest is computed.
    pub has_digest: bool,
    /// Whether the process may use one core only.
    pub is_on_one_core: bool,
    /// Flushes during the build, in addition to the one at the end.
    pub flushes: Option<Flushes>,
}

/// Flushes during a build.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flushes {
    /// Number of scans between two flushes; the next one begins after the previous one has ended.
    pub every_scans: usize,
    /// Interval between scans, in seconds; 0 inserts without waiting.
    pub period_s: f64,
    /// Whether scans are inserted during a flush.
    pub is_background: bool,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Built {
    /// Cost of each scan, in order.
    pub scans: Vec<ScanCost>,
    /// Wall time of the flush at the end, in seconds.
    pub flush_wall_s: f64,
    /// CPU time of the flush at the end, in seconds.
    pub flush_cpu_s: f64,
    /// Resident memory before the first scan, in bytes.
    pub start_resident_bytes: u64,
    /// Largest resident memory of the process until the end of the flush, in bytes.
    pub peak_resident_bytes: u64,
    pub tiles: u64,
    /// Bytes of the tiles in memory after the last scan.
    pub tile_bytes: u64,
    /// Bytes of the map's files after the flush.
    pub map_file_bytes: u64,
    /// Bytes read from the disk, from any file.
    pub bytes_read: u64,
    /// Bytes written to the disk, to any file.
    pub bytes_written: u64,
    /// Number of files opened or created, and of reads at a place of their own.
    pub accesses: u64,
    /// Number of syncs; files that are synced together count once.
    pub syncs: u64,
    /// Number of tiles read.
    pub loads: u64,
    /// Number of tiles written.
    pub saves: u64,
    /// The digest of the map, in hexadecimal digits; empty if not requested.
    pub digest: String,
}

/// Cost of inserting a scan.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct ScanCost {
    /// Distance that the sensor has travelled, in metres.
    pub distance_m: f64,
    /// Wall time of the insertion.
    pub wall_ms: f64,
    /// CPU time of all threads since the previous scan, without that of generating the scan.
    pub cpu_ms: f64,
    /// Resident memory of the process after the call, in bytes.
    pub resident_bytes: u64,
    /// Bytes written to the disk since the map was created.
    pub bytes_written: u64,
    /// Wall time of the flush call that followed; 0 without a flush.
    pub flush_ms: f64,
}

impl Build {
    /// Builds the map in this process.
    ///
    /// # Errors
    ///
    /// Fails if scans cannot be read, the folder cannot be replaced or the map cannot be created.
    pub fn run(self) -> Result<Built> {
        let config = self.case.config(self.limit)?.with_storage(self.storage);
        let disk = MeteredDisk::new(self.disk);
        let meter = disk.meter();
        if self.limit == Limit::InMemory {
            let mut mapper = InMemoryMapper::new(config)?;
            let mut built = self.insert_all(&mut mapper, &meter, |_, _| Ok(false))?;
            if self.has_digest {
                built.digest = mapper.digest()?.to_string();
            }
            return Ok(built);
        }
        replace_folder(&self.folder)?;
        let mut mapper = OutOfCoreTileMapper::create(MapPath::on(Arc::new(disk), &self.folder), config)?;
        let mut built = self.insert_all(&mut mapper, &meter, flush)?;
        built.map_file_bytes = file_bytes(&self.folder)?;
        drop(mapper);
        if self.has_digest {
            // Bypasses the slow disk: the digest is not part of the measurement.
            built.digest = MapReader::open(&self.folder, 0)?.digest()?.to_string();
        }
        if !self.is_kept {
            remove_folder(&self.folder)?;
        }
        Ok(built)
    }

    /// Inserts all scans. `flush` returns whether it flushed.
    fn insert_all<M: Mapper>(
        &self,
        mapper: &mut M,
        meter: &Meter,
        flush: impl Fn(&mut M, Flushes) -> Result<bool>,
    ) -> Result<Built> {
        let mut built = Built { start_resident_bytes: process_memory::resident_bytes()?, ..Built::default() };
        let mut scans = self.case.scans()?;
        let mut odometer = Odometer::default();
        let mut since_last = Stopwatch::start()?;
        let (begun, mut unflushed) = (Instant::now(), 0);
        loop {
            let some: Vec<Scan> = scans.by_ref().take(self.scans_at_a_time).collect::<Result<_>>()?;
            if some.is_empty() {
                break;
            }
            for scan in &some {
                let period_s = self.flushes.map_or(0.0, |flushes| flushes.period_s);
                let at = Duration::from_secs_f64(period_s * built.scans.len() as f64);
                thread::sleep(at.saturating_sub(begun.elapsed()));
                let others_s = since_last.stop()?.others_s;
                let stopwatch = Stopwatch::start()?;
                mapper.insert_scan(scan)?;
                let took = stopwatch.stop()?;
                since_last = Stopwatch::start()?;
                unflushed += 1;
                let mut flush_ms = 0.0;
                let mut flush_cpu_s = 0.0;
                if let Some(flushes) = self.flushes.filter(|flushes| unflushed >= flushes.every_scans) {
                    let stopwatch = Stopwatch::start()?;
                    if flush(mapper, flushes)? {
                        let took = stopwatch.stop()?;
                        (flush_ms, flush_cpu_s, unflushed) = (1e3 * took.wall_s, took.cpu_s(), 0);
                        since_last = Stopwatch::start()?;
                    }
                }
                built.scans.push(ScanCost {
                    distance_m: odometer.to(scan),
                    wall_ms: 1e3 * took.wall_s,
                    cpu_ms: 1e3 * (took.cpu_s() + others_s + flush_cpu_s),
                    resident_bytes: process_memory::resident_bytes()?,
                    bytes_written: meter.bytes_written(),
                    flush_ms,
                });
            }
        }
        built.tile_bytes = mapper.statistics().cached.bytes();
        let stopwatch = Stopwatch::start()?;
        mapper.flush()?;
        let took = stopwatch.stop()?;
        (built.flush_wall_s, built.flush_cpu_s) = (took.wall_s, took.cpu_s());
        built.peak_resident_bytes = process_memory::peak_bytes()?;
        let statistics = mapper.statistics();
        let IoCounts { loads, saves, .. } = statistics.io;
        let (bytes_read, bytes_written) = (meter.bytes_read(), meter.bytes_written());
        let (tiles, accesses, syncs) = (statistics.tiles, meter.accesses(), meter.syncs());
        Ok(Built { tiles, bytes_read, bytes_written, accesses, syncs, loads, saves, ..built })
    }
}

impl Built {
    /// Wall time of `insert_scan` at a quantile, in milliseconds.
    pub fn insert_ms(&self, quantile: f64) -> f64 {
        let mut times: Vec<f64> = self.scans.iter().map(|scan| scan.wall_ms).collect();
        times.sort_unstable_by(f64::total_cmp);
        let at = (quantile * times.len() as f64).ceil() as usize;
        times.get(at.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    }

    /// Longest call that flushed, in milliseconds.
    pub fn flush_ms(&self) -> f64 {
        self.scans.iter().map(|scan| scan.flush_ms).fold(0.0, f64::max)
    }

    /// Wall time of all scans and of the flush, in seconds.
    pub fn wall_s(&self) -> f64 {
        self.scans.iter().map(|scan| scan.wall_ms).sum::<f64>() / 1e3 + self.flush_wall_s
    }

    /// CPU time of all threads for all scans and for the flush, in seconds.
    pub fn cpu_s(&self) -> f64 {
        self.scans.iter().map(|scan| scan.cpu_ms).sum::<f64>() / 1e3 + self.flush_cpu_s
    }

    /// Ratio of the bytes written to the disk to those of the map's files.
    pub fn written_by_map(&self) -> f64 {
        self.bytes_written as f64 / self.map_file_bytes as f64
    }
}

/// Flushes, unless a background flush is still running.
fn flush(mapper: &mut OutOfCoreTileMapper, flushes: Flushes) -> Result<bool> {
    if !flushes.is_background {
        mapper.flush()?;
    } else if mapper.is_flushing() {
        return Ok(false);
    } else {
        mapper.begin_flush()?;
    }
    Ok(true)
}

/// Travelled distance of a sensor.
#[derive(Default)]
struct Odometer {
    last: Option<[f64; 3]>,
    length_m: f64,
}

impl Odometer {
    fn to(&mut self, scan: &Scan) -> f64 {
        if let Some(last) = self.last.replace(scan.origin) {
            self.length_m += (0..3).map(|k| (scan.origin[k] - last[k]).powi(2)).sum::<f64>().sqrt();
        }
        self.length_m
    }
}

/// Removes an old map folder and creates its parent.
fn replace_folder(folder: &Path) -> Result<()> {
    remove_folder(folder)?;
    let parent = folder.parent().unwrap_or(folder);
    fs::create_dir_all(parent).with_context(|| format!("{}: cannot create the folder", parent.display()))
}

/// Removes a folder with its content, if it exists.
///
/// # Errors
///
/// Fails if the folder cannot be removed.
pub fn remove_folder(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("{}: cannot remove", folder.display()))?;
    }
    Ok(())
}

/// Bytes of all files in a folder, recursively.
fn file_bytes(folder: &Path) -> Result<u64> {
    let mut bytes = 0;
    for entry in fs::read_dir(folder).with_context(|| format!("{}: cannot read", folder.display()))? {
        let entry = entry?;
        let metadata = entry.metadata()?;
        bytes += if metadata.is_dir() { file_bytes(&entry.path())? } else { metadata.len() };
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Input;
    use workload::SurveyName;

    fn build(limit: Limit, folder: &Path) -> Built {
        let input = Input::Synthetic { survey: SurveyName::Drive, rays: 500, scans: 5 };
        let case =
            Case { name: "drive".into(), input, resolution_m: 0.4, tile_size_m: 4.0, max_range_m: 30.0 };
        let folder = folder.join("map");
        let build = Build {
            case,
            limit,
            disk: DiskSpeed::Unsynced,
            storage: Storage::Compact,
            scans_at_a_time: 2,
            folder,
            is_kept: false,
            has_digest: true,
            is_on_one_core: false,
            flushes: None,
        };
        build.run().unwrap()
    }

    #[test]
    fn a_build_on_disk_equals_the_build_in_memory_and_counts_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let in_memory = build(Limit::InMemory, folder.path());
        let on_disk = build(Limit::None, folder.path());
        assert_eq!(in_memory.digest, on_disk.digest);
        assert_eq!([in_memory.scans.len(), on_disk.scans.len()], [5; 2]);
        assert_eq!(in_memory.tiles, on_disk.tiles);
        assert_eq!([in_memory.bytes_written, in_memory.map_file_bytes], [0; 2]);
        assert!(on_disk.written_by_map() >= 1.0 && on_disk.map_file_bytes > 1_000);
        assert!((on_disk.scans[4].distance_m - 4.0).abs() < 0.1);
        assert!(on_disk.peak_resident_bytes >= on_disk.start_resident_bytes);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
