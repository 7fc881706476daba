use crate::args::SnapshotArgs;
use crate::counted::Counted;
use crate::json;
use crate::quiet::summary_out;
use std::io::Write;
use std::process::ExitCode;
use voxtile::operations::{SnapshotInfo, delete_snapshot, new_snapshot, snapshot, snapshots};
use voxtile_pipeline::whole_map;

pub fn run(args: &SnapshotArgs) -> anyhow::Result<ExitCode> {
    let map = whole_map(&args.map)?;
    let was_there = !args.delete && new_snapshot(map, &args.name).is_ok();
    let info = if args.delete {
        // Read before it is deleted.
        let info = snapshots(map)?.into_iter().find(|info| info.name == args.name.as_str());
        delete_snapshot(map, &args.name)?;
        info
    } else {
        snapshot(map, &args.name)?;
        // The snapshot exists even if this read fails.
        new_snapshot(map, &args.name).inspect_err(|error| log::warn!("{error:#}")).ok()
    };
    let mut out = summary_out(args.json);
    if args.json {
        let answer = serde_json::json!({ "map": args.map.display().to_string(), "deleted": args.delete, "snapshot": info });
        json::print(&answer, &mut out)?;
    } else if args.delete {
        writeln!(out, "deleted   {}", args.name)?;
    } else if info.is_none() {
        writeln!(out, "kept      {}", args.name)?;
    } else if let Some(SnapshotInfo { name, flush_number, scan_number, tiles, .. }) = info {
        let before = if was_there { "; already existed" } else { "" };
        let tiles = Counted(tiles, "tile");
        writeln!(out, "kept      {name}: flush {flush_number}, scan {scan_number}, {tiles}{before}")?;
    }
    Ok(ExitCode::SUCCESS)
}
