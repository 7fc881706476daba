use std::io::BufReader;
use std::path::Path;
use voxtile::io::{ScanSource, open_scans, read_scan_stream};
use voxtile::{Error, Result};

/// Whether scans are to come from standard input.
pub fn is_standard_input(scans: &Path) -> bool {
    scans == Path::new("-")
}

/// Opens scans, which are a scan stream if they come from standard input.
pub fn open(scans: &Path, poses: Option<&Path>) -> Result<Box<dyn ScanSource>> {
    if !is_standard_input(scans) {
        return open_scans(scans, poses);
    }
    if poses.is_some() {
        return Err(Error::argument("--poses", "a scan stream has its own poses; leave the option out"));
    }
    let input = BufReader::with_capacity(1 << 18, std::io::stdin().lock());
    Ok(Box::new(read_scan_stream(input, Path::new("standard input"), false)?))
}
