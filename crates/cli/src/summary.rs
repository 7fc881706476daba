use crate::json;
use crate::memory;
use crate::region_tiles;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;
use voxtile::OctreeConfig;
use voxtile::mapper::{IoCounts, MapReader, MapView, MemoryCounts, StallCounts};
use voxtile::scan::ScanReport;
use voxtile::space::{Grid, TileBox};
use voxtile::tile::{OctreeStatistics, TileCounts};

/// What a build did, and what the map now is.
#[derive(Debug, Serialize)]
pub struct Summary {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    pub map: PathBuf,
    pub scans: u64,
    /// Scans of the same input that were in the map before.
    pub resumed_after: u64,
    pub interrupted: bool,
    /// Where the poses come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<String>,
    /// The tiles that are mapped; missing where that is all of space.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_tiles: Option<TileBox>,
    /// The scans that were skipped, with the reason of each.
    #[serde(rename = "unread_scans")]
    pub unread: Vec<String>,
    /// How many scans were left out because they came faster than they could be mapped.
    #[serde(rename = "left_out_scans")]
    pub left_out: u64,
    /// What a person should know beside.
    pub remarks: Vec<String>,
    #[serde(skip)]
    pub grid: Grid,
    #[serde(flatten)]
    pub report: ScanReport,
    pub scan_number: u64,
    pub voxels: u64,
    pub occupied: u64,
    pub tiles: u64,
    pub cached_tiles: u64,
    /// Sizes of the tiles in memory at the end.
    pub cached: TileCounts,
    /// The work for pointer octrees; missing where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub octrees: Option<OctreeWork>,
    pub disk_bytes: u64,
    pub loads: u64,
    pub saves: u64,
    /// What went to disk and came back.
    pub io: IoCounts,
    /// Waits for the disk.
    pub stalls: StallCounts,
    /// Bytes of memory at the end, by what they hold.
    pub memory: MemoryCounts,
    pub seconds: f64,
    /// Largest resident memory of the process.
    pub peak_rss_bytes: Option<u64>,
}

/// What was done for pointer octrees, from the start to the last flush.
#[derive(Debug, Serialize)]
pub struct OctreeWork {
    /// Hits of the voxel caches among all updates; missing where there are no caches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hit_rate: Option<f64>,
    #[serde(flatten)]
    pub statistics: OctreeStatistics,
}

impl Summary {
    /// The summary of `scans` inserted into a map that has been flushed.
    pub fn of(
        map: &Path,
        scans: u64,
        report: ScanReport,
        mapper: &impl MapView,
        elapsed: Duration,
    ) -> voxtile::Result<Self> {
        let reader = MapReader::open(map, 1)?;
        let (voxels, occupied) = reader.voxel_counts().unwrap_or_default();
        let statistics = mapper.statistics();
        Ok(Self {
            map: map.to_owned(),
            scans,
            resumed_after: 0,
            interrupted: false,
            poses: None,
            region_tiles: mapper.config().rays.region,
            unread: Vec::new(),
            left_out: 0,
            remarks: Vec::new(),
            grid: mapper.config().grid,
            report,
            scan_number: reader.scan_number(),
            voxels,
            occupied,
            tiles: statistics.tiles,
            cached_tiles: statistics.cached_tiles,
            cached: statistics.cached,
            octrees: OctreeWork::of(mapper),
            disk_bytes: statistics.disk_bytes,
            loads: statistics.io.loads,
            saves: statistics.io.saves,
            io: statistics.io,
            stalls: statistics.stalls,
            memory: statistics.memory,
            seconds: elapsed.as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        })
    }

    /// Prints the summary for a person, or as JSON.
    pub fn print(&self, json: bool) -> anyhow::Result<()> {
        let mut out = std::io::stdout().lock();
        if json {
            return json::print(self, &mut out);
        }
        let ScanReport { points, skipped, cut_at_max_range, .. } = self.report;
        let rate = self.scans as f64 / self.seconds.max(1e-9);
        writeln!(out, "map       {}", self.map.display())?;
        writeln!(out, "scans     {} in {:.1} s ({rate:.1} a second)", HumanCount(self.scans), self.seconds)?;
        if self.resumed_after > 0 {
            writeln!(out, "resumed   after {} scans", HumanCount(self.resumed_after))?;
        }
        if let Some(poses) = &self.poses {
            writeln!(out, "poses     {poses}")?;
        }
        if let Some(tiles) = self.region_tiles {
            writeln!(out, "region    {}", region_tiles::text(tiles, &self.grid))?;
        }
        if !self.unread.is_empty() {
            writeln!(out, "unread    {} scans, skipped", HumanCount(self.unread.len() as u64))?;
            self.unread.iter().try_for_each(|scan| writeln!(out, "          {scan}"))?;
        }
        if self.left_out > 0 {
            let left_out = HumanCount(self.left_out);
            writeln!(out, "left out  {left_out} scans, which came faster than they could be mapped")?;
        }
        writeln!(
            out,
            "points    {}, {} cut at the max range",
            HumanCount(points),
            HumanCount(cut_at_max_range)
        )?;
        for (cause, count) in skipped.by_cause().into_iter().filter(|&(_, count)| count > 0) {
            writeln!(out, "skipped   {} {cause}", HumanCount(count))?;
        }
        writeln!(out, "voxels    {}, {} occupied", HumanCount(self.voxels), HumanCount(self.occupied))?;
        writeln!(out, "tiles     {}, {} on disk", HumanCount(self.tiles), HumanBytes(self.disk_bytes))?;
        let TileCounts { table_bytes, octree_bytes, voxel_cache_bytes, .. } = self.cached;
        writeln!(
            out,
            "cached    {} tiles: {} in tables, {} in octrees, {} in voxel caches",
            HumanCount(self.cached_tiles),
            HumanBytes(table_bytes),
            HumanBytes(octree_bytes),
            HumanBytes(voxel_cache_bytes)
        )?;
        if let Some(octrees) = &self.octrees {
            octrees.print(&mut out)?;
        }
        self.print_io(&mut out)?;
        if let Some(bytes) = self.peak_rss_bytes {
            writeln!(out, "memory    {} at most", HumanBytes(bytes))?;
        }
        Ok(())
    }
}

impl Summary {
    fn print_io(&self, out: &mut impl Write) -> std::io::Result<()> {
        let IoCounts { bytes_read, bytes_written, encoded, decoded, .. } = self.io;
        writeln!(
            out,
            "tile I/O  {} read ({}), {} written ({})",
            HumanCount(self.loads),
            HumanBytes(bytes_read),
            HumanCount(self.saves),
            HumanBytes(bytes_written)
        )?;
        if encoded > 0 {
            writeln!(
                out,
                "compact   {} tiles encoded, {} decoded",
                HumanCount(encoded),
                HumanCount(decoded)
            )?;
        }
        let StallCounts { count, p50_us, p99_us, worst_us, .. } = self.stalls;
        if count > 0 {
            let [p50, p99, worst] = [p50_us, p99_us, worst_us].map(|us| us as f64 / 1e3);
            let count = HumanCount(count);
            writeln!(
                out,
                "stalls    {count}: half within {p50:.1} ms, 99 % within {p99:.1}, at most {worst:.1}"
            )?;
        }
        Ok(())
    }
}

impl OctreeWork {
    fn of(mapper: &impl MapView) -> Option<Self> {
        let OctreeConfig::Pointers(cache) = mapper.config().octree else { return None };
        let statistics = mapper.statistics().octrees;
        let hit_rate = cache.cache().map(|_| statistics.voxel_cache.hit_rate());
        Some(Self { hit_rate, statistics })
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let OctreeStatistics { voxel_cache, voxels_written, queue, times, .. } = self.statistics;
        if let Some(hit_rate) = self.hit_rate {
            let (hits, misses) = (HumanCount(voxel_cache.hits), HumanCount(voxel_cache.misses));
            let (evictions, drained) = (HumanCount(voxel_cache.evictions), HumanCount(voxel_cache.drained));
            writeln!(out, "cache     {hits} hits, {misses} misses, hit rate {:.1} %", 100.0 * hit_rate)?;
            writeln!(out, "          {evictions} voxels evicted, {drained} drained")?;
        }
        writeln!(out, "octrees   {} voxels written", HumanCount(voxels_written))?;
        if queue.limit_voxels > 0 {
            let (batches, voxels) = (HumanCount(queue.batches_in), HumanCount(queue.voxels_in));
            let (peak, waits) = (HumanCount(queue.peak_voxels), HumanCount(queue.waits));
            writeln!(
                out,
                "queue     {batches} batches of {voxels} voxels, {peak} at most at once, {waits} waits"
            )?;
        }
        let stages = [
            ("tables", times.table_update_ns),
            ("cache", times.cache_insertion_ns),
            ("eviction", times.eviction_ns),
            ("enqueuing", times.enqueue_ns),
            ("octrees", times.octree_update_ns),
        ];
        let stages = stages.map(|(name, ns)| format!("{name} {:.2} s", ns as f64 * 1e-9));
        writeln!(out, "stages    {}", stages.join(", "))
    }
}
