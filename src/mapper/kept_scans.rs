use super::kept_scan::KeptScan;
use crate::error::{Error, Result};
use crate::store::{Disk, KeptRecord, KeptRecords, Layout, TileStore};
use std::sync::Arc;

/// Largest number of points of a kept scan that are read into memory (7 MiB). Larger scans are read at each use.
const MAX_POINTS_IN_MEMORY: u64 = 1 << 18;

/// Iterator over the scans that a map keeps, in order. It reads one scan at a time.
#[derive(Debug)]
pub struct KeptScans {
    disk: Arc<dyn Disk>,
    layout: Layout,
    records: KeptRecords,
    /// The flush that is read; `None` for a snapshot, which never changes.
    flush_number: Option<u64>,
}

impl KeptScans {
    pub(super) fn new(
        disk: Arc<dyn Disk>,
        layout: Layout,
        records: KeptRecords,
        flush_number: Option<u64>,
    ) -> Self {
        Self { disk, layout, records, flush_number }
    }

    /// Returns the record of the next scan, without its points; [`KeptScans::open`] reads them.
    ///
    /// # Errors
    ///
    /// Fails if the catalog is damaged or a read fails.
    pub fn next_record(&mut self) -> Result<Option<KeptRecord>> {
        self.records.next_kept().map_err(|error| self.explain(error))
    }

    /// Opens the scan of a record.
    ///
    /// # Errors
    ///
    /// Fails if the scan is damaged or a read fails.
    pub fn open(&self, record: KeptRecord) -> Result<KeptScan> {
        KeptScan::open(&self.disk, &self.layout, record, MAX_POINTS_IN_MEMORY)
            .map_err(|error| self.explain(error))
    }

    /// Turns damage into [`Error::Changed`] if a writer has flushed since and may have removed the file.
    fn explain(&self, error: Error) -> Error {
        let folder = self.layout.folder();
        let (Error::Damaged { .. }, Some(flush_number)) = (&error, self.flush_number) else { return error };
        match TileStore::open_read_only(self.disk.clone(), folder) {
            Ok(store) if store.commits().flush_number != flush_number => {
                Error::Changed { path: folder.to_owned() }
            }
            _ => error,
        }
    }
}

impl Iterator for KeptScans {
    type Item = Result<KeptScan>;

    fn next(&mut self) -> Option<Self::Item> {
        let record = self.next_record().transpose()?;
        Some(record.and_then(|record| self.open(record)))
    }
}
