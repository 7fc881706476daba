use super::brick::{Brick, Storage};
use super::brick_directory::Address;
use super::brick_table::Table;
use super::palette::{StateId, UNKNOWN};
use super::unpadded_evidence::UnpaddedEvidence;
use crate::sensor::Evidence;
use crate::space::VoxelKey;

/// Batch of voxels, of any tables, that are looked up together. Each stage of the look-up is done for all voxels before
/// the next stage, so that the CPU waits for the memory of many voxels at once.
pub(crate) struct VoxelBatch<'a> {
    voxels: Vec<(&'a Table, Address)>,
}

/// Result of the look-up in a voxel's brick.
#[derive(Clone, Copy)]
enum Found<'a> {
    State(&'a StateId),
    Evidence(&'a UnpaddedEvidence),
}

impl<'a> VoxelBatch<'a> {
    /// Maximum number of voxels. What the first stage loads must still be in the L1 cache in the last stage.
    pub(crate) const MAX_VOXELS: usize = 64;

    pub(crate) fn new() -> Self {
        Self { voxels: Vec::with_capacity(Self::MAX_VOXELS) }
    }

    /// Adds a voxel of the tile with this table; at most [`VoxelBatch::MAX_VOXELS`].
    #[inline]
    pub(crate) fn push(&mut self, table: &'a Table, key: VoxelKey) {
        self.voxels.push((table, Address::of_key(key)));
    }

    /// Looks the voxels up and clears the batch. Passes the evidence of each to `take`, in order; `None` if the voxel
    /// was never observed.
    pub(crate) fn take(&mut self, mut take: impl FnMut(Option<Evidence>)) {
        for voxels in self.voxels.chunks(Self::MAX_VOXELS) {
            let mut blocks = [0; Self::MAX_VOXELS];
            for (block, (table, at)) in blocks.iter_mut().zip(voxels) {
                *block = table.directory.block(*at);
            }
            let mut numbers = [0; Self::MAX_VOXELS];
            for ((number, block), (table, at)) in numbers.iter_mut().zip(blocks).zip(voxels) {
                *number = table.directory.in_block(block, *at);
            }
            let mut found = [Found::NOTHING; Self::MAX_VOXELS];
            for ((found, number), (table, at)) in found.iter_mut().zip(numbers).zip(voxels) {
                let brick = table.bricks.get((number as usize).wrapping_sub(1));
                *found = Found::of(brick.unwrap_or(Brick::ABSENT_BRICK), at.place);
            }
            let mut evidences = [None; Self::MAX_VOXELS];
            for ((evidence, found), (table, _)) in evidences.iter_mut().zip(found).zip(voxels) {
                *evidence = match found {
                    Found::State(&UNKNOWN) => None,
                    Found::State(&state) => Some(table.palette.evidence(state)),
                    Found::Evidence(&evidence) => Some(evidence.into()),
                };
            }
            evidences[..voxels.len()].iter().for_each(|evidence| take(*evidence));
        }
        self.voxels.clear();
    }
}

impl<'a> Found<'a> {
    const NOTHING: Self = Self::State(&UNKNOWN);

    #[inline]
    fn of(brick: &'a Brick, place: usize) -> Self {
        let (word, bit) = (place / 64, place % 64);
        match &brick.evidence {
            // An unobserved voxel has the unknown state.
            Storage::Interned(cells) => {
                cells.cell(word).map_or(Self::NOTHING, |cell| Self::State(&cell[bit]))
            }
            Storage::Plain(cells) if brick.observed[word] >> bit & 1 == 1 => {
                cells.cell(word).map_or(Self::NOTHING, |cell| Self::Evidence(&cell[bit]))
            }
            Storage::Plain(_) => Self::NOTHING,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{BRICK_VOXELS, BrickCode};
    use voxtile_simulation::Random;

    #[test]
    fn batched_and_single_look_ups_are_equal() {
        let mut random = Random::of(5, &[]);
        let mut tables = vec![Table::default(); 3];
        for table in &mut tables[1..] {
            for brick in [0, 1, 9, 64, 700] {
                let observed = (0..BRICK_VOXELS).filter(|_| random.chance(0.2)).collect::<Vec<_>>();
                let evidence = |place| {
                    (
                        place,
                        Evidence {
                            log_odds: (place % 7) as f64 - 3.0,
                            observation_count: place as i32 % 5 + 1,
                        },
                    )
                };
                table.insert(BrickCode(brick), &observed.into_iter().map(evidence).collect::<Vec<_>>());
            }
        }
        let palette = tables[2].palette.clone();
        tables[2].bricks.iter_mut().step_by(2).for_each(|brick| brick.make_plain(&palette));
        let mut voxels = VoxelBatch::new();
        let mut found = 0;
        for count in [0, 1, 63, 64].into_iter().cycle().take(400) {
            let queried: Vec<(&Table, VoxelKey)> = (0..count)
                .map(|_| {
                    let brick = [0, 1, 2, 9, 64, 700][random.below(6) as usize];
                    let code = BrickCode(brick).voxel(random.below(512) as usize);
                    (&tables[random.below(3) as usize], code.to_key())
                })
                .collect();
            queried.iter().for_each(|&(table, key)| voxels.push(table, key));
            let mut answers = Vec::new();
            voxels.take(|evidence| answers.push(evidence));
            let one_by_one: Vec<_> = queried.iter().map(|&(table, key)| table.get_key(key)).collect();
            assert_eq!(answers, one_by_one);
            found += answers.iter().flatten().count();
        }
        assert!(found > 500, "{found}");
    }
}
