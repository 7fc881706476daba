use super::codebook::Codebook;
use super::column_writer::ColumnWriter;
use super::columns::put_states;
use super::group_index::GroupEntry;
use super::numbers::put_number;
use super::symbol::RARE;
use crate::sensor::Evidence;
use crate::space::{BRICK_VOXELS, BrickCode};
use crate::tile::table::{Brick, CELL_VOXELS, Palette, StateId, Storage, UnpaddedEvidence};
use std::io;

/// Number of voxels that completes a group: reading one voxel decodes its whole group.
const GROUP_VOXELS: usize = 1 << 15;

/// Maximum number of voxels of a group that a reader accepts; version 1 wrote such groups.
pub(super) const MAX_GROUP_VOXELS: usize = (1 << 16) + BRICK_VOXELS - 1;

/// Maximum number of bricks in a group.
pub(super) const GROUP_BRICKS: usize = 1 << 10;

/// Consecutive bricks of a table in Morton order, as columns.
#[derive(Default)]
pub(super) struct Group {
    bricks: usize,
    /// For each brick but the first, the difference of its code from the previous one.
    steps: Vec<u8>,
    /// For each brick, the set of nonzero words in its mask: bit `k` for word `k`.
    words: Vec<u8>,
    /// The nonzero words.
    masks: Vec<u8>,
    /// One symbol per voxel.
    symbols: Vec<u8>,
    /// The second byte of each voxel whose symbol is a prefix.
    seconds: Vec<u8>,
    /// The state of each voxel whose state is not in the codebook.
    rares: Vec<Evidence>,
    /// First and last brick.
    ends: Option<[BrickCode; 2]>,
}

impl Group {
    pub(super) fn is_full(&self) -> bool {
        is_full(self.bricks, self.symbols.len())
    }

    pub(super) fn push(&mut self, brick: &Brick, codebook: &Codebook, palette: &Palette) {
        let code = brick.code();
        let [first, last] = self.ends.unwrap_or([code; 2]);
        if self.bricks > 0 {
            put_number(code.0 - last.0 - 1, &mut self.steps);
        }
        self.ends = Some([first, code]);
        self.bricks += 1;
        let mut words = 0;
        for (word, &mask) in brick.observed.iter().enumerate().filter(|(_, mask)| **mask != 0) {
            words |= 1 << word;
            self.masks.extend_from_slice(&mask.to_le_bytes());
            match &brick.evidence {
                Storage::Interned(cells) => {
                    if let Some(cell) = cells.cell(word) {
                        self.push_states(mask, cell, codebook, palette);
                    }
                }
                Storage::Plain(cells) => {
                    if let Some(cell) = cells.cell(word) {
                        self.push_plain(mask, cell, codebook, palette);
                    }
                }
            }
        }
        self.words.push(words);
    }

    fn push_states(
        &mut self,
        mask: u64,
        cell: &[StateId; CELL_VOXELS],
        codebook: &Codebook,
        palette: &Palette,
    ) {
        let code = |state: StateId| codebook.interned[usize::from(state)];
        let mut symbols = [0; CELL_VOXELS];
        let mut count = 0;
        let mut largest = 0;
        let mut take = |bit: usize| {
            let symbol = code(cell[bit]) as u8;
            symbols[count % CELL_VOXELS] = symbol;
            largest = largest.max(symbol);
            count += 1;
        };
        if mask == u64::MAX {
            (0..CELL_VOXELS).for_each(&mut take)
        } else {
            bits(mask).for_each(&mut take)
        }
        self.symbols.extend_from_slice(&symbols[..count]);
        if largest >= codebook.symbols.first_prefix() {
            bits(mask)
                .for_each(|bit| self.push_rest(code(cell[bit]), codebook, || palette.evidence(cell[bit])));
        }
    }

    fn push_plain(
        &mut self,
        mask: u64,
        cell: &[UnpaddedEvidence; CELL_VOXELS],
        codebook: &Codebook,
        palette: &Palette,
    ) {
        for bit in bits(mask) {
            let evidence = cell[bit].into();
            let code = codebook.code(evidence, palette);
            self.symbols.push(code as u8);
            self.push_rest(code, codebook, || evidence);
        }
    }

    /// Appends the data of a voxel that follow its symbol.
    fn push_rest(&mut self, code: u16, codebook: &Codebook, evidence: impl Fn() -> Evidence) {
        let [symbol, second] = code.to_le_bytes();
        if symbol == RARE {
            self.rares.push(evidence());
        } else if symbol >= codebook.symbols.first_prefix() {
            self.seconds.push(second);
        }
    }

    /// Appends the encoded group and clears it; returns its index entry, or `None` if the group is empty.
    pub(super) fn end(
        &mut self,
        column_writer: &mut ColumnWriter,
        out: &mut Vec<u8>,
    ) -> io::Result<Option<GroupEntry>> {
        let Some([first, _]) = self.ends else { return Ok(None) };
        let begin = out.len();
        let mut rares = Vec::new();
        put_states(self.rares.iter().copied(), &mut rares);
        let columns = [&self.steps, &self.words, &self.masks, &self.symbols, &self.seconds, &rares];
        put_number(self.bricks as u64, out);
        column_writer.put_columns(columns.map(|column| &column[..]), out)?;
        self.clear();
        let group = &out[begin..];
        // The length fits into 32 bits: at most 2^15 + 511 voxels of 14 bytes, and their bricks.
        Ok(Some(GroupEntry { first, bytes: group.len() as u32, crc: crc32fast::hash(group) }))
    }

    pub(super) fn clear(&mut self) {
        let Self { bricks, steps, words, masks, symbols, seconds, rares, ends } = self;
        (*bricks, *ends) = (0, None);
        [steps, words, masks, symbols, seconds].into_iter().for_each(Vec::clear);
        rares.clear();
    }
}

/// Counts the groups into which bricks are divided.
#[derive(Default)]
pub(super) struct GroupSizes {
    full: usize,
    /// Counts of the last group, which may be empty.
    bricks: usize,
    voxels: usize,
}

impl GroupSizes {
    /// Adds a brick with the given number of voxels.
    pub(super) fn push(&mut self, voxels: usize) {
        self.bricks += 1;
        self.voxels += voxels;
        if is_full(self.bricks, self.voxels) {
            *self = Self { full: self.full + 1, bricks: 0, voxels: 0 };
        }
    }

    pub(super) fn groups(&self) -> usize {
        self.full + usize::from(self.bricks > 0)
    }
}

fn is_full(bricks: usize, voxels: usize) -> bool {
    bricks == GROUP_BRICKS || voxels >= GROUP_VOXELS
}

/// Iterates over the set bits in ascending order.
pub(super) fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}
