use crate::args::ConvertArgs;
use crate::json;
use voxtile_pipeline::{read_map, whole_map};

use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::written::warn_of_scans_left;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::{MapReader, MapView};
use voxtile::operations::{CopyScans, WrittenMap, convert};
use voxtile::{Result, Storage};
use voxtile_pipeline::memory;

#[derive(Serialize)]
struct Conversion<'a> {
    from: Form<'a>,
    to: Form<'a>,
    scan_number: u64,
    tiles: u64,
    voxels: u64,
    occupied: u64,
    warnings: Vec<String>,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

#[derive(Serialize)]
struct Form<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    storage: Storage,
    /// Size in bytes; `None` for a map of the original format, which does not record sizes.
    table_bytes: Option<u64>,
    octree_bytes: Option<u64>,
}

pub fn run(args: &ConvertArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let progress = Progress::over_tiles(0);
    let mut conversion = read_map(&args.map, |reader| {
        let scans = if args.drop_scans { CopyScans::No } else { CopyScans::Yes };
        let written = convert(reader, whole_map(&args.output)?, args.storage.into(), scans, |done, all| {
            progress.set(done, all)
        })?;
        Ok(Conversion::of(args, reader, &written)?)
    })?;
    drop(progress);
    conversion.seconds = started.elapsed().as_secs_f64();
    conversion.peak_rss_bytes = memory::peak_bytes();
    let mut out = summary_out(args.json);
    if args.json {
        json::print(&conversion, &mut out)?;
    } else {
        conversion.print(&mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl<'a> Conversion<'a> {
    fn of(args: &'a ConvertArgs, reader: &MapReader, written: &WrittenMap) -> Result<Self> {
        let (table_bytes, octree_bytes) = reader.disk_bytes().unzip();
        let from = Form { map: &args.map, storage: reader.config().storage, table_bytes, octree_bytes };
        let to = Form {
            map: &args.output,
            storage: args.storage.into(),
            table_bytes: Some(written.table_bytes),
            octree_bytes: Some(written.octree_bytes),
        };
        let WrittenMap { tiles, voxels, occupied, .. } = *written;
        let (scan_number, seconds, peak_rss_bytes) = (reader.scan_number(), 0.0, None);
        let warnings = if args.drop_scans { warn_of_scans_left([reader]) } else { Vec::new() };
        Ok(Self { from, to, scan_number, tiles, voxels, occupied, warnings, seconds, peak_rss_bytes })
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let (voxels, occupied) = (HumanCount(self.voxels), HumanCount(self.occupied));
        writeln!(out, "map       {}", self.to.map.display())?;
        writeln!(out, "voxels    {voxels}, {occupied} occupied")?;
        writeln!(out, "tiles     {}, {} on disk", HumanCount(self.tiles), HumanBytes(self.to.bytes()))?;
        if self.from.table_bytes.is_some() {
            let (before, storage) = (HumanBytes(self.from.bytes()), self.from.storage);
            let ratio = self.to.bytes() as f64 / self.from.bytes().max(1) as f64;
            writeln!(out, "before    {before} with {storage} storage; now {:.1} % of it", 100.0 * ratio)?;
        }
        writeln!(out, "time      {:.1} s", self.seconds)
    }
}

impl Form<'_> {
    fn bytes(&self) -> u64 {
        self.table_bytes.unwrap_or_default() + self.octree_bytes.unwrap_or_default()
    }
}
