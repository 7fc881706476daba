use crate::args::DigestArgs;
use crate::json;
use std::io::Write;
use std::process::ExitCode;
use voxtile::MapQueries;
use voxtile::mapper::MapView;
use voxtile_pipeline::memory;
use voxtile_pipeline::read_any_map;

pub fn run(args: &DigestArgs) -> anyhow::Result<ExitCode> {
    let (digest, scan_number) = read_any_map(&args.map, |reader| {
        let digest = if args.layers { reader.layer_digest()? } else { reader.digest()? };
        Ok((digest, reader.scan_number()))
    })?;
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
