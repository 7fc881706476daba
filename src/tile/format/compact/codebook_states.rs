use super::column_reader::{Column, ColumnReader};
use super::columns::{STATE_BYTES, state_at};
use super::input::Input;
use crate::error::{DecodeError, FormatError};
use crate::sensor::Evidence;
use crate::tile::format::entry::fault_of;
use crate::tile::table::Palette;
use std::io::Read;

/// States of a [`Codebook`](super::codebook::Codebook) that was read, not validated yet.
#[derive(Debug)]
pub(super) struct CodebookStates {
    /// Offset of the codebook in the table.
    offset: u64,
    /// Encoded for [`state_at`].
    states: Vec<u8>,
}

impl CodebookStates {
    pub(super) fn read(
        states: usize,
        column_reader: &mut ColumnReader,
        input: &mut Input<impl Read>,
    ) -> Result<Self, DecodeError> {
        let offset = input.offset;
        let mut bytes = Vec::new();
        let column = Column { name: "codebook", max_bytes: states * STATE_BYTES, bytes: &mut bytes };
        column_reader.take_columns([column], input)?;
        if bytes.len() != states * STATE_BYTES {
            let reason = format!("a codebook of {} bytes for {states} states", bytes.len());
            return Err(FormatError::at_offset(offset, reason).into());
        }
        Ok(Self { offset, states: bytes })
    }

    pub(super) fn len(&self) -> usize {
        self.states.len() / STATE_BYTES
    }

    pub(super) fn state(&self, number: usize) -> Result<Evidence, String> {
        let state = state_at(&self.states, number);
        match fault_of(state) {
            None => Ok(state),
            Some((_, reason)) => Err(format!("state {number} of the codebook: {reason}")),
        }
    }

    /// Returns all states as a palette, in which they are numbered from 1.
    pub(super) fn palette(&self) -> Result<Palette, FormatError> {
        let wrong = |reason| FormatError::at_offset(self.offset, reason);
        let mut palette = Palette::with_max_limit();
        for number in 0..self.len() {
            match palette.intern(self.state(number).map_err(wrong)?) {
                Ok(id) if usize::from(id) == number + 1 => {}
                _ => return Err(wrong(format!("entry {number} of the codebook is a duplicate"))),
            }
        }
        Ok(palette)
    }
}
