use crate::kept_source::{KeptSource, is_map};
use crate::new_poses::PoseFile;
use crate::place::url_of;
use crate::scan_place::scans_at;
use crate::watch::Watch;
use std::io::{BufReader, stdin};
use std::path::Path;
use voxtile::{Error, Result};
use voxtile_formats::{ReadOptions, ScanSource, open_scans, read_scan_stream};

/// Most letters of an input's name that a map keeps.
const MAX_LETTERS: usize = 200;

/// Whether scans are to come from standard input.
pub fn is_standard_input(scans: &Path) -> bool {
    scans == Path::new("-")
}

/// Opens scans, which are a scan stream if they come from standard input. Once it is to stop, nothing waits for a
/// bucket.
///
/// # Errors
///
/// An input that cannot be read, options that do not fit it; [`Error::Stopped`].
pub fn open(scans: &Path, options: &ReadOptions, watch: &Watch) -> Result<Box<dyn ScanSource + Send>> {
    if options.format.is_none() && is_map(scans, watch.stop())? {
        let source = KeptSource::open(scans, PoseFile::of_reading(options).as_ref())?;
        return Ok(options.selection.clone().of(Box::new(source)));
    }
    if let Some(url) = url_of(scans) {
        return scans_at(url, options, watch);
    }
    if !is_standard_input(scans) {
        return open_scans(scans, options);
    }
    if options.poses.is_some() {
        return Err(Error::argument("poses", "a scan stream has its own poses; leave the option out"));
    }
    let input = BufReader::with_capacity(1 << 18, stdin());
    let stream = read_scan_stream(input, Path::new("standard input"), false)?;
    Ok(options.selection.clone().of(Box::new(stream)))
}

/// What a map calls an input, for people: the last part of its path (the last two, where that is `scans`), or the label
/// of a stream.
pub fn name_of(scans: &Path, source: &dyn ScanSource) -> String {
    if is_standard_input(scans) {
        return source.fingerprint().unwrap_or_else(|_| "standard input".to_owned());
    }
    name_of_path(scans)
}

/// The same of a path.
pub fn name_of_path(scans: &Path) -> String {
    let path = scans.canonicalize().unwrap_or_else(|_| scans.to_owned());
    let part = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let last = part(&path).unwrap_or_else(|| scans.display().to_string());
    let name = match path.parent().and_then(part) {
        Some(parent) if last == "scans" => format!("{parent}/{last}"),
        _ => last,
    };
    name.chars().take(MAX_LETTERS).collect()
}
