use super::entry::{Entry, check_evidence, of_another_tile};
use super::reader::TakeEntries;
use super::{ENTRY_BYTES, EntryBytes};
use crate::error::FormatError;
use crate::sensor::Evidence;
use crate::space::{BRICK_VOXELS, MortonCode, VoxelBox};
use crate::tile::Table;

/// Decodes entries in any order, as in a file without a trailer. Consecutive entries of one brick are grouped.
pub(super) struct AnyOrderEntries<'a> {
    voxels: &'a VoxelBox,
    table: Table,
    /// Entries of one brick, with their offsets.
    run: Vec<(MortonCode, Evidence, u64)>,
    /// The same entries as position and evidence, for [`Table::insert`].
    voxels_of_run: Vec<(usize, Evidence)>,
}

impl<'a> AnyOrderEntries<'a> {
    pub(super) fn new(voxels: &'a VoxelBox) -> Self {
        let (run, voxels_of_run) = (Vec::with_capacity(BRICK_VOXELS), Vec::with_capacity(BRICK_VOXELS));
        Self { voxels, table: Table::default(), run, voxels_of_run }
    }

    fn take_one(&mut self, entry: &EntryBytes, offset: u64) -> Result<(), FormatError> {
        let Entry { key, evidence } = Entry::of(entry);
        if !self.voxels.contains(key.to_index_from(self.voxels.min)) {
            return Err(of_another_tile(key, offset));
        }
        check_evidence(evidence, offset)?;
        let code = key.morton();
        if self.run.last().is_some_and(|(previous, ..)| previous.brick() != code.brick()) {
            self.end_run()?;
        }
        if self.run.len() >= BRICK_VOXELS {
            let reason = format!("duplicate key: {:?} or another one of its 8 x 8 x 8 voxels", key.0);
            return Err(FormatError::at_offset(offset, reason));
        }
        self.run.push((code, evidence, offset));
        Ok(())
    }

    /// Moves the grouped entries into the table, all voxels of the brick at once.
    fn end_run(&mut self) -> Result<(), FormatError> {
        let Some(&(first, ..)) = self.run.first() else { return Ok(()) };
        self.run.sort_unstable_by_key(|&(code, _, offset)| (code, offset));
        let in_run = self.run.windows(2).find(|pair| pair[0].0 == pair[1].0).map(|pair| pair[1].2);
        let in_table = || {
            let known = |&&(code, ..): &&(MortonCode, Evidence, u64)| self.table.get(code).is_some();
            let may_be = self.table.has_brick(first.brick());
            may_be.then(|| self.run.iter().find(known)).flatten().map(|&(.., offset)| offset)
        };
        if let Some(offset) = in_run.or_else(in_table) {
            return Err(FormatError::at_offset(offset, "duplicate key"));
        }
        self.voxels_of_run.clear();
        self.voxels_of_run
            .extend(self.run.iter().map(|&(code, evidence, _)| (code.place_in_brick(), evidence)));
        self.table.insert(first.brick(), &self.voxels_of_run);
        self.run.clear();
        Ok(())
    }
}

impl TakeEntries for AnyOrderEntries<'_> {
    type Made = Table;

    fn take(&mut self, entries: &[EntryBytes], offset: u64) -> Result<(), FormatError> {
        (0..).zip(entries).try_for_each(|(number, entry)| self.take_one(entry, offset + number * ENTRY_BYTES))
    }

    fn end(mut self) -> Result<Table, FormatError> {
        self.end_run()?;
        Ok(self.table)
    }
}
