use super::bit_coder::Bits;
use super::context::CONTEXTS;
use super::voxel_tree::{Cube, Update};
use voxtile::{FormatError, Result};

/// Initial probability of a 1 in each context, in 1/256; 0 for a context that never occurred.
///
/// The probabilities are counted in packets of lidar scans of a hall, of a street and from a hand-held sensor.
/// `docs/sharing.md` describes the count and the gain on other scans. The table is part of the format: another table
/// needs another version.
pub(super) static PRIOR: &[u8; CONTEXTS] = include_bytes!("prior.bin");

/// Counts the zeros and ones in each context of a packet of these updates, to compute the prior.
///
/// # Errors
///
/// As for [`encode_updates`](super::encode_updates).
pub fn count_contexts(updates: &[Update], counts: &mut [[u64; 2]]) -> Result<()> {
    let cube = Cube::of(updates)?;
    // Cannot fail, because `Counter` returns no errors.
    let _ = cube.walk(&mut Counter(counts));
    Ok(())
}

struct Counter<'a>(&'a mut [[u64; 2]]);

impl Bits for Counter<'_> {
    fn bit(&mut self, context: usize, bit: bool) -> std::result::Result<bool, FormatError> {
        if let Some(counts) = self.0.get_mut(context) {
            counts[usize::from(bit)] += 1;
        }
        Ok(bit)
    }
}
