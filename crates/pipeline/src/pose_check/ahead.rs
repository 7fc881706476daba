use super::check::PoseCheck;
use crate::scan_input::ScanInput;
use crate::watch::Watch;
use std::path::Path;
use voxtile::Result;
use voxtile_formats::{PointBudget, ReadOptions};

/// Checks the poses of an input before anything is mapped. Returns `false` if the input or its poses cannot be read
/// twice.
///
/// # Errors
///
/// The poses do not fit the scans, or the input cannot be opened.
pub fn check_ahead(
    scans: &ScanInput,
    options: &ReadOptions,
    budget: &PointBudget,
    watch: &Watch,
) -> Result<bool> {
    let may_be_read_twice = |path: &Path| path.is_file() || path.is_dir();
    // `poses` may be `identity`, which is not a file.
    let poses = options.poses.as_deref().filter(|path| path.exists());
    if !scans.is_on_disk() || !poses.is_none_or(may_be_read_twice) {
        return Ok(false);
    }
    // These reads do not count for the selection of the build.
    let selection = options.selection.clone().of_one_input();
    let mut source = scans.open(&ReadOptions { selection, ..options.clone() }, watch)?;
    let Some(mut check) = PoseCheck::of(options, &source.pose_source(), scans.first()) else {
        return Ok(true);
    };
    while !check.is_done() && !watch.stop().is_set() {
        let doubt = match source.next_stored(budget) {
            Ok(Some(scan)) => check.take(&scan)?,
            Ok(None) => check.finish()?,
            Err(_) if source.pass_unread() => None,
            // The build reports this error later.
            Err(_) => check.finish()?,
        };
        if let Some(doubt) = doubt {
            return Err(doubt.refusal());
        }
    }
    Ok(true)
}
