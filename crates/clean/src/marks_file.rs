use rustc_hash::FxHashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use voxtile::scan::MovingMarks;
use voxtile::{Error, Result};
use voxtile_scratch::ScratchFile;

/// New marks of moving points of scans, in an unnamed temporary file.
#[derive(Debug)]
pub(crate) struct MarksFile {
    folder: PathBuf,
    /// A `Mutex` because reads move the position of the file.
    file: Mutex<ScratchFile>,
    places: FxHashMap<u64, Place>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    offset: u64,
    bytes: usize,
    points: u64,
}

impl MarksFile {
    /// Creates an empty file in a folder.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn in_folder(folder: &Path) -> Result<Self> {
        let file = ScratchFile::in_folder(folder)
            .map_err(|error| Error::io(folder, "create a temporary file in", error))?;
        Ok(Self { folder: folder.to_owned(), file: Mutex::new(file), places: FxHashMap::default() })
    }

    /// Adds the marks of a scan.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn push(&mut self, number: u64, marks: &MovingMarks) -> Result<()> {
        let file = self.file.get_mut().unwrap_or_else(PoisonError::into_inner);
        let (offset, bytes) = (file.len(), marks.as_bytes());
        let place = Place { offset, bytes: bytes.len(), points: marks.points() };
        file.append(bytes).map_err(|error| Error::io(&self.folder, "write a temporary file in", error))?;
        self.places.insert(number, place);
        Ok(())
    }

    /// Returns the numbers of the scans, in no particular order.
    pub(crate) fn numbers(&self) -> Vec<u64> {
        self.places.keys().copied().collect()
    }

    /// Returns the marks of a scan.
    ///
    /// # Errors
    ///
    /// An I/O error, or a scan without marks.
    pub(crate) fn of_scan(&self, number: u64) -> Result<MovingMarks> {
        let read = || -> io::Result<Option<MovingMarks>> {
            let Some(place) = self.places.get(&number) else { return Ok(None) };
            let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
            Ok(MovingMarks::from_bytes(file.bytes(place.offset, place.bytes)?.to_vec(), place.points))
        };
        let marks = read().and_then(|marks| marks.ok_or_else(|| io::Error::other("it was changed")));
        marks.map_err(|error| Error::io(&self.folder, "read a temporary file in", error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_read_as_written() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = MarksFile::in_folder(folder.path()).unwrap();
        let marks = |number: u64| MovingMarks::new((0..100 * number).map(|k| k % (number + 2) == 0));
        (0..20).for_each(|number| file.push(number, &marks(number)).unwrap());
        for number in [7, 0, 19, 3] {
            assert_eq!(file.of_scan(number).unwrap(), marks(number));
        }
        assert!(file.of_scan(20).is_err());
        assert_eq!(file.numbers().len(), 20);
    }
}
