use crate::clean::Phase;
use crate::find_moving::MovingFinder;
use crate::marks_file::MarksFile;
use crate::scan_map::{Order, scan_map};
use crate::seen_through::BothOrders;
use crate::stays::{StayCounter, Stays};
use rayon::prelude::*;
use std::ops::RangeInclusive;
use voxtile::mapper::{KeptScan, KeptScans, KeptSummary};
use voxtile::scan::{MovingMarks, ScanPoints, Stop};
use voxtile::{Aabb, MapPath, MapReader, MemoryLimit, Queries, Result};

/// Memory in bytes if there is no limit in bytes.
const DEFAULT_BYTES: usize = 256 << 20;

/// Most bytes per point for the voxels of a scan: rows of voxels, and points and answers of queries.
const BYTES_PER_POINT: usize = 160;

/// Search for the moving points of all kept scans.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    /// Box in metres, world frame, outside of which no point is marked.
    pub(crate) region: Option<Aabb>,
    /// Number of scans that must hit a thing in the same voxel for it to count as parked.
    pub(crate) parked_scans: Option<u32>,
    pub(crate) memory: MemoryLimit,
    pub(crate) stop: Stop,
}

/// Result of a search.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) scans: KeptSummary,
    /// Marks of the scans whose marks change.
    pub(crate) marks: MarksFile,
    /// Number of points of all scans.
    pub(crate) points: u64,
    /// Number of moving points.
    pub(crate) moving_points: u64,
}

impl Search {
    /// Searches the scans of a map, whatever their marks. `progress` receives the number of scans done and in total.
    pub(crate) fn run(&self, map: MapPath, progress: &mut impl FnMut(Phase, u64, u64)) -> Result<Found> {
        let shares = MemoryShares::of(self.memory, self.parked_scans.is_some());
        let reader = MapReader::open(map, shares.tiles_bytes)?;
        let scans = reader.kept_summary()?;
        let all = scans.scans().len() as u64;
        // The map lacks hits whose points are marked.
        let has_marks = scans.scans().iter().any(|scan| scan.moving_points > 0);
        let maps = 1 + u64::from(has_marks);
        let mut map_of = |order: Order, earlier| {
            let mapped = |done| progress(Phase::Mapping, earlier * all + done, maps * all);
            scan_map(&reader, order, shares.map_bytes, &self.stop, mapped)
        };
        let reverse = map_of(Order::Reverse, 0)?;
        let forward = has_marks.then(|| map_of(Order::Forward, 1)).transpose()?;
        let maps = BothOrders {
            forward: forward.as_ref().map_or(&reader as &dyn Queries, |forward| forward.get()),
            reverse: reverse.get(),
        };
        let finder = MovingFinder::new(maps, reader.folder(), shares.points_at_a_time(), &self.stop);
        let stays =
            self.parked_scans.map(|min_scans| self.count(&reader, &finder, &shares, min_scans, progress));
        let stays = stays.transpose()?;
        let finder = finder.with(self.region, stays.as_ref());
        let mut marks = MarksFile::in_folder(reader.folder())?;
        let (points, moving_points) = find_in(
            &reader,
            &finder,
            0..=u64::MAX,
            |number, of_scan| marks.push(number, of_scan),
            |done| progress(Phase::Finding, done, all),
        )?;
        Ok(Found { scans, marks, points, moving_points })
    }

    /// Counts the scans that hit each voxel that was seen through.
    fn count(
        &self,
        map: &MapReader,
        finder: &MovingFinder<'_>,
        shares: &MemoryShares,
        min_scans: u32,
        progress: &mut impl FnMut(Phase, u64, u64),
    ) -> Result<Stays> {
        let all = map.kept_summary()?.scans().len() as u64;
        let mut counter = StayCounter::begin(map, shares.counts_bytes)?;
        for (done, scan) in map.kept_scans()?.enumerate() {
            self.stop.check()?;
            progress(Phase::Counting, done as u64, all);
            finder.for_each_part(&scan?, |voxels| counter.add(&voxels))?;
        }
        Ok(counter.finish(min_scans))
    }
}

/// Searches the scans with these numbers. `take` receives the marks of those whose marks change, `progress` the number
/// of scans done. Returns the numbers of points and of moving points.
pub(crate) fn find_in(
    map: &MapReader,
    finder: &MovingFinder<'_>,
    numbers: RangeInclusive<u64>,
    mut take: impl FnMut(u64, &MovingMarks) -> Result<()>,
    mut progress: impl FnMut(u64),
) -> Result<(u64, u64)> {
    let (mut points, mut moving_points, mut done) = (0, 0, 0);
    let mut kept = map.kept_scans()?;
    loop {
        finder.check_stop()?;
        progress(done);
        let batch = next_batch(&mut kept, &numbers)?;
        if batch.is_empty() {
            return Ok((points, moving_points));
        }
        let of_batch: Result<Vec<_>> = batch.par_iter().map(|scan| finder.marks_of(scan)).collect();
        for (scan, of_scan) in batch.iter().zip(of_batch?) {
            (points, moving_points) = (points + of_scan.points(), moving_points + of_scan.marked());
            let is_same = match scan.moving() {
                Some(before) => *before == of_scan,
                None => of_scan.marked() == 0 && !scan.record().has_lost_marks(),
            };
            if !is_same {
                take(scan.number(), &of_scan)?;
            }
        }
        done += batch.len() as u64;
    }
}

/// Returns the next scans, to be examined at the same time: at most one per thread.
fn next_batch(kept: &mut KeptScans, numbers: &RangeInclusive<u64>) -> Result<Vec<KeptScan>> {
    let mut batch = Vec::new();
    while batch.len() < rayon::current_num_threads()
        && let Some(record) = kept.next_record()?
    {
        if numbers.contains(&record.number) {
            batch.push(kept.open(record)?);
        }
    }
    Ok(batch)
}

/// Shares of the memory limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MemoryShares {
    /// Tiles of the map.
    pub(crate) tiles_bytes: usize,
    /// Each temporary map of the scans.
    pub(crate) map_bytes: usize,
    /// Counts of scans.
    pub(crate) counts_bytes: usize,
    /// Voxels of the scans that are examined at the same time.
    scans_bytes: usize,
}

impl MemoryShares {
    pub(crate) fn of(memory: MemoryLimit, has_counts: bool) -> Self {
        let bytes = match memory {
            MemoryLimit::Bytes(bytes) => bytes,
            _ => DEFAULT_BYTES,
        };
        let counts_bytes = if has_counts { bytes / 8 } else { 0 };
        let (map_bytes, scans_bytes) = (bytes / 4, bytes / 8);
        let tiles_bytes = bytes / 2 - counts_bytes - scans_bytes;
        Self { tiles_bytes, map_bytes, counts_bytes, scans_bytes }
    }

    /// Returns the number of points of a scan that are examined at the same time.
    pub(crate) fn points_at_a_time(&self) -> u64 {
        let scans = rayon::current_num_threads();
        (self.scans_bytes / BYTES_PER_POINT / scans.max(1)).max(1) as u64
    }
}
