use crate::counted::Counted;
use crate::json;
use crate::option_names::with_options;
use crate::quiet::summary_out;
use crate::region_tiles;
use indicatif::{HumanBytes, HumanCount};
use std::io::Write;
use voxtile::mapper::{IoCounts, StallCounts};
use voxtile::scan::ScanReport;
use voxtile::tile::{OctreeStatistics, TileCounts};
use voxtile_pipeline::{OctreeWork, Summary};

/// Prints the summary of a build as text or JSON.
pub fn print(mut summary: Summary, json: bool) -> anyhow::Result<()> {
    for text in summary.remarks.iter_mut().chain(&mut summary.unread) {
        *text = with_options(text).into_owned();
    }
    let mut out = summary_out(json);
    if json {
        return json::print(&summary, &mut out);
    }
    let ScanReport { points, skipped, cut_at_max_range, .. } = summary.report;
    let rate = summary.scans as f64 / summary.seconds.max(1e-9);
    writeln!(out, "map       {}", summary.map.display())?;
    writeln!(
        out,
        "scans     {} in {:.1} s ({rate:.1} per second)",
        HumanCount(summary.scans),
        summary.seconds
    )?;
    if summary.resumed_after > 0 {
        writeln!(out, "resumed   after {}", Counted(summary.resumed_after, "scan"))?;
    }
    if let Some(poses) = &summary.poses {
        writeln!(out, "poses     {poses}")?;
    }
    if let Some(tiles) = summary.region_tiles {
        writeln!(out, "region    {}", region_tiles::text(tiles, &summary.grid))?;
    }
    if !summary.unread.is_empty() {
        writeln!(out, "unread    {}, skipped", Counted(summary.unread.len() as u64, "scan"))?;
        summary.unread.iter().try_for_each(|scan| writeln!(out, "          {scan}"))?;
    }
    if summary.left_out > 0 {
        let left_out = HumanCount(summary.left_out);
        writeln!(out, "dropped   {left_out} scans, which arrived faster than they could be mapped")?;
    }
    writeln!(
        out,
        "points    {}, {} cut at the maximum range",
        HumanCount(points),
        HumanCount(cut_at_max_range)
    )?;
    for (cause, count) in skipped.by_cause().into_iter().filter(|&(_, count)| count > 0) {
        writeln!(out, "skipped   {} {cause}", HumanCount(count))?;
    }
    writeln!(out, "voxels    {}, {} occupied", HumanCount(summary.voxels), HumanCount(summary.occupied))?;
    writeln!(
        out,
        "tiles     {} of {} m, {} on disk",
        HumanCount(summary.tiles),
        summary.grid.tile_size_m(),
        HumanBytes(summary.disk_bytes)
    )?;
    let TileCounts { table_bytes, octree_bytes, voxel_cache_bytes, .. } = summary.cached;
    writeln!(
        out,
        "cached    {} tiles: {} in tables, {} in octrees, {} in voxel caches",
        HumanCount(summary.cached_tiles),
        HumanBytes(table_bytes),
        HumanBytes(octree_bytes),
        HumanBytes(voxel_cache_bytes)
    )?;
    if let Some(octrees) = &summary.octrees {
        print_octrees(octrees, &mut out)?;
    }
    print_io(&summary, &mut out)?;
    if let Some(bytes) = summary.peak_rss_bytes {
        writeln!(out, "memory    {} peak", HumanBytes(bytes))?;
    }
    Ok(())
}

fn print_io(summary: &Summary, out: &mut impl Write) -> std::io::Result<()> {
    let IoCounts { bytes_read, bytes_written, encoded, decoded, .. } = summary.io;
    writeln!(
        out,
        "tile I/O  {} read ({}), {} written ({})",
        HumanCount(summary.loads),
        HumanBytes(bytes_read),
        HumanCount(summary.saves),
        HumanBytes(bytes_written)
    )?;
    if encoded > 0 {
        writeln!(out, "compact   {} tiles encoded, {} decoded", HumanCount(encoded), HumanCount(decoded))?;
    }
    let StallCounts { count, p50_us, p99_us, worst_us, .. } = summary.stalls;
    if count > 0 {
        let [p50, p99, worst] = [p50_us, p99_us, worst_us].map(|us| us as f64 / 1e3);
        let count = HumanCount(count);
        writeln!(
            out,
            "stalls    {count}: half within {p50:.1} ms, 99 % within {p99:.1}, maximum {worst:.1}"
        )?;
    }
    Ok(())
}

fn print_octrees(octrees: &OctreeWork, out: &mut impl Write) -> std::io::Result<()> {
    let OctreeStatistics { voxel_cache, voxels_written, queue, times, .. } = octrees.statistics;
    if let Some(hit_rate) = octrees.hit_rate {
        let (hits, misses) = (HumanCount(voxel_cache.hits), HumanCount(voxel_cache.misses));
        let (evictions, drained) = (HumanCount(voxel_cache.evictions), HumanCount(voxel_cache.drained));
        writeln!(out, "cache     {hits} hits, {misses} misses, hit rate {:.1} %", 100.0 * hit_rate)?;
        writeln!(out, "          {evictions} voxels evicted, {drained} drained")?;
    }
    writeln!(out, "octrees   {} voxels written", HumanCount(voxels_written))?;
    if queue.limit_voxels > 0 {
        let (batches, voxels) = (HumanCount(queue.batches_in), HumanCount(queue.voxels_in));
        let (peak, waits) = (HumanCount(queue.peak_voxels), HumanCount(queue.waits));
        writeln!(out, "queue     {batches} batches of {voxels} voxels, peak {peak}, {waits} waits")?;
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
