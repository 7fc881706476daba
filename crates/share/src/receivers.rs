use super::receiver::Receiver;
use super::receiver_config::ReceiverConfig;
use super::set::VoxelSet;
use std::collections::BTreeMap;
use std::time::Duration;
use voxtile::{Error, FormatError, Result};

/// Receivers of several robots under one memory limit.
///
/// A receiver may use any free memory. If none is free, every robot is entitled to an equal share of the limit: a robot
/// below its share may grow up to it, and the robot that exceeds its share most loses voxels from the end of its layer.
/// No robot is cut below its share.
#[derive(Clone, Debug)]
pub struct Receivers<K> {
    memory_bytes: usize,
    robots: BTreeMap<K, Receiver>,
}

impl<K> IntoIterator for Receivers<K> {
    type Item = (K, Receiver);
    type IntoIter = std::collections::btree_map::IntoIter<K, Receiver>;

    fn into_iter(self) -> Self::IntoIter {
        self.robots.into_iter()
    }
}

/// Maximum memory that one packet can add before voxels are removed: each voxel is alone in its tile.
const PACKET_BYTES: usize = super::codec::MAX_VOXELS_PER_PACKET * VoxelSet::MAX_BYTES_PER_VOXEL;

impl<K: Ord + Clone> Receivers<K> {
    /// Minimum memory limit, in bytes.
    pub const MIN_BYTES: usize = 64 << 20;

    /// Creates an empty collection with a limit on its total memory, in bytes.
    ///
    /// # Errors
    ///
    /// A limit below [`Receivers::MIN_BYTES`].
    pub fn new(memory_bytes: usize) -> Result<Self> {
        if memory_bytes < Self::MIN_BYTES {
            let reason = format!("{memory_bytes} bytes; at least {} are needed", Self::MIN_BYTES);
            return Err(Error::argument("memory", reason));
        }
        Ok(Self { memory_bytes, robots: BTreeMap::new() })
    }

    /// Adds a receiver for a robot, optionally with an existing layer. It may use the memory that the others leave; if
    /// that is too little, the largest layers shrink. A robot without a layer has no share before its first status.
    pub fn insert(&mut self, robot: K, config: ReceiverConfig, layer: Option<VoxelSet>) {
        self.robots.insert(robot, Receiver::started(config, layer));
        self.set_shares();
    }

    /// Gives every robot an equal share of the memory.
    fn set_shares(&mut self) {
        let part = self.part_bytes();
        self.robots.values_mut().for_each(|receiver| receiver.set_part_bytes(part));
        self.shrink_to_limit();
    }

    /// Returns the number of robots that have sent a status or have a layer.
    pub fn known(&self) -> usize {
        self.robots.values().filter(|receiver| receiver.layer().is_some()).count()
    }

    /// Returns whether the memory suffices for the share of one more robot.
    pub fn has_room(&self) -> bool {
        self.usable_bytes() / (self.known() + 1) >= Receiver::MIN_BYTES
    }

    /// Removes a robot and returns its receiver.
    pub fn remove(&mut self, robot: &K) -> Option<Receiver> {
        self.robots.remove(robot)
    }

    /// Processes the bytes of a robot's packet. Packets of robots that were not added, or that have no share, are
    /// ignored.
    ///
    /// # Errors
    ///
    /// Bytes that are not a valid packet; the layer is unchanged.
    pub fn take(&mut self, robot: &K, bytes: &[u8], now: Duration) -> std::result::Result<(), FormatError> {
        let (all, part) = (self.memory_bytes(), self.part_bytes());
        let usable = self.usable_bytes();
        let has_room = self.has_room();
        let Some(receiver) = self.robots.get_mut(robot) else { return Ok(()) };
        let was_known = receiver.layer().is_some();
        if !was_known && !has_room {
            return Ok(());
        }
        let free = usable.saturating_sub(all - receiver.memory_bytes());
        receiver.set_memory_bytes(free.max(part));
        let taken = receiver.take(bytes, now);
        if receiver.layer().is_some() != was_known {
            self.set_shares();
        } else {
            self.shrink_to_limit();
        }
        taken
    }

    /// Shrinks the layers that exceed their share most, until the total is within the limit.
    fn shrink_to_limit(&mut self) {
        let part = self.part_bytes();
        loop {
            let excess = self.memory_bytes().saturating_sub(self.usable_bytes());
            let most = self.robots.values_mut().max_by_key(|receiver| receiver.memory_bytes());
            let Some(receiver) = most.filter(|receiver| excess > 0 && receiver.memory_bytes() > part) else {
                return;
            };
            let before = receiver.memory_bytes();
            receiver.cut_to_bytes(part.max(before - excess));
            if receiver.memory_bytes() >= before {
                return;
            }
        }
    }

    /// Returns an upper bound on the memory of all receivers, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.robots.values().map(Receiver::memory_bytes).sum()
    }

    /// Returns the guaranteed share of each robot, in bytes.
    pub fn part_bytes(&self) -> usize {
        self.usable_bytes() / self.known().max(1)
    }

    /// Returns the free memory in bytes, without the reserve for one packet.
    pub fn free_bytes(&self) -> usize {
        self.usable_bytes().saturating_sub(self.memory_bytes())
    }

    fn usable_bytes(&self) -> usize {
        self.memory_bytes - PACKET_BYTES
    }

    /// Returns the number of robots.
    pub fn len(&self) -> usize {
        self.robots.len()
    }

    /// Returns whether there are no robots.
    pub fn is_empty(&self) -> bool {
        self.robots.is_empty()
    }

    /// Returns a robot's receiver.
    pub fn get(&self, robot: &K) -> Option<&Receiver> {
        self.robots.get(robot)
    }

    /// Returns a robot's receiver mutably, for its requests and the digests of its layer.
    pub fn get_mut(&mut self, robot: &K) -> Option<&mut Receiver> {
        self.robots.get_mut(robot)
    }

    /// Returns all receivers, ordered by robot.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &Receiver)> {
        self.robots.iter()
    }

    /// Returns all receivers mutably, for their requests and the digests of their layers.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (&K, &mut Receiver)> {
        self.robots.iter_mut()
    }
}
