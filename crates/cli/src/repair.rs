use crate::args::RepairArgs;
use crate::counted::Counted;
use crate::json;
use crate::progress::Progress;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::process::ExitCode;
use voxtile::integrity::{Action, Repair, repair};
use voxtile_pipeline::whole_map;

/// Maximum number of actions in JSON; the summary counts all.
const MAX_ACTIONS: usize = 10_000;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a std::path::Path,
    #[serde(flatten)]
    repair: Repair,
    done: Vec<Action>,
}

pub fn run(args: &RepairArgs) -> anyhow::Result<ExitCode> {
    let progress = Progress::over_tiles(0);
    let mut done = Vec::new();
    let repair = repair(
        whole_map(&args.map)?,
        |action| {
            if !args.json {
                progress.print(&action.to_string());
            } else if done.len() < MAX_ACTIONS {
                done.push(action.clone());
            }
        },
        |tiles, all| progress.set(tiles, all),
    )?;
    drop(progress);
    let is_complete = repair.is_complete();
    let mut out = std::io::stdout().lock();
    if args.json {
        json::print(&Report { map: &args.map, repair, done }, &mut out)?;
    } else if repair.actions == 0 {
        writeln!(out, "nothing to repair in {}", Counted(repair.tiles, "tile"))?;
    } else {
        let (tiles, lost) = (Counted(repair.tiles, "tile"), HumanCount(repair.tiles_lost));
        writeln!(out, "repaired: the map has {tiles}; lost tiles: {lost}, their space is unknown")?;
        if repair.snapshots_lost + repair.snapshot_tiles_lost > 0 {
            let (snapshots, tiles) =
                (HumanCount(repair.snapshots_lost), Counted(repair.snapshot_tiles_lost, "tile"));
            writeln!(out, "snapshots: {snapshots} lost; others lost {tiles}")?;
        }
        if repair.scans_lost + repair.snapshot_scans_lost > 0 {
            let (scans, of_snapshots) =
                (HumanCount(repair.scans_lost), HumanCount(repair.snapshot_scans_lost));
            writeln!(
                out,
                "kept scans: {scans} of the map and {of_snapshots} of snapshots are lost; a map or snapshot that lost \
                 some cannot be replayed"
            )?;
        }
        if repair.marks_lost > 0 {
            let scans = Counted(repair.marks_lost, "kept scan");
            writeln!(
                out,
                "marks of moving points: those of {scans} are lost; mark them again with `voxtile clean`, or remove all \
                 with `voxtile clean --undo`"
            )?;
        }
        if repair.inputs_forgotten > 0 {
            let inputs = HumanCount(repair.inputs_forgotten);
            writeln!(
                out,
                "inputs: {inputs} removed from the list, because the number of their scans in the map is unknown"
            )?;
        }
        if repair.left > 0 {
            let left = Counted(repair.left, "tile");
            writeln!(
                out,
                "still damaged: {left}, because the disk reports errors; copy the map to another disk"
            )?;
        }
    }
    // Scripts must not treat an incomplete map as intact.
    Ok(if is_complete { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
