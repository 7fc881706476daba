use super::answers::after;
use super::codec::{Ask, DigestEntry};
use super::parts::Parts;
use super::set::VoxelSet;
use super::set_range::SetRange;
use crate::space::TileIndex;
use std::time::Duration;

/// What a receiver still has to ask for, to have a set whole: digests of tiles, and the voxels where they differ.
#[derive(Clone, Debug, Default)]
pub(super) struct CatchUp {
    digests: Parts,
    content: Parts,
    last_ask: Option<Asked>,
}

#[derive(Clone, Debug)]
struct Asked {
    at: Duration,
    /// When the last answer came.
    heard_at: Duration,
    /// Answers since.
    packets: usize,
    /// What is left of what was asked for.
    rest: Parts,
}

/// Parts that one ask for voxels lists.
const PARTS_PER_ASK: usize = 20;
/// Answers after which the next ask goes out; a sender answers with as many by default.
const PACKETS_PER_ASK: usize = 16;

impl CatchUp {
    /// Bytes of memory, at most.
    pub(super) const MOST_BYTES: usize = 3 * Parts::MOST_BYTES;

    pub(super) fn is_done(&self) -> bool {
        self.digests.is_empty() && self.content.is_empty()
    }

    /// Begins with everything.
    pub(super) fn begin(&mut self, layer: &VoxelSet) {
        *self = Self::default();
        if layer.is_empty() { &mut self.content } else { &mut self.digests }.put(SetRange::ALL);
    }

    /// Takes digests; returns the parts of which the sender has no voxels.
    pub(super) fn take_digests(
        &mut self,
        first: TileIndex,
        entries: &[DigestEntry],
        layer: &mut VoxelSet,
        now: Duration,
    ) -> Vec<SetRange> {
        let Some(last) = entries.last() else { return Vec::new() };
        let is_asked = self.heard(SetRange::of_tiles(first, last.last), now);
        if !is_asked {
            return Vec::new();
        }
        let mut begin = first;
        let mut empty = Vec::new();
        for entry in entries {
            let range = SetRange::of_tiles(begin, entry.last);
            begin = after(entry.last);
            let own = layer.short_digest(range.first.tile, range.last.tile);
            if own == (entry.voxels, entry.digest) {
                continue;
            }
            if entry.voxels == 0 {
                empty.push(range);
            } else if own.0 == 0
                || entries.len() == 1
                || entry.voxels <= FEW_VOXELS
                || is_single(layer, range)
            {
                self.content.put(range);
            } else {
                self.digests.put(range);
            }
        }
        empty
    }

    /// Has a part fetched.
    pub(super) fn want_content(&mut self, range: SetRange) {
        self.content.put(range);
    }

    /// Ticks off a part whose voxels came.
    pub(super) fn take_content(&mut self, range: SetRange, now: Duration) {
        self.heard(range, now);
    }

    /// Ticks off; whether any of it was asked for.
    fn heard(&mut self, range: SetRange, now: Duration) -> bool {
        let was_asked = self.digests.remove(range) | self.content.remove(range);
        if let Some(asked) = &mut self.last_ask {
            asked.rest.remove(range);
            asked.heard_at = now;
            asked.packets += 1;
        }
        was_asked
    }

    /// The next ask, if it is time for one: after the answers to the one before, or when these do not come any more.
    pub(super) fn poll(
        &mut self,
        epoch: u32,
        now: Duration,
        interval: Duration,
        patience: Duration,
    ) -> Option<Ask> {
        if let Some(asked) = &self.last_ask {
            let is_answered = asked.rest.is_empty() || asked.packets >= PACKETS_PER_ASK;
            let is_over = is_answered || now >= asked.heard_at + patience;
            if !is_over || now < asked.at + interval {
                return None;
            }
        }
        // Before there is no room for what further digests say.
        let digests = if self.content.is_half_full() { None } else { self.digests.iter().next() };
        let (ask, rest) = if let Some(range) = digests {
            (Ask::Digests { epoch, range }, vec![range])
        } else if !self.content.is_empty() {
            let ranges: Vec<SetRange> = self.content.iter().take(PARTS_PER_ASK).collect();
            (Ask::Content { epoch, ranges: ranges.clone() }, ranges)
        } else {
            self.last_ask = None;
            return None;
        };
        self.last_ask = Some(Asked { at: now, heard_at: now, packets: 0, rest: rest.into_iter().collect() });
        Some(ask)
    }
}

/// Voxels that are as soon sent as looked at more closely.
const FEW_VOXELS: u64 = 256;

fn is_single(layer: &VoxelSet, range: SetRange) -> bool {
    !layer.has_several_tiles(range.first.tile, range.last.tile)
}
