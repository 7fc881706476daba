use crate::space::MortonCode;
use serde::Serialize;
use std::ops::{AddAssign, Sub};

/// Cache of OctoCache (Chen et al., ASPLOS 2025, sections 4.1 to 4.3): it absorbs the updates of voxels, and only
/// evicted voxels are written to the octree.
///
/// The bucket of a voxel is its Morton code modulo the number of buckets. A cell contains the *accumulated* log-odds,
/// so queries for cached voxels need only the cache. During a scan buckets may grow; after it each bucket keeps its
/// `tau` latest cells, and the earliest are evicted in Morton order.
#[derive(Clone, Debug)]
pub struct VoxelCache {
    tau: usize,
    /// Whether the number of buckets adapts to the scans.
    fits_itself: bool,
    buckets: Box<[Vec<Cell>]>,
    len: usize,
    cell_bytes: usize,
    /// Buckets with more than `tau` cells.
    overfull: Vec<u32>,
    /// Number of the current scan, and the number of distinct voxels that it inserted.
    scan: u32,
    voxels_of_scan: usize,
    counts: VoxelCacheCounts,
}

/// Counts of a voxel cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct VoxelCacheCounts {
    /// Updates of voxels that were in the cache.
    pub hits: u64,
    /// Updates of voxels that were not in the cache.
    pub misses: u64,
    /// Voxels evicted to the octree because their buckets were full.
    pub evictions: u64,
    /// Voxels moved to the octree by a sync.
    pub drained: u64,
}

impl VoxelCacheCounts {
    /// Share of hits among all updates, from 0 to 1; 0 without updates.
    pub fn hit_rate(&self) -> f64 {
        self.hits as f64 / (self.hits + self.misses).max(1) as f64
    }
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    code: MortonCode,
    log_odds: f32,
    /// The scan that last inserted or changed the voxel.
    scan: u32,
}

/// Cells of an adaptive cache, as a multiple of the voxels of a scan; the paper uses 3 to 4 in section 5.2.
const CELLS_PER_SCAN_VOXEL: usize = 3;

impl VoxelCache {
    /// Creates a cache whose buckets keep `tau` voxels between scans. `buckets` must be a power of two; `None` adapts
    /// it to the scans.
    pub fn new(tau: usize, buckets: Option<usize>) -> Self {
        Self {
            tau,
            fits_itself: buckets.is_none(),
            buckets: empty_buckets(buckets.unwrap_or(1)),
            len: 0,
            cell_bytes: 0,
            overfull: Vec::new(),
            scan: 0,
            voxels_of_scan: 0,
            counts: VoxelCacheCounts::default(),
        }
    }

    /// Counts of the cache.
    pub fn counts(&self) -> VoxelCacheCounts {
        self.counts
    }

    /// Number of voxels in the cache.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether the cache is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        self.buckets.len() * size_of::<Vec<Cell>>()
            + self.cell_bytes
            + self.overfull.capacity() * size_of::<u32>()
    }

    /// Inserts the accumulated log-odds of an updated voxel.
    pub fn put(&mut self, code: MortonCode, log_odds: f32) {
        let number = code.0 as usize & (self.buckets.len() - 1);
        let bucket = &mut self.buckets[number];
        if let Some(cell) = bucket.iter_mut().find(|cell| cell.code == code) {
            self.counts.hits += 1;
            self.voxels_of_scan += usize::from(cell.scan != self.scan);
            (cell.log_odds, cell.scan) = (log_odds, self.scan);
        } else {
            self.counts.misses += 1;
            self.voxels_of_scan += 1;
            let capacity = bucket.capacity();
            bucket.push(Cell { code, log_odds, scan: self.scan });
            if bucket.len() == self.tau + 1 {
                self.overfull.push(number as u32);
            }
            self.cell_bytes += (bucket.capacity() - capacity) * size_of::<Cell>();
            self.len += 1;
        }
        // Grow during a scan too: otherwise a first scan would make buckets that are too long to search.
        if self.fits_itself && self.voxels_of_scan * CELLS_PER_SCAN_VOXEL > self.buckets.len() * self.tau {
            self.grow(self.buckets.len() * 2);
        }
    }

    /// The accumulated log-odds of a voxel, if it is cached.
    pub fn get(&self, code: MortonCode) -> Option<f32> {
        let bucket = &self.buckets[code.0 as usize & (self.buckets.len() - 1)];
        bucket.iter().find(|cell| cell.code == code).map(|cell| cell.log_odds)
    }

    /// The cached voxels under a node, in Morton order. `first` is the node's first code, `span` its number of voxels.
    pub fn under(&self, first: MortonCode, span: u64) -> Vec<(MortonCode, f32)> {
        let count = (span as usize).min(self.buckets.len());
        // A node's codes are consecutive, and so are their buckets.
        let buckets = (0..count).map(|k| (first.0 as usize + k) & (self.buckets.len() - 1));
        let cells = buckets.flat_map(|bucket| &self.buckets[bucket]);
        let mut voxels: Vec<_> = cells
            .filter(|cell| first <= cell.code && cell.code.0 < first.0 + span)
            .map(|cell| (cell.code, cell.log_odds))
            .collect();
        voxels.sort_unstable_by_key(|&(code, _)| code);
        voxels
    }

    /// Ends a scan: keeps at most `tau` voxels per bucket and returns the others in Morton order.
    pub fn evict(&mut self) -> Vec<(MortonCode, f32)> {
        (self.scan, self.voxels_of_scan) = (self.scan.wrapping_add(1), 0);
        let mut evicted = Vec::new();
        for number in self.overfull.drain(..) {
            let bucket = &mut self.buckets[number as usize];
            let surplus = bucket.len() - self.tau;
            evicted.extend(bucket.drain(..surplus).map(|cell| (cell.code, cell.log_odds)));
        }
        self.counts.evictions += evicted.len() as u64;
        self.in_morton_order(evicted)
    }

    /// Empties the cache and returns its voxels in Morton order.
    pub fn drain(&mut self) -> Vec<(MortonCode, f32)> {
        let cells = self.buckets.iter_mut().flat_map(|bucket| bucket.drain(..));
        let drained: Vec<_> = cells.map(|cell| (cell.code, cell.log_odds)).collect();
        self.counts.drained += drained.len() as u64;
        self.overfull.clear();
        (self.scan, self.voxels_of_scan) = (self.scan.wrapping_add(1), 0);
        self.in_morton_order(drained)
    }

    fn in_morton_order(&mut self, mut evicted: Vec<(MortonCode, f32)>) -> Vec<(MortonCode, f32)> {
        evicted.sort_unstable_by_key(|&(code, _)| code);
        self.len -= evicted.len();
        evicted
    }

    /// Distributes the cells over more buckets, preserving their order within a bucket.
    fn grow(&mut self, buckets: usize) {
        let old = std::mem::replace(&mut self.buckets, empty_buckets(buckets));
        for cell in old.iter().flatten() {
            self.buckets[cell.code.0 as usize & (buckets - 1)].push(*cell);
        }
        let is_overfull = |number: &u32| self.buckets[*number as usize].len() > self.tau;
        self.overfull = (0..buckets as u32).filter(is_overfull).collect();
        self.cell_bytes = self.buckets.iter().map(|bucket| bucket.capacity() * size_of::<Cell>()).sum();
    }
}

impl Sub for VoxelCacheCounts {
    type Output = Self;

    /// Returns the difference to earlier counts.
    fn sub(self, before: Self) -> Self {
        Self {
            hits: self.hits - before.hits,
            misses: self.misses - before.misses,
            evictions: self.evictions - before.evictions,
            drained: self.drained - before.drained,
        }
    }
}

impl AddAssign for VoxelCacheCounts {
    fn add_assign(&mut self, other: Self) {
        self.hits += other.hits;
        self.misses += other.misses;
        self.evictions += other.evictions;
        self.drained += other.drained;
    }
}

fn empty_buckets(count: usize) -> Box<[Vec<Cell>]> {
    vec![Vec::new(); count].into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(voxels: Vec<(MortonCode, f32)>) -> Vec<u64> {
        voxels.into_iter().map(|(code, _)| code.0).collect()
    }

    #[test]
    fn the_earliest_voxels_are_evicted_in_morton_order_and_hits_do_not_renew_them() {
        let mut cache = VoxelCache::new(2, Some(4));
        for code in [16, 1, 8, 12, 5, 4, 16] {
            cache.put(MortonCode(code), code as f32);
        }
        cache.put(MortonCode(8), 80.0);
        // Bucket 0 received 16, 8, 12, 4 in this order; bucket 1 received 1, 5.
        assert_eq!(cache.evict(), [(MortonCode(8), 80.0), (MortonCode(16), 16.0)]);
        assert_eq!(cache.get(MortonCode(12)), Some(12.0));
        assert_eq!(cache.get(MortonCode(16)), None);
        assert_eq!(cache.counts(), VoxelCacheCounts { hits: 2, misses: 6, evictions: 2, drained: 0 });
        assert_eq!(codes(cache.drain()), [1, 4, 5, 12]);
        assert_eq!(cache.counts().drained, 4);
        assert!(cache.is_empty());
    }

    #[test]
    fn an_adaptive_cache_holds_a_repeated_scan() {
        let mut cache = VoxelCache::new(4, None);
        for _ in 0..2 {
            for code in 0..1000 {
                cache.put(MortonCode(code * 7), 1.0);
            }
            cache.evict();
        }
        assert_eq!(cache.counts().misses, 1000);
        assert_eq!(cache.counts().hits, 1000);
    }

    #[test]
    fn an_adaptive_cache_has_three_to_six_times_the_capacity_of_the_largest_scan() {
        for tau in [1, 4, 6] {
            let mut cache = VoxelCache::new(tau, None);
            for voxels in [1000, 37, 1750, 600] {
                (0..voxels).for_each(|code| cache.put(MortonCode(code * 5), 1.0));
                (0..voxels).for_each(|code| cache.put(MortonCode(code * 5), 2.0));
                cache.evict();
                let room = cache.buckets.len() * tau;
                let largest = if voxels < 1750 && room < 3 * 1750 { 1000 } else { 1750 };
                assert!((3 * largest..6 * largest).contains(&room), "{room} for {largest}, tau {tau}");
            }
        }
    }

    #[test]
    fn under_returns_the_cached_voxels_of_a_node() {
        let mut cache = VoxelCache::new(4, Some(16));
        for code in [3, 63, 64, 70, 127, 128, 1000] {
            cache.put(MortonCode(code), 0.5);
        }
        assert_eq!(codes(cache.under(MortonCode(64), 64)), [64, 70, 127]);
        assert_eq!(codes(cache.under(MortonCode(0), 8)), [3]);
        assert_eq!(codes(cache.under(MortonCode(0), MortonCode::END)), [3, 63, 64, 70, 127, 128, 1000]);
    }
}
