use crate::args::ScansArgs;
use crate::json;
use crate::option_names::with_options;
use crate::progress::{Progress, at_terminal};
use crate::read_options::read_options;
use crate::stop_signal;
use anyhow::Context;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::{BufWriter, IntoInnerError, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tempfile::SpooledTempFile;
use voxtile::mapper::MapReader;
use voxtile::scan::Stop;
use voxtile::space::Point;
use voxtile::store::ScanRecord;
use voxtile_formats::{PointBudget, ScanSource};
use voxtile_pipeline::LocalScans;
use voxtile_pipeline::place::url_of;
use voxtile_pipeline::read_map;

/// Memory for the points of a scan, in bytes; larger scans use a temporary file.
const POINTS_BYTES: usize = 64 << 20;

/// Memory for the rows of a map, in bytes; longer lists use a temporary file.
const ROWS_BYTES: usize = 4 << 20;

#[derive(Debug, Default, Serialize)]
struct Overview {
    format: String,
    scans: u64,
    /// `None` for a map without kept scans.
    points: Option<u64>,
    /// Number of points that are marked as moving, of a map with kept scans.
    moving_points: Option<u64>,
    /// Size on disk of the kept scans, in bytes.
    kept_bytes: Option<u64>,
    first_stamp_ns: Option<i64>,
    last_stamp_ns: Option<i64>,
    fields: Vec<String>,
    poses: Option<String>,
    remarks: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Row {
    number: u64,
    name: Option<String>,
    stamp_ns: Option<i64>,
    points: Option<u64>,
    /// Number of points that are marked as moving, if the map keeps the scan.
    moving_points: Option<u64>,
    /// Number of tiles that the scan updated, if the map keeps the scan.
    tiles: Option<u64>,
    /// Size on disk in bytes, if the map keeps the scan.
    kept_bytes: Option<u64>,
    origin_m: Point,
}

pub fn run(args: &ScansArgs) -> anyhow::Result<ExitCode> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    let overview = match &args.data[..] {
        [map] if is_map(map)? => of_map(map, args, &mut out)?,
        _ => of_input(args, &mut out)?,
    };
    if args.json {
        json::print(&overview, &mut out)?;
    } else {
        overview.print(&args.data, &mut out)?;
    }
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

fn is_map(path: &Path) -> voxtile::Result<bool> {
    let has_metadata = |path: &Path| path.join("metadata.json").is_file();
    let text = path.to_str().and_then(|text| text.rsplit_once('@'));
    match url_of(path) {
        // There are no temporary files to remove yet, so signals keep their default action.
        Some(_) => voxtile_pipeline::is_map(path, &Stop::default()),
        None => Ok(has_metadata(path) || text.is_some_and(|(map, _)| has_metadata(Path::new(map)))),
    }
}

fn of_map(map: &Path, args: &ScansArgs, out: &mut impl Write) -> anyhow::Result<Overview> {
    // `read_map` may repeat this closure after a failure: print only after it succeeds.
    let (overview, mut rows) = read_map(map, |reader| {
        let mut rows = BufWriter::new(SpooledTempFile::new(ROWS_BYTES));
        let overview = listed(reader, args, &mut rows)?;
        Ok((overview, rows.into_inner().map_err(IntoInnerError::into_error)?))
    })?;
    rows.rewind()?;
    std::io::copy(&mut rows, out)?;
    Ok(overview)
}

/// Lists the scans of one state of a map.
fn listed(reader: &MapReader, args: &ScansArgs, rows: &mut impl Write) -> anyhow::Result<Overview> {
    let mut overview = Overview { format: "map".to_owned(), ..Overview::default() };
    if !reader.keeps_scans() {
        overview.remarks.push("the map keeps no scans; build with --keep-scans to list them".to_owned());
        reader.scans()?.iter().try_for_each(|scan| overview.add(&Row::of(scan), args, rows))?;
        return Ok(overview);
    }
    (overview.points, overview.moving_points) = (Some(0), Some(0));
    let mut scans = reader.kept_scans()?;
    while let Some(scan) = scans.next_record()? {
        let listed = ScanRecord::new(scan.number, scan.stamp_ns, scan.origin_m());
        let (points, tiles) = (Some(scan.points), Some(scan.tiles.len() as u64));
        let kept_bytes = scan.places().map(|place| place.bytes).sum();
        let moving_points = Some(scan.moving.map_or(0, |marks| marks.marked));
        let row = Row { points, moving_points, tiles, kept_bytes: Some(kept_bytes), ..Row::of(&listed) };
        overview.kept_bytes = Some(overview.kept_bytes.unwrap_or_default() + kept_bytes);
        overview.moving_points = overview.moving_points.zip(moving_points).map(|(all, some)| all + some);
        overview.add(&row, args, rows)?;
    }
    let not_kept = (reader.scans()?.len() as u64).saturating_sub(overview.scans);
    if not_kept > 0 {
        overview.remarks.push(format!("{not_kept} more scans are in the map, but not kept"));
    }
    Ok(overview)
}

fn of_input(args: &ScansArgs, out: &mut impl Write) -> anyhow::Result<Overview> {
    let mut options = read_options(&args.read)?;
    // List clouds without poses too, with a remark; a build would skip them.
    options.clouds.may_lack_poses = true;
    let watch = at_terminal(stop_signal::catch_if_fetched(&args.data)?);
    let local = LocalScans::of(&args.data, &options, &watch)?;
    let mut source: Box<dyn ScanSource + Send> = local.inputs().open(&options, &watch)?;
    let progress = Progress::over_scans(source.len_hint());
    let room = PointBudget::new(POINTS_BYTES, &std::env::temp_dir());
    let mut overview = Overview { format: source.format(), points: Some(0), ..Overview::default() };
    overview.poses = Some(source.pose_source().to_string());
    while let Some(scan) =
        source.next_stored(&room).with_context(|| format!("after {} scans", overview.scans))?
    {
        let row = Row {
            number: overview.scans,
            name: Some(scan.name.clone()),
            stamp_ns: scan.stamp_ns,
            points: Some(scan.points_in_sensor.len() as u64),
            moving_points: None,
            tiles: None,
            kept_bytes: None,
            origin_m: scan.world_from_sensor.position_m(),
        };
        overview.add(&row, args, out)?;
        progress.step();
        watch.stop().check()?;
    }
    overview.fields = source.fields();
    overview.remarks = source.remarks().iter().map(|remark| with_options(remark).into_owned()).collect();
    Ok(overview)
}

impl Overview {
    fn add(&mut self, row: &Row, args: &ScansArgs, out: &mut impl Write) -> anyhow::Result<()> {
        self.scans += 1;
        self.points = self.points.map(|points| points + row.points.unwrap_or_default());
        if let Some(stamp_ns) = row.stamp_ns {
            self.first_stamp_ns = Some(self.first_stamp_ns.map_or(stamp_ns, |first| first.min(stamp_ns)));
            self.last_stamp_ns = Some(self.last_stamp_ns.map_or(stamp_ns, |last| last.max(stamp_ns)));
        }
        match (args.each, args.json) {
            (false, _) => {}
            (true, true) => json::print(row, out)?,
            (true, false) => row.print(out)?,
        }
        Ok(())
    }

    fn print(&self, data: &[PathBuf], out: &mut impl Write) -> std::io::Result<()> {
        let first = data.first().map(|path| path.display().to_string()).unwrap_or_default();
        let others = match data.len() {
            0 | 1 => String::new(),
            paths => format!(" and {} more", paths - 1),
        };
        writeln!(out, "input     {first}{others}: {}", self.format)?;
        let points = self.points.map_or(String::new(), |points| format!(", {} points", HumanCount(points)));
        writeln!(out, "scans     {}{points}", HumanCount(self.scans))?;
        if let Some(moving @ 1..) = self.moving_points {
            writeln!(out, "moving    {} points are marked (voxtile clean)", HumanCount(moving))?;
        }
        if let (Some(bytes), Some(points)) = (self.kept_bytes, self.points) {
            let a_point = bytes as f64 / points.max(1) as f64;
            writeln!(out, "kept      {}, {a_point:.2} bytes per point", HumanBytes(bytes))?;
        }
        if let (Some(first), Some(last)) = (self.first_stamp_ns, self.last_stamp_ns) {
            let (first, span) = (seconds(first), last.saturating_sub(first));
            writeln!(out, "time      {first} to {} s: {:.1} s", seconds(last), span as f64 * 1e-9)?;
        }
        if !self.fields.is_empty() {
            writeln!(out, "fields    {}", self.fields.join(" "))?;
        }
        if let Some(poses) = &self.poses {
            writeln!(out, "poses     {poses}")?;
        }
        self.remarks.iter().try_for_each(|remark| writeln!(out, "note      {remark}"))
    }
}

impl Row {
    fn of(scan: &ScanRecord) -> Self {
        Self {
            number: scan.number,
            name: None,
            stamp_ns: scan.stamp_ns,
            points: None,
            moving_points: None,
            tiles: None,
            kept_bytes: None,
            origin_m: scan.origin_m,
        }
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let stamp = self.stamp_ns.map_or("-".to_owned(), seconds);
        let [x, y, z] = self.origin_m;
        write!(out, "{:>8}  {stamp:>20}  {x:.3} {y:.3} {z:.3}", self.number)?;
        if let Some(points) = self.points {
            write!(out, "  {points} points")?;
        }
        if let Some(moving @ 1..) = self.moving_points {
            write!(out, " ({moving} moving)")?;
        }
        if let Some(tiles) = self.tiles {
            write!(out, "  {tiles} tiles")?;
        }
        writeln!(out, "  {}", self.name.as_deref().unwrap_or_default())
    }
}

/// Formats nanoseconds as seconds, exactly.
fn seconds(stamp_ns: i64) -> String {
    let (whole, rest) = (stamp_ns.div_euclid(1_000_000_000), stamp_ns.rem_euclid(1_000_000_000));
    format!("{whole}.{rest:09}")
}
