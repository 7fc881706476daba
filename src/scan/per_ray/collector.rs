use super::far_runs::FarRuns;
use crate::scan::ScanReport;
use crate::scan::pages::{
    BrickCounts, CountedPage, Footprint, PageMap, Window, brick_in_page, place_in_page,
};
use crate::scan::ray::SlabRay;
use crate::scan::spill::ScanParts;
use crate::scan::trace::{Allowance, CollectorLimit};
use crate::scan::updates::{
    BrickRuns, MappedTiles, Misses, Run, ScanUpdates, TileRuns, TileUpdates, brick_code, bricks_by_tile,
    in_order_of_tiles, mean_tiles_of_brick, part_in_tile,
};
use crate::space::{BRICK_VOXELS, BrickMask, Grid, TileIndex, VoxelIndex, is_in_mask};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Collector of the updates of consecutive rays in insertion per ray: each ray updates all voxels that it crosses.
///
/// The updates of a voxel are stored as runs: a number of misses, then a hit. This preserves their order; the order
/// between voxels is irrelevant.
#[derive(Clone, Debug, Default)]
pub(crate) struct PerRayCollector {
    pages: PageMap<CountedPage>,
    /// Runs that ended with a hit, in order.
    ended: Vec<EndedRun>,
    /// Updates outside the window if memory is limited; otherwise they are in pages.
    far: Option<FarRuns>,
    max_bytes: usize,
    allowance: Allowance,
}

/// Maximum bytes that a ray adds per slab: three eighths of a brick of 512 bytes, and three 64ths of a page.
const BYTES_PER_SLAB: usize = 256;
/// Maximum bytes that a ray adds in addition to its slabs: the page and brick that it ends in.
const BYTES_PER_RAY: usize = 4 << 10;

/// Run of misses that ended with a hit.
#[derive(Clone, Copy, Debug)]
struct EndedRun {
    page: u32,
    /// Morton position of the voxel in the page.
    place: u32,
    misses: u16,
    intensity: f32,
}

/// Brick with counts or hits.
struct Brick<'a> {
    counts: BrickCounts<'a>,
    /// Runs in the brick that ended with a hit, in order.
    ended: &'a [Run],
}

impl PerRayCollector {
    /// Clears the collector and sets another window; the memory is kept. With a limit, updates outside the window are
    /// grouped by tiles of `grid`.
    pub(crate) fn clear(&mut self, window: Window, limit: Option<(&CollectorLimit, &Grid)>) {
        self.pages.clear(window, usize::MAX);
        self.ended.clear();
        self.far = limit.map(|(_, grid)| FarRuns::new(*grid));
        self.max_bytes = limit.map_or(usize::MAX, |(limit, _)| limit.small_bytes);
        self.allowance.grant(self.max_bytes);
    }

    /// Returns whether another ray may exceed the limit. The first ray never does.
    #[inline]
    pub(crate) fn is_full_for(&mut self, ray: &SlabRay) -> bool {
        let new_bytes = BYTES_PER_RAY + BYTES_PER_SLAB * ray.slabs_after(0) as usize;
        self.allowance.is_spent_by(new_bytes) && self.is_full_measured(new_bytes)
    }

    #[cold]
    fn is_full_measured(&mut self, new_bytes: usize) -> bool {
        let pages: usize =
            self.pages.pages().iter().map(|page| size_of::<CountedPage>() + page.heap_bytes()).sum();
        let far = self.far.as_ref().map_or(0, FarRuns::bytes);
        let bytes = pages + far + self.ended.len() * size_of::<EndedRun>();
        let left = self.max_bytes.saturating_sub(bytes);
        // Grants an allowance, because otherwise the next ray would measure again.
        self.allowance.grant(left);
        bytes > 0 && left < new_bytes.max(self.max_bytes / 8)
    }

    pub(crate) fn bytes(&self) -> usize {
        let far = self.far.as_ref().map_or(0, FarRuns::bytes);
        self.pages.bytes() + self.ended.capacity() * size_of::<EndedRun>() + far
    }

    /// Records a ray that passes all voxels except its last. At most [`MAX_RAYS`](crate::scan::pages::MAX_RAYS) rays
    /// may be recorded.
    pub(crate) fn pass(&mut self, ray: &SlabRay) {
        let Self { pages, far: Some(far), .. } = self else {
            let mut far = Vec::new();
            ray.pass(&mut self.pages, 0, false, |voxel| far.push(voxel));
            for voxel in far {
                let page = self.pages.number_of(voxel);
                self.pages.pages_mut()[page].pass_at(place_in_page(voxel));
            }
            return;
        };
        ray.pass(pages, 0, false, |voxel| far.pass(voxel));
    }

    /// Records the end of a ray in a voxel, with an intensity if the sensor model needs one.
    pub(crate) fn hit(&mut self, voxel: VoxelIndex, intensity: f32) {
        if let Some(far) = &mut self.far
            && self.pages.window().local(voxel).is_none()
        {
            return far.hit(voxel, intensity);
        }
        let (page, place) = (self.pages.number_of(voxel), place_in_page(voxel));
        let misses = self.pages.pages_mut()[page].take(place);
        self.ended.push(EndedRun { page: page as u32, place, misses, intensity });
    }

    /// Visits the updates by mapped tile. Bricks across a tile border are split. With more than `bricks_at_a_time`
    /// bricks, a tile may be visited several times, each time with other voxels.
    fn for_each_tile(
        &self,
        mapped: MappedTiles<'_>,
        bricks_at_a_time: usize,
        mut visit: impl FnMut(TileIndex, TileRuns),
    ) {
        let (bricks, indices) = self.bricks();
        let ended = self.ended_by_brick(&bricks);
        let runs_of_tile = |first: usize, tile: TileIndex, numbers: Vec<u32>| {
            let mut scratch = Scratch::default();
            let mut runs = TileRuns::default();
            for number in numbers.into_iter().map(|number| first + number as usize) {
                let index = indices[number];
                let brick = Brick { counts: bricks[number], ended: ended.of_brick(number) };
                let (ended, misses) = brick.runs(&part_in_tile(mapped.grid, tile, index), &mut scratch);
                if !(ended.is_empty() && misses.is_empty()) {
                    runs.push(BrickRuns { brick: brick_code(index), runs: ended, misses });
                }
            }
            (tile, runs)
        };
        for (number, some) in indices.chunks(bricks_at_a_time).enumerate() {
            let first = number * bricks_at_a_time;
            let tiles = bricks_by_tile(mapped, some, 0).into_par_iter();
            let runs: Vec<_> = tiles.map(|(tile, numbers)| runs_of_tile(first, tile, numbers)).collect();
            runs.into_iter().for_each(|(tile, runs)| visit(tile, runs));
        }
    }

    /// The bricks of all pages, page by page, and their indices: the indices of their voxels divided by 8.
    fn bricks(&self) -> (Vec<BrickCounts<'_>>, Vec<VoxelIndex>) {
        let bricks: Vec<BrickCounts<'_>> = self.pages.pages().iter().flat_map(CountedPage::bricks).collect();
        let mut indices = Vec::with_capacity(bricks.len());
        for (page, &index) in self.pages.pages().iter().zip(self.pages.indices()) {
            let first = indices.len();
            indices.resize(first + page.brick_count(), index);
            page.places().for_each(|(place, brick)| indices[first + brick] = brick_in_page(index, place));
        }
        (bricks, indices)
    }

    /// Groups the runs that ended with a hit by brick, using a counting sort in two passes.
    fn ended_by_brick(&self, bricks: &[BrickCounts<'_>]) -> EndedByBrick {
        let mut first_of_page = Vec::with_capacity(self.pages.pages().len());
        let mut first = 0;
        for page in self.pages.pages() {
            first_of_page.push(first);
            first += page.brick_count();
        }
        let brick_of = |run: &EndedRun| {
            let page = run.page as usize;
            first_of_page[page] + self.pages.pages()[page].number_of(run.place)
        };
        let mut ends = vec![0_u32; bricks.len() + 1];
        self.ended.iter().for_each(|run| ends[brick_of(run) + 1] += 1);
        (1..ends.len()).for_each(|k| ends[k] += ends[k - 1]);
        let mut runs = vec![NO_RUN; self.ended.len()];
        for run in &self.ended {
            // `ends` contains the start of each brick's runs at first, and their end after this loop.
            let next = &mut ends[brick_of(run)];
            runs[*next as usize] = run.run();
            *next += 1;
        }
        EndedByBrick { runs, ends }
    }
}

/// Runs that ended with a hit, brick by brick; those of a brick in the order of the rays.
struct EndedByBrick {
    runs: Vec<Run>,
    /// End of each brick's runs.
    ends: Vec<u32>,
}

impl EndedByBrick {
    fn of_brick(&self, number: usize) -> &[Run] {
        let start = number.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.runs[start as usize..self.ends[number] as usize]
    }
}

const NO_RUN: Run = Run { place: 0, misses: 0, hit: None };

impl EndedRun {
    fn run(&self) -> Run {
        let place = (self.place as usize % BRICK_VOXELS) as u16;
        Run { place, misses: self.misses, hit: Some(self.intensity) }
    }
}

/// Reusable buffers for the runs of a brick.
struct Scratch {
    ended: Vec<Run>,
    /// One entry per voxel of a brick, plus a chunk that may be written past the end.
    misses: [Misses; BRICK_VOXELS + CHUNK],
}

/// Mask of all voxels of a brick.
const WHOLE: BrickMask = [u64::MAX; 8];
/// Number of voxels whose counts are processed together.
const CHUNK: usize = 8;

impl Default for Scratch {
    fn default() -> Self {
        Self { ended: Vec::new(), misses: [Misses::default(); BRICK_VOXELS + CHUNK] }
    }
}

impl<'a> Brick<'a> {
    /// Returns the runs of the masked voxels that ended with a hit, and the misses after them.
    fn runs<'s>(&self, part: &BrickMask, scratch: &'s mut Scratch) -> (&'s [Run], &'s [Misses])
    where
        'a: 's,
    {
        let Scratch { ended, misses } = scratch;
        let mut passed = self.passed(misses);
        if *part == WHOLE {
            return (self.ended, &misses[..passed]);
        }
        passed = kept(&mut misses[..passed], |misses| is_in_mask(part, misses.place.into()));
        ended.clear();
        ended.extend(self.ended.iter().filter(|run| is_in_mask(part, run.place.into())));
        (ended, &misses[..passed])
    }

    /// Writes the misses since each voxel's last hit to the front of `all`; returns the number of voxels that have any.
    fn passed(&self, all: &mut [Misses; BRICK_VOXELS + CHUNK]) -> usize {
        let mut count = 0;
        let Some(counts) = self.counts.as_bytes() else {
            for place in 0..BRICK_VOXELS {
                let misses = self.counts.get(place);
                all[count] = Misses { place: place as u16, misses };
                count += usize::from(misses > 0);
            }
            return count;
        };
        // Most voxels were not passed, so whole chunks are skipped.
        for (chunk, first) in counts.as_chunks::<CHUNK>().0.iter().zip((0..).step_by(CHUNK)) {
            if u64::from_ne_bytes(*chunk) == 0 {
                continue;
            }
            let out = &mut all[count..][..CHUNK];
            let mut written = 0;
            // Branchless, because a branch would be unpredictable.
            for (&misses, place) in chunk.iter().zip(first..) {
                out[written % CHUNK] = Misses { place, misses: misses.into() };
                written += usize::from(misses > 0);
            }
            count += written;
        }
        count
    }
}

/// Moves the values that are kept to the front, in order; returns their number.
fn kept<T: Copy>(values: &mut [T], is_kept: impl Fn(&T) -> bool) -> usize {
    let mut count = 0;
    for k in 0..values.len() {
        let value = values[k];
        values[count] = value;
        count += usize::from(is_kept(&value));
    }
    count
}

/// Approximate maximum number of tiles whose updates are in memory at a time before they are moved to parts. Used for
/// small tiles, of which several share a brick.
const TILES_AT_A_TIME: usize = 4096;

/// Moves the updates of several collectors to `parts`; the collectors are in the order of their rays.
pub(crate) fn drain_in_order(
    mapped: MappedTiles<'_>,
    collectors: &mut [PerRayCollector],
    parts: &ScanParts<'_>,
) {
    let bricks_at_a_time = match mean_tiles_of_brick(mapped.grid) {
        1 => usize::MAX,
        tiles => TILES_AT_A_TIME / tiles,
    };
    for collector in collectors {
        collector.for_each_tile(mapped, bricks_at_a_time, |tile, runs| {
            let (hits, misses) = runs.hits_and_misses();
            if hits + misses > 0 {
                parts.add(std::iter::once((tile, TileUpdates::Runs(runs), (hits, misses))));
            }
        });
        if let Some(far) = &mut collector.far {
            parts.add(far.take());
        }
    }
}

/// Returns the updates of several collectors; the collectors are in the order of their rays.
pub(crate) fn updates_in_order(
    mapped: MappedTiles<'_>,
    collectors: &mut [PerRayCollector],
    mut report: ScanReport,
) -> ScanUpdates {
    let mut tiles: FxHashMap<TileIndex, Vec<TileRuns>> = FxHashMap::default();
    for collector in collectors {
        collector.for_each_tile(mapped, usize::MAX, |tile, runs| {
            let (hits, misses) = runs.hits_and_misses();
            if hits + misses > 0 {
                report.hits += hits;
                report.misses += misses;
                tiles.entry(tile).or_default().push(runs);
            }
        });
    }
    let of_tile = |(tile, parts)| (tile, TileUpdates::Runs(TileRuns::merged(parts)));
    in_order_of_tiles(mapped.grid, tiles.into_iter().map(of_tile).collect(), report)
}
