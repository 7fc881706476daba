use super::answers::after;
use super::codec::{DigestEntry, Request};
use super::interval_set::IntervalSet;
use super::set::VoxelSet;
use super::set_range::SetRange;
use std::time::Duration;
use voxtile::space::TileIndex;

/// Anti-entropy of a receiver: the ranges to request until its layer equals the sender's set. It requests digests of
/// tiles, then the voxels of the tiles that differ.
#[derive(Clone, Debug, Default)]
pub(super) struct AntiEntropy {
    digests: IntervalSet,
    content: IntervalSet,
    outstanding: Option<Outstanding>,
}

#[derive(Clone, Debug)]
struct Outstanding {
    at: Duration,
    /// Time of the last answer.
    answered_at: Duration,
    /// Number of answers so far.
    packets: usize,
    /// Requested ranges without an answer.
    rest: IntervalSet,
}

/// Maximum number of ranges in one request for voxels.
const RANGES_PER_REQUEST: usize = 20;
/// Number of answers after which the next request is sent: the default of a sender's packets per answer.
const PACKETS_PER_REQUEST: usize = 16;

impl AntiEntropy {
    /// Upper bound on the memory, in bytes.
    pub(super) const MAX_BYTES: usize = 3 * IntervalSet::MAX_BYTES;

    pub(super) fn is_done(&self) -> bool {
        self.digests.is_empty() && self.content.is_empty()
    }

    /// Starts again with the whole set.
    pub(super) fn begin(&mut self, layer: &VoxelSet) {
        *self = Self::default();
        if layer.is_empty() { &mut self.content } else { &mut self.digests }.put(SetRange::ALL);
    }

    /// Processes digests. Returns the ranges in which the sender has no voxels.
    pub(super) fn take_digests(
        &mut self,
        first: TileIndex,
        entries: &[DigestEntry],
        layer: &mut VoxelSet,
        now: Duration,
    ) -> Vec<SetRange> {
        let Some(last) = entries.last() else { return Vec::new() };
        let was_requested = self.mark_received(SetRange::of_tiles(first, last.last), now);
        if !was_requested {
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

    /// Adds a range of voxels to request.
    pub(super) fn request_content(&mut self, range: SetRange) {
        self.content.put(range);
    }

    /// Removes a range whose voxels have arrived.
    pub(super) fn take_content(&mut self, range: SetRange, now: Duration) {
        self.mark_received(range, now);
    }

    /// Removes an answered range. Returns whether any part of it was requested.
    fn mark_received(&mut self, range: SetRange, now: Duration) -> bool {
        let was_requested = self.digests.remove(range) | self.content.remove(range);
        if let Some(request) = &mut self.outstanding {
            request.rest.remove(range);
            request.answered_at = now;
            request.packets += 1;
        }
        was_requested
    }

    /// Returns the next request if it is due: once the previous request is answered, or after no answer arrived for
    /// `patience`.
    pub(super) fn poll(
        &mut self,
        epoch: u32,
        now: Duration,
        interval: Duration,
        patience: Duration,
    ) -> Option<Request> {
        if let Some(request) = &self.outstanding {
            let is_answered = request.rest.is_empty() || request.packets >= PACKETS_PER_REQUEST;
            let is_over = is_answered || now >= request.answered_at + patience;
            if !is_over || now < request.at + interval {
                return None;
            }
        }
        // Digests add ranges to `content`. Request none while `content` is half full, so that all ranges fit.
        let digests = if self.content.is_half_full() { None } else { self.digests.iter().next() };
        let (request, rest) = if let Some(range) = digests {
            (Request::Digests { epoch, range }, vec![range])
        } else if !self.content.is_empty() {
            let ranges: Vec<SetRange> = self.content.iter().take(RANGES_PER_REQUEST).collect();
            (Request::Content { epoch, ranges: ranges.clone() }, ranges)
        } else {
            self.outstanding = None;
            return None;
        };
        self.outstanding =
            Some(Outstanding { at: now, answered_at: now, packets: 0, rest: rest.into_iter().collect() });
        Some(request)
    }
}

/// A range of at most this many voxels is requested as voxels, because further digests would take as many bytes.
const FEW_VOXELS: u64 = 256;

fn is_single(layer: &VoxelSet, range: SetRange) -> bool {
    !layer.has_several_tiles(range.first.tile, range.last.tile)
}
