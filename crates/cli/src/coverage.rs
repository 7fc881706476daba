use crate::args::CoverageArgs;
use crate::counted::Counted;
use crate::json;
use crate::part::region_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::stop_signal;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::MapView;
use voxtile_compare::{Class, Coverage, FrontierOptions, Observations, frontiers, observations};
use voxtile_pipeline::{SensorPositions, memory, read_any_map};

/// Number of frontiers in the summary for people.
const MAX_PRINTED: usize = 10;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    coverage: Coverage,
    observations: Observations,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

/// Finds the frontiers of a map and prints them.
pub fn run(args: &CoverageArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let options = FrontierOptions::default()
        .with_min_voxels(args.min_voxels)
        .with_region(args.region.as_deref().map(region_of).transpose()?)
        .with_memory(usize::try_from(args.memory.as_u64()).unwrap_or(usize::MAX))
        .with_stop(stop_signal::catch_unfinished()?);
    let (coverage, observations) = read_any_map(&args.map, |map| {
        let sensor = SensorPositions::read(map, args.poses.as_deref())?;
        let positions = sensor.as_ref().map(|sensor| &sensor.positions_m[..]);
        let progress = Progress::over_tiles(map.tile_indices().len());
        let counted = observations(map, positions, &options, &|done, all| progress.set(done, all))?;
        let progress = Progress::over_blocks();
        Ok((frontiers(map, &options, &|done, all| progress.set(done, all))?, counted))
    })?;
    let mut out = summary_out(args.json);
    if args.json {
        let seconds = started.elapsed().as_secs_f64();
        let (map, peak_rss_bytes) = (&*args.map, memory::peak_bytes());
        let report = Report { map, coverage, observations, seconds, peak_rss_bytes };
        json::print(&report, &mut out)?;
    } else {
        print(&coverage, &observations, &mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print(coverage: &Coverage, observations: &Observations, out: &mut impl Write) -> io::Result<()> {
    let (free, occupied) = (HumanCount(coverage.free), HumanCount(coverage.occupied));
    writeln!(out, "observed  {occupied} occupied voxels, {free} free")?;
    if let (Some(voxels), Some(share)) = (coverage.voxels_of_box, coverage.observed_share) {
        writeln!(out, "box       {:.1} % of {} observed", 100.0 * share, Counted(voxels, "voxel"))?;
    }
    print_classes("times", &observations.counts, "", out)?;
    if let Some(distances_m) = &observations.distances_m {
        print_classes("distance", distances_m, " m", out)?;
    }
    let listed = Counted(coverage.frontiers.len() as u64, "frontier");
    let (voxels, small) = (Counted(coverage.frontier_voxels, "voxel"), HumanCount(coverage.small_frontiers));
    writeln!(out, "frontiers {listed}, and {small} smaller; {voxels} in all")?;
    for frontier in coverage.frontiers.iter().take(MAX_PRINTED) {
        let [x, y, z] = frontier.goal_m;
        let voxels = Counted(frontier.voxels, "voxel");
        writeln!(
            out,
            "{:>8}  {:.2} m2, {voxels}, goal {x:.1} {y:.1} {z:.1}",
            frontier.number, frontier.area_m2
        )?;
    }
    Ok(())
}

/// Prints the shares of the occupied voxels, such as `times     1 12.0 %, 2 20.5 %, 4 67.5 %`: each class begins at its
/// number and ends where the next one begins.
fn print_classes(name: &str, classes: &[Class], unit: &str, out: &mut impl Write) -> io::Result<()> {
    let all: u64 = classes.iter().map(|class| class.voxels).sum();
    let share = |class: &Class| {
        format!("{}{unit} {:.1} %", class.from, 100.0 * class.voxels as f64 / all.max(1) as f64)
    };
    let shares: Vec<String> = classes.iter().map(share).collect();
    if !shares.is_empty() {
        writeln!(out, "{name:<9} from {}", shares.join(", from "))?;
    }
    Ok(())
}
