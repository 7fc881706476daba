use super::layer_hits::{LayerHit, LayerHits};
use super::tile_runs::{BrickRuns, Run, TileRuns};
use super::tile_updates::{BrickUpdate, OrderedUpdates, TileUpdates};
use crate::config::Layers;
use crate::space::{BrickCode, BrickMask};
use std::io::{self, BufRead};

/// Packed updates of one tile from any number of scans, in order. They take a fourth to a tenth of the unpacked size.
///
/// Numbers are encoded with seven bits per byte; of masks only the nonzero bytes are stored.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PackedUpdates {
    bytes: Vec<u8>,
    updates: usize,
}

const MASKS: u8 = 0;
const RUNS: u8 = 1;
const ORDERED: u8 = 2;
/// Like `MASKS`, but each brick also has the mask of its weak misses.
const GUARDED_MASKS: u8 = 3;
const LAYERS: u8 = 4;

impl PackedUpdates {
    /// Appends the updates of one scan.
    pub fn push(&mut self, updates: &TileUpdates) {
        if let TileUpdates::WithLayers(evidence, hits) = updates {
            self.push(evidence);
            self.push_hits(hits);
            return;
        }
        self.updates += updates.len();
        if let TileUpdates::Packed(packed) = updates {
            return self.bytes.extend_from_slice(&packed.bytes);
        }
        let out = &mut Packer { bytes: &mut self.bytes };
        match updates {
            TileUpdates::Masks(bricks) => {
                let has_weak = bricks.iter().any(|brick| brick.weak != [0; 8]);
                out.byte(if has_weak { GUARDED_MASKS } else { MASKS });
                out.number(bricks.len() as u64);
                let mut last = 0;
                for brick in bricks {
                    out.brick(brick.brick, &mut last);
                    out.mask(&brick.hits);
                    out.mask(&brick.misses);
                    if has_weak {
                        out.mask(&brick.weak);
                    }
                    out.number(brick.intensities.len() as u64);
                    brick.intensities.iter().for_each(|intensity| out.float(*intensity));
                }
            }
            TileUpdates::Runs(runs) => {
                out.byte(RUNS);
                out.number(runs.brick_count() as u64);
                let mut last = 0;
                for brick in runs.bricks() {
                    out.brick(brick.brick, &mut last);
                    out.number((brick.runs.len() + brick.misses.len()) as u64);
                    brick.iter().for_each(|run| out.run(&run));
                }
            }
            TileUpdates::Ordered(updates) => {
                out.byte(ORDERED);
                let (voxels, intensities) = updates.parts();
                out.number(voxels.len() as u64);
                voxels.iter().for_each(|voxel| out.bytes.extend(voxel.to_le_bytes()));
                out.number(intensities.len() as u64);
                intensities.iter().for_each(|intensity| out.float(*intensity));
            }
            TileUpdates::Layers(hits) => out.hits(hits),
            TileUpdates::Packed(_) | TileUpdates::WithLayers(..) => {}
        }
    }

    fn push_hits(&mut self, hits: &LayerHits) {
        self.updates += hits.len();
        Packer { bytes: &mut self.bytes }.hits(hits);
    }

    /// Packs the updates of one scan.
    pub(crate) fn of(updates: &TileUpdates) -> Self {
        let mut packed = Self::default();
        packed.push(updates);
        packed
    }

    /// Inverse of [`PackedUpdates::as_bytes`]; `updates` is their number. The bytes must be those that `as_bytes`
    /// returned.
    pub(crate) fn from_parts(bytes: Vec<u8>, updates: usize) -> Self {
        Self { bytes, updates }
    }

    /// Appends later updates.
    pub(crate) fn append(&mut self, others: &Self) {
        self.bytes.extend_from_slice(&others.bytes);
        self.updates += others.updates;
    }

    /// Removes the first `bytes` bytes, which must contain exactly the first `updates` updates.
    pub fn drop_first(&mut self, bytes: usize, updates: usize) {
        self.bytes.drain(..bytes.min(self.bytes.len()));
        self.updates = self.updates.saturating_sub(updates);
    }

    /// Releases unused memory.
    pub fn shrink(&mut self) {
        self.bytes.shrink_to_fit();
    }

    /// The updates as bytes. Appending does not change earlier bytes.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The updates of each scan, in order.
    pub fn iter(&self) -> impl Iterator<Item = TileUpdates> {
        let mut input = Unpacker { input: &*self.bytes };
        std::iter::from_fn(move || {
            let next = input.next().transpose()?;
            Some(next.expect("packed updates are complete"))
        })
    }

    /// Passes the updates of each scan to `take`, in order, from the bytes of [`PackedUpdates::as_bytes`].
    ///
    /// # Errors
    ///
    /// Fails if `input` cannot be read, is truncated, or was not written by [`PackedUpdates`].
    pub fn unpack(input: impl BufRead, mut take: impl FnMut(TileUpdates)) -> io::Result<()> {
        let mut input = Unpacker { input };
        while let Some(updates) = input.next()? {
            take(updates);
        }
        Ok(())
    }

    /// Number of updates.
    pub fn len(&self) -> usize {
        self.updates
    }

    /// Returns whether nothing was appended.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        self.bytes.capacity()
    }
}

struct Packer<'a> {
    bytes: &'a mut Vec<u8>,
}

impl Packer<'_> {
    fn byte(&mut self, byte: u8) {
        self.bytes.push(byte);
    }

    /// Writes seven bits per byte, the lowest first; the eighth bit is set if more bytes follow.
    fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }

    fn float(&mut self, number: f32) {
        self.bytes.extend(number.to_le_bytes());
    }

    /// Writes a brick's code as the difference from the previous one, because bricks are in order.
    fn brick(&mut self, BrickCode(code): BrickCode, last: &mut u64) {
        self.number(code.wrapping_sub(*last));
        *last = code;
    }

    /// Writes the set of nonzero words; for each of these, the set of nonzero bytes, and these bytes.
    fn mask(&mut self, mask: &BrickMask) {
        self.byte(set_of(mask.map(|word| word != 0)));
        for word in mask.iter().filter(|word| **word != 0) {
            let bytes = word.to_le_bytes();
            self.byte(set_of(bytes.map(|byte| byte != 0)));
            self.bytes.extend(bytes.iter().filter(|byte| **byte != 0));
        }
    }

    /// Writes the time stamp, and of each hit the set of its attributes before them.
    fn hits(&mut self, hits: &LayerHits) {
        self.byte(LAYERS);
        let Layers { colour, intensity_max, class, time, shape } = hits.layers;
        let has_intensity = intensity_max.is_some();
        self.byte(set_of([colour, has_intensity, class, time, shape, hits.stamp_ns.is_some(), false, false]));
        intensity_max.iter().for_each(|max| self.float(*max));
        hits.stamp_ns.iter().for_each(|stamp_ns| self.bytes.extend(stamp_ns.to_le_bytes()));
        self.number(hits.len() as u64);
        for hit in hits.iter() {
            let has_offset = hit.offset != [0; 3];
            self.byte(set_of([
                hit.colour.is_some(),
                hit.intensity.is_some(),
                hit.class.is_some(),
                has_offset,
                false,
                false,
                false,
                false,
            ]));
            self.bytes.extend(hit.voxel.to_le_bytes());
            self.bytes.extend(hit.colour.iter().flatten());
            hit.intensity.iter().for_each(|intensity| self.bytes.extend(intensity.to_le_bytes()));
            self.bytes.extend(hit.class);
            if has_offset {
                hit.offset.iter().for_each(|offset| self.bytes.extend(offset.to_le_bytes()));
            }
        }
    }

    fn run(&mut self, run: &Run) {
        self.number(u64::from(run.place));
        self.number(u64::from(run.misses) << 1 | u64::from(run.hit.is_some()));
        if let Some(intensity) = run.hit {
            self.float(intensity);
        }
    }
}

/// Returns a byte whose bit `k` is flag `k`.
fn set_of(are_in: [bool; 8]) -> u8 {
    (0..8).fold(0, |set, k| set | u8::from(are_in[k]) << k)
}

/// Reader for the output of [`Packer`].
struct Unpacker<R> {
    input: R,
}

/// Maximum number of items that are reserved at once for a count in the input.
const MAX_RESERVED: usize = 1 << 12;

impl<R: BufRead> Unpacker<R> {
    /// Reads the updates of one scan; `None` at the end.
    fn next(&mut self) -> io::Result<Option<TileUpdates>> {
        if self.input.fill_buf()?.is_empty() {
            return Ok(None);
        }
        Ok(Some(match self.byte()? {
            kind @ (MASKS | GUARDED_MASKS) => TileUpdates::Masks(
                self.bricks(|input, brick| input.brick_update(brick, kind == GUARDED_MASKS))?,
            ),
            LAYERS => TileUpdates::Layers(self.layer_hits()?),
            RUNS => TileUpdates::Runs(self.tile_runs()?),
            ORDERED => {
                let voxels = self.many(|input| Ok(u32::from_le_bytes(input.take()?)))?;
                let intensities = self.many(Self::float)?;
                TileUpdates::Ordered(OrderedUpdates::from_parts(voxels, intensities))
            }
            other => {
                let reason = format!("unknown kind of updates: {other}");
                return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
            }
        }))
    }

    fn bricks<T>(
        &mut self,
        mut brick: impl FnMut(&mut Self, BrickCode) -> io::Result<T>,
    ) -> io::Result<Vec<T>> {
        let mut last = 0_u64;
        self.many(|input| {
            last = last.wrapping_add(input.number()?);
            brick(input, BrickCode(last))
        })
    }

    fn brick_update(&mut self, brick: BrickCode, has_weak: bool) -> io::Result<BrickUpdate> {
        let (hits, misses) = (self.mask()?, self.mask()?);
        let weak = if has_weak { self.mask()? } else { [0; 8] };
        Ok(BrickUpdate { brick, hits, misses, weak, intensities: self.many(Self::float)?.into() })
    }

    /// Reads all as runs, including the misses after the last run of a voxel.
    fn tile_runs(&mut self) -> io::Result<TileRuns> {
        let mut all = TileRuns::default();
        let (mut last, mut runs) = (0_u64, Vec::new());
        for _ in 0..self.number()? {
            last = last.wrapping_add(self.number()?);
            runs.clear();
            self.many_to(&mut runs, Self::run)?;
            all.push(BrickRuns { brick: BrickCode(last), runs: &runs, misses: &[] });
        }
        Ok(all)
    }

    fn run(&mut self) -> io::Result<Run> {
        let place = self.number()? as u16;
        let misses = self.number()?;
        let hit = if misses & 1 == 1 { Some(self.float()?) } else { None };
        Ok(Run { place, misses: (misses >> 1) as u16, hit })
    }

    fn layer_hits(&mut self) -> io::Result<LayerHits> {
        let set = self.byte()?;
        let has = |k: u8| set >> k & 1 == 1;
        let mut layers =
            Layers { colour: has(0), intensity_max: None, class: has(2), time: has(3), shape: has(4) };
        if has(1) {
            layers.intensity_max = Some(self.float()?);
        }
        let stamp_ns = if has(5) { Some(i64::from_le_bytes(self.take()?)) } else { None };
        let mut hits = LayerHits::new(layers, stamp_ns);
        for _ in 0..self.number()? {
            let set = self.byte()?;
            let has = |k: u8| set >> k & 1 == 1;
            let mut hit = LayerHit { voxel: u32::from_le_bytes(self.take()?), ..LayerHit::default() };
            if has(0) {
                hit.colour = Some(self.take()?);
            }
            if has(1) {
                hit.intensity = Some(u16::from_le_bytes(self.take()?));
            }
            if has(2) {
                hit.class = Some(self.byte()?);
            }
            if has(3) {
                for offset in &mut hit.offset {
                    *offset = i16::from_le_bytes(self.take()?);
                }
            }
            hits.push(hit);
        }
        Ok(hits)
    }

    fn mask(&mut self) -> io::Result<BrickMask> {
        let words = self.byte()?;
        let mut mask = [0; 8];
        for (_, word) in mask.iter_mut().enumerate().filter(|(k, _)| words >> k & 1 == 1) {
            *word = self.word()?;
        }
        Ok(mask)
    }

    fn word(&mut self) -> io::Result<u64> {
        let set = self.byte()?;
        let mut bytes = [0; 8];
        for (_, byte) in bytes.iter_mut().enumerate().filter(|(k, _)| set >> k & 1 == 1) {
            *byte = self.byte()?;
        }
        Ok(u64::from_le_bytes(bytes))
    }

    /// Reads a list after its length. It grows as items are read, so a wrong length reserves no memory.
    fn many<T>(&mut self, one: impl FnMut(&mut Self) -> io::Result<T>) -> io::Result<Vec<T>> {
        let mut all = Vec::new();
        self.many_to(&mut all, one)?;
        Ok(all)
    }

    /// Like [`Unpacker::many`], but appends to `all`.
    fn many_to<T>(
        &mut self,
        all: &mut Vec<T>,
        mut one: impl FnMut(&mut Self) -> io::Result<T>,
    ) -> io::Result<()> {
        let count = self.number()? as usize;
        all.reserve(count.min(MAX_RESERVED));
        for _ in 0..count {
            all.push(one(self)?);
        }
        Ok(())
    }

    fn number(&mut self) -> io::Result<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                break;
            }
        }
        Ok(number)
    }

    fn float(&mut self) -> io::Result<f32> {
        Ok(f32::from_le_bytes(self.take()?))
    }

    #[inline]
    fn byte(&mut self) -> io::Result<u8> {
        let [byte] = self.take()?;
        Ok(byte)
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut taken = [0; N];
        self.input.read_exact(&mut taken)?;
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tile_runs::Misses;
    use super::*;
    use crate::sensor::Observation;
    use proptest::prelude::*;

    fn mask() -> impl Strategy<Value = BrickMask> {
        let word = prop_oneof![3 => Just(0), 1 => any::<u64>(), 1 => (0..64_u32).prop_map(|bit| 1 << bit)];
        prop::array::uniform8(word)
    }

    fn masks() -> impl Strategy<Value = TileUpdates> {
        let brick = (0..1_u64 << 39, mask(), mask(), mask(), any::<bool>());
        let brick = brick.prop_map(|(code, hits, misses, weak, has)| {
            let count: u32 = hits.iter().map(|word| word.count_ones()).sum();
            let intensities = (0..if has { count } else { 0 }).map(|k| k as f32 * 0.5).collect();
            let weak = std::array::from_fn(|word| misses[word] & weak[word]);
            BrickUpdate { brick: BrickCode(code), hits, misses, weak, intensities }
        });
        prop::collection::vec(brick, 0..6).prop_map(TileUpdates::Masks)
    }

    fn runs() -> impl Strategy<Value = TileUpdates> {
        let run = (0..512_u16, any::<u16>(), prop::option::of(-1e3..1e3_f32));
        let run = run.prop_map(|(place, misses, hit)| Run { place, misses, hit });
        let brick = (0..1_u64 << 39, prop::collection::vec(run, 0..20));
        prop::collection::vec(brick, 0..6).prop_map(|bricks| {
            let mut all = TileRuns::default();
            for (code, runs) in &bricks {
                all.push(BrickRuns { brick: BrickCode(*code), runs, misses: &[] });
            }
            TileUpdates::Runs(all)
        })
    }

    fn ordered() -> impl Strategy<Value = TileUpdates> {
        let update = (prop::array::uniform3(0..1024_i32), prop::option::of(0.0..255_f32));
        (prop::collection::vec(update, 0..30), any::<bool>()).prop_map(|(updates, keep)| {
            let mut ordered = OrderedUpdates::default();
            for (offset, hit) in updates {
                ordered.push(offset, hit.map_or(Observation::Miss, Observation::Hit), keep);
            }
            TileUpdates::Ordered(ordered)
        })
    }

    proptest! {
        #[test]
        fn packed_updates_round_trip_in_order(
            all in prop::collection::vec(prop_oneof![masks(), runs(), ordered()], 0..8),
        ) {
            let mut packed = PackedUpdates::default();
            all.iter().for_each(|updates| packed.push(updates));
            prop_assert_eq!(packed.iter().collect::<Vec<_>>(), all.clone());
            prop_assert_eq!(packed.len(), all.iter().map(TileUpdates::len).sum::<usize>());
            prop_assert_eq!(packed.is_empty(), all.is_empty());
        }
    }

    #[test]
    fn misses_after_the_runs_are_unpacked_as_runs() {
        let (run, passed) = (Run { place: 4, misses: 2, hit: Some(1.0) }, Misses { place: 4, misses: 300 });
        let mut runs = TileRuns::default();
        runs.push(BrickRuns { brick: BrickCode(7), runs: &[run], misses: &[passed] });
        let back: Vec<_> = PackedUpdates::of(&TileUpdates::Runs(runs)).iter().collect();
        let [TileUpdates::Runs(back)] = &back[..] else { panic!("{back:?}") };
        let all = [run, passed.into()];
        let wanted = BrickRuns { brick: BrickCode(7), runs: &all, misses: &[] };
        assert_eq!(back.bricks().collect::<Vec<_>>(), [wanted]);
    }
}
