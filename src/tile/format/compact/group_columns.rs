use super::column_reader::{Column, ColumnReader};
use super::columns::{STATE_BYTES, state_at};
use super::group::{GROUP_BRICKS, MAX_GROUP_VOXELS};
use super::input::Input;
use super::numbers::take_number;
use super::symbol::{RARE, Symbols};
use crate::error::DecodeError;
use crate::sensor::Evidence;
use crate::space::{BRICK_VOXELS, BrickCode, BrickMask};
use crate::tile::format::entry::fault_of;
use std::io::Read;

/// Decoded columns of a group; see [`Group`](super::group::Group).
#[derive(Default)]
pub(super) struct Columns {
    pub(super) offset: u64,
    pub(super) bricks: usize,
    steps: Vec<u8>,
    words: Vec<u8>,
    masks: Vec<u8>,
    symbols: Vec<u8>,
    seconds: Vec<u8>,
    rares: Vec<u8>,
}

/// Limits for the size of a group.
pub(super) struct GroupLimits {
    pub(super) bricks: usize,
    pub(super) voxels: usize,
}

impl Columns {
    /// Reads the next group.
    pub(super) fn read(
        &mut self,
        limits: &GroupLimits,
        column_reader: &mut ColumnReader,
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        /// Size of the largest step in bytes.
        const STEP_BYTES: usize = 6;
        self.offset = input.offset;
        let bricks = input.number("bricks of a group", GROUP_BRICKS.min(limits.bricks))?;
        let voxels = limits.voxels.min(MAX_GROUP_VOXELS).min(bricks * BRICK_VOXELS);
        self.bricks = bricks;
        let column = |name, max_bytes, bytes| Column { name, max_bytes, bytes };
        column_reader.take_columns(
            [
                column("steps", bricks * STEP_BYTES, &mut self.steps),
                column("words", bricks, &mut self.words),
                column("masks", bricks * size_of::<BrickMask>(), &mut self.masks),
                column("symbols", voxels, &mut self.symbols),
                column("second bytes", voxels, &mut self.seconds),
                column("rare states", voxels * STATE_BYTES, &mut self.rares),
            ],
            input,
        )
    }
}

const FEWER_SECONDS: &str = "fewer second bytes than prefixes";

/// Unread rest of the columns of a group.
#[derive(Clone, Copy)]
pub(super) struct Rest<'a> {
    steps: &'a [u8],
    words: &'a [u8],
    masks: &'a [[u8; 8]],
    symbols: &'a [u8],
    seconds: &'a [u8],
    rares: &'a [u8],
    rares_done: usize,
}

impl<'a> Rest<'a> {
    pub(super) fn of(columns: &'a Columns) -> Self {
        let Columns { steps, words, masks, symbols, seconds, rares, offset: _, bricks: _ } = columns;
        Self { steps, words, masks: masks.as_chunks().0, symbols, seconds, rares, rares_done: 0 }
    }

    /// Returns whether all columns are read completely.
    pub(super) fn is_empty(&self) -> bool {
        let Self { steps, words, masks, symbols, seconds, rares, rares_done } = *self;
        let is_done = [steps, words, symbols, seconds].iter().all(|column| column.is_empty());
        is_done && masks.is_empty() && rares_done * STATE_BYTES == rares.len()
    }

    /// Reads the code of the next brick, which must be greater than the previous one.
    pub(super) fn take_code(&mut self, before: Option<BrickCode>) -> Result<BrickCode, String> {
        let step = take_number(|| {
            let (&byte, rest) = self.steps.split_first()?;
            self.steps = rest;
            Some(byte)
        });
        let code = step.and_then(|step| before.map_or(0, |before| before.0 + 1).checked_add(step));
        let code = code.filter(|&code| code < BrickCode::END);
        code.map(BrickCode).ok_or_else(|| "an invalid step between bricks".into())
    }

    /// Reads the mask of the next brick, which must not be empty.
    pub(super) fn take_mask(&mut self) -> Result<BrickMask, String> {
        const SHORT: &str = "a group ends before its last brick";
        let (&words, rest) = self.words.split_first().ok_or(SHORT)?;
        self.words = rest;
        let (masks, rest) = self.masks.split_at_checked(words.count_ones() as usize).ok_or(SHORT)?;
        self.masks = rest;
        let mut masks = masks.iter().map(|&mask| u64::from_le_bytes(mask));
        let observed: BrickMask =
            std::array::from_fn(|word| if words >> word & 1 == 1 { masks.next().unwrap_or(0) } else { 0 });
        let is_set = |word: usize| (words >> word & 1 == 1) == (observed[word] != 0);
        if words == 0 || !(0..8).all(is_set) {
            return Err("a brick with an empty mask".into());
        }
        Ok(observed)
    }

    /// Reads the symbols of the next `voxels` voxels.
    #[inline]
    pub(super) fn take_symbols(&mut self, voxels: usize) -> Result<&'a [u8], String> {
        let (symbols, rest) = self.symbols.split_at_checked(voxels).ok_or("fewer symbols than voxels")?;
        self.symbols = rest;
        Ok(symbols)
    }

    pub(super) fn take_second(&mut self) -> Result<u8, String> {
        let (&second, rest) = self.seconds.split_first().ok_or(FEWER_SECONDS)?;
        self.seconds = rest;
        Ok(second)
    }

    /// Skips the second bytes and rare states that belong to the given symbols.
    pub(super) fn pass(&mut self, passed: &[u8], symbols: Symbols) -> Result<(), String> {
        let count = |from| passed.iter().filter(|&&symbol| symbol >= from).count();
        let rares = count(RARE);
        let seconds = count(symbols.first_prefix()) - rares;
        self.seconds = self.seconds.get(seconds..).ok_or(FEWER_SECONDS)?;
        self.rares_done = self.rares_done.saturating_add(rares);
        Ok(())
    }

    pub(super) fn take_rare(&mut self) -> Result<Evidence, String> {
        let states = self.rares.len() / STATE_BYTES;
        if self.rares_done >= states || states * STATE_BYTES != self.rares.len() {
            return Err("fewer rare states than rare symbols".into());
        }
        let state = state_at(self.rares, self.rares_done);
        self.rares_done += 1;
        match fault_of(state) {
            None => Ok(state),
            Some((_, reason)) => Err(format!("a rare state: {reason}")),
        }
    }
}
