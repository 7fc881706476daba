use crate::kept_source::{KeptSource, is_map};
use crate::new_poses::PoseFile;
use crate::place::url_of;
use crate::scan_place::scans_at;
use crate::watch::Watch;
use std::io::{BufReader, stdin};
use std::path::Path;
use voxtile::{Error, Result};
use voxtile_formats::{ReadOptions, ScanSource, open_scans, read_scan_stream};

/// Maximum length of an input name stored in a map, in characters.
const MAX_LETTERS: usize = 200;

/// Returns whether the scans are read from standard input.
pub fn is_standard_input(scans: &Path) -> bool {
    scans == Path::new("-")
}

/// Opens scans. Standard input must be a scan stream. Waiting for a bucket can be stopped.
///
/// # Errors
///
/// The input cannot be read, the options do not fit it, or [`Error::Stopped`].
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
        return Err(Error::argument("poses", "a scan stream has its own poses; omit the option"));
    }
    let input = BufReader::with_capacity(1 << 18, stdin());
    let stream = read_scan_stream(input, Path::new("standard input"), false)?;
    Ok(options.selection.clone().of(Box::new(stream)))
}

/// Returns the display name of an input stored in the map: the last component of its path (the last two if it is
/// `scans`), or the label of a stream.
pub fn name_of(scans: &Path, source: &dyn ScanSource) -> String {
    if is_standard_input(scans) {
        return source.fingerprint().unwrap_or_else(|_| "standard input".to_owned());
    }
    name_of_path(scans)
}

/// As [`name_of`], for a path.
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
