use super::kept_scan::KeptScan;
use crate::error::{Error, Result};
use crate::store::{Disk, KeptRecord, KeptRecords, Layout, TileStore};
use std::sync::Arc;

/// Most points of a kept scan that are read into memory: 7 MiB. Those of a larger one are read again when needed.
const MAX_POINTS_IN_MEMORY: u64 = 1 << 18;

/// The scans that a map keeps, one at a time, in order. Reading one does not read others.
#[derive(Debug)]
pub struct KeptScans {
    disk: Arc<dyn Disk>,
    layout: Layout,
    records: KeptRecords,
    /// The flush that is read; `None` for a snapshot, which does not change.
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

    /// What is known of the next scan, without its points; [`KeptScans::open`] reads these.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub fn next_record(&mut self) -> Result<Option<KeptRecord>> {
        self.records.next_kept().map_err(|error| self.explain(error))
    }

    /// The scan of a record.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub fn open(&self, record: KeptRecord) -> Result<KeptScan> {
        KeptScan::open(&self.disk, &self.layout, record, MAX_POINTS_IN_MEMORY)
            .map_err(|error| self.explain(error))
    }

    /// What is missing is damage, unless a writer has removed it since.
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
