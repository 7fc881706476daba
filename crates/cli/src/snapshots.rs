use crate::args::SnapshotsArgs;
use crate::counted::Counted;
use crate::json;
use indicatif::HumanBytes;
use std::io::Write;
use std::process::ExitCode;
use voxtile::operations::{SnapshotInfo, snapshots};
use voxtile_pipeline::check_is_no_file;
use voxtile_pipeline::place::place_of;

pub fn run(args: &SnapshotsArgs) -> anyhow::Result<ExitCode> {
    check_is_no_file(&args.map)?;
    let infos = snapshots(place_of(&args.map)?)?;
    let mut out = std::io::stdout().lock();
    if args.json {
        let answer = serde_json::json!({ "map": args.map.display().to_string(), "snapshots": infos });
        json::print(&answer, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    if infos.is_empty() {
        writeln!(out, "no snapshots")?;
    }
    let width = infos.iter().map(|info| info.name.len()).max().unwrap_or_default();
    for info in &infos {
        print(info, width, &mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print(info: &SnapshotInfo, width: usize, out: &mut impl Write) -> std::io::Result<()> {
    let SnapshotInfo { name, flush_number, scan_number, tiles, own_bytes, damage, .. } = info;
    if let Some(damage) = damage {
        return writeln!(out, "{name:width$}  {damage}");
    }
    let (tiles, own) = (Counted(*tiles, "tile"), HumanBytes(*own_bytes));
    writeln!(out, "{name:width$}  flush {flush_number}, scan {scan_number}, {tiles}, {own} used only by it")
}
