use super::manifest::Manifest;
use super::object_name::ObjectName;
use std::fmt::Write as _;
use std::io::{self, Read, Write as _};
use std::path::Path;
use voxtile::store::{Disk, EntryKind};
use voxtile::{Error, Result};

/// States of a map that were pushed from its folder or pulled into it, by the checksums of their manifests. The folder
/// builds on these states. They are stored in a file in the folder, so that a moved or copied folder keeps them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct KnownStates(Vec<KnownState>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct KnownState {
    flush_number: u64,
    name: ObjectName,
    /// Whether the state was in a bucket. Otherwise, a push was about to write it.
    was_in_bucket: bool,
}

/// Name of the file in the map's folder, and of the temporary file that replaces it.
pub(super) const BUCKET_STATES: &str = "bucket_states";
pub(super) const BUCKET_STATES_NEXT: &str = "bucket_states.next";

/// Maximum number of states; the oldest are dropped.
const MAX_STATES: usize = 256;

/// Maximum size of the file that is read, in bytes: more than the maximum number of states needs.
const MAX_BYTES: u64 = 1 << 16;

impl KnownStates {
    /// Reads the states of a folder; `None` if the file does not exist. Invalid lines are ignored.
    pub(super) fn read(disk: &dyn Disk, folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(BUCKET_STATES);
        let failed = |error| Error::io(&path, "read", error);
        if !matches!(disk.kind(&path).map_err(failed)?, Some(EntryKind::File(_))) {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        disk.open(&path).and_then(|input| input.take(MAX_BYTES).read_to_end(&mut bytes)).map_err(failed)?;
        let text = String::from_utf8_lossy(&bytes);
        Ok(Some(Self(text.lines().filter_map(KnownState::of_line).collect())))
    }

    /// Returns whether the folder builds on a state.
    pub(super) fn contains(&self, state: ObjectName) -> bool {
        self.0.iter().any(|known| known.name == state)
    }

    /// Returns whether the state of a flush was in a bucket.
    pub(super) fn was_in_bucket(&self, flush_number: u64) -> bool {
        self.0.iter().any(|known| known.was_in_bucket && known.flush_number == flush_number)
    }

    /// Adds a state as the newest.
    pub(super) fn add(&mut self, manifest: &Manifest, name: ObjectName, was_in_bucket: bool) {
        self.0.retain(|known| known.name != name);
        self.0.push(KnownState { flush_number: manifest.flush_number, name, was_in_bucket });
        self.0.drain(..self.0.len().saturating_sub(MAX_STATES));
    }

    /// Writes the states durably and atomically.
    pub(super) fn write(&self, disk: &dyn Disk, folder: &Path) -> Result<()> {
        let [path, next] = [BUCKET_STATES, BUCKET_STATES_NEXT].map(|name| folder.join(name));
        let write = || -> io::Result<()> {
            let mut out = disk.create(&next)?;
            out.write_all(self.to_text().as_bytes())?;
            out.flush()?;
            out.sync()?;
            drop(out);
            disk.rename(&next, &path)?;
            disk.sync_folder(folder)
        };
        write().map_err(|error| {
            // Remove the temporary file: a later call would overwrite it, but there may be none.
            let _ = disk.remove_file(&next);
            Error::io(&path, "write", error)
        })
    }

    fn to_text(&self) -> String {
        let mut text = String::new();
        for KnownState { flush_number, name, was_in_bucket } in &self.0 {
            let how = if *was_in_bucket { IN_BUCKET } else { OFFERED };
            let _ = writeln!(text, "{how} {flush_number} {name}");
        }
        text
    }
}

const IN_BUCKET: &str = "there";
const OFFERED: &str = "offered";

impl KnownState {
    fn of_line(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        let was_in_bucket = match words.next()? {
            IN_BUCKET => true,
            OFFERED => false,
            _ => return None,
        };
        let flush_number = words.next()?.parse().ok()?;
        let name = ObjectName::from_digits(words.next()?)?;
        words.next().is_none().then_some(Self { flush_number, name, was_in_bucket })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::store::FsDisk;

    fn state(flush_number: u64) -> (Manifest, ObjectName) {
        (Manifest::new(None, flush_number, 0), ObjectName::of(&flush_number.to_le_bytes()))
    }

    #[test]
    fn states_are_read_back_and_the_newest_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(KnownStates::read(&FsDisk, folder.path()).unwrap(), None);
        let mut states = KnownStates::default();
        for number in 0..300 {
            let (manifest, name) = state(number);
            states.add(&manifest, name, number % 2 == 0);
        }
        states.write(&FsDisk, folder.path()).unwrap();
        let read = KnownStates::read(&FsDisk, folder.path()).unwrap().unwrap();
        assert_eq!(read, states);
        assert!(!read.contains(state(43).1) && read.contains(state(44).1) && read.contains(state(299).1));
        assert!(read.was_in_bucket(298) && !read.was_in_bucket(299));
    }

    #[test]
    fn invalid_lines_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let (manifest, name) = state(7);
        let mut wanted = KnownStates::default();
        wanted.add(&manifest, name, true);
        let good = wanted.to_text();
        let text = format!("there\nthere x {name}\nsomewhere 7 {name}\n{good}there 7 {name} 1\nthere 7 12\n");
        std::fs::write(folder.path().join(BUCKET_STATES), text.as_bytes()).unwrap();
        assert_eq!(KnownStates::read(&FsDisk, folder.path()).unwrap(), Some(wanted));
        std::fs::write(folder.path().join(BUCKET_STATES), [0xff, 0, 10]).unwrap();
        assert_eq!(KnownStates::read(&FsDisk, folder.path()).unwrap(), Some(KnownStates::default()));
    }
}
