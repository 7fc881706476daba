use crate::args::VerifyArgs;
use crate::counted::Counted;
use crate::json;
use crate::progress::Progress;
use indicatif::HumanBytes;
use serde::Serialize;
use std::io::Write;
use std::process::ExitCode;
use voxtile::integrity::{Finding, Verification, verify};
use voxtile_pipeline::memory;
use voxtile_pipeline::place::{place_of, url_of};
use voxtile_pipeline::whole_map;

/// Maximum number of findings in JSON; the summary counts all.
const MAX_FINDINGS: usize = 10_000;

#[derive(Serialize)]
struct Report<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a std::path::Path,
    whole: bool,
    #[serde(flatten)]
    verification: Verification,
    findings: Vec<Finding>,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &VerifyArgs) -> anyhow::Result<ExitCode> {
    let map = match url_of(&args.map) {
        Some(_) => place_of(&args.map)?,
        None => whole_map(&args.map)?.into(),
    };
    let progress = Progress::over_tiles(0);
    let mut findings = Vec::new();
    let verification = verify(
        map,
        |finding| {
            if !args.json {
                progress.print(&finding.to_string());
            } else if findings.len() < MAX_FINDINGS {
                findings.push(finding.clone());
            }
        },
        |done, all| progress.set(done, all),
    )?;
    drop(progress);
    let whole = verification.is_whole();
    let mut out = std::io::stdout().lock();
    if args.json {
        let peak_rss_bytes = memory::peak_bytes();
        let report = Report { map: &args.map, whole, verification, findings, peak_rss_bytes };
        json::print(&report, &mut out)?;
    } else {
        print(args, &verification, &mut out)?;
    }
    Ok(if whole { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print(args: &VerifyArgs, verification: &Verification, out: &mut impl Write) -> std::io::Result<()> {
    let Verification {
        verified,
        flush_number,
        scan_number,
        tiles,
        voxels,
        table_bytes,
        damage,
        leftovers,
        unsettled,
        snapshots,
        ..
    } = verification;
    writeln!(
        out,
        "{}, {}, {} of tables; flush {flush_number}, scan {scan_number}",
        Counted(*tiles, "tile"),
        Counted(*voxels, "voxel"),
        HumanBytes(*table_bytes)
    )?;
    if *snapshots > 0 {
        writeln!(out, "{}", Counted(*snapshots, "snapshot"))?;
    }
    if *leftovers > 0 {
        let (leftovers, map) = (Counted(*leftovers, "file"), args.map.display());
        writeln!(
            out,
            "leftovers: {leftovers}, named above, must still be removed or renamed. The \
             next process that opens the map for writing completes this, and so does `voxtile repair {map}`."
        )?;
    }
    match (damage, verified) {
        (0, _) if *unsettled > 0 => writeln!(
            out,
            "undecided: {}, because the map kept changing; run verify while no process writes",
            Counted(*unsettled, "possible fault")
        ),
        (0, true) => writeln!(out, "intact: all checksums match"),
        (0, false) => writeln!(out, "unverified: the map has no checksums; its tables are well-formed"),
        (damage, _) if url_of(&args.map).is_some() => {
            let findings = Counted(*damage, "finding");
            writeln!(
                out,
                "damaged: {findings}; send the map again with `voxtile push --resend` from its folder"
            )
        }
        (damage, _) => {
            let (findings, map) = (Counted(*damage, "finding"), args.map.display());
            writeln!(out, "damaged: {findings}; restore files from a backup, or run `voxtile repair {map}`")
        }
    }
}
