use super::codebook_states::CodebookStates;
use super::group_columns::Rest;
use super::group_reader::TakeBricks;
use super::open_brick::OpenBrick;
use super::symbol::RARE;
use crate::sensor::Evidence;
use crate::space::{BrickMask, MortonCode, is_in_mask};

/// Finds one voxel. The states of other voxels are skipped without decoding.
pub(super) struct VoxelFinder<'a> {
    codebook: &'a CodebookStates,
    wanted: MortonCode,
    found: Option<Evidence>,
}

impl<'a> VoxelFinder<'a> {
    pub(super) fn new(codebook: &'a CodebookStates, wanted: MortonCode) -> Self {
        Self { codebook, wanted, found: None }
    }
}

impl TakeBricks for VoxelFinder<'_> {
    /// `None` if the voxel was not observed.
    type Made = Option<Evidence>;

    fn take(&mut self, brick: OpenBrick, rest: &mut Rest<'_>) -> Result<(), String> {
        let symbols = rest.take_symbols(brick.voxels())?;
        let place = self.wanted.place_in_brick();
        if brick.code != self.wanted.brick() || !is_in_mask(&brick.observed, place) {
            return rest.pass(symbols, brick.symbols);
        }
        let at = rank(&brick.observed, place);
        rest.pass(&symbols[..at], brick.symbols)?;
        self.found = Some(match symbols[at] {
            RARE => rest.take_rare()?,
            symbol => self.codebook.state(brick.number(symbol, rest)?.into())?,
        });
        rest.pass(&symbols[at + 1..], brick.symbols)
    }

    fn made(self) -> Option<Evidence> {
        self.found
    }
}

/// Number of voxels in a mask before a position.
fn rank(mask: &BrickMask, place: usize) -> usize {
    let whole: u32 = mask[..place / 64].iter().map(|word| word.count_ones()).sum();
    let part = mask[place / 64] & ((1 << (place % 64)) - 1);
    (whole + part.count_ones()) as usize
}
