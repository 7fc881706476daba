use super::group::bits;
use super::group_columns::Rest;
use super::symbol::{RARE, Symbols};
use crate::sensor::Evidence;
use crate::space::{BRICK_EDGE, BrickCode, BrickMask, VoxelBox, mask_of_box, places};
use crate::tile::table::{
    Brick, CELL_VOXELS, Cells, Full, Palette, StateId, Storage, UNKNOWN, UnpaddedEvidence,
};

/// Brick whose voxels are being read.
pub(super) struct OpenBrick {
    pub(super) code: BrickCode,
    pub(super) observed: BrickMask,
    pub(super) symbols: Symbols,
}

/// Reason why a brick cannot be read as palette states.
pub(super) enum Refusal {
    /// The palette is full.
    Full,
    Wrong(String),
}

impl From<String> for Refusal {
    fn from(reason: String) -> Self {
        Self::Wrong(reason)
    }
}

impl From<Full> for Refusal {
    fn from(_: Full) -> Self {
        Self::Full
    }
}

impl OpenBrick {
    pub(super) fn voxels(&self) -> usize {
        self.observed.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Checks that all voxels belong to a tile.
    pub(super) fn check_is_inside(&self, tile: &VoxelBox) -> Result<(), String> {
        let other = || format!("voxels of brick {:#x} belong to another tile", self.code.0);
        let place = places(self.observed).next().ok_or_else(other)?;
        let voxel = self.code.voxel(place).to_key().to_index_from(tile.min);
        if !tile.contains(voxel) {
            return Err(other());
        }
        let first = voxel.map(|k| k & !(BRICK_EDGE - 1));
        if (0..3).all(|k| first[k] >= tile.min[k] && first[k].saturating_add(BRICK_EDGE) <= tile.end[k]) {
            return Ok(());
        }
        let local = |of: [i32; 3]| std::array::from_fn(|k| of[k].saturating_sub(first[k]));
        let inside = mask_of_box(local(tile.min), local(tile.end));
        let is_inside = self.observed.iter().zip(inside).all(|(&observed, inside)| observed & !inside == 0);
        if is_inside { Ok(()) } else { Err(other()) }
    }

    /// Completes the brick.
    pub(super) fn closed(self, evidence: Storage) -> Brick {
        Brick::with(self.code, self.observed, evidence)
    }

    /// Reads the states of the voxels; missing ones are added to the palette.
    pub(super) fn interned(
        &self,
        rest: &mut Rest<'_>,
        palette: &mut Palette,
    ) -> Result<Cells<StateId>, Refusal> {
        let direct = self.symbols.direct();
        let mut cells = Cells::of_words(&self.observed, UNKNOWN);
        let masks = self.observed.iter().filter(|&&mask| mask != 0);
        for (cell, &mask) in cells.all_mut().iter_mut().zip(masks) {
            let symbols = rest.take_symbols(mask.count_ones() as usize)?;
            if symbols.iter().fold(0, |largest, &symbol| largest.max(symbol)) >= direct {
                for (bit, &symbol) in bits(mask).zip(symbols) {
                    cell[bit] = self.state(symbol, rest, palette)?;
                }
            } else {
                set(cell, mask, symbols);
            }
        }
        Ok(cells)
    }

    fn state(&self, symbol: u8, rest: &mut Rest<'_>, palette: &mut Palette) -> Result<StateId, Refusal> {
        if symbol == RARE {
            return Ok(palette.intern(rest.take_rare()?)?);
        }
        Ok(self.common(symbol, rest)?)
    }

    /// Reads the evidence of the voxels without adding states; used if the palette is full.
    pub(super) fn plain(
        &self,
        rest: &mut Rest<'_>,
        palette: &Palette,
    ) -> Result<Cells<UnpaddedEvidence>, String> {
        let mut cells = Cells::of_words(&self.observed, UnpaddedEvidence::from(Evidence::PRIOR));
        let masks = self.observed.iter().filter(|&&mask| mask != 0);
        for (cell, &mask) in cells.all_mut().iter_mut().zip(masks) {
            let symbols = rest.take_symbols(mask.count_ones() as usize)?;
            for (bit, &symbol) in bits(mask).zip(symbols) {
                cell[bit] = self.evidence(symbol, rest, palette)?.into();
            }
        }
        Ok(cells)
    }

    /// Reads the evidence of the next voxel, whose symbol was read already; the palette must contain the codebook.
    pub(super) fn evidence(
        &self,
        symbol: u8,
        rest: &mut Rest<'_>,
        palette: &Palette,
    ) -> Result<Evidence, String> {
        match symbol {
            RARE => rest.take_rare(),
            _ => Ok(palette.evidence(self.common(symbol, rest)?)),
        }
    }

    /// Palette state of a codebook number.
    pub(super) const fn state_of(number: u16) -> StateId {
        number + 1
    }

    /// Palette state of a symbol that is not rare.
    fn common(&self, symbol: u8, rest: &mut Rest<'_>) -> Result<StateId, String> {
        Ok(Self::state_of(self.number(symbol, rest)?))
    }

    /// Codebook number of a symbol that is not rare.
    pub(super) fn number(&self, symbol: u8, rest: &mut Rest<'_>) -> Result<u16, String> {
        let number = if symbol < self.symbols.direct() {
            Some(usize::from(symbol))
        } else if symbol < self.symbols.first_prefix() {
            None
        } else {
            self.symbols.number(symbol, rest.take_second()?)
        };
        let number = number.ok_or_else(|| format!("symbol {symbol} has no state"))?;
        Ok(number as u16)
    }
}

/// Sets the states of the voxels in `mask`, whose symbols are codebook numbers.
#[inline]
fn set(cell: &mut [StateId; CELL_VOXELS], mask: u64, symbols: &[u8]) {
    if let Ok(symbols) = <&[u8; CELL_VOXELS]>::try_from(symbols) {
        *cell = symbols.map(|symbol| OpenBrick::state_of(symbol.into()));
    } else {
        for (bit, &symbol) in bits(mask).zip(symbols) {
            cell[bit] = OpenBrick::state_of(symbol.into());
        }
    }
}
