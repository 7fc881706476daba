use super::group::bits;
use super::group_columns::Rest;
use super::open_brick::OpenBrick;
use super::reader::TakeGroups;
use super::symbol::Symbols;
use crate::space::{BrickCode, VoxelBox};
use crate::tile::format::SiftedVoxels;
use crate::tile::table::Palette;

/// Finds the voxels of groups whose log-odds are at least a threshold. Others are passed over by their symbols, 64 at a
/// time.
pub(super) struct GroupSieve<'a> {
    voxels: &'a VoxelBox,
    symbols: Symbols,
    /// The codebook.
    palette: Palette,
    from: f64,
    /// By symbol, whether a voxel must be looked at: the symbol is of a state that passes, or not of a state alone.
    is_looked_at: [bool; 256],
    /// Number of bricks and of observed voxels so far.
    bricks: usize,
    observed: usize,
    /// The previous brick.
    before: Option<BrickCode>,
    found: SiftedVoxels,
}

impl<'a> GroupSieve<'a> {
    /// The palette holds the codebook.
    pub(super) fn new(voxels: &'a VoxelBox, palette: Palette, from: f64) -> Self {
        let symbols = Symbols::of(palette.len() - 1);
        let mut is_looked_at = [true; 256];
        for symbol in 0..symbols.direct() {
            let state = OpenBrick::state_of(symbol.into());
            is_looked_at[usize::from(symbol)] = palette.evidence(state).log_odds >= from;
        }
        let found = Vec::new();
        Self { voxels, symbols, palette, from, is_looked_at, bricks: 0, observed: 0, before: None, found }
    }
}

impl TakeGroups for GroupSieve<'_> {
    type Made = SiftedVoxels;

    fn bricks(&self) -> usize {
        self.bricks
    }

    fn voxels(&self) -> usize {
        self.observed
    }

    fn add_brick(&mut self, rest: &mut Rest<'_>) -> Result<(), String> {
        let code = rest.take_code(self.before)?;
        self.before = Some(code);
        let observed = rest.take_mask()?;
        let brick = OpenBrick { code, observed, symbols: self.symbols };
        brick.check_is_inside(self.voxels)?;
        self.bricks += 1;
        for (word, &mask) in observed.iter().enumerate().filter(|(_, mask)| **mask != 0) {
            let symbols = rest.take_symbols(mask.count_ones() as usize)?;
            self.observed += symbols.len();
            if !symbols.iter().fold(false, |any, &symbol| any | self.is_looked_at[usize::from(symbol)]) {
                continue;
            }
            for (bit, &symbol) in bits(mask).zip(symbols) {
                if self.is_looked_at[usize::from(symbol)] {
                    let evidence = brick.evidence(symbol, rest, &self.palette)?;
                    if evidence.log_odds >= self.from {
                        self.found.push((code.voxel(64 * word + bit), evidence));
                    }
                }
            }
        }
        Ok(())
    }

    fn end(self) -> SiftedVoxels {
        self.found
    }
}
