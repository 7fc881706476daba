use crate::build::remove_folder;
use crate::case::{Case, Limit};
use crate::process_memory;
use anyhow::{Context, Result};
use report::{Samples, Stopwatch};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use voxtile::{MapReader, MapView, Mapper, OutOfCoreTileMapper, Storage};

/// A robot that repeats the same round all day: many scans of a small map, with background flushes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Day {
    pub case: Case,
    /// Memory limit in bytes, for all that grows.
    pub memory_bytes: usize,
    /// How the tiles are stored.
    pub storage: Storage,
    /// Number of scans between two flushes.
    pub flush_every_scans: usize,
    /// Number of scans in one part of the day.
    pub scans_per_part: usize,
    /// Folder of the map. It must not exist, and is removed at the end.
    pub folder: PathBuf,
}

/// Costs of a part of the day, and state at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Part {
    pub scans: u64,
    pub flushes: u64,
    /// Mean CPU time of a scan, with all threads and flushes.
    pub cpu_ms: f64,
    /// Wall times of the calls that insert a scan: median, 99.9th percentile and maximum.
    pub median_ms: f64,
    pub p999_ms: f64,
    pub worst_ms: f64,
    /// Longest call that began a flush.
    pub begin_flush_ms: f64,
    /// Largest resident memory of the process after a scan, in bytes.
    pub resident_bytes: u64,
    /// Largest number of files and folders in the map's folder, counted at the beginning of each flush and at the end
    /// of the part.
    pub files: u64,
    /// Largest number of bytes of all files.
    pub map_bytes: u64,
    /// Largest number of bytes of the log of commits.
    pub log_bytes: u64,
    pub tiles: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DayFound {
    pub parts: Vec<Part>,
    /// Largest resident memory of the process, in bytes.
    pub peak_resident_bytes: u64,
    /// Number of the last scan in the map on disk.
    pub scan_number: u64,
}

/// A part that is being measured.
#[derive(Default)]
struct OpenPart {
    part: Part,
    wall_ms: Samples,
    cpu_s: f64,
}

impl Day {
    /// Runs the day in this process.
    ///
    /// # Errors
    ///
    /// Fails if the map cannot be created.
    pub fn run(self) -> Result<DayFound> {
        let config = self.case.config(Limit::Bytes(self.memory_bytes))?.with_storage(self.storage);
        let mut mapper = OutOfCoreTileMapper::create(&self.folder, config)?;
        let mut parts = Vec::new();
        let mut open_part = OpenPart::default();
        let mut unflushed = 0;
        let mut since_last = Stopwatch::start()?;
        for scan in self.case.scans()? {
            let scan = scan?;
            // Excludes the generation of the scan, but includes work that other threads did meanwhile.
            open_part.cpu_s += since_last.stop()?.others_s;
            let stopwatch = Stopwatch::start()?;
            mapper.insert_scan(&scan)?;
            let took = stopwatch.stop()?;
            open_part.wall_ms.push(1e3 * took.wall_s);
            open_part.cpu_s += took.cpu_s();
            unflushed += 1;
            if unflushed >= self.flush_every_scans && !mapper.is_flushing() {
                let stopwatch = Stopwatch::start()?;
                mapper.begin_flush()?;
                let took = stopwatch.stop()?;
                open_part.cpu_s += took.cpu_s();
                open_part.part.begin_flush_ms = open_part.part.begin_flush_ms.max(1e3 * took.wall_s);
                open_part.part.flushes += 1;
                unflushed = 0;
                open_part.look_at(&self.folder)?;
            }
            open_part.part.resident_bytes =
                open_part.part.resident_bytes.max(process_memory::resident_bytes()?);
            open_part.part.scans += 1;
            if open_part.part.scans as usize == self.scans_per_part {
                open_part.look_at(&self.folder)?;
                let part = std::mem::take(&mut open_part).end(&mapper);
                eprintln!("  {} scans: {:.2} ms CPU a scan, {} files", part.scans, part.cpu_ms, part.files);
                parts.push(part);
            }
            since_last = Stopwatch::start()?;
        }
        mapper.flush()?;
        drop(mapper);
        let scan_number = MapReader::open(&self.folder, 0)?.scan_number();
        remove_folder(&self.folder)?;
        Ok(DayFound { parts, peak_resident_bytes: process_memory::peak_bytes()?, scan_number })
    }
}

impl OpenPart {
    fn look_at(&mut self, folder: &Path) -> Result<()> {
        let (files, bytes) = count(folder)?;
        self.part.files = self.part.files.max(files);
        self.part.map_bytes = self.part.map_bytes.max(bytes);
        let log = folder.join("commits.log");
        let log_bytes =
            fs::metadata(&log).with_context(|| format!("{}: cannot read the size", log.display()))?.len();
        self.part.log_bytes = self.part.log_bytes.max(log_bytes);
        Ok(())
    }

    fn end(self, mapper: &OutOfCoreTileMapper) -> Part {
        let quantile = |share| self.wall_ms.quantile(share);
        Part {
            cpu_ms: 1e3 * self.cpu_s / self.part.scans as f64,
            median_ms: quantile(0.5),
            p999_ms: quantile(0.999),
            worst_ms: quantile(1.0),
            tiles: mapper.statistics().tiles,
            ..self.part
        }
    }
}

/// Counts files and folders in a folder, recursively, and their bytes. A flush may run meanwhile: uncommitted and
/// removed files are not counted.
fn count(folder: &Path) -> Result<(u64, u64)> {
    let (mut files, mut bytes) = (0, 0);
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder).with_context(|| format!("{}: cannot read", folder.display()))?;
        for entry in entries {
            let Ok(metadata) =
                entry.as_ref().map_err(|_| ()).and_then(|entry| entry.metadata().map_err(|_| ()))
            else {
                continue;
            };
            if entry.as_ref().is_ok_and(|entry| entry.file_name().to_string_lossy().ends_with(".next")) {
                continue;
            }
            files += 1;
            match entry {
                Ok(entry) if metadata.is_dir() => folders.push(entry.path()),
                _ => bytes += metadata.len(),
            }
        }
    }
    Ok((files, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Input;
    use workload::SurveyName;

    #[test]
    fn a_day_is_split_into_parts_with_all_scans() {
        let folder = tempfile::tempdir().unwrap();
        let input = Input::EveryNth { survey: SurveyName::Warehouse, rays: 300, scans: 12, every: 20 };
        let case =
            Case { name: "warehouse".into(), input, resolution_m: 0.4, tile_size_m: 8.0, max_range_m: 20.0 };
        let day = Day {
            case,
            memory_bytes: 64 << 20,
            storage: Storage::Compact,
            flush_every_scans: 3,
            scans_per_part: 6,
            folder: folder.path().join("map"),
        };
        let found = day.run().unwrap();
        assert_eq!((found.parts.len(), found.scan_number), (2, 12));
        assert!(found.parts.iter().all(|part| part.scans == 6 && part.files > 0 && part.log_bytes > 0));
        // A flush that is still running when the next is due delays it.
        assert!(found.parts.iter().map(|part| part.flushes).sum::<u64>() > 0);
        let [first, second] = found.parts[..] else { panic!("two parts") };
        assert!(second.tiles > first.tiles && second.worst_ms >= second.median_ms, "{found:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
