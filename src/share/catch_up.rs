use super::answers::after;
use super::codec::{Ask, DigestEntry};
use super::set::VoxelSet;
use super::set_range::{SetPosition, SetRange};
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

/// Parts of a set, to be ticked off.
#[derive(Clone, Debug, Default)]
struct Parts(Vec<SetRange>);

/// Parts that one ask for voxels lists.
const PARTS_PER_ASK: usize = 20;
/// Answers after which the next ask goes out; a sender answers with as many by default.
const PACKETS_PER_ASK: usize = 16;

impl CatchUp {
    pub(super) fn is_done(&self) -> bool {
        self.digests.0.is_empty() && self.content.0.is_empty()
    }

    /// Begins with everything.
    pub(super) fn begin(&mut self, layer: &VoxelSet) {
        *self = Self::default();
        if layer.is_empty() { &mut self.content } else { &mut self.digests }.0.push(SetRange::ALL);
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
                self.content.0.push(range);
            } else {
                self.digests.0.push(range);
            }
        }
        empty
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
            let is_answered = asked.rest.0.is_empty() || asked.packets >= PACKETS_PER_ASK;
            let is_over = is_answered || now >= asked.heard_at + patience;
            if !is_over || now < asked.at + interval {
                return None;
            }
        }
        let (ask, rest) = if let Some(&range) = self.digests.0.first() {
            (Ask::Digests { epoch, range }, vec![range])
        } else if !self.content.0.is_empty() {
            let ranges: Vec<SetRange> = self.content.0.iter().copied().take(PARTS_PER_ASK).collect();
            (Ask::Content { epoch, ranges: ranges.clone() }, ranges)
        } else {
            self.last_ask = None;
            return None;
        };
        self.last_ask = Some(Asked { at: now, heard_at: now, packets: 0, rest: Parts(rest) });
        Some(ask)
    }
}

/// Voxels that are as soon sent as looked at more closely.
const FEW_VOXELS: u64 = 256;

fn is_single(layer: &VoxelSet, range: SetRange) -> bool {
    range.first.tile == range.last.tile || layer.tiles_between(range.first.tile, range.last.tile).len() <= 1
}

impl Parts {
    /// Takes a part away; whether there was any of it.
    fn remove(&mut self, part: SetRange) -> bool {
        let before = std::mem::take(&mut self.0);
        let mut was_there = false;
        for range in before {
            if part.last < range.first || range.last < part.first {
                self.0.push(range);
                continue;
            }
            was_there = true;
            if range.first < part.first {
                self.0.push(SetRange { first: range.first, last: before_position(part.first) });
            }
            if part.last < range.last {
                self.0.push(SetRange { first: part.last.next(), last: range.last });
            }
        }
        was_there
    }
}

/// The place before one that is not the first of all.
fn before_position(position: SetPosition) -> SetPosition {
    if position.code > 0 {
        return SetPosition { code: position.code - 1, ..position };
    }
    let TileIndex { x, y, z } = position.tile;
    let tile = match (y, z) {
        (i32::MIN, i32::MIN) => TileIndex::new(x.saturating_sub(1), i32::MAX, i32::MAX),
        (_, i32::MIN) => TileIndex::new(x, y - 1, i32::MAX),
        _ => TileIndex::new(x, y, z - 1),
    };
    SetPosition { tile, code: super::set_range::LAST_CODE }
}
