use std::fs::{self, File};
use std::io;
use std::path::Path;
use voxtile::store::check_outside_of_maps;
use voxtile::{Error, Result};

/// Returns whether a path denotes standard output.
pub fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

/// Kind of output target.
pub(super) enum TargetKind {
    File,
    Stream,
}

pub(super) fn target_kind(target: &Path) -> Result<TargetKind> {
    if is_standard_output(target) {
        return Ok(TargetKind::Stream);
    }
    check_target(target)
}

pub(super) fn check_target(target: &Path) -> Result<TargetKind> {
    let reason = match fs::symlink_metadata(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(Error::io(target, "look at", error)),
        Ok(metadata) if metadata.is_file() => None,
        Ok(metadata) if metadata.is_dir() => Some("is a folder: use a file in it"),
        Ok(metadata) if metadata.is_symlink() => {
            Some("is a symbolic link, which is not followed: use its target, or - for standard output")
        }
        // A pipe or a device.
        Ok(_) => return Ok(TargetKind::Stream),
    };
    if target.file_name().is_none() {
        return Err(Error::argument("output", format!("{} is not a file name", target.display())));
    }
    match reason {
        Some(reason) => Err(Error::argument("output", format!("{} {reason}", target.display()))),
        None => check_outside_of_maps(target).map(|()| TargetKind::File),
    }
}

pub(super) fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    // Only Unix can open and sync a folder. A writable folder may be unreadable.
    match File::open(folder) {
        Ok(folder) if cfg!(unix) => folder.sync_all(),
        _ => Ok(()),
    }
}
