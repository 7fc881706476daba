//! Measures the first query of a point in each tile on disk. Prints one row per map, for `docs/performance.md`.
//!
//! `first_points [--passes N] MAP...`

use std::error::Error;
use std::path::Path;
use std::time::Instant;
use voxtile::space::VoxelIndex;
use voxtile::{MapReader, MapView};

fn main() -> Result<(), Box<dyn Error>> {
    let mut maps: Vec<String> = std::env::args().skip(1).collect();
    let passes = match maps.first().map(String::as_str) {
        Some("--passes") => maps.drain(..2).nth(1).ok_or("a number of passes")?.parse()?,
        _ => 5,
    };
    println!("| map | points | kB read (median) | max | CPU us (median) | 99 % | wall us (median) | 99 % |");
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    for map in maps {
        println!("{}", row(Path::new(&map), passes)?);
    }
    Ok(())
}

fn row(map: &Path, passes: usize) -> Result<String, Box<dyn Error>> {
    let points = points(map)?;
    let (mut bytes, mut cpu, mut wall) = (Vec::new(), Vec::new(), Vec::new());
    // The first pass loads the files into the page cache.
    for pass in 0..=passes {
        let reader = MapReader::open(map, 0)?;
        for &point in &points {
            let read_before = reader.statistics().io.bytes_read;
            let (began, cpu_before) = (Instant::now(), cpu_seconds());
            let evidence = reader.evidence(point)?;
            let (cpu_after, took) = (cpu_seconds(), began.elapsed().as_secs_f64());
            evidence.ok_or("an observed voxel is one")?;
            if pass > 0 {
                bytes.push((reader.statistics().io.bytes_read - read_before) as f64 * 1e-3);
                cpu.push(1e6 * (cpu_after - cpu_before));
                wall.push(1e6 * took);
            }
        }
    }
    let name = map.file_name().unwrap_or_default().display();
    let [bytes, most_bytes] = [0.5, 1.0].map(|share| quantile(&mut bytes, share));
    let [cpu, most_cpu] = [0.5, 0.99].map(|share| quantile(&mut cpu, share));
    let [wall, most_wall] = [0.5, 0.99].map(|share| quantile(&mut wall, share));
    Ok(format!(
        "| {name} | {} | {bytes:.1} | {most_bytes:.1} | {cpu:.0} | {most_cpu:.0} | {wall:.0} | {most_wall:.0} |",
        points.len()
    ))
}

/// Returns the middle one of each tile's observed voxels.
fn points(map: &Path) -> Result<Vec<VoxelIndex>, Box<dyn Error>> {
    let mut points = Vec::new();
    for tile in MapReader::open(map, 0)?.tiles() {
        let tile = tile?;
        points.extend(tile.voxels().nth(tile.table().len() / 2).map(|voxel| voxel.index));
    }
    Ok(points)
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((values.len().saturating_sub(1) as f64 * share) as usize).copied().unwrap_or(f64::NAN)
}

/// CPU time of this thread.
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
