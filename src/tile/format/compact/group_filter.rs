use super::group::bits;
use super::group_columns::Rest;
use super::group_reader::TakeBricks;
use super::open_brick::OpenBrick;
use super::symbol::Symbols;
use crate::tile::format::FilteredVoxels;
use crate::tile::table::Palette;

/// Finds the voxels of groups whose log-odds are at least a threshold. Others are skipped by their symbols, 64 at a
/// time.
pub(super) struct GroupFilter {
    /// Palette with the codebook.
    palette: Palette,
    from: f64,
    /// By symbol, whether voxels must be examined: its state reaches the threshold, or the symbol alone does not
    /// identify a state.
    is_examined: [bool; 256],
    found: FilteredVoxels,
}

impl GroupFilter {
    /// Creates a filter. The palette must contain the codebook.
    pub(super) fn new(palette: Palette, from: f64) -> Self {
        let mut is_examined = [true; 256];
        for symbol in 0..Symbols::of(palette.len() - 1).direct() {
            let state = OpenBrick::state_of(symbol.into());
            is_examined[usize::from(symbol)] = palette.evidence(state).log_odds >= from;
        }
        Self { palette, from, is_examined, found: Vec::new() }
    }
}

impl TakeBricks for GroupFilter {
    type Made = FilteredVoxels;

    fn take(&mut self, brick: OpenBrick, rest: &mut Rest<'_>) -> Result<(), String> {
        for (word, &mask) in brick.observed.iter().enumerate().filter(|(_, mask)| **mask != 0) {
            let symbols = rest.take_symbols(mask.count_ones() as usize)?;
            if !symbols.iter().fold(false, |any, &symbol| any | self.is_examined[usize::from(symbol)]) {
                continue;
            }
            for (bit, &symbol) in bits(mask).zip(symbols) {
                if self.is_examined[usize::from(symbol)] {
                    let evidence = brick.evidence(symbol, rest, &self.palette)?;
                    if evidence.log_odds >= self.from {
                        self.found.push((brick.code.voxel(64 * word + bit), evidence));
                    }
                }
            }
        }
        Ok(())
    }

    fn made(self) -> FilteredVoxels {
        self.found
    }
}
