use super::{Error, Result};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Columns along the edge of a page.
pub(super) const PAGE_EDGE: usize = 256;

/// Maximum number of pages in memory, of 1.3 MB each. Voxels arrive tile by tile, from which most maps' tiles touch
/// four pages.
const MAX_PAGES: usize = 12;

/// Bytes of a column in a file.
const COLUMN_BYTES: usize = 20;

/// Occupied voxels of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Column {
    /// Highest and lowest index along z.
    pub(super) highest: i32,
    pub(super) lowest: i32,
    /// Number of voxels, and the sum of their indices along z.
    pub(super) count: u32,
    pub(super) sum: i64,
}

/// Columns of a large image, in square pages. A few pages are in memory, the others in a temporary file.
pub(super) struct ColumnPages {
    folder: PathBuf,
    file: File,
    /// Position of each page in the file, in pages. A page without a voxel has none.
    slots: BTreeMap<u64, u64>,
    /// Pages in memory, the one used last at the end.
    pages: Vec<(u64, Vec<Column>)>,
    buffer: Vec<u8>,
}

impl Column {
    const EMPTY: Self = Self { highest: i32::MIN, lowest: i32::MAX, count: 0, sum: 0 };

    fn bytes(&self) -> [u8; COLUMN_BYTES] {
        let mut bytes = [0; COLUMN_BYTES];
        bytes[..4].copy_from_slice(&self.highest.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.lowest.to_le_bytes());
        bytes[8..12].copy_from_slice(&self.count.to_le_bytes());
        bytes[12..].copy_from_slice(&self.sum.to_le_bytes());
        bytes
    }

    fn of(bytes: &[u8; COLUMN_BYTES]) -> Self {
        let four = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let sum = std::array::from_fn(|k| bytes[12 + k]);
        Self {
            highest: i32::from_le_bytes(four(0)),
            lowest: i32::from_le_bytes(four(4)),
            count: u32::from_le_bytes(four(8)),
            sum: i64::from_le_bytes(sum),
        }
    }
}

impl ColumnPages {
    pub(super) fn new(folder: &Path) -> Result<Self> {
        let file = tempfile::tempfile_in(folder)
            .map_err(|error| Error::io(folder, "make a temporary file in", error))?;
        let (slots, pages, buffer) = Default::default();
        Ok(Self { folder: folder.to_owned(), file, slots, pages, buffer })
    }

    /// Adds the voxel with this index along z to a column of a page.
    pub(super) fn add(&mut self, page: u64, place: usize, z: i32) -> Result<()> {
        self.fetch(page)?;
        if let Some(column) = self.pages.last_mut().and_then(|(_, columns)| columns.get_mut(place)) {
            column.highest = column.highest.max(z);
            column.lowest = column.lowest.min(z);
            column.count = column.count.saturating_add(1);
            column.sum += i64::from(z);
        }
        Ok(())
    }

    /// Returns the pages with a voxel, in ascending order.
    pub(super) fn pages(&self) -> Vec<u64> {
        self.slots.keys().copied().collect()
    }

    /// Returns the columns of a page, row by row.
    pub(super) fn page(&mut self, page: u64) -> Result<Vec<Column>> {
        self.fetch(page)?;
        Ok(self.pages.last().map(|(_, columns)| columns.clone()).unwrap_or_default())
    }

    /// Makes a page the last one in memory.
    fn fetch(&mut self, page: u64) -> Result<()> {
        if self.pages.last().is_some_and(|(last, _)| *last == page) {
            return Ok(());
        }
        if let Some(at) = self.pages.iter().position(|(known, _)| *known == page) {
            self.pages[at..].rotate_left(1);
            return Ok(());
        }
        let mut columns = match self.pages.len() < MAX_PAGES {
            true => Vec::with_capacity(PAGE_EDGE * PAGE_EDGE),
            false => {
                let (oldest, columns) = self.pages.remove(0);
                self.store(oldest, &columns)?;
                columns
            }
        };
        columns.clear();
        let next_slot = self.slots.len() as u64;
        match self.slots.get(&page) {
            Some(&slot) => self.load(slot, &mut columns)?,
            None => {
                columns.resize(PAGE_EDGE * PAGE_EDGE, Column::EMPTY);
                self.slots.insert(page, next_slot);
            }
        }
        self.pages.push((page, columns));
        Ok(())
    }

    fn store(&mut self, page: u64, columns: &[Column]) -> Result<()> {
        self.buffer.clear();
        self.buffer.extend(columns.iter().flat_map(Column::bytes));
        let slot = self.slots.get(&page).copied().unwrap_or_default();
        let failed = |error| Error::io(&self.folder, "write a temporary file in", error);
        self.file.seek(position_of(slot)).map_err(failed)?;
        self.file.write_all(&self.buffer).map_err(failed)
    }

    fn load(&mut self, slot: u64, columns: &mut Vec<Column>) -> Result<()> {
        self.buffer.resize(PAGE_EDGE * PAGE_EDGE * COLUMN_BYTES, 0);
        let failed = |error| Error::io(&self.folder, "read a temporary file in", error);
        self.file.seek(position_of(slot)).map_err(failed)?;
        self.file.read_exact(&mut self.buffer).map_err(failed)?;
        columns.extend(self.buffer.as_chunks().0.iter().map(Column::of));
        Ok(())
    }
}

fn position_of(slot: u64) -> SeekFrom {
    SeekFrom::Start(slot * (PAGE_EDGE * PAGE_EDGE * COLUMN_BYTES) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_beyond_those_in_memory_are_kept_in_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let mut pages = ColumnPages::new(folder.path()).unwrap();
        let place = |page: u64| (page as usize * 977) % (PAGE_EDGE * PAGE_EDGE);
        for round in 0..3 {
            for page in (0..40).rev() {
                pages.add(7 * page, place(page), round * page as i32 - 20).unwrap();
            }
        }
        assert_eq!(pages.pages(), (0..40).map(|page| 7 * page).collect::<Vec<_>>());
        for page in 0..40 {
            let columns = pages.page(7 * page).unwrap();
            assert_eq!(columns.len(), PAGE_EDGE * PAGE_EDGE);
            let expected =
                Column { highest: 2 * page as i32 - 20, lowest: -20, count: 3, sum: 3 * page as i64 - 60 };
            assert_eq!(columns[place(page)], expected);
            assert_eq!(columns.iter().filter(|column| **column != Column::EMPTY).count(), 1);
        }
        assert!(pages.pages.len() <= MAX_PAGES);
    }
}
