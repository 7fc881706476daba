use super::entry::{Entry, check_evidence, of_another_tile};
use super::gather::Gather;
use super::reader::TakeEntries;
use super::{ENTRY_BYTES, EntryBytes};
use crate::error::FormatError;
use crate::sensor::Evidence;
use crate::space::{
    BRICK_EDGE, BRICK_VOXELS, BrickCode, BrickMask, VoxelBox, VoxelIndex, VoxelKey, is_in_mask, mask_of_box,
    place_of_voxel,
};

/// Decodes entries in Morton order, as in a file with a trailer. Properties common to a brick are checked once per
/// brick.
pub(super) struct AscendingEntries<'a, G> {
    voxels: &'a VoxelBox,
    gather: G,
    brick: OpenBrick,
    /// One more than the position of the last voxel in the open brick; 0 if there is none.
    after_last: usize,
    /// Selected voxels of the open brick.
    run: Vec<(usize, Evidence)>,
}

struct OpenBrick {
    /// `None` before the first one.
    code: Option<BrickCode>,
    /// Common upper bits of its voxels' keys; before the first brick, bits that no key has.
    upper: [u16; 3],
    /// Voxels of the brick that belong to the tile.
    inside: BrickMask,
}

/// Bits of a coordinate that differ within a brick.
const LOWER: u16 = BRICK_EDGE as u16 - 1;

impl<'a, G: Gather> AscendingEntries<'a, G> {
    pub(super) fn new(voxels: &'a VoxelBox, gather: G) -> Self {
        let brick = OpenBrick { code: None, upper: [u16::MAX; 3], inside: [0; 8] };
        Self { voxels, gather, brick, after_last: 0, run: Vec::with_capacity(BRICK_VOXELS) }
    }

    #[inline]
    fn take_one(&mut self, entry: &EntryBytes, offset: u64) -> Result<(), FormatError> {
        let Entry { key, evidence } = Entry::of(entry);
        let upper = key.0.map(|k| k & !LOWER);
        if self.brick.upper != upper {
            self.open(Entry { key, evidence }, upper, offset)?;
        }
        let place = place_of_voxel(key.0.map(i32::from));
        if !is_in_mask(&self.brick.inside, place) {
            return Err(of_another_tile(key, offset));
        }
        check_evidence(evidence, offset)?;
        if self.after_last > place {
            return Err(out_of_order(key, offset));
        }
        self.after_last = place + 1;
        if self.gather.wants(evidence) {
            self.run.push((place, evidence));
        }
        Ok(())
    }

    #[inline(never)]
    fn open(&mut self, entry: Entry, upper: [u16; 3], offset: u64) -> Result<(), FormatError> {
        let Entry { key, evidence } = entry;
        let voxel = key.to_index_from(self.voxels.min);
        if !self.voxels.contains(voxel) {
            return Err(of_another_tile(key, offset));
        }
        // Errors of the entry itself take precedence.
        check_evidence(evidence, offset)?;
        let code = Some(key.morton().brick());
        if self.brick.code >= code {
            return Err(out_of_order(key, offset));
        }
        self.close();
        self.brick = OpenBrick { code, upper, inside: self.inside(voxel) };
        Ok(())
    }

    /// Mask of the tile's voxels in the brick of `voxel`.
    fn inside(&self, voxel: VoxelIndex) -> BrickMask {
        let first = voxel.map(|k| k & !(BRICK_EDGE - 1));
        let local = |of: VoxelIndex| std::array::from_fn(|k| of[k].saturating_sub(first[k]));
        mask_of_box(local(self.voxels.min), local(self.voxels.end))
    }

    fn close(&mut self) {
        self.after_last = 0;
        if let Some(code) = self.brick.code
            && !self.run.is_empty()
        {
            self.gather.add(code, &self.run);
            self.run.clear();
        }
    }
}

impl<G: Gather> TakeEntries for AscendingEntries<'_, G> {
    type Made = G::Made;

    fn take(&mut self, entries: &[EntryBytes], offset: u64) -> Result<(), FormatError> {
        (0..).zip(entries).try_for_each(|(number, entry)| self.take_one(entry, offset + number * ENTRY_BYTES))
    }

    fn end(mut self) -> Result<G::Made, FormatError> {
        self.close();
        Ok(self.gather.made())
    }
}

fn out_of_order(key: VoxelKey, offset: u64) -> FormatError {
    FormatError::at_offset(offset, format!("key {:?} is not in Morton order", key.0))
}

#[cfg(test)]
mod tests {
    use super::super::any_order_entries::AnyOrderEntries;
    use super::super::gather::VoxelFilter;
    use super::*;
    use crate::tile::Table;
    use crate::tile::format::encode_entries;
    use std::collections::BTreeMap;
    use voxtile_simulation::Random;

    const VOXELS: VoxelBox = VoxelBox { min: [-21, 65_530, 3], end: [0, 65_551, 24] };

    fn random_entries(random: &mut Random, count: u64) -> Vec<EntryBytes> {
        let mut voxels = BTreeMap::new();
        for _ in 0..count {
            let voxel = std::array::from_fn(|k| VOXELS.min[k] + random.below(21) as i32);
            let log_odds = [0.5, -0.25, random.between(-3.0, 3.0)][random.below(3) as usize];
            let evidence = Evidence { log_odds, observation_count: random.below(9) as i32 };
            voxels.insert(VoxelKey::from_index(voxel).morton(), evidence);
        }
        let mut table = Table::default();
        for (code, evidence) in voxels {
            table.insert(code.brick(), &[(code.place_in_brick(), evidence)]);
        }
        let mut bytes = Vec::new();
        let taken: Result<(), ()> = encode_entries(&table, |chunk| {
            bytes.extend_from_slice(chunk);
            Ok(())
        });
        taken.unwrap();
        bytes.as_chunks().0.to_vec()
    }

    fn read<E: TakeEntries>(mut entries: E, bytes: &[EntryBytes]) -> Result<E::Made, FormatError> {
        // In two chunks, as when reading a file.
        let (first, second) = bytes.split_at(bytes.len() / 3);
        entries.take(first, 16)?;
        entries.take(second, 16 + first.len() as u64 * ENTRY_BYTES)?;
        entries.end()
    }

    /// Returns the offset of the first entry that is not greater than the previous one.
    fn disorder(bytes: &[EntryBytes]) -> Option<u64> {
        let codes: Vec<_> = bytes.iter().map(|entry| Entry::of(entry).key.morton()).collect();
        let wrong = codes.windows(2).position(|pair| pair[0] >= pair[1])?;
        Some(16 + (wrong as u64 + 1) * ENTRY_BYTES)
    }

    #[test]
    fn both_decoders_give_the_same_tables_and_errors() {
        let mut random = Random::of(5, &[]);
        let (mut whole, mut damaged) = (0, 0);
        for round in 0..600 {
            let mut bytes = random_entries(&mut random, round % 40 * 20);
            if !bytes.is_empty() && random.chance(0.7) {
                let entry = random.below(bytes.len() as u64) as usize;
                // Mostly in the key, where most flipped bits make the entry invalid.
                let end = if random.chance(0.7) { 6 } else { ENTRY_BYTES };
                bytes[entry][random.below(end) as usize] ^= 1 << random.below(8);
            }
            let fast = read(AscendingEntries::new(&VOXELS, Table::default()), &bytes);
            let naive = read(AnyOrderEntries::new(&VOXELS), &bytes);
            for from in [f64::NEG_INFINITY, -0.25, 0.5, 9.0] {
                match (read(AscendingEntries::new(&VOXELS, VoxelFilter::from(from)), &bytes), &fast) {
                    (Ok(filtered), Ok(table)) => assert!(table.iter_from(from).eq(filtered)),
                    (Err(filtered), Err(table)) => assert_eq!(filtered, *table),
                    (filtered, _) => panic!("{filtered:?}"),
                }
            }
            match (fast, naive, disorder(&bytes)) {
                (Ok(fast), Ok(naive), None) => {
                    assert!(fast.iter().eq(naive.iter()));
                    whole += 1;
                }
                (Err(fast), Err(naive), None) => {
                    assert_eq!(fast, naive);
                    damaged += 1;
                }
                (Err(fast), naive, Some(at)) => {
                    // The first error; within an entry, an error of the entry itself takes precedence.
                    let alone = naive.err().filter(|error| !error.reason.contains("duplicate"));
                    match alone.filter(|error| error.at < at + ENTRY_BYTES) {
                        Some(naive) => assert_eq!(fast, naive),
                        None => assert_eq!(fast.at, at),
                    }
                    damaged += 1;
                }
                (fast, naive, disorder) => panic!("{fast:?} {naive:?} {disorder:?}"),
            }
        }
        assert!(whole > 150 && damaged > 150, "{whole} {damaged}");
    }
}
