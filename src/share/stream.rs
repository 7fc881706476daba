use super::stamps::Stamps;
use std::collections::BTreeMap;
use std::time::Duration;

/// What a receiver knows of the packets of one sender's life.
#[derive(Clone, Debug)]
pub(super) struct Stream {
    pub(super) epoch: u32,
    /// The last packet that is known to have been sent.
    pub(super) highest: u64,
    /// When that became known.
    pub(super) highest_at: Duration,
    /// Packets up to it that did not come.
    missing: BTreeMap<u64, Missing>,
    pub(super) stamps: Stamps,
}

#[derive(Clone, Copy, Debug)]
struct Missing {
    ask_at: Duration,
    asked: u32,
}

/// How far a packet may be from the last one. Beyond it the sender is asked whether that is true.
pub(super) const WINDOW: u64 = 4096;

/// Bytes of the missing packets, at most: 11 in a node, five at least.
const MISSING_BYTES: usize = WINDOW as usize / 5 * 11 * size_of::<(u64, Missing)>() * 5 / 4;

impl Stream {
    /// Bytes of memory, at most, where stamps were given so many.
    pub(super) fn most_bytes(stamp_bytes: usize) -> usize {
        Stamps::most_bytes(stamp_bytes) + MISSING_BYTES
    }

    /// The packets after one, which the sender said it has sent.
    pub(super) fn new(epoch: u32, sequence: u64, now: Duration, stamp_bytes: usize) -> Self {
        let stamps = Stamps::new(sequence, stamp_bytes);
        Self { epoch, highest: sequence, highest_at: now, missing: BTreeMap::new(), stamps }
    }

    /// Whether a packet can be one of this stream's.
    pub(super) fn can_be(&self, epoch: u32, sequence: u64) -> bool {
        epoch == self.epoch && sequence.abs_diff(self.highest) <= WINDOW
    }

    /// Notes that packets up to one were sent; those in between are missing.
    pub(super) fn reach(&mut self, sequence: u64, now: Duration, patience: Duration) {
        if sequence <= self.highest {
            return;
        }
        for missing in self.highest + 1..=sequence {
            self.missing.insert(missing, Missing { ask_at: now + patience, asked: 0 });
        }
        (self.highest, self.highest_at) = (sequence, now);
        while self.missing.len() as u64 > WINDOW {
            self.missing.pop_first();
        }
    }

    /// Notes that a packet came; `false` if it came before, or is too late to be of use.
    pub(super) fn arrive(&mut self, sequence: u64, now: Duration, patience: Duration) -> bool {
        self.reach(sequence, now, patience);
        self.missing.remove(&sequence).is_some() && sequence > self.stamps.forgotten()
    }

    /// Notes that a packet's voxels came by others.
    pub(super) fn is_repaired(&mut self, sequence: u64) {
        self.missing.remove(&sequence);
    }

    /// Gives up packets before one; whether there were any.
    pub(super) fn give_up_before(&mut self, oldest: u64) -> bool {
        let kept = self.missing.split_off(&oldest);
        let given_up = std::mem::replace(&mut self.missing, kept);
        !given_up.is_empty()
    }

    pub(super) fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    pub(super) fn missing(&self) -> usize {
        self.missing.len()
    }

    /// Packets to ask for now, the oldest first, and whether one of them was asked for often in vain.
    pub(super) fn due(&mut self, now: Duration, most: usize, retry: Duration) -> (Vec<u64>, bool) {
        let mut due = Vec::new();
        let mut is_in_vain = false;
        for (&sequence, missing) in
            self.missing.iter_mut().filter(|(_, missing)| missing.ask_at <= now).take(most)
        {
            missing.asked = (missing.asked + 1).min(16);
            missing.ask_at = now + retry * 2_u32.pow((missing.asked - 1).min(3));
            is_in_vain |= missing.asked > 3;
            due.push(sequence);
        }
        (due, is_in_vain)
    }
}
