use crate::clean::Phase;
use crate::find_moving::MovingFinder;
use crate::marks_file::MarksFile;
use crate::stays::{StayCounter, Stays};
use rayon::prelude::*;
use voxtile::mapper::{KeptScan, KeptScans, KeptSummary};
use voxtile::scan::Stop;
use voxtile::{Aabb, MapPath, MapReader, MemoryLimit, Result};

/// Number of points from which on no further scan is examined at the same time.
const MAX_POINTS_AT_ONCE: u64 = 1 << 19;

/// Memory for tiles in bytes if there is no limit in bytes.
const DEFAULT_CACHE_BYTES: usize = 128 << 20;

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
    /// Marks of the scans that have moving points.
    pub(crate) marks: MarksFile,
    /// Number of points of all scans.
    pub(crate) points: u64,
    /// Number of moving points.
    pub(crate) moving_points: u64,
}

impl Search {
    /// Searches a map without marks. `progress` receives the number of scans done and in total.
    pub(crate) fn run(&self, map: MapPath, progress: &mut impl FnMut(Phase, u64, u64)) -> Result<Found> {
        let reader = MapReader::open(map, cache_bytes(self.memory))?;
        let scans = reader.kept_summary()?;
        let stays = self.parked_scans.map(|min_scans| self.count(&reader, &scans, min_scans, progress));
        let stays = stays.transpose()?;
        let finder = MovingFinder::new(&reader, self.region, stays.as_ref());
        let mut marks = MarksFile::in_folder(reader.folder())?;
        let (mut points, mut moving_points) = (0, 0);
        let all = scans.scans().len() as u64;
        let (mut done, mut kept) = (0, reader.kept_scans()?);
        loop {
            self.stop.check()?;
            progress(Phase::Finding, done, all);
            let batch = next_batch(&mut kept)?;
            if batch.is_empty() {
                break;
            }
            let of_batch: Result<Vec<_>> = batch.par_iter().map(|scan| finder.marks_of(scan)).collect();
            for (scan, of_scan) in batch.iter().zip(of_batch?) {
                (points, moving_points) = (points + of_scan.points(), moving_points + of_scan.marked());
                if of_scan.marked() > 0 {
                    marks.push(scan.number(), &of_scan)?;
                }
            }
            done += batch.len() as u64;
        }
        Ok(Found { scans, marks, points, moving_points })
    }

    /// Counts the scans that hit each voxel that was seen through.
    fn count(
        &self,
        map: &MapReader,
        scans: &KeptSummary,
        min_scans: u32,
        progress: &mut impl FnMut(Phase, u64, u64),
    ) -> Result<Stays> {
        let finder = MovingFinder::new(map, None, None);
        let mut counter = StayCounter::beside(map, self.memory)?;
        for (done, scan) in map.kept_scans()?.enumerate() {
            self.stop.check()?;
            progress(Phase::Counting, done as u64, scans.scans().len() as u64);
            finder.for_each_part(&scan?, |voxels| counter.add(&voxels))?;
        }
        counter.finish(min_scans, self.memory)
    }
}

/// Returns the next scans, to be examined at the same time: at most one per thread, and of limited size.
fn next_batch(kept: &mut KeptScans) -> Result<Vec<KeptScan>> {
    let (mut batch, mut points) = (Vec::new(), 0);
    while batch.len() < rayon::current_num_threads() && points < MAX_POINTS_AT_ONCE {
        let Some(scan) = kept.next().transpose()? else { break };
        points += scan.record().points;
        batch.push(scan);
    }
    Ok(batch)
}

/// Returns the memory for tiles in bytes. The rest of the limit is for the scans.
pub(crate) fn cache_bytes(memory: MemoryLimit) -> usize {
    match memory {
        MemoryLimit::Bytes(bytes) => bytes / 2,
        _ => DEFAULT_CACHE_BYTES,
    }
}
