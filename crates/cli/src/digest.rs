use crate::args::DigestArgs;
use crate::json;
use std::io::Write;
use std::process::ExitCode;
use voxtile::MapQueries;
use voxtile::mapper::MapView;
use voxtile_pipeline::memory;
use voxtile_pipeline::{read_any_map, read_map, scan_digest};

pub fn run(args: &DigestArgs) -> anyhow::Result<ExitCode> {
    let (digest, scan_number) = match args.scans {
        true => read_map(&args.map, |map| Ok((scan_digest(map)?, map.scan_number())))?,
        false => read_any_map(&args.map, |map| {
            let digest = if args.layers { map.layer_digest()? } else { map.digest()? };
            Ok((digest, map.scan_number()))
        })?,
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        let digest = digest.to_string();
        let peak = memory::peak_bytes();
        let answer =
            serde_json::json!({ "digest": digest, "scan_number": scan_number, "peak_rss_bytes": peak });
        json::print(&answer, &mut out)?;
    } else {
        writeln!(out, "{digest}")?;
    }
    Ok(ExitCode::SUCCESS)
}
