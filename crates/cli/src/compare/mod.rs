//! `voxtile compare`: changes between two maps, as a summary, lists, voxels and a page.

mod page;
mod pictures;

use crate::args::CompareArgs;
use crate::counted::Counted;
use crate::json;
use crate::part::region_of;
use crate::picture::name_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::stop_signal;
use indicatif::HumanCount;
use page::Page;
use pictures::Pictures;
use serde::Serialize;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::MapView;
use voxtile::{Error, Result};
use voxtile_compare::{Clusters, CompareOptions, Comparison, EpochCounts, compare};
use voxtile_pipeline::output::{OutputFile, is_standard_output};
use voxtile_pipeline::{
    AnyMap, ListFormat, WhichChanges, changes_format, check_crs, memory, read_any_maps, viewpoints_of,
    warnings_of, write_change_list, write_changed_voxels,
};

/// Number of changes in the summary for people.
const MAX_PRINTED: usize = 10;

#[derive(Serialize)]
struct Report {
    maps: [Side; 2],
    resolution_m: f64,
    crs: Option<String>,
    #[serde(flatten)]
    comparison: Comparison,
    warnings: Vec<String>,
    list: Option<String>,
    output: Option<String>,
    output_voxels: Option<u64>,
    report: Option<String>,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

/// One of the maps.
#[derive(Serialize)]
struct Side {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: PathBuf,
    snapshot: Option<String>,
    scan_number: u64,
}

/// Compares two maps, writes the requested files and prints a summary.
pub fn run(args: &CompareArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let stop = stop_signal::catch_unfinished()?;
    args.list.as_deref().map(ListFormat::of_path).transpose()?;
    args.output.as_deref().map(changes_format).transpose()?;
    let mut page = args.report.as_deref().map(page_file).transpose()?;
    let options = CompareOptions::default()
        .with_tolerance(args.tolerance)
        .with_min_voxels(args.min_voxels)
        .with_certainty(args.certainty)
        .with_region(args.region.as_deref().map(region_of).transpose()?)
        .with_memory(usize::try_from(args.memory.as_u64()).unwrap_or(usize::MAX))
        .with_stop(stop);
    let mut report = read_any_maps(&args.before, &args.after, |before, after| {
        let options = options.clone().with_viewpoints([
            viewpoints_of(before, args.poses_before.as_deref())?,
            viewpoints_of(after, args.poses_after.as_deref())?,
        ]);
        let report = report(args, &options, [(&args.before, before), (&args.after, after)])?;
        if let Some(file) = &mut page {
            write_page(&report, args, &options, [before, after], file)?;
        }
        Ok(report)
    })?;
    page.map(OutputFile::finish).transpose()?;
    report.seconds = started.elapsed().as_secs_f64();
    report.peak_rss_bytes = memory::peak_bytes();
    let mut out = summary_out(args.json);
    match args.json {
        true => json::print(&report, &mut out)?,
        false => report.print(&mut out)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn report(
    args: &CompareArgs,
    options: &CompareOptions,
    maps: [(&Path, &AnyMap); 2],
) -> anyhow::Result<Report> {
    let [(_, before), (_, after)] = maps;
    let crs = check_crs(maps)?;
    let warnings = warnings_of(maps);
    for warning in &warnings {
        log::warn!("{warning}");
    }
    let progress = Progress::over_blocks();
    let comparison = compare(before, after, options, &|done, all| progress.set(done, all))?;
    if let Some(path) = &args.list {
        write_change_list(&comparison, crs.as_deref(), path)?;
    }
    let output_voxels = match &args.output {
        Some(path) => {
            let which = if args.all { WhichChanges::All } else { WhichChanges::Listed };
            let progress = Progress::over_blocks();
            let step = |done, all| progress.set(done, all);
            Some(write_changed_voxels(before, after, options, &comparison, which, path, &step)?)
        }
        None => None,
    };
    let name = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
    Ok(Report {
        maps: maps.map(|(path, map)| Side::of(path, map)),
        resolution_m: before.config().grid.resolution_m(),
        crs,
        comparison,
        warnings,
        list: name(&args.list),
        output: name(&args.output),
        output_voxels,
        report: name(&args.report),
        seconds: 0.0,
        peak_rss_bytes: None,
    })
}

/// Creates the file of the page before maps are read, so that a wrong path is reported at once.
fn page_file(path: &Path) -> Result<OutputFile> {
    if is_standard_output(path) {
        let reason = "needs a file, because standard output is used for the summary";
        return Err(Error::argument("report", reason));
    }
    OutputFile::create(path)
}

fn write_page(
    report: &Report,
    args: &CompareArgs,
    options: &CompareOptions,
    maps: [&AnyMap; 2],
    file: &mut OutputFile,
) -> Result<()> {
    let names = [&args.before, &args.after].map(|path| name_of(path));
    let title = format!("{} to {}: {} m voxels", names[0], names[1], report.resolution_m);
    let pictures = Pictures::draw(maps, options, &report.comparison, &title)?;
    let written = Page { report, options, names, pictures }.write(file.out());
    file.written(written)
}

impl Side {
    fn of(path: &Path, map: &AnyMap) -> Self {
        let (map_path, snapshot) = match map {
            AnyMap::Map(reader) => (reader.folder(), reader.snapshot().map(ToString::to_string)),
            AnyMap::Octree(_) => (path, None),
        };
        Self { map: map_path.to_owned(), snapshot, scan_number: map.scan_number() }
    }

    fn name(&self) -> String {
        let snapshot = self.snapshot.as_ref().map_or(String::new(), |name| format!("@{name}"));
        format!("{}{snapshot}, {}", self.map.display(), Counted(self.scan_number, "scan"))
    }
}

impl Report {
    fn print(&self, out: &mut impl Write) -> io::Result<()> {
        let comparison = &self.comparison;
        let [before, after] = &self.maps;
        writeln!(out, "before    {}", before.name())?;
        writeln!(out, "after     {}", after.name())?;
        let tolerance = Counted(u64::from(comparison.tolerance_voxels), "voxel");
        let tolerance_m = f64::from(comparison.tolerance_voxels) * self.resolution_m;
        writeln!(out, "tolerance {tolerance} ({tolerance_m:.3} m)\n")?;
        writeln!(out, "{:<10} {:>19} {:>19}", "occupied", "before", "after")?;
        type Count = fn(&EpochCounts) -> Option<u64>;
        let rows: [(&str, Count); 6] = [
            ("all", |counts| Some(counts.occupied)),
            ("unchanged", |counts| Some(counts.unchanged)),
            ("changed", |counts| Some(counts.changed)),
            ("uncertain", |counts| Some(counts.uncertain)),
            ("not seen", |counts| Some(counts.not_seen)),
            ("  hidden", |counts| counts.hidden),
        ];
        for (name, count) in rows {
            let both = [&comparison.before, &comparison.after];
            let [before, after] = both.map(|counts| match count(counts) {
                Some(voxels) => {
                    format!("{:>11} {:>5.1} %", HumanCount(voxels).to_string(), percent(voxels, counts))
                }
                None => format!("{:>19}", "unknown"),
            });
            if both.into_iter().any(|counts| count(counts).is_some()) {
                writeln!(out, "{name:<10} {before} {after}")?;
            }
        }
        writeln!(out)?;
        print_clusters("vanished", &comparison.vanished, out)?;
        print_clusters("appeared", &comparison.appeared, out)?;
        for change in comparison.changes.iter().take(MAX_PRINTED) {
            let [x, y, z] = change.center_m;
            let size: [f64; 3] = std::array::from_fn(|k| change.bounds_m.max[k] - change.bounds_m.min[k]);
            let voxels = Counted(change.voxels, "voxel");
            writeln!(
                out,
                "{:>8}  {} {voxels} at {x:.1} {y:.1} {z:.1}, {:.1} x {:.1} x {:.1} m",
                change.number,
                change.kind.name(),
                size[0],
                size[1],
                size[2]
            )?;
        }
        let rest = comparison.changes.len().saturating_sub(MAX_PRINTED);
        if rest > 0 && self.list.is_none() {
            writeln!(out, "          and {rest} more: --list writes all")?;
        }
        for path in [&self.list, &self.output, &self.report].into_iter().flatten() {
            writeln!(out, "wrote     {path}")?;
        }
        Ok(())
    }
}

fn percent(count: u64, counts: &EpochCounts) -> f64 {
    100.0 * count as f64 / counts.occupied.max(1) as f64
}

fn print_clusters(name: &str, clusters: &Clusters, out: &mut impl Write) -> io::Result<()> {
    write!(
        out,
        "{name}  {} of {}",
        Counted(clusters.clusters, "cluster"),
        Counted(clusters.voxels, "voxel")
    )?;
    if clusters.small_clusters > 0 {
        let smaller = Counted(clusters.small_clusters, "smaller one");
        write!(out, "; {smaller} of {} not listed", Counted(clusters.small_voxels, "voxel"))?;
    }
    writeln!(out)
}
