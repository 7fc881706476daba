//! Does the memory stay within the limit for random inputs?

use super::memory::OVERHEAD_MIB;
use crate::findings::Findings;
use crate::hard_scan::{HardScan, Points};
use crate::promise::{Promise, Wanted};
use crate::setting::{Setting, mib};
use anyhow::Result;
use std::fs;
use std::time::{Duration, Instant};
use voxtile::MemoryLimit;
use voxtile::space::Grid;
use voxtile_simulation::Random;

/// Finds the worst peak of random inputs with random limits.
pub fn answer(setting: &Setting) -> Result<Findings> {
    let until = Instant::now() + Duration::from_secs(setting.size(600, 25));
    let mut random = Random::of(u64::from(std::process::id()), &[15]);
    let (mut worst_mib, mut worst, mut tried) = (f64::NEG_INFINITY, String::new(), 0);
    while Instant::now() < until {
        let resolution_m = [0.05, 0.1, 0.2, 0.5][random.below(4) as usize];
        let tile_voxels = [2.0, 3.0, 4.0, 9.0, 16.0, 31.0, 50.0, 64.0][random.below(8) as usize];
        let tile_size_m = tile_voxels * resolution_m;
        let least = MemoryLimit::min_bytes(&Grid::new(resolution_m, tile_size_m)?).div_ceil(1 << 20);
        // Number of voxels on all rays, so that each input takes a second or two.
        let voxels = random.between(1e5, setting.size(2e8, 1e7));
        let rays = 10_f64.powf(random.between(1.0, 5.3)).min(voxels);
        let reach_m = (voxels / rays).clamp(10.0, 100_000.0) * resolution_m;
        // With one folder per tile, the file system would take most of the time for hundreds of thousands of small
        // tiles.
        let reach_m = reach_m.min(tile_size_m * 300_000.0 / rays).max(2.0 * resolution_m);
        let scans = [1, 1, 2, 5][random.below(4) as usize];
        let points = Points::Fan {
            scans,
            rays: (rays / f64::from(scans)).ceil() as u32,
            reach_m,
            opening: random.between(0.0, 1.0),
            is_sky: random.below(4) == 0,
        };
        let limit_mib = least + random.below(setting.size(200, 60)) as usize + 40;
        let name = format!("random {tried}");
        let per_ray = random.below(3) == 0;
        // Without this, a flush begins only on a slow disk.
        let is_flushed = random.below(2) == 0;
        let is_octomap = random.below(3) == 0;
        let mut options = Vec::new();
        for (option, one_in) in [("--keep-scans", 3), ("--threads=1", 4), ("--flush-every=2", 4)] {
            let is_taken = random.below(one_in) == 0 && !(is_flushed && option.starts_with("--flush"));
            options.extend(is_taken.then(|| option.to_owned()));
        }
        let hard = HardScan {
            name,
            points,
            resolution_m,
            tile_size_m,
            limit_mib,
            per_ray,
            is_flushed,
            is_octomap,
            options,
        };
        let input = hard.write(&setting.work)?;
        let taken = match hard.build(&input, &setting.work.join("hard"), true) {
            Ok(taken) => taken,
            // An error about too many tiles for the limit is acceptable.
            Err(error) if error.to_string().contains("too few for a") => {
                let _ = fs::remove_dir_all(setting.work.join("hard"));
                continue;
            }
            Err(error) => return Err(error),
        };
        let beyond_mib = mib(taken.peak_bytes as f64) - limit_mib as f64;
        if beyond_mib > worst_mib {
            worst = format!("{}, {limit_mib} MiB", hard.description());
            worst_mib = beyond_mib;
            eprintln!("  search, {worst}: {beyond_mib:.0} MiB beyond");
        }
        tried += 1;
    }
    let what = format!("worst of {tried} random inputs ({worst}): peak of memory beyond the limit");
    let mut findings = Findings::default();
    findings.promises.push(Promise::new(what, worst_mib, Wanted::AtMost(OVERHEAD_MIB), "MiB"));
    Ok(findings)
}
